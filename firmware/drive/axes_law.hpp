#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "control/haptic_loop.hpp"
#include "control/interference.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Where the handles of all axes are at the moment of one axis' sample.
template <std::size_t axes>
struct AxesPositions {
  std::array<std::int64_t, axes> position{};  ///< counts along +x, offset and direction applied
  std::array<bool, axes> valid{};             ///< false: nobody knows, and no force may follow from it
};

/// A law over several axes: what stands between the counts of all axes and the force of each, beside the wall
/// that each axis renders on its own. AxesTick asks it in the slot of every axis, and in that slot only for
/// the force of that axis, so that every force goes by counts that are as fresh as the axis' own.
///
///   Settings                 what it works by; empty for a law without parameters, which pays nothing for it
///   settings(values)         main loop, whenever a parameter has changed: the settings, which the tick takes
///                            over together with those of the axes, from axis 0's slot on
///   couples(values, i, j)    main loop: what a hand does on axis i is felt on axis j or the other way round;
///                            whoever arms one of two such axes must command the other, if that is armed
///   ISR_force(s, axis, at)   N along +x of this axis. It is added to the axis' wall and keeps, with it, to
///                            the axis' force limit, slew limit, soft start and trips.
///   ISR_rendered(s, axis, loop, driven)
///                            what the axis' own loop has made of it; `driven`: the motor follows
///   needs_all_positions      true: the board reads the counters of all axes in each slot, and `at` holds
///                            them. False: `at` is not filled, and costs nothing.
///
/// Which law it is, is chosen when the firmware is compiled (device_law.hpp): a device whose axes have
/// nothing to do with each other pays nothing for the place. A law's own parameters are entries of the object
/// dictionary like any other; beside the dictionary only the law knows of them.
template <typename Law, std::size_t axes>
concept AxesLaw = requires(Law law, const typename Law::Settings& settings, const ParameterValues& values,
                           std::size_t axis, const AxesPositions<axes>& at,
                           const control::HapticLoop<float>::Output& loop, bool driven) {
  { Law::settings(values) } -> std::same_as<typename Law::Settings>;
  { Law::couples(values, axis, axis) } -> std::same_as<bool>;
  { Law::needs_all_positions } -> std::convertible_to<bool>;
  { law.ISR_force(settings, axis, at) } -> std::same_as<float>;
  { law.ISR_rendered(settings, axis, loop, driven) } -> std::same_as<void>;
};

/// The axis along the surface of this one's wall: the next one, and the first after the last.
template <std::size_t axes>
constexpr std::size_t axis_along(std::size_t axis) {
  return (axis + 1) % axes;
}

/// Axes at right angles to each other: the interference along the surface of one axis' wall (eq. 4 of paper
/// 1) is felt along axis_along() it. Each axis takes what the other made last.
template <std::size_t axes>
class TangentialInterference {
 public:
  static constexpr bool needs_all_positions = false;
  struct Settings {};

  static constexpr Settings settings(const ParameterValues& /*values*/) { return {}; }
  static constexpr bool couples(const ParameterValues& values, std::size_t one, std::size_t other) {
    const auto parallel = [&values](std::size_t axis) {
      return values.choice<control::InterferenceMode, "interference.mode">(axis) ==
             control::InterferenceMode::parallel;
    };
    return parallel(one) || parallel(other);
  }

  float ISR_force(const Settings&, std::size_t axis, const AxesPositions<axes>& /*at*/) const {
    return along_[axis];
  }
  void ISR_rendered(const Settings&, std::size_t axis, const control::HapticLoop<float>::Output& loop,
                    bool driven) {
    if constexpr (axes > 1) along_[axis_along<axes>(axis)] = driven ? loop.tangential_force : 0.0f;
  }

 private:
  std::array<float, axes> along_{};  ///< N
};

}  // namespace kmax::firmware
