#pragma once

#include <cstdint>
#include <new>

#include "control/edge_period_velocity.hpp"
#include "control/foaw_velocity.hpp"
#include "control/low_pass_velocity.hpp"
#include "control/resampler.hpp"
#include "control/tracking_velocity.hpp"

namespace kmax::control {

enum class VelocityEstimatorKind : std::uint8_t {
  difference = 0,
  low_pass = 1,
  foaw = 2,  // best fit
  foaw_end_fit = 3,
  tracking = 4,
  edge_period = 5,
};

template <typename Scalar>
struct VelocityEstimatorConfig {
  VelocityEstimatorKind kind = VelocityEstimatorKind::foaw;
  std::int32_t window = 16;  // intervals, 1 .. 16; FOAW only
  Scalar bandwidth = 100;    // Hz, > 0; low-pass and tracking only
};

// One of the velocity estimators, chosen by the coefficients at every sample; no virtual call. Input:
// resampled counts, multiples of `step`; output m/s. The headers of the estimators say what each one does and
// costs. FOAW's history is kept whichever kind runs, which adds its push() to the other kinds, but not by the
// edge period, whose own history takes its place. FOAW with the best fit, the costliest and the default, is
// part of what calls update(); the others are one function.
//
// A change of kind between samples gives no spike, because the new estimator does not start from nothing:
//   - difference, foaw and foaw_end_fit give exactly what they would have given had they always been
//     selected, unless edge_period ran before: their state is the history;
//   - low_pass and tracking start on the previous sample with the last output as their velocity;
//   - edge_period starts there as well, with a history laid out along that velocity, and so do foaw and
//     foaw_end_fit after it.
// So the first output after a change is one that the new estimator gives in its own right, or lies between
// the last output and the present difference, give or take what a step is over the window.
//
// A change of the step (position.resolution in flight) moves the count by up to half of both steps although
// the handle has not moved. That sample is taken as the new origin, the output is held for it, and every
// estimator continues on the new grid from the held velocity; its history is laid out along it (about 300
// instructions, once; twice as many for the edge period).
//
// After another period or count length call reset(). Every count is valid and gives a finite output.
template <typename Scalar>
class VelocityEstimator {
 public:
  struct Coefficients {
    VelocityEstimatorKind kind = VelocityEstimatorKind::foaw;
    std::uint32_t key = 0;  // the state that the kind uses, and the step: update() looks for a change of it
    typename LowPassVelocity<Scalar>::Coefficients low_pass;
    typename FoawVelocity<Scalar>::Coefficients foaw;
    typename TrackingVelocity<Scalar>::Coefficients tracking;
  };

  // Outside the interrupt. period s > 0, count_length metres per count > 0, step in counts >= 1 (the
  // resampler's).
  static constexpr Coefficients prepare(const VelocityEstimatorConfig<Scalar>& config, Scalar period,
                                        Scalar count_length, std::int32_t step) {
    return {config.kind, key_of(config.kind, step),
            LowPassVelocity<Scalar>::prepare(config.bandwidth, period, count_length),
            FoawVelocity<Scalar>::prepare(config.window, period, count_length, step),
            TrackingVelocity<Scalar>::prepare(config.bandwidth, period, count_length)};
  }

  // As if the handle had always stood on this count.
  void reset(std::int64_t count) {
    low_pass_.reset(count);
    new (&history_.foaw) FoawVelocity<Scalar>;
    history_.foaw.reset(count);
    tracking_.reset(count);
    last_ = count;
    velocity_ = 0;
    key_ = no_key;
  }

  // `sample.steps` must say by how many steps the count has moved since the last call, as the resampler's
  // does.
  [[gnu::always_inline]] Scalar update(const Coefficients& coefficients, const Resampler::Sample& sample) {
    if (coefficients.key != key_) [[unlikely]] {
      if (changed(coefficients, sample.count)) return velocity_;
    }
    return advance(coefficients, sample);
  }

  // The same without a resampler before it. What a count is off the multiples of the step is left for the
  // next one.
  Scalar update(const Coefficients& coefficients, std::int64_t count) {
    if (coefficients.key != key_) [[unlikely]] {
      if (changed(coefficients, count)) return velocity_;
    }
    const std::int32_t difference = count_difference(count, last_);
    const std::int32_t steps = difference / coefficients.foaw.step;
    return advance(coefficients, {count - (difference - steps * coefficients.foaw.step), steps});
  }

 private:
  [[gnu::always_inline]] Scalar advance(const Coefficients& coefficients, const Resampler::Sample& sample) {
    last_ = sample.count;
    if (coefficients.kind == VelocityEstimatorKind::foaw) [[likely]] {
      const auto pushed = history_.foaw.push(sample.steps);
      return velocity_ = history_.foaw.template estimate<FoawFit::best>(coefficients.foaw, pushed);
    }
    return velocity_ = by_another(coefficients, sample.steps);
  }

  // What is not FOAW with the best fit. A function of its own: it would be in the image wherever a sample is
  // taken.
  [[gnu::noinline]] Scalar by_another(const Coefficients& coefficients, std::int32_t steps) {
    if (coefficients.kind == VelocityEstimatorKind::edge_period)
      return history_.edges.update(steps) * coefficients.foaw.scale;
    const auto pushed = history_.foaw.push(steps);
    switch (coefficients.kind) {
      case VelocityEstimatorKind::low_pass:
        return low_pass_.update(coefficients.low_pass, last_);
      case VelocityEstimatorKind::tracking:
        return tracking_.update(coefficients.tracking, last_);
      case VelocityEstimatorKind::foaw_end_fit:
        return history_.foaw.template estimate<FoawFit::end>(coefficients.foaw, pushed);
      case VelocityEstimatorKind::foaw:         // by advance()
      case VelocityEstimatorKind::edge_period:  // above
      case VelocityEstimatorKind::difference:
        break;
    }
    return static_cast<Scalar>(steps) * coefficients.foaw.scale;
  }

  static constexpr std::uint32_t step_bits = 0x3FFFFFFFU;
  static constexpr std::uint32_t no_key = 0xFFFFFFFFU;

  // The three kinds that work on FOAW's history share a state. Steps up to 2^30 - 1 all differ in it; no step
  // of any kind makes no_key.
  static constexpr std::uint32_t key_of(VelocityEstimatorKind kind, std::int32_t step) {
    const std::uint32_t state = kind == VelocityEstimatorKind::low_pass      ? 1U
                                : kind == VelocityEstimatorKind::tracking    ? 2U
                                : kind == VelocityEstimatorKind::edge_period ? edge_state
                                                                             : 0U;
    const std::uint32_t above_one = (static_cast<std::uint32_t>(step) - 1) & step_bits;
    return state << 30 | (above_one < step_bits ? above_one : step_bits - 1);
  }
  static constexpr std::uint32_t edge_state = 3;

  // Another kind or another step: true if this sample is only a new origin.
  [[gnu::noinline, gnu::cold]] bool changed(const Coefficients& coefficients, std::int64_t count) {
    const bool step_changed = key_ != no_key && ((coefficients.key ^ key_) & step_bits) != 0;
    const bool had_edges = key_ != no_key && key_ >> 30 == edge_state;
    key_ = coefficients.key;
    if (step_changed) last_ = count;
    if (coefficients.kind == VelocityEstimatorKind::edge_period) {
      new (&history_.edges) EdgePeriodVelocity<Scalar>(velocity_ * coefficients.foaw.per_sample);
    } else if (had_edges || step_changed) {
      if (had_edges) new (&history_.foaw) FoawVelocity<Scalar>;
      history_.foaw.reset(coefficients.foaw, last_, velocity_);
    }
    low_pass_.reset(last_, velocity_);
    tracking_.reset(coefficients.tracking, last_, velocity_);
    return step_changed;
  }

  // One of the two, as the key has it; before the first sample FOAW's.
  union History {
    constexpr History() : foaw() {}
    FoawVelocity<Scalar> foaw;
    EdgePeriodVelocity<Scalar> edges;
  };
  History history_;
  LowPassVelocity<Scalar> low_pass_;
  TrackingVelocity<Scalar> tracking_;
  std::int64_t last_ = 0;
  Scalar velocity_ = 0;
  std::uint32_t key_ = no_key;
};

}  // namespace kmax::control
