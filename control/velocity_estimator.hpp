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

// Where samples come faster than this, s, FOAW takes every second one, with what was moved since the one
// before it, and holds its output in between. A window of as many intervals is then twice as long: half of
// the cost and, over the motions of docs/velocity_estimators.md at 20 kHz, 0.7 of the error in the mean, at
// most 1.3 of it, in impacts and in fast motions on fine counts. At 2 kHz it would lag.
inline constexpr double foaw_shortest_period = 0.0001;

// One of the velocity estimators, chosen by the coefficients at every sample; no virtual call. Input:
// resampled counts, multiples of `step`; output m/s. The headers of the estimators say what each one does and
// costs. FOAW's history is kept whichever kind runs, which adds its push() to the other kinds, but not by the
// edge period, whose own history takes its place. FOAW with the best fit, the costliest and the default, is
// part of what calls update(); the others are one function.
//
// A change of kind between samples gives no spike, because the new estimator does not start from nothing:
//   - difference, foaw and foaw_end_fit give exactly what they would have given had they always been
//     selected, unless edge_period ran before: their state is the history. Where FOAW takes every second
//     sample the last output is held until the next one that it takes;
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
//
// `number` of a sample: one more than that of the sample before. FOAW takes the even ones where it takes
// every second one, so that whoever counts the samples can put other work into the odd ones.
template <typename Scalar>
class VelocityEstimator {
 public:
  struct Coefficients {
    VelocityEstimatorKind kind = VelocityEstimatorKind::foaw;
    std::uint8_t foaw_leaves_out = 0;  // FOAW takes samples whose number has none of these bits
    std::uint32_t key = 0;  // the state that the kind uses, and the step: update() looks for a change of it
    typename LowPassVelocity<Scalar>::Coefficients low_pass;
    typename FoawVelocity<Scalar>::Coefficients foaw;
    typename TrackingVelocity<Scalar>::Coefficients tracking;
  };

  // Outside the interrupt. period s > 0, count_length metres per count > 0, step in counts >= 1 (the
  // resampler's).
  static constexpr Coefficients prepare(const VelocityEstimatorConfig<Scalar>& config, Scalar period,
                                        Scalar count_length, std::int32_t step) {
    const bool leaves_out = period < static_cast<Scalar>(foaw_shortest_period);
    const Scalar foaw_period = leaves_out ? Scalar{2} * period : period;
    return {config.kind,
            static_cast<std::uint8_t>(leaves_out ? 1 : 0),
            key_of(config.kind, step),
            LowPassVelocity<Scalar>::prepare(config.bandwidth, period, count_length),
            FoawVelocity<Scalar>::prepare(config.window, foaw_period, count_length, step),
            TrackingVelocity<Scalar>::prepare(config.bandwidth, period, count_length)};
  }

  // As if the handle had always stood on this count.
  void reset(std::int64_t count) {
    low_pass_.reset(count);
    new (&history_.foaw) FoawVelocity<Scalar>;
    history_.foaw.reset(count);
    tracking_.reset(count);
    last_ = count;
    moved_ = 0;
    velocity_ = 0;
    key_ = no_key;
  }

  // `sample.steps` must say by how many steps the count has moved since the last call, as the resampler's
  // does.
  [[gnu::always_inline]] Scalar update(const Coefficients& coefficients, const Resampler::Sample& sample,
                                       std::uint32_t number) {
    if (coefficients.key != key_) [[unlikely]] {
      if (changed(coefficients, sample.count, number)) return velocity_;
    }
    return advance(coefficients, sample, number);
  }

  // The same without a resampler before it. What a count is off the multiples of the step is left for the
  // next one.
  Scalar update(const Coefficients& coefficients, std::int64_t count, std::uint32_t number) {
    if (coefficients.key != key_) [[unlikely]] {
      if (changed(coefficients, count, number)) return velocity_;
    }
    const std::int32_t difference = count_difference(count, last_);
    const std::int32_t steps = difference / coefficients.foaw.step;
    return advance(coefficients, {count - (difference - steps * coefficients.foaw.step), steps}, number);
  }

 private:
  [[gnu::always_inline]] Scalar advance(const Coefficients& coefficients, const Resampler::Sample& sample,
                                        std::uint32_t number) {
    last_ = sample.count;
    if (coefficients.kind == VelocityEstimatorKind::foaw) [[likely]] {
      if (!foaw_takes(coefficients, number)) {
        moved_ = sample.steps;
        return velocity_;
      }
      const auto pushed = history_.foaw.push(saturated_sum(moved_, sample.steps));
      return velocity_ = history_.foaw.template estimate<FoawFit::best>(coefficients.foaw, pushed);
    }
    return velocity_ = by_another(coefficients, sample.steps, number);
  }

  static bool foaw_takes(const Coefficients& coefficients, std::uint32_t number) {
    return (number & coefficients.foaw_leaves_out) == 0;
  }

  // m/s for one step per sample. Where FOAW takes every second sample its interval is two samples long, and
  // its scale half of this one.
  static Scalar scale(const Coefficients& coefficients) {
    return coefficients.foaw_leaves_out != 0 ? Scalar(2) * coefficients.foaw.scale : coefficients.foaw.scale;
  }

  // What is not FOAW with the best fit. A function of its own: it would be in the image wherever a sample is
  // taken.
  [[gnu::noinline]] Scalar by_another(const Coefficients& coefficients, std::int32_t steps,
                                      std::uint32_t number) {
    if (coefficients.kind == VelocityEstimatorKind::edge_period)
      return history_.edges.update(steps) * scale(coefficients);
    const bool taken = foaw_takes(coefficients, number);
    typename FoawVelocity<Scalar>::Pushed pushed;
    if (taken) {
      pushed = history_.foaw.push(saturated_sum(moved_, steps));
    } else {
      moved_ = steps;
    }
    switch (coefficients.kind) {
      case VelocityEstimatorKind::low_pass:
        return low_pass_.update(coefficients.low_pass, last_);
      case VelocityEstimatorKind::tracking:
        return tracking_.update(coefficients.tracking, last_);
      case VelocityEstimatorKind::foaw_end_fit:
        return taken ? history_.foaw.template estimate<FoawFit::end>(coefficients.foaw, pushed) : velocity_;
      case VelocityEstimatorKind::foaw:         // by advance()
      case VelocityEstimatorKind::edge_period:  // above
      case VelocityEstimatorKind::difference:
        break;
    }
    return static_cast<Scalar>(steps) * scale(coefficients);
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
  [[gnu::noinline, gnu::cold]] bool changed(const Coefficients& coefficients, std::int64_t count,
                                            std::uint32_t number) {
    const bool step_changed = key_ != no_key && ((coefficients.key ^ key_) & step_bits) != 0;
    const bool had_edges = key_ != no_key && key_ >> 30 == edge_state;
    key_ = coefficients.key;
    if (step_changed) last_ = count;
    if (coefficients.kind == VelocityEstimatorKind::edge_period) {
      new (&history_.edges) EdgePeriodVelocity<Scalar>(velocity_ / scale(coefficients));
    } else if (had_edges || step_changed) {
      if (had_edges) new (&history_.foaw) FoawVelocity<Scalar>;
      // Where the last count is one that FOAW leaves out, half of an interval has passed since its sample.
      const bool left_out = !foaw_takes(coefficients, step_changed ? number : number - 1);
      moved_ = history_.foaw.reset(coefficients.foaw, last_, velocity_, left_out ? Scalar(0.5) : Scalar(0));
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
  std::int32_t moved_ = 0;  // steps in the sample that FOAW has left out
  Scalar velocity_ = 0;
  std::uint32_t key_ = no_key;
};

}  // namespace kmax::control
