#pragma once

#include <cstddef>
#include <vector>

#include "control/stability_criteria.hpp"
#include "firmware/parameter_values.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::check {

/// What the criteria judge, out of one axis' parameters:
///
///   K, B             wall.stiffness, wall.damping; 0 with wall.law none
///   F_MC, x_0        the largest coefficient the law can command: none for plain; wall.magnetic_coefficient
///                    for magnetic; what eq. 7 and its interval give at most for adaptive
///   T                1 / haptic.rate
///   T_d              guard.delay + 1 / current.bandwidth + 0.65 ticks, see control/current_loop_delay.hpp
///   quantum          the step in use: measured in whole encoder counts, as the firmware rounds
///                    position.resolution
///   m, b, f_c        device.mass, guard.damping, guard.friction
///   F_h, v           guard.operator_force, guard.operator_speed
///   force limit      force.limit
///
/// Left out: the velocity that eq. 7 of the adaptive law feeds back (a damper on the way in, and with
/// wall.adaptive_velocity = speed a negative one on the way out), the lag of the velocity estimator, the
/// force slew limit, force compensation.
control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand = {});

/// The parameters that it reads, of that axis.
const std::vector<device::Parameter>& case_parameters(std::size_t axis);

}  // namespace kmax::check
