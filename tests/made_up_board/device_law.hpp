#pragma once

#include <cstddef>
#include <cstdint>

#include "firmware/drive/axes_law.hpp"
#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware {

/// A law of coupled handles for the made-up board: one end stop that all share, at a sum of their positions,
/// which each axis feels, as stiff as axis 0's wall. Elsewhere the device is like any other.
template <std::size_t axes>
class DeviceLaw {
 public:
  static constexpr bool needs_all_positions = true;
  static constexpr std::int64_t stop = 4000;  ///< counts
  using Tangential = TangentialInterference<axes>;
  struct Settings {
    float stiffness = 0.0f;  ///< N/count
    [[no_unique_address]] typename Tangential::Settings tangential{};
  };

  static Settings settings(const ParameterValues& values) {
    return {values.real<"wall.stiffness">(0) * static_cast<float>(count_length(values, 0)),
            Tangential::settings(values)};
  }
  static constexpr bool couples(const ParameterValues& /*values*/, std::size_t /*one*/,
                                std::size_t /*other*/) {
    return true;
  }

  float ISR_force(const Settings& s, std::size_t axis, const AxesPositions<axes>& at) const {
    std::int64_t beyond = -stop;
    for (std::size_t i = 0; i < axes; ++i) {
      if (!at.valid[i]) return 0.0f;
      beyond += at.position[i];
    }
    const float pushed_back =
        beyond > 0 ? -s.stiffness * static_cast<float>(static_cast<std::int32_t>(beyond)) : 0.0f;
    return tangential_.ISR_force(s.tangential, axis, at) + pushed_back;
  }
  void ISR_rendered(const Settings& s, std::size_t axis, const control::HapticLoop<float>::Output& loop,
                    bool driven) {
    tangential_.ISR_rendered(s.tangential, axis, loop, driven);
  }

 private:
  Tangential tangential_;
};

}  // namespace kmax::firmware
