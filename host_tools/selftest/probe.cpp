#include "host_tools/selftest/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host_tools/device/disarm_failure.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::selftest {

using base::DeviceError;
using device::Parameter;
using std::chrono::milliseconds;

Probe::Probe(device::Device& device, std::size_t axis, Progress progress)
    : device_(device), bench_(device, axis, Evidence::travel, std::move(progress)) {
  bench::require_disarmed(device);
  count_length_ = bench_.number("measured.count_length");
  first_count_ = bench_.number("measured.count");
  tick_ = 1.0 / bench_.number("info.tick_rate");
}

bool Probe::disarm(std::string& words) {
  try {
    bench_.disarm();
  } catch (const std::exception& error) {
    words += device::words_for_disarm_failure(bench_.link_timeout(), error.what()) +
             ": see that it has no force; ";
    return false;
  }
  words += "the axis is disarmed; ";
  return true;
}

bool Probe::put_back(std::string& words) {
  try {
    // Of the test, or what has taken the force when the link was lost for a while.
    clear_fault();
    bench_.journal().put_back();
  } catch (const std::exception& error) {
    words += fmt::format("its parameters could not be put back ({}); ", error.what());
    return false;
  }
  return true;
}

Restored Probe::restore() {
  Restored restored{true, "nothing was changed in the device"};
  if (!bench_.journal().empty()) {
    restored.words.clear();
    restored.in_order = disarm(restored.words) && put_back(restored.words);
    restored.words +=
        restored.in_order
            ? "every parameter is as it was"
            : "drive.mode, excitation.*, capture.* and link.timeout may still be as the test has "
              "set them; nothing of it was saved: switch the device off and on, or set them by 'kmax set'";
    // Said here: no second attempt by the destructor.
    bench_.journal().forget();
  }
  if (fault_at_start_ && fault_at_start_->cleared)
    restored.words +=
        fmt::format("; the fault that was there before has been cleared ({})", fault_at_start_->words);
  return restored;
}

std::optional<FaultAtStart> Probe::clear_fault_at_start() {
  const device::DriveStatus status = bench_.drive().status();
  if (!status.faulty()) return std::nullopt;
  clear_fault();
  fault_at_start_ = {fault_of(status), status.fault_words(), !bench_.drive().status().faulty()};
  return fault_at_start_;
}

void Probe::clear_fault() {
  if (!bench_.drive().status().faulty()) return;
  try {
    bench_.drive().clear();
  } catch (const DeviceError&) {
    // Its cause remains.
  }
}

LinkTrial Probe::try_link(int exchanges) {
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
    if (i % 10 == 0) bench_.progress("link");
    const auto start = device_.link().now();
    ++trial.exchanges;
    try {
      device_.read(uptime);
    } catch (const device::LinkError&) {
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

std::vector<double> Probe::read_supply(int readings) {
  std::vector<double> volts;
  for (int i = 0; i < readings; ++i) {
    volts.push_back(bench_.number("supply.voltage"));
    device_.link().wait(milliseconds(5));
  }
  return volts;
}

ArmingTrial Probe::try_arming() {
  return bench_.repeat([&] {
    bench_.progress("arming with zero volts");
    ArmingTrial trial;
    try {
      bench_.arm();
      // What only shows once the bridge is on.
      device_.link().wait(milliseconds(20));
      const std::optional<bench::Trip> trip = bench_.trip();
      trial.armed = !trip;
      if (trip) trial.fault = trip->fault;
    } catch (const bench::ArmingRefused& refused) {
      trial.refusal = refused.refusal();
    } catch (const bench::AxisTripped& tripped) {
      trial.fault = tripped.trip().fault;
    }
    bench_.disarm();
    if (trial.fault == firmware::Fault::link_silent) throw bench::HeldUp{bench_.link_timeout()};
    // It was armed if something has moved the handle then, which is no hindrance to arming.
    trial.armed = trial.armed || trial.fault == firmware::Fault::excitation_travel;
    return trial;
  });
}

bool Probe::arm_with_zero_volts() {
  try {
    // A hand may have been at the handle.
    first_count_ = bench_.number("measured.count");
    bench_.rehome(0.0);
    bench_.arm();
  } catch (const std::runtime_error&) {
    return false;
  }
  return true;
}

double Probe::displacement() {
  const double moved = position_now();
  largest_displacement_ = std::max(largest_displacement_, std::abs(moved));
  return moved;
}

double Probe::distance_from_start(double counts) const {
  // The counter wraps at 2^32.
  return std::remainder(counts - first_count_, 4294967296.0) * count_length_;
}

PulseResponse Probe::response_of(const bench::Waveforms& seen) {
  PulseResponse response;
  response.before = seen.before;
  const auto column = [&](const char* name) {
    const auto found = seen.channels.find(name);
    return found == seen.channels.end() ? std::vector<double>() : found->second;
  };
  response.current_b = column("current_b");
  response.current_c = column("current_c");
  response.voltage = column("voltage");
  response.supply = column("supply");
  for (const double count : column("count")) {
    largest_displacement_ = std::max(largest_displacement_, std::abs(distance_from_start(count)));
    response.position.push_back(count * count_length_);
  }
  if (seen.trip) {
    response.fault = seen.trip->fault;
    response.fault_value = seen.trip->value;
  }
  return response;
}

PulseResponse Probe::watch_at_rest(std::size_t samples) {
  bench_.progress("at rest");
  PulseResponse response = response_of(bench_.watch({{"current_b", "current_c", "count"}, samples}));
  response.voltage.assign(response.size(), 0.0);
  response.before = response.size();
  return response;
}

PulseResponse Probe::give(const Pulse& pulse, Observe observe) {
  constexpr std::size_t before = 32, after = 60;
  bench::ExcitationPlan excitation;
  excitation.kind = "voltage";
  excitation.alternation = pulse.voltage;
  excitation.half_period = static_cast<int>(pulse.half_period);
  excitation.ramp = pulse.ramp * tick_;
  excitation.angle = pulse.angle;
  excitation.duration = pulse.duration * tick_;
  bench::CapturePlan plan;
  plan.channels = {"current_b", "current_c", "voltage", observe == Observe::supply ? "supply" : "count"};
  plan.samples = before + pulse.duration + after;
  plan.before = before;
  PulseResponse response = response_of(bench_.repeat([&] {
    bench_.progress(fmt::format("a pulse of {:.2f} V", pulse.voltage));
    if (const double moved = displacement(); std::abs(moved) > farthest_start)
      throw HandleMoved(fmt::format(
          "the handle stands {:.2f} mm from where it was at the start, and the test has not moved it that "
          "far",
          moved * 1e3));
    return bench_.record_alone(excitation, plan);
  }));
  response.pulse = pulse;
  displacement();
  bench_.disarm();
  displacement();
  return response;
}

}  // namespace kmax::selftest
