#pragma once

namespace kmax::control {

/// Currents of the three motor phases, A, positive out of the bridge into the motor.
template <typename Scalar>
struct PhaseCurrents {
  Scalar a{}, b{}, c{};
};

}  // namespace kmax::control
