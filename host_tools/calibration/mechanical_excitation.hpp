#pragma once
// What the motion step shakes the handle with: square waves of force, of which one has about
// `motion_force_ratio` times the friction, with the half period of its swing and with a third of it, in turn.
// One speed cannot tell damping from friction: on five simulated motors (tests/host_tools/calibration, worst
// of 20 seeds each) friction was wrong by up to 57 % with one, by 12 % with both and the same number of
// samples.

namespace kmax::calibration {

inline constexpr double motion_force_ratio = 5.0;          // force / friction
inline constexpr double motion_second_period = 1.0 / 3.0;  // of the first half period

}  // namespace kmax::calibration
