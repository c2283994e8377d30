#pragma once
// A current sensor with the bridge off: its mean must be near zero (the firmware takes its own offset off
// while the bridge is off) and its noise within what the winding fits assume.

#include <span>

#include "host_tools/calibration/estimate.hpp"

namespace kmax::calibration {

struct CurrentOffsetConfig {
  double adc_step = 0.02;       // A
  double largest_offset = 0.1;  // A, of the mean
  double largest_noise = 0.15;  // A, standard deviation of a sample
  std::size_t fewest_samples = 100;
};

enum class CurrentOffsetCause {
  none,
  too_little_data,  // found: samples
  not_finite,       // found: index
  offset_large,     // found: A
  noise_large,      // found: A
  railed,           // constant and far from zero: amplifier or converter stuck; found: A
};
std::string_view to_string(CurrentOffsetCause cause);

struct CurrentOffset {
  Estimate mean{.unit = "A"};
  double noise = 0.0;  // A, standard deviation of a sample
  Finding<CurrentOffsetCause> finding;
};

CurrentOffset check_current_offset(std::span<const double> current, const CurrentOffsetConfig& config = {});

}  // namespace kmax::calibration
