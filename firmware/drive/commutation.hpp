#pragma once

#include <array>
#include <cstdint>

#include "firmware/drive/axis.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Whether the rotor's electrical angle is known, so that torque points where it should. One axis, main loop.
///
/// Known are: a brushed motor; a motor that has been identified (motor.calibrated) with counts that mean the
/// same after every start, from an absolute encoder, a passed index or a rest at which the handle always
/// starts; and what a host has found out in this power cycle (motor.commutation_known = yes).
///
/// What the host has found out is forgotten when one of the parameters that it was found with changes, when
/// the counts get another origin, and after a fault that says that counts were lost: encoder and spin_out.
/// It is tied to the parameters that are set when motor.commutation_known becomes yes.
class Commutation {
 public:
  /// Whenever parameters or `counts` (AxisReport::reference_generation) may have changed.
  void follow(ParameterValues& values, std::size_t axis, std::uint32_t counts) {
    const bool found = values.whole<"motor.commutation_known">(axis) == 1;
    const Basis basis = basis_of(values, axis, counts);
    if (found && found_ && basis != basis_) {
      forget(values, axis);
      return;
    }
    if (found && !found_) basis_ = basis;
    found_ = found;
  }

  void forget(ParameterValues& values, std::size_t axis) {
    values.set_whole<"motor.commutation_known">(0, axis);
    found_ = false;
  }

  /// `referenced`: the counts are those from the encoder's index.
  static bool known(const ParameterValues& values, std::size_t axis, bool referenced) {
    if (values.choice<MotorKind, "motor.kind">(axis) == MotorKind::dc) return true;
    if (values.whole<"motor.commutation_known">(axis) == 1) return true;
    const bool lasting = values.choice<EncoderKind, "encoder.kind">(axis) == EncoderKind::as5047p ||
                         values.whole<"encoder.start">(axis) == 1;
    return values.whole<"motor.calibrated">(axis) == 1 && (lasting || referenced);
  }

 private:
  using Basis = std::array<std::uint32_t, 9>;

  static Basis basis_of(const ParameterValues& values, std::size_t axis, std::uint32_t counts) {
    const auto word = [&](std::size_t entry) { return values.raw(slot_of(entry, axis)); };
    return {word(entry_of<"motor.kind">()),
            word(entry_of<"motor.pole_pairs">()),
            word(entry_of<"motor.electrical_offset">()),
            word(entry_of<"encoder.kind">()),
            word(entry_of<"encoder.counts_per_turn">()),
            word(entry_of<"encoder.direction">()),
            word(entry_of<"encoder.offset">()),
            word(entry_of<"encoder.index">()),
            counts};
  }

  Basis basis_{};
  bool found_ = false;
};

}  // namespace kmax::firmware
