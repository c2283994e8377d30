#pragma once
// How hard the first contact with a wall feels. Lawrence and others (IEEE Trans. Robotics and Automation
// 16(4), 2000) found that people judge hardness by the rate at which the force rises, over the speed of the
// hand, rather than by the stiffness.

#include <optional>
#include <span>

namespace kmax::experiment {

struct ContactForce {
  double time = 0.0;      ///< s after the first sample in the wall; ascending
  double distance = 0.0;  ///< m from the surface; not above 0: in the wall
  double force = 0.0;     ///< N, positive out of the wall
};

inline constexpr double rate_hardness_time = 0.004;  ///< s in the wall; at least one sample

/// N/s per m/s, of a spring alone its stiffness: what the force rises by from the last sample outside to the
/// last within rate_hardness_time, over the time between the two and over `speed`, m/s towards the wall.
/// Empty without a sample on either side, with one of that time outside the wall again, or unless speed > 0.
std::optional<double> rate_hardness(std::span<const ContactForce> trace, double speed);

}  // namespace kmax::experiment
