#include "host_tools/wall/wall_evaluation.hpp"

#include "firmware/drive/haptic_configuration.hpp"

namespace kmax::wall {

WallEvaluator::WallEvaluator(const firmware::ParameterValues& values, std::size_t axis)
    : coefficients_(
          control::WallLaw<double>::prepare(firmware::wall_configuration<double>(values, axis),
                                            1.0 / static_cast<double>(values.real<"haptic.rate">(axis)))),
      position_(static_cast<double>(values.real<"wall.position">(axis))),
      side_(values.whole<"wall.side">(axis)) {}

Evaluation WallEvaluator::at(double position, double velocity) const {
  control::WallLaw<double> law;
  const auto out = law.update(coefficients_, side_ * (position - position_), side_ * velocity);
  // Adding zero turns the minus zero of a mirrored wall into a plain one.
  return {side_ * out.force + 0.0, side_ * out.magnetic_force + 0.0, out.inside};
}

}  // namespace kmax::wall
