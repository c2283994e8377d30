#pragma once

namespace kmax::control {

/// The hand and arm of a person who holds the handle, along the axis:
///
///   handle x --(k1 | b1)-- hand mass M, at y --(k2 | b2)-- intended position
///
/// Structure after Fu & Cavusoglu 2012 (hand on a stylus); their three directions span k1 380 to 770 N/m, b1
/// 0.78 to 3.6 N s/m, M 0.20 to 0.27 kg, k2 79 to 272 N/m, b2 4.6 to 18 N s/m. A constant impedance: what a
/// person does on purpose, or by tensing, is another set of numbers.
template <typename Scalar>
struct Hand {
  Scalar hand_mass = 0;       ///< M, kg, >= 0; 0: nobody holds the handle, and the rest is not read
  Scalar grip_stiffness = 0;  ///< k1, N/m, >= 0
  Scalar grip_damping = 0;    ///< b1, N s/m, >= 0
  Scalar arm_stiffness = 0;   ///< k2, N/m, >= 0
  Scalar arm_damping = 0;     ///< b2, N s/m, >= 0
};

}  // namespace kmax::control
