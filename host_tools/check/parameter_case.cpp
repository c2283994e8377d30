#include "host_tools/check/parameter_case.hpp"

#include <array>

#include "firmware/stability_case.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::check {

control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand) {
  auto judged = firmware::stability_case<double>(values, axis, device::shortest_double);
  judged.hand = hand;
  return judged;
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
