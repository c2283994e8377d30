#pragma once

#include <cstddef>
#include <vector>

#include "firmware/fault.hpp"
#include "host_tools/selftest/pulse_plan.hpp"

namespace kmax::selftest {

/// What one pulse, or a while at rest, showed; one sample per tick.
struct Recording {
  Pulse pulse{};
  std::size_t before = 0;                                       ///< samples before the pulse begins
  std::vector<double> voltage, current_b, current_c, position;  ///< V, A, A, m
  std::vector<double> supply;                                   ///< V
  firmware::Fault fault = firmware::Fault::none;                ///< that ended it
  double fault_value = 0.0;

  std::size_t size() const { return current_b.size(); }
  bool tripped() const { return fault != firmware::Fault::none; }
};

struct MeanAndDeviation {
  double mean = 0.0, deviation = 0.0;
};
MeanAndDeviation mean_and_deviation(const std::vector<double>& values, std::size_t first, std::size_t last);

/// Samples from which conclusions may be drawn: until the bridge is off again. Behind a trip that is the last
/// sample at which a voltage was given.
std::size_t end_of_pulse(const Recording& recording);

/// Current along the pulse's direction, offsets of the time before the pulse removed: DC (b - c)/2.
std::vector<double> current_along(const Recording& recording, bool synchronous);

}  // namespace kmax::selftest
