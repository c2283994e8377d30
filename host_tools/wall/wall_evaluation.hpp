#pragma once

#include <cstddef>

#include "control/wall_law.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::wall {

/// What the wall law gives at one place and velocity.
struct Evaluation {
  double force;           ///< N along +x
  double magnetic_force;  ///< N along +x, the field's share
  bool inside;
};

/// The firmware's wall law, evaluated by itself: no encoder, no sampling, no force limit, in double.
///
/// Each evaluation stands alone, as the first sample of a contact: the memory of the latched and peak_hold
/// modes does not reach from one to the next.
class WallEvaluator {
 public:
  explicit WallEvaluator(const firmware::ParameterValues& values, std::size_t axis = 0);

  /// Position m, velocity m/s, both along +x.
  Evaluation at(double position, double velocity) const;

 private:
  control::WallLaw<double>::Coefficients coefficients_;
  double position_;
  double side_;
};

}  // namespace kmax::wall
