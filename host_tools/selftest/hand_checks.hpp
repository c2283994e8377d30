#pragma once

#include "host_tools/selftest/bench.hpp"
#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

/// Checks in which the user takes part; `say` tells what to do. The bridge is off, or armed with zero volts.
/// Each waits for at most `patience` seconds.
struct HandSettings {
  double patience = 20.0;
  double travel = 5e-3;  ///< m that the handle must be moved
};

/// The handle is moved by hand: the encoder must count. Nothing is armed.
CheckResult check_hand_motion(Bench& bench, const HandSettings& settings, const Bench::Tell& say);

/// The emergency stop is pressed: the line must take an axis that is armed with zero volts out of operation.
CheckResult check_hand_stop(Bench& bench, const HandSettings& settings, const Bench::Tell& say);

}  // namespace kmax::selftest
