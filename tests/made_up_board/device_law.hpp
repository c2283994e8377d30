#pragma once

#include <cstddef>
#include <cstdint>

#include "firmware/drive/axes_law.hpp"

namespace kmax::firmware {

/// A law of coupled handles for the made-up board: one end stop that all share, at a sum of their positions,
/// which each axis feels. Elsewhere the device is like any other.
template <std::size_t axes>
class DeviceLaw {
 public:
  static constexpr bool needs_all_positions = true;
  static constexpr std::int64_t stop = 4000;          ///< counts
  static constexpr float stiffness = 1.0f / 1024.0f;  ///< N/count

  float ISR_force(std::size_t axis, const AxesPositions<axes>& at) const {
    std::int64_t beyond = -stop;
    for (std::size_t i = 0; i < axes; ++i) {
      if (!at.valid[i]) return 0.0f;
      beyond += at.position[i];
    }
    const float pushed_back =
        beyond > 0 ? -stiffness * static_cast<float>(static_cast<std::int32_t>(beyond)) : 0.0f;
    return tangential_.ISR_force(axis, at) + pushed_back;
  }
  void ISR_rendered(std::size_t axis, const control::HapticLoop<float>::Output& loop, bool driven) {
    tangential_.ISR_rendered(axis, loop, driven);
  }

 private:
  TangentialInterference<axes> tangential_;
};

}  // namespace kmax::firmware
