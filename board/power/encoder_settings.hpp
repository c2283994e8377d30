#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/referenced_quadrature_counter.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::board {

/// What an axis' tick does for its count.
enum class EncoderRole : std::uint8_t {
  lines,              ///< quadrature
  lines_beside_chip,  ///< the same, and makes the frame for the axis whose encoder is the AS5047P
  chip,               ///< takes that frame
  missing,            ///< asks for that chip too and has none; makes the frame like the one above
};

/// The encoders of all axes, as the parameters ask for them. A board has one AS5047P at most: the first axis
/// that asks for it has it.
struct EncoderSettings {
  std::array<EncoderRole, firmware::axis_count> role{};
  std::array<drivers::ReferencedQuadratureConfig, firmware::axis_count> quadrature{};
  /// Raised with each change of the above.
  std::array<std::uint32_t, firmware::axis_count> generation{};

  using Axes = std::array<bool, firmware::axis_count>;
  /// Those after these. `presence_changed`: axes that come or go.
  EncoderSettings next(const firmware::ParameterValues& values, const Axes& absent,
                       const Axes& presence_changed) const {
    EncoderSettings next;
    bool chip_asked_for = false;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (values.choice<firmware::EncoderKind, "encoder.kind">(axis) == firmware::EncoderKind::quadrature ||
          absent[axis])
        continue;
      next.role[axis] = chip_asked_for ? EncoderRole::missing : EncoderRole::chip;
      chip_asked_for = true;
    }
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (chip_asked_for && next.role[axis] == EncoderRole::lines)
        next.role[axis] = EncoderRole::lines_beside_chip;
      const bool has_index = values.whole<"encoder.index">(axis) != 0;
      next.quadrature[axis] = {
          .has_index = has_index,
          // A handle that starts at its rest has its origin there.
          .from_index = has_index && values.whole<"encoder.start">(axis) == 0,
          .counts_per_turn = static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis))};
      const bool same = next.role[axis] == role[axis] && next.quadrature[axis] == quadrature[axis];
      next.generation[axis] = generation[axis] + (same && !presence_changed[axis] ? 0U : 1U);
    }
    return next;
  }
  /// Another axis has the chip, or none has any more.
  bool chip_moves_from(const EncoderSettings& before) const {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if ((role[axis] == EncoderRole::chip) != (before.role[axis] == EncoderRole::chip)) return true;
    }
    return false;
  }
};

}  // namespace kmax::board
