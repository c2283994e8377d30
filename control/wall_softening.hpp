#pragma once

#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct WallSofteningConfig {
  Scalar halving_time = Scalar(0.1);  ///< s, > 0: an alarm that lasts this long halves the wall's force
  Scalar least = Scalar(0.05);        ///< 0 to 1: the factor never falls below
};

/// The factor on a wall's force that falls while the wall is called unstable, and rises again only by
/// reset().
///
/// All of the force is meant to be multiplied (spring, damper and field), since each of them can be what
/// makes a wall unstable. It falls a little at every sample, so no step is felt. The factor is
/// 1 - ln 2 x period / halving_time per sample: at 500 Hz and 0.1 s it halves 0.7 % sooner than configured.
/// Cost: 2 multiplications and a comparison while there is an alarm.
template <typename Scalar>
class WallSoftening {
 public:
  struct Coefficients {
    Scalar per_sample = Scalar(1);
    Scalar least{};
  };

  /// Outside the interrupt. `period`: s per call of update(). A halving time shorter than a sample, or one
  /// that is no number, softens to the least at once.
  static constexpr Coefficients prepare(const WallSofteningConfig<Scalar>& config, Scalar period) {
    constexpr Scalar ln2 = Scalar(0.693147180559945309);
    const Scalar step = config.halving_time > period ? ln2 * period / config.halving_time : Scalar(1);
    return {Scalar(1) - bounded_share(step), bounded_share(config.least)};
  }

  void reset() { factor_ = Scalar(1); }

  /// One haptic sample. The factor for the force of this very sample.
  Scalar update(const Coefficients& c, bool unstable) {
    if (unstable) [[unlikely]] {
      const Scalar softer = factor_ * c.per_sample;
      if (softer > c.least) {
        factor_ = softer;
      } else if (c.least < factor_) {
        factor_ = c.least;
      }
    }
    return factor_;
  }

  Scalar factor() const { return factor_; }

 private:
  Scalar factor_ = Scalar(1);
};

}  // namespace kmax::control
