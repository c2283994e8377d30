#pragma once

#include "host_tools/selftest/recording.hpp"

namespace kmax::selftest {

/// Resistance and time constant of whatever one recording's strongest sensor saw, without belief in the
/// parameters: for the scale and the shape of the currents that judge_phases() expects.
struct WindingEstimate {
  double amplitude = 0.0;      ///< A, of the strongest sensor at the ends of the halves
  double noise = 0.0;          ///< A, standard deviation before the pulse
  double time_constant = 0.0;  ///< s; the one that leaves the smallest residual
};

WindingEstimate estimate_winding(const Recording& recording, double tick);

}  // namespace kmax::selftest
