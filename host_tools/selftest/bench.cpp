#include "host_tools/selftest/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::selftest {

using device::DeviceError;
using device::Parameter;
using std::chrono::milliseconds;

namespace {
bool starts_with(const std::string_view text, const std::string_view begin) {
  return text.substr(0, begin.size()) == begin;
}
}  // namespace

Bench::Bench(device::Device& device, std::size_t axis, Tell tell)
    : device_(device), axis_(axis), tell_(std::move(tell)), drive_(device, axis) {
  for (std::size_t any = 0; any < firmware::axis_count; ++any) {
    if (device::Drive(device_, any).status().armed())
      throw DeviceError(fmt::format("axis {} is armed; 'kmax disarm' first", any));
  }
  remember();
  count_length_ = number("measured.count_length");
  first_count_ = number("measured.count");
  tick_ = 1.0 / device_.read_number("info.tick_rate");
}

Bench::~Bench() {
  // Nobody is left to be told what leave() could not do: link.timeout, which the test has set, removes the
  // force of an axis that could not be disarmed.
  leave();
}

Bench::Left Bench::leave() {
  Left left{true, "nothing was changed in the device"};
  if (changed_) {
    left.words.clear();
    left.in_order = disarm(left) && put_back(left);
    if (left.in_order) left.words += "every parameter is as it was";
    if (!left.in_order)
      left.words +=
          "drive.mode, excitation.*, capture.* and link.timeout may still be as the test has set them; "
          "nothing of it was saved: switch the device off and on, or set them by 'kmax set'";
    changed_ = false;
  }
  if (fault_at_start_ && fault_at_start_->cleared)
    left.words +=
        fmt::format("; the fault that was there before has been cleared ({})", fault_at_start_->words);
  return left;
}

bool Bench::disarm(Left& left) {
  try {
    drive_.disarm();
  } catch (const std::exception& error) {
    left.words += fmt::format("the axis could not be disarmed ({}); ", error.what());
    left.words += may_drive_ ? fmt::format(
                                   "the device removes its force by itself after {:g} s without a "
                                   "message (link.timeout): see that it has no force; ",
                                   longest_silence)
                             : std::string("the test had not armed it; ");
    return false;
  }
  may_drive_ = false;
  left.words += "the axis is disarmed; ";
  return true;
}

bool Bench::put_back(Left& left) {
  try {
    // Of the test, or what has taken the force when the link was lost for a while.
    clear_fault();
    device_.write(Parameter::of<"capture.command">(),
                  static_cast<std::uint32_t>(firmware::CaptureCommand::stop), true);
    device_.apply(before_);
  } catch (const std::exception& error) {
    left.words += fmt::format("its parameters could not be put back ({}); ", error.what());
    return false;
  }
  return true;
}

void Bench::remember() {
  for (const Parameter& parameter : device::all_parameters()) {
    if (!parameter.writable() || (parameter.belongs_to_axis() && parameter.axis() != axis_)) continue;
    const std::string_view name = parameter.definition().name;
    const bool used = starts_with(name, "excitation.") || name == "drive.mode" || name == "link.timeout" ||
                      (starts_with(name, "capture.") && name != "capture.command");
    if (used) before_.push_back({parameter, device_.read(parameter)});
  }
  run_ = device_.read(Parameter::of<"excitation.run">(axis_));
}

double Bench::number(const char* name) {
  const auto parameter = device::resolve(name, axis_);
  return device_.read_number(parameter.name());
}

double Bench::displacement() {
  const double moved = position_now();
  largest_displacement_ = std::max(largest_displacement_, std::abs(moved));
  return moved;
}

double Bench::position_now() {
  return distance_from_start(number("measured.count"));
}

double Bench::distance_from_start(double counts) const {
  // The counter wraps at 2^32.
  return std::remainder(counts - first_count_, 4294967296.0) * count_length_;
}

bool Bench::arm_with_zero_volts() {
  try {
    // A hand may have been at the handle.
    first_count_ = number("measured.count");
    arm_quietly();
  } catch (const DeviceError&) {
    return false;
  }
  return true;
}

void Bench::set(const std::vector<std::string>& assignments) {
  changed_ = true;
  device_.apply(device::parse_assignments(assignments, axis_));
}

std::optional<FaultAtStart> Bench::clear_fault_at_start() {
  const device::DriveStatus status = drive_.status();
  if (!status.faulty()) return std::nullopt;
  clear_fault();
  fault_at_start_ = {fault_of(status), status.fault_words(), !drive_.status().faulty()};
  return fault_at_start_;
}

void Bench::clear_fault() {
  if (!drive_.status().faulty()) return;
  try {
    drive_.clear();
  } catch (const DeviceError&) {
    // Its cause remains.
  }
}

LinkTrial Bench::try_link(int exchanges) {
  LinkTrial trial;
  trial.over_can = device_.description().starts_with("can:");
  const std::vector<std::string> counters =
      trial.over_can
          ? std::vector<std::string>{"can.overruns",  "can.queue_overflows", "can.bus_offs",
                                     "can.discarded", "can.sdo_timeouts",    "counters.missed_ticks"}
          : std::vector<std::string>{"counters.crc_errors",      "counters.line_errors",
                                     "counters.gap_errors",      "counters.length_errors",
                                     "counters.queue_overflows", "counters.missed_ticks"};
  std::vector<Parameter> asked;
  for (const std::string& name : counters) asked.push_back(device::resolve(name));
  const auto before = device_.read(asked);
  const auto uptime = Parameter::of<"info.tick">();
  for (int i = 0; i < exchanges; ++i) {
    if (i % 10 == 0) tell_("link");
    const auto start = device_.link().now();
    ++trial.exchanges;
    try {
      device_.read(uptime);
    } catch (const link::LinkError&) {
      if (++trial.lost * 5 > exchanges) throw;
      continue;
    }
    const double taken = std::chrono::duration<double>(device_.link().now() - start).count();
    trial.mean_round_trip += taken / exchanges;
    trial.longest_round_trip = std::max(trial.longest_round_trip, taken);
  }
  const auto after = device_.read(asked);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const std::uint32_t rise = after[i] - before[i];
    if (rise != 0) trial.risen.push_back({counters[i], static_cast<double>(rise)});
  }
  return trial;
}

std::vector<double> Bench::read_supply(int readings) {
  std::vector<double> volts;
  for (int i = 0; i < readings; ++i) {
    volts.push_back(number("supply.voltage"));
    device_.link().wait(milliseconds(5));
  }
  return volts;
}

void Bench::arm_quietly() {
  const double left = std::max(0.0, travel - std::abs(displacement()));
  set({"drive.mode=excitation", "excitation.kind=voltage", "excitation.bias=0", "excitation.alternation=0",
       "excitation.half_period=0", "excitation.alternation_axis=along", "excitation.angle=0",
       "excitation.angle_rate=0", "excitation.angle_span=0", "excitation.ramp=0", "excitation.duration=0",
       fmt::format("excitation.travel={}", left), fmt::format("link.timeout={}", longest_silence)});
  may_drive_ = true;
  drive_.arm();
}

ArmingTrial Bench::try_arming() {
  ArmingTrial trial;
  const auto start = device_.link().now();
  for (int silences = 0;;) {
    tell_("arming with zero volts");
    try {
      arm_quietly();
      // What only shows once the bridge is on.
      device_.link().wait(milliseconds(20));
    } catch (const DeviceError&) {
      // The status says why.
    }
    const device::DriveStatus status = drive_.status();
    // It was armed if something has moved the handle then, which is told apart from what hinders arming.
    const bool armed = status.armed() || fault_of(status) == firmware::Fault::excitation_travel;
    trial = {armed, armed ? firmware::Refusal::none : status.refusal, fault_of(status)};
    if (status.faulty()) {
      clear_fault();
    } else {
      drive_.disarm();
    }
    if (trial.fault == firmware::Fault::link_silent) {
      note_silence(++silences);
      continue;
    }
    const bool starting = trial.refusal == firmware::Refusal::power_stage_not_ready ||
                          trial.refusal == firmware::Refusal::store_busy;
    if (!starting || device_.link().now() - start > std::chrono::seconds(2)) return trial;
    device_.link().wait(milliseconds(100));
  }
}

Recording Bench::record_rest(std::size_t samples) {
  tell_("at rest");
  changed_ = true;
  device::CaptureReader capture(device_);
  device::CaptureSettings settings;
  settings.axis = axis_;
  settings.channels = {"current_b", "current_c", "count"};
  settings.samples = static_cast<std::uint32_t>(samples);
  capture.arm(settings);
  capture.wait(std::chrono::seconds(1));
  const device::Captured captured = capture.read();
  Recording recording;
  recording.current_b = captured.column("current_b");
  recording.current_c = captured.column("current_c");
  take_counts(captured.column("count"), recording);
  recording.voltage.assign(captured.samples(), 0.0);
  recording.before = captured.samples();
  return recording;
}

void Bench::take_counts(const std::vector<double>& counts, Recording& recording) {
  for (const double count : counts) {
    largest_displacement_ = std::max(largest_displacement_, std::abs(distance_from_start(count)));
    recording.position.push_back(count * count_length_);
  }
}

void Bench::note_silence(int silences) {
  if (silences >= most_silences)
    throw DeviceError(
        fmt::format("{} times in a row the device heard nothing for {:g} s and removed the force: this "
                    "program or the link was held up for so long; try again when this computer has less to "
                    "do",
                    silences, longest_silence));
}

Recording Bench::give(const Pulse& pulse, Observe observe) {
  for (int silences = 0;;) {
    if (const auto recording = try_to_give(pulse, observe)) return *recording;
    note_silence(++silences);
  }
}

/// Nothing: the host was silent for too long, before the pulse or after it.
std::optional<Recording> Bench::try_to_give(const Pulse& pulse, Observe observe) {
  try {
    const Recording recording = give_once(pulse, observe);
    if (recording.fault == firmware::Fault::link_silent) return std::nullopt;
    return recording;
  } catch (const HandleMoved&) {
    throw;
  } catch (const DeviceError&) {
    // It could not be armed, or the pulse never came.
    if (fault_of(drive_.status()) != firmware::Fault::link_silent) throw;
    clear_fault();
    return std::nullopt;
  }
}

Recording Bench::give_once(const Pulse& pulse, Observe observe) {
  constexpr std::uint32_t before = 32, after = 60;
  tell_(fmt::format("a pulse of {:.2f} V", pulse.voltage));
  if (const double moved = displacement(); std::abs(moved) > farthest_start)
    throw HandleMoved(
        fmt::format("the handle stands {:.2f} mm from where it was at the start, and the test has not moved "
                    "it that far",
                    moved * 1e3));
  arm_quietly();
  device::CaptureReader capture(device_);
  device::CaptureSettings settings;
  settings.axis = axis_;
  settings.channels = {"current_b", "current_c", "voltage", observe == Observe::supply ? "supply" : "count"};
  settings.samples = before + pulse.duration + after;
  settings.pre_trigger = before;
  settings.trigger = firmware::CaptureTrigger::excitation;
  capture.arm(settings);
  device_.link().wait(milliseconds(5));
  run_ = (run_ + 1) & 0xFFFFU;
  set({fmt::format("excitation.alternation={}", static_cast<float>(pulse.voltage)),
       fmt::format("excitation.half_period={}", pulse.half_period),
       fmt::format("excitation.ramp={}", static_cast<float>(pulse.ramp * tick_)),
       fmt::format("excitation.angle={}", static_cast<float>(pulse.angle)),
       fmt::format("excitation.duration={}", static_cast<float>(pulse.duration * tick_)),
       fmt::format("excitation.run={}", run_)});
  capture.wait(std::chrono::seconds(1));
  const device::Captured captured = capture.read();
  Recording recording;
  recording.pulse = pulse;
  recording.before = captured.trigger_sample;
  recording.current_b = captured.column("current_b");
  recording.current_c = captured.column("current_c");
  recording.voltage = captured.column("voltage");
  if (observe == Observe::supply) {
    recording.supply = captured.column("supply");
  } else {
    take_counts(captured.column("count"), recording);
  }
  const device::DriveStatus status = drive_.status();
  recording.fault = fault_of(status);
  recording.fault_value = static_cast<double>(status.fault_value);
  displacement();
  drive_.disarm();
  if (recording.tripped()) clear_fault();
  displacement();
  return recording;
}

}  // namespace kmax::selftest
