#include "host_tools/check/parameter_case.hpp"

#include <array>

#include "control/current_loop_delay.hpp"
#include "control/resampler.hpp"
#include "firmware/haptic_configuration.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::check {

namespace {
// As the user wrote it: 0.1, not the 0.100000001490116 of the float that is nearest to it.
double real(float value) {
  return device::shortest_double(value);
}

double largest_coefficient(const control::WallLawConfig<float>& wall) {
  switch (wall.kind) {
    case control::WallKind::magnetic:
      return real(wall.magnetic_coefficient);
    case control::WallKind::adaptive:
      // The period only matters for the decay.
      return real(control::AdaptiveCoefficient<float>::prepare(wall.adaptive, 1.0f).most);
    case control::WallKind::none:
    case control::WallKind::plain:
      break;
  }
  return 0.0;
}
}  // namespace

control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand) {
  const auto wall = firmware::wall_configuration<float>(values, axis);
  const bool any_wall = wall.kind != control::WallKind::none;
  const double count = firmware::count_length(values, axis);

  control::StabilityCase<double> c{};
  c.stiffness = any_wall ? real(wall.stiffness) : 0.0;
  c.wall_damping = any_wall ? real(wall.damping) : 0.0;
  c.magnetic_coefficient = largest_coefficient(wall);
  c.magnetic_length = real(wall.magnetic_length);
  c.period = 1.0 / real(values.real<"haptic.rate">(axis));
  c.delay = real(values.real<"guard.delay">(axis)) +
            control::current_loop_delay(real(values.real<"current.bandwidth">(axis)),
                                        static_cast<double>(firmware::tick_rate_hz));
  c.quantum =
      count * control::resampler_step(static_cast<double>(values.real<"position.resolution">(axis)), count);
  c.mass = real(values.real<"device.mass">(axis));
  c.damping = real(values.real<"guard.damping">(axis));
  c.friction = real(values.real<"guard.friction">(axis));
  c.operator_force = real(values.real<"guard.operator_force">(axis));
  c.operator_speed = real(values.real<"guard.operator_speed">(axis));
  c.detection_share = 1.0;
  c.force_limit = real(values.real<"force.limit">(axis));
  c.hand = hand;
  return c;
}

const std::vector<device::Parameter>& case_parameters(std::size_t axis) {
  static const auto by_axis = [] {
    using device::Parameter;
    std::array<std::vector<Parameter>, firmware::axis_count> all;
    for (std::size_t a = 0; a < firmware::axis_count; ++a)
      all[a] = {Parameter::of<"wall.law">(a),
                Parameter::of<"wall.stiffness">(a),
                Parameter::of<"wall.damping">(a),
                Parameter::of<"wall.magnetic_coefficient">(a),
                Parameter::of<"wall.magnetic_length">(a),
                Parameter::of<"wall.adaptive_gain">(a),
                Parameter::of<"wall.adaptive_offset">(a),
                Parameter::of<"wall.adaptive_force_min">(a),
                Parameter::of<"wall.adaptive_force_max">(a),
                Parameter::of<"position.resolution">(a),
                Parameter::of<"device.transmission">(a),
                Parameter::of<"encoder.counts_per_turn">(a),
                Parameter::of<"haptic.rate">(a),
                Parameter::of<"current.bandwidth">(a),
                Parameter::of<"guard.delay">(a),
                Parameter::of<"device.mass">(a),
                Parameter::of<"guard.damping">(a),
                Parameter::of<"guard.friction">(a),
                Parameter::of<"guard.operator_force">(a),
                Parameter::of<"guard.operator_speed">(a),
                Parameter::of<"force.limit">(a)};
    return all;
  }();
  return by_axis.at(axis);
}

}  // namespace kmax::check
