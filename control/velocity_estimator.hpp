#pragma once

#include <cstdint>

#include "control/difference_velocity.hpp"
#include "control/foaw_velocity.hpp"
#include "control/low_pass_velocity.hpp"
#include "control/tracking_velocity.hpp"

namespace kmax::control {

enum class VelocityEstimatorKind : std::uint8_t {
  difference = 0,
  low_pass = 1,
  foaw = 2,  // best fit
  foaw_end_fit = 3,
  tracking = 4,
};

template <typename Scalar>
struct VelocityEstimatorConfig {
  VelocityEstimatorKind kind = VelocityEstimatorKind::foaw;
  std::int32_t window = 16;  // intervals, 1 .. 16; FOAW only
  Scalar bandwidth = 100;    // Hz, > 0; low-pass and tracking only
};

// One of the velocity estimators, chosen by the coefficients at every sample; no virtual call. Input:
// resampled counts, multiples of `step`; output m/s. The headers of the estimators say what each one does and
// costs; FOAW's history is kept whichever kind runs, which adds its push() to the other kinds.
//
// A change of kind between samples gives no spike, because the new estimator does not start from nothing:
//   - difference, foaw and foaw_end_fit give exactly what they would have given had they always been
//   selected:
//     their state is the history, which is always kept;
//   - low_pass and tracking start on the previous sample with the last output as their velocity.
// So the first output after a change is one that the new estimator gives in its own right, or lies between
// the last output and the present difference.
//
// A change of the step (position.resolution in flight) moves the count by up to half of both steps although
// the handle has not moved. That sample is taken as the new origin, the output is held for it, and every
// estimator continues on the new grid from the held velocity; FOAW's history is laid out along it (about 200
// instructions, once).
//
// After another period or count length call reset(). Every count is valid and gives a finite output.
template <typename Scalar>
class VelocityEstimator {
 public:
  struct Coefficients {
    VelocityEstimatorKind kind = VelocityEstimatorKind::foaw;
    typename DifferenceVelocity<Scalar>::Coefficients difference;
    typename LowPassVelocity<Scalar>::Coefficients low_pass;
    typename FoawVelocity<Scalar>::Coefficients foaw;
    typename TrackingVelocity<Scalar>::Coefficients tracking;
  };

  // Outside the interrupt. period s > 0, count_length metres per count > 0, step in counts >= 1 (the
  // resampler's).
  static constexpr Coefficients prepare(const VelocityEstimatorConfig<Scalar>& config, Scalar period,
                                        Scalar count_length, std::int32_t step) {
    return {config.kind, DifferenceVelocity<Scalar>::prepare(period, count_length),
            LowPassVelocity<Scalar>::prepare(config.bandwidth, period, count_length),
            FoawVelocity<Scalar>::prepare(config.window, period, count_length, step),
            TrackingVelocity<Scalar>::prepare(config.bandwidth, period, count_length)};
  }

  // As if the handle had always stood on this count.
  void reset(std::int64_t count) {
    difference_.reset(count);
    low_pass_.reset(count);
    foaw_.reset(count);
    tracking_.reset(count);
    last_ = count;
    velocity_ = 0;
    step_ = 0;
  }

  Scalar update(const Coefficients& coefficients, std::int64_t count) {
    if (coefficients.foaw.step != step_) {
      const bool resampled_anew = step_ != 0;
      step_ = coefficients.foaw.step;
      if (resampled_anew) {
        foaw_.reset(coefficients.foaw, count, velocity_);
        start(coefficients, count);
        last_ = count;
        return velocity_;
      }
    }
    if (coefficients.kind != kind_) start(coefficients, last_);
    foaw_.push(coefficients.foaw, count);
    switch (kind_) {
      case VelocityEstimatorKind::difference:
        velocity_ = difference_.update(coefficients.difference, count);
        break;
      case VelocityEstimatorKind::low_pass:
        velocity_ = low_pass_.update(coefficients.low_pass, count);
        break;
      case VelocityEstimatorKind::foaw:
        velocity_ = foaw_.template estimate<FoawFit::best>(coefficients.foaw);
        break;
      case VelocityEstimatorKind::foaw_end_fit:
        velocity_ = foaw_.template estimate<FoawFit::end>(coefficients.foaw);
        break;
      case VelocityEstimatorKind::tracking:
        velocity_ = tracking_.update(coefficients.tracking, count);
        break;
    }
    last_ = count;
    return velocity_;
  }

 private:
  void start(const Coefficients& coefficients, std::int64_t count) {
    kind_ = coefficients.kind;
    difference_.reset(count);
    low_pass_.reset(count, velocity_);
    tracking_.reset(coefficients.tracking, count, velocity_);
  }

  DifferenceVelocity<Scalar> difference_;
  LowPassVelocity<Scalar> low_pass_;
  FoawVelocity<Scalar> foaw_;
  TrackingVelocity<Scalar> tracking_;
  std::int64_t last_ = 0;
  Scalar velocity_ = 0;
  std::int32_t step_ = 0;  // 0: no sample since reset()
  VelocityEstimatorKind kind_ = VelocityEstimatorKind::foaw;
};

}  // namespace kmax::control
