#include "host_tools/bench/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::bench {

using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {
constexpr double longest_timeout = 1.0;      // s, of link.timeout during the procedure
constexpr double longest_excitation = 70.0;  // s, longer than any plan's
// Of different lengths: a handle that is shaken in step with the looks would be found at rest at its turning
// point each time.
constexpr microseconds between_looks[] = {microseconds(20'000), microseconds(12'700), microseconds(7'300)};
// A capture is looked at every 20 ms: a handle that swings in 21 ms was met where it turns back time and
// again.
constexpr microseconds between_doubts[] = {microseconds(3'100), microseconds(7'900), microseconds(5'300)};
constexpr microseconds start_patience{2'000'000};

// A handle that coasted out of its travel, or a host that was held up.
bool is_harmless(const Trip& trip) {
  return !trip.remains &&
         (trip.fault == firmware::Fault::excitation_travel || trip.fault == firmware::Fault::link_silent);
}

bool starting(firmware::Refusal refusal) {
  return refusal == firmware::Refusal::power_stage_not_ready || refusal == firmware::Refusal::store_busy;
}

microseconds of_seconds(double seconds) {
  return microseconds(static_cast<std::int64_t>(std::llround(seconds * 1e6)));
}
}  // namespace

void require_disarmed(device::Device& device) {
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (device::Drive(device, axis).status().armed())
      throw base::DeviceError(fmt::format("axis {} is armed; 'kmax disarm' first", axis));
  }
}

Bench::Bench(device::Device& device, std::size_t axis, double travel, Progress progress)
    : device_(device),
      drive_(device, axis),
      journal_(device, axis),
      progress_(std::move(progress)),
      travel_(travel) {
  home_ = number("measured.position");
}

void Bench::begin() {
  if (begun_) return;
  // Noted before any capture changes them.
  journal_.note(std::vector<std::string>{"capture.axis", "capture.channel_1", "capture.channel_2",
                                         "capture.channel_3", "capture.channel_4", "capture.interval",
                                         "capture.samples", "capture.pre_trigger", "capture.trigger",
                                         "capture.trigger_level"});
  double timeout = number("link.timeout");
  if (!(timeout > 0.0 && timeout <= longest_timeout)) {
    timeout = longest_timeout;
    journal_.set_temporary({fmt::format("link.timeout={}", timeout)});
  }
  timeout_ = timeout;
  longest_silence_ = std::min(longest_silence_, timeout / 4.0);
  run_ = static_cast<unsigned>(number("excitation.run"));
  begun_ = true;
}

Bench::~Bench() {
  try {
    disarm();
  } catch (const std::exception&) {
    // The link is gone: link.timeout, which begin() has seen to, removes the force on the device.
  }
}

double Bench::number(const std::string& name) {
  const device::Parameter parameter = device::resolve(name, drive_.axis());
  return firmware::number_from_raw(parameter.definition().type, device_.read(parameter));
}

void Bench::set_temporary(const std::vector<std::string>& texts) {
  disarm();
  journal_.set_temporary(texts);
}

void Bench::set_result(const std::vector<std::string>& texts) {
  disarm();
  journal_.set_result(texts);
}

double Bench::displacement() {
  return number("measured.position") - home_;
}

void Bench::rehome(double displacement) {
  home_ = number("measured.position") - displacement;
}

void Bench::wait(double seconds) {
  const auto end = device_.link().now() + of_seconds(seconds);
  for (;;) {
    const auto left = end - device_.link().now();
    if (left <= microseconds(0)) return;
    device_.link().wait(
        std::min<microseconds>(left, still_watch_.active() ? next_look() : of_seconds(longest_silence_)));
    if (stands()) return;
    // Both a sign of life for the device and a look whether there is still a reason to wait.
    if (armed_ && drive_.status().faulty()) return;
  }
}

std::optional<Trip> Bench::trip() {
  const device::DriveStatus status = drive_.status();
  if (status.armed()) return std::nullopt;
  armed_ = false;
  if (!status.faulty())
    throw base::DeviceError(fmt::format("axis {}: somebody else has disarmed it: {}", drive_.axis(),
                                        device::to_string(status.state())));
  return cleared(status);
}

Trip Bench::cleared(const device::DriveStatus& status) {
  Trip found{device::fault_of(status), status.fault_words(), false, static_cast<double>(status.fault_value)};
  try {
    drive_.clear();
  } catch (const base::DeviceError&) {
    found.remains = unusable_ = true;
  }
  return found;
}

std::optional<Trip> Bench::take_unseen_trip() {
  return std::exchange(unseen_trip_, std::nullopt);
}

// A refusal because the power stage still starts or the store is busy is none for two seconds.
void Bench::arm_when_ready() {
  const auto end = device_.link().now() + start_patience;
  for (;;) {
    try {
      drive_.arm();
      return;
    } catch (const base::DeviceError&) {
      const device::DriveStatus status = drive_.status();
      if (status.armed() || status.faulty() || !starting(status.refusal) || device_.link().now() >= end)
        throw;
    }
    progress_("");
    device_.link().wait(of_seconds(longest_silence_));
  }
}

void Bench::arm(double reach) {
  if (armed_) return;
  if (const auto trip = take_unseen_trip()) throw AxisTripped(*trip);
  begin();
  // A tenth of a millimetre is left in any case: whoever is at the bound may still go back.
  const double left = reach > 0.0 ? reach : std::max(travel_ - std::abs(displacement()), 1e-4);
  // A voltage of zero, not 'off', which controls the current with gains that may not fit the motor yet.
  std::vector<std::string> texts = ExcitationPlan{.kind = "voltage"}.assignments();
  texts.push_back("drive.mode=excitation");
  texts.push_back(fmt::format("excitation.travel={:.9g}", left));
  journal_.set_temporary(texts);
  try {
    // Even an attempt that ends in an exception may have armed it.
    armed_ = true;
    arm_when_ready();
  } catch (const base::DeviceError& error) {
    const device::DriveStatus status = drive_.status();
    armed_ = status.armed();
    if (armed_) throw;
    if (status.faulty()) {
      const Trip found = cleared(status);
      require_heard(found);
      throw AxisTripped(found);
    }
    if (status.refusal == firmware::Refusal::none) throw;
    unusable_ = true;
    throw ArmingRefused(status.refusal, error.what());
  }
}

void Bench::disarm() {
  if (!armed_) return;
  drive_.disarm();
  armed_ = false;
  const device::DriveStatus status = drive_.status();
  if (!status.faulty()) return;
  const Trip found = cleared(status);
  if (!is_harmless(found)) unseen_trip_ = found;
}

void Bench::brake() {
  if (!armed_) return;
  still_watch_ = {};
  journal_.set_temporary(ExcitationPlan{.kind = "voltage"}.assignments());
  wait(0.1);
  const std::optional<Trip> tripped = trip();
  // A fast handle with a small current.limit: it coasts, and nothing is wrong with the axis.
  if (tripped && tripped->fault != firmware::Fault::over_current && !is_harmless(*tripped))
    unseen_trip_ = tripped;
}

void Bench::begin_still_watch(const StillLimits& limits) {
  still_watch_ = {};
  if (limits.any()) still_watch_ = {limits, number("measured.count"), device_.link().now()};
}

microseconds Bench::next_look() {
  looks_ = (looks_ + 1) % std::size(between_looks);
  return between_looks[looks_];
}

bool Bench::stands() {
  if (!still_watch_.active() || !armed_) return false;
  for (std::size_t look = 0;; ++look) {
    const double count = number("measured.count"), velocity = number("measured.velocity");
    const bool stands = still_watch_.stands(count, velocity, device_.link().now());
    if (stands || !still_watch_.doubtful()) return stands;
    device_.link().wait(between_doubts[look % std::size(between_doubts)]);
  }
}

void Bench::finish_and_brake(Waveforms& seen) {
  const auto end = device_.link().now() + of_seconds(longest_excitation);
  while (armed_ && number("measured.excitation_finished") == 0.0) {
    progress_("");
    seen.trip = trip();
    if (seen.trip) {
      // The samples are there, and the device has ended what a silent host left running.
      if (seen.trip->fault == firmware::Fault::link_silent) seen.trip.reset();
      return;
    }
    seen.stood_afterwards = stands();
    if (seen.stood_afterwards) break;
    if (device_.link().now() >= end)
      throw base::DeviceError(
          fmt::format("axis {}: the excitation does not end; look at excitation.duration", drive_.axis()));
    device_.link().wait(next_look());
  }
  brake();
}

void Bench::require_heard(const Trip& trip) const {
  if (trip.fault == firmware::Fault::link_silent) throw HeldUp{timeout_};
}

// What could not be done for `error`: was it because the host was held up?
void Bench::require_heard_after(const base::DeviceError& error) {
  const device::DriveStatus status = drive_.status();
  const bool silent = heard_nothing(status);
  if (!silent && !(stood_still(error) && !status.faulty())) return;
  drive_.disarm();
  armed_ = false;
  if (silent) cleared(status);
  throw HeldUp{timeout_};
}

Waveforms Bench::record(const ExcitationPlan& excitation, const CapturePlan& plan, double reach) {
  return record_heard(excitation, plan, reach, Afterwards::armed);
}

Waveforms Bench::record_alone(const ExcitationPlan& excitation, const CapturePlan& plan) {
  return record_heard(excitation, plan, 0.0, Afterwards::any);
}

Waveforms Bench::record_heard(const ExcitationPlan& excitation, const CapturePlan& plan, double reach,
                              Afterwards afterwards) {
  try {
    Waveforms seen = record_once(excitation, plan, reach, afterwards);
    if (seen.trip) require_heard(*seen.trip);
    return seen;
  } catch (const base::DeviceError& error) {
    // It could not be armed, or the excitation never came.
    require_heard_after(error);
    throw;
  }
}

Waveforms Bench::record_once(const ExcitationPlan& excitation, const CapturePlan& plan, double reach,
                             Afterwards afterwards) {
  arm(reach);
  begin_still_watch({});
  device::CaptureReader reader(device_);
  const bool from_start = plan.delay <= 0.0;
  if (from_start) begin_capture(reader, plan, firmware::CaptureTrigger::excitation);
  // Until the samples from before have been taken.
  if (plan.before > 0) device_.link().wait(milliseconds(5));
  std::vector<std::string> texts = excitation.assignments();
  run_ = (run_ + 1) % 65536;
  texts.push_back(fmt::format("excitation.run={}", run_));
  journal_.set_temporary(texts);
  begin_still_watch(plan.still);
  if (!from_start) {
    wait(plan.delay);
    begin_capture(reader, plan, firmware::CaptureTrigger::now);
  }
  return finish_capture(reader, afterwards, plan.brake);
}

Waveforms Bench::watch(const CapturePlan& plan) {
  begin();
  begin_still_watch({});
  device::CaptureReader reader(device_);
  begin_capture(reader, plan, firmware::CaptureTrigger::now);
  return finish_capture(reader, Afterwards::any, false);
}

void Bench::begin_capture(device::CaptureReader& reader, const CapturePlan& plan,
                          firmware::CaptureTrigger trigger) {
  reader.arm({.axis = drive_.axis(),
              .channels = plan.channels,
              .interval = static_cast<std::uint32_t>(plan.interval),
              .samples = static_cast<std::uint32_t>(plan.samples),
              .pre_trigger = static_cast<std::uint32_t>(plan.before),
              .trigger = trigger});
}

Waveforms Bench::finish_capture(device::CaptureReader& reader, Afterwards afterwards, bool brakes) {
  struct Ended {};
  Waveforms seen;
  try {
    reader.wait(std::chrono::seconds(1), [&](const device::CaptureProgress&) {
      progress_("");
      if (armed_) seen.trip = trip();
      seen.stood = stands();
      if (seen.trip || seen.stood) throw Ended();
    });
  } catch (const Ended&) {
    reader.stop();
    if (seen.stood) {
      brake();
      disarm();
    }
  }
  if (brakes && !seen.trip) finish_and_brake(seen);
  if (afterwards == Afterwards::any && !seen.trip && armed_) seen.trip = trip();
  try {
    const device::Captured captured = reader.read([&](const device::CaptureProgress&) { progress_(""); });
    seen.interval = captured.interval / captured.tick_rate;
    seen.before = captured.trigger_sample;
    for (const device::CaptureColumn& column : captured.columns) seen.channels[column.name] = column.values;
  } catch (const base::DeviceError&) {
    // Stopped before it began.
    if (!seen.trip && !seen.stood) throw;
  }
  if (seen.trip || !armed_) return seen;
  seen.trip = trip();
  if (afterwards == Afterwards::any && seen.trip && seen.trip->fault == firmware::Fault::link_silent)
    seen.trip.reset();
  return seen;
}

}  // namespace kmax::bench
