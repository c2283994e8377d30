#pragma once

#include <cstdint>

#include "control/finite.hpp"

namespace kmax::control {

/// The disturbance of paper 1's section 2, which shows how background forces tune the arm.
enum class InterferenceMode : std::uint8_t {
  none,
  perpendicular,  ///< eq. 2: F_B everywhere, F_I added inside, both along the wall's normal
  parallel,       ///< eq. 4: inside, F_I along the surface; F_B along the normal from t_0 on
};

template <typename Scalar>
struct InterferenceConfig {
  InterferenceMode mode = InterferenceMode::none;
  Scalar force{};             ///< F_I, N
  Scalar background_force{};  ///< F_B, N; the paper keeps F_B <= F_I
  Scalar onset_time{};        ///< t_0, s after contact; parallel mode only
};

/// Eqs. 2 and 4 of paper 1, without the wall's own force. Normal forces are positive outwards.
///
/// Eq. 4 writes one sum for forces that act in different directions. Read here: the interference is
/// tangential (that is what "parallel" says), the background force normal, as in eq. 2 and Fig. 1(b).
/// Time runs in whole samples from the moment of contact and starts again at each contact.
/// Cost: about 15 instructions.
template <typename Scalar>
class Interference {
 public:
  struct Coefficients {
    InterferenceMode mode = InterferenceMode::none;
    Scalar force{}, background_force{};
    std::uint32_t onset_samples = 0;
  };
  struct Output {
    Scalar normal{};      ///< N, outwards, F_B's share included
    Scalar tangential{};  ///< N, along the surface
  };

  /// Outside the interrupt path. `period`: s per haptic sample. The onset is rounded up to a whole sample
  /// and bounded to 2^31 samples.
  static constexpr Coefficients prepare(const InterferenceConfig<Scalar>& config, Scalar period) {
    Coefficients c{config.mode, config.force, config.background_force, 0};
    const Scalar samples = config.onset_time / period;
    constexpr Scalar most = Scalar(2147483648.0);
    if (samples >= most) {
      c.onset_samples = 0x80000000u;
    } else if (samples > Scalar(0)) {
      c.onset_samples = static_cast<std::uint32_t>(samples);
      // A quotient within a thousandth of a whole number is that number: 0.1 s / 0.002 s is 50 samples
      // however the two were rounded.
      if (samples - static_cast<Scalar>(c.onset_samples) > Scalar(0.001)) ++c.onset_samples;
    }
    return c;
  }

  void reset() { samples_inside_ = 0; }

  Output update(const Coefficients& c, bool inside) {
    Output out;
    const std::uint32_t elapsed = samples_inside_;
    if (!inside) {
      samples_inside_ = 0;
    } else if (elapsed != UINT32_MAX) {
      samples_inside_ = elapsed + 1;
    }
    if (c.mode == InterferenceMode::none) [[likely]]
      return out;
    if (c.mode == InterferenceMode::perpendicular) {
      out.normal = inside ? saturate(c.background_force + c.force) : c.background_force;
    } else if (c.mode == InterferenceMode::parallel && inside) {
      out.tangential = c.force;
      if (elapsed >= c.onset_samples) out.normal = c.background_force;
    }
    return out;
  }

  /// N, outwards: F_B's share of the last sample's normal force.
  Scalar background(const Coefficients& c) const {
    const bool acts = c.mode == InterferenceMode::perpendicular ||
                      (c.mode == InterferenceMode::parallel && samples_inside_ > c.onset_samples);
    return acts ? c.background_force : Scalar(0);
  }

 private:
  std::uint32_t samples_inside_ = 0;
};

}  // namespace kmax::control
