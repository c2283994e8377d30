#pragma once

#include <optional>
#include <stdexcept>

#include "host_tools/selftest/checks.hpp"
#include "host_tools/selftest/probe.hpp"

namespace kmax::selftest {

/// Checks in which the user takes part; `say` gets what to do. The bridge is off, or armed with zero volts.
/// Each waits for at most `patience` seconds.
struct HandSettings {
  double patience = 20.0;
  double travel = 5e-3;  ///< m that the handle must be moved
};

/// The handle is moved by hand: the encoder must count. Nothing is armed.
CheckResult check_hand_motion(Probe& probe, const HandSettings& settings, const Probe::Progress& say);

/// The emergency stop is pressed: the line must take an axis that is armed with zero volts out of operation.
CheckResult check_hand_stop(Probe& probe, const HandSettings& settings, const Probe::Progress& say);

struct SelfTestSettings {
  std::size_t axis = 0;
  int link_exchanges = 50;
  std::optional<HandSettings> hand{};  ///< the user takes part
  Probe::Progress say{};               ///< how the user is asked; without it, like the progress
};

/// The test has ended before its end: why, and what has become of the axis and its parameters.
class SelfTestEnded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Finds the faulty part of an axis without moving the handle by more than a millimetre.
///
///   1  link, supply, temperature, currents and counts with the bridge off
///   2  arming with zero volts: what the device itself refuses, and why
///   3  a ladder of single short periods of voltage, each at most twice the one before, from a tenth of what
///      the claimed resistance asks for (0.05 V if the motor is not calibrated), until one sensor sees half
///      the test current, 40 % of current.limit; then one along each phase at the last voltage: the circuit.
///      They move a free handle without friction by at most 0.03 mm each
///   4  if the circuit is healthy: a long even swing (80 ms) at the test current, a synchronous motor in two
///      directions, planned to move a free handle by 0.25 mm at most; once more with twice the current if
///      nothing has moved
///   5  the swing once more with the supply watched
///
/// The bounds go by the claimed mass and torque constant, or by the mobility that the pulses before have
/// shown, whichever is larger (pulse.hpp); and excitation.travel trips at 0.8 mm from the start.
///
/// It ends early where a result explains why going on would say nothing. A handle that something else has
/// moved by more than a millimetre, or past excitation.travel, is a failed check.
///
/// Leaves the axis disarmed and every parameter as it was; a fault that was there before is cleared, if it
/// can be, and is in the report. Errors: DeviceError if an axis is armed, and DeviceError or
/// device::LinkError if not even that can be read; nothing has been changed then. SelfTestEnded for
/// everything that comes later: a lost link, an exception from `progress`, parameters that could not be put
/// back. What `progress` throws that is no std::exception passes through, after the attempt to leave the
/// device in order.
Report run_selftest(device::Device& device, const SelfTestSettings& settings,
                    const Probe::Progress& progress);

/// Steps 1 to 5, with a probe that stays usable.
Evidence gather_evidence(Probe& probe, const SelfTestSettings& settings);

}  // namespace kmax::selftest
