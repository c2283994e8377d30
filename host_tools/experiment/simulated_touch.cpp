#include "host_tools/experiment/simulated_touch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

namespace kmax::experiment {
namespace {

using control::HapticLoop;

std::int64_t counts(double position, double per_metre) {
  const double exact = position * per_metre;
  const auto truncated = static_cast<std::int64_t>(exact);
  return static_cast<double>(truncated) > exact ? truncated - 1 : truncated;
}

/// The judged window while it passes.
class WindowJudge {
 public:
  WindowJudge(double begin, double end, const TouchJudgement& judgement, const TouchSetup& setup)
      : begin_(begin), quarter_length_((end - begin) / 4.0), judgement_(judgement), setup_(setup) {
    low_.fill(std::numeric_limits<double>::infinity());
    high_.fill(-std::numeric_limits<double>::infinity());
  }

  void take(double time, double position, double force) {
    if (time < begin_) return;
    const double judged = judgement_.by_force ? force : position;
    const auto quarter =
        std::min<std::size_t>(3, static_cast<std::size_t>((time - begin_) / quarter_length_));
    if (quarter > quarter_) close_quarters(quarter);
    low_[quarter] = std::min(low_[quarter], judged);
    high_[quarter] = std::max(high_[quarter], judged);
    const double outside = setup_.motion.wall_side * (position - setup_.motion.wall_position);
    deepest_ = std::max(deepest_, -outside);
    touched_ = touched_ || outside <= 0.0;
  }

  /// A quarter was still and the wall was touched: nothing that follows can change the verdict.
  bool certain() const { return still_ && touched_; }

  void finish(TouchOutcome& outcome) {
    close_quarters(4);
    outcome.peak_to_peak = std::max(
        0.0, *std::max_element(high_.begin(), high_.end()) - *std::min_element(low_.begin(), low_.end()));
    outcome.deepest = deepest_;
    outcome.by_force = judgement_.by_force;
    if (!touched_) {
      outcome.verdict = simulation::ContactVerdict::no_contact;
    } else {
      outcome.verdict = still_ ? simulation::ContactVerdict::stable : simulation::ContactVerdict::unstable;
    }
  }

 private:
  void close_quarters(std::size_t next) {
    for (; quarter_ < next; ++quarter_)
      still_ = still_ || !(high_[quarter_] - low_[quarter_] > judgement_.threshold);
  }

  double begin_, quarter_length_;
  TouchJudgement judgement_;
  const TouchSetup& setup_;
  std::array<double, 4> low_{}, high_{};
  std::size_t quarter_ = 0;
  double deepest_ = -std::numeric_limits<double>::infinity();
  bool touched_ = false, still_ = false;
};

/// What a wall that grows has come to at the end of the judged window.
class RenderedShare {
 public:
  void take(double share) {
    sum_ += share;
    ++samples_;
  }
  double mean() const { return samples_ > 0 ? sum_ / static_cast<double>(samples_) : 0.0; }

 private:
  double sum_ = 0.0;
  std::uint64_t samples_ = 0;
};

void require(const TouchSetup& setup, std::span<const TouchJudgement> judgements) {
  const double rate = setup.wall.tick_rate;
  if (setup.wall.divider != 1 || !(rate >= 10.0 && rate <= 1e6))
    throw std::invalid_argument(
        fmt::format("simulated touch at {} Hz with divider {}: allowed is 10 to 1e6 Hz, one sample per tick",
                    rate, setup.wall.divider));
  if (!(setup.window > 0.0 && setup.window <= setup.motion.hold_time))
    throw std::invalid_argument(
        fmt::format("judged window of {} s: allowed is above 0 and at most the hold of {} s", setup.window,
                    setup.motion.hold_time));
  if (setup.window * rate < 8.0)
    throw std::invalid_argument(fmt::format(
        "judged window of {} s holds fewer than 8 samples at {} Hz: judge longer", setup.window, rate));
  if (!(setup.least_rendered_share >= 0.0 && setup.least_rendered_share <= 1.0))
    throw std::invalid_argument(
        fmt::format("share of the stiffness that a wall must come to, {}: allowed is 0 to 1",
                    setup.least_rendered_share));
  for (const TouchJudgement& judgement : judgements) {
    if (!(judgement.threshold > 0.0))
      throw std::invalid_argument(fmt::format("threshold of {} {} peak to peak: it must be above 0",
                                              judgement.threshold, judgement.by_force ? "N" : "m"));
  }
  if (!(setup.wall.count_length > 0.0) || setup.wall.count_length > 1.0)
    throw std::invalid_argument(
        fmt::format("count length {} m: allowed is above 0 to 1 m", setup.wall.count_length));
}

}  // namespace

Resisted resisted_force(const HapticLoop<float>& loop, const HapticLoop<float>::Coefficients& c,
                        double interference_share) {
  const HapticLoop<float>::Output& out = loop.output();
  const bool pushed = c.interference.mode == control::InterferenceMode::perpendicular && out.inside;
  return {std::abs(static_cast<double>(loop.background_force(c))) +
              (pushed ? interference_share * static_cast<double>(c.interference.force) : 0.0),
          static_cast<double>(out.tangential_force)};
}

control::HapticLoopConfig<float> touched_wall(double rate, double count_length, double force_limit) {
  control::HapticLoopConfig<float> wall;
  wall.count_length = count_length;
  wall.tick_rate = rate;
  wall.divider = 1;
  wall.force.limit = force_limit > 0.0 ? static_cast<float>(force_limit) : 1e9F;
  wall.force.ramp_time = 0.0F;
  return wall;
}

namespace {

/// How long a touch goes on.
enum class Until : std::uint8_t {
  each_is_certain,  ///< each criterion for itself: what follows is no part of its outcome
  all_are_certain,
  end_of_hold,
};

std::vector<TouchOutcome> run_touch(const TouchSetup& setup, std::span<const TouchJudgement> judgements,
                                    Until until, std::vector<TouchSample>* recording) {
  require(setup, judgements);
  simulation::CoupledHandle handle(setup.device, setup.person, setup.motion);
  handle.set_integrator(setup.integrator);
  if (setup.matrices) handle.share(setup.matrices);
  handle.begin_motion();

  using Loop = HapticLoop<float>;
  const double per_metre = 1.0 / setup.wall.count_length;
  const std::int64_t start = counts(setup.motion.start_position, per_metre);
  const Loop::Coefficients coefficients = Loop::prepare(setup.wall, start);
  Loop loop;
  const AddedForce added = setup.added_force ? setup.added_force(setup) : AddedForce{};

  TouchOutcome touch;  // without a verdict
  const double period = 1.0 / setup.wall.tick_rate;
  std::uint64_t saturated = 0, since_contact = 0;
  const bool grows = coefficients.wall.stiffness.grows;
  RenderedShare rendered;
  std::vector<WindowJudge> judges;
  std::vector<std::optional<TouchOutcome>> outcomes(judgements.size());
  const auto finish = [&](std::size_t n) {
    touch.event_limit_hits = handle.event_limit_hits();
    if (since_contact > 0)
      touch.saturated_share = static_cast<double>(saturated) / static_cast<double>(since_contact);
    if (grows) {
      touch.rendered_share = rendered.mean();
      touch.rendered = touch.rendered_share >= setup.least_rendered_share;
    }
    outcomes[n] = touch;
    judges[n].finish(*outcomes[n]);
    // Of a wall that nobody got to nothing is known.
    if (outcomes[n]->verdict == simulation::ContactVerdict::no_contact) outcomes[n]->rendered = true;
  };
  double end = std::numeric_limits<double>::infinity();
  for (;; ++touch.samples) {
    const double time = handle.motion().elapsed();
    if (judges.empty() && handle.motion().hold_end()) {
      end = *handle.motion().hold_end();
      for (const TouchJudgement& judgement : judgements)
        judges.emplace_back(end - setup.window, end, judgement, setup);
    }
    if (time >= end - 1e-9) break;
    const double position = handle.position();
    const std::int64_t count = counts(position, per_metre);
    const auto more = added ? static_cast<float>(added(count, loop.output())) : 0.0F;
    const Loop::Output& out = loop.tick(coefficients, count, true, more);
    const Resisted resisted = resisted_force(loop, coefficients);
    handle.resist_across(resisted.across);
    if (out.inside && since_contact == 0) {
      touch.contact_speed = -setup.motion.wall_side * handle.velocity();
      touch.coefficient_at_contact = static_cast<double>(out.magnetic_coefficient);
    }
    const auto force = static_cast<double>(out.force);
    if (grows && out.inside && time >= end - 0.25 * setup.window)
      rendered.take(static_cast<double>(loop.present_stiffness(coefficients)) /
                    static_cast<double>(setup.wall.wall.stiffness));
    // What a wall that grows comes to is known at the end.
    const bool open = grows && setup.least_rendered_share > 0.0;
    bool all_certain = !judges.empty() && !open;
    for (std::size_t n = 0; n < judges.size(); ++n) {
      if (outcomes[n]) continue;
      judges[n].take(time, position, force);
      if (open || !judges[n].certain()) {
        all_certain = false;
      } else if (until == Until::each_is_certain) {
        finish(n);
      }
    }
    if (all_certain && until != Until::end_of_hold) break;
    if (recording != nullptr)
      recording->push_back({time, position, handle.velocity(), handle.hand_position(), force, resisted.along,
                            static_cast<double>(out.magnetic_coefficient)});
    const double limit = setup.device.force_limit;
    if (out.inside || since_contact > 0) {
      ++since_contact;
      if (out.limited || (limit > 0.0 && std::abs(force) > limit)) ++saturated;
    }
    handle.advance(force, resisted.along, period);
  }
  std::vector<TouchOutcome> all;
  for (std::size_t n = 0; n < judges.size(); ++n) {
    if (!outcomes[n]) finish(n);
    all.push_back(*outcomes[n]);
  }
  return all;
}

}  // namespace

TouchOutcome simulate_touch(const TouchSetup& setup, std::vector<TouchSample>* recording) {
  if (!(setup.threshold > 0.0 && setup.force_threshold >= 0.0))
    throw std::invalid_argument(fmt::format(
        "threshold of {} m or {} N peak to peak: the first must be above 0, the second 0 (not used) or above",
        setup.threshold, setup.force_threshold));
  const TouchJudgement moves{false, setup.threshold}, swings{true, setup.force_threshold};
  std::vector<TouchJudgement> judgements;
  const bool by_force = setup.force_threshold > 0.0;
  if (!by_force || setup.judges_both) judgements.push_back(moves);
  if (by_force) judgements.push_back(swings);
  const std::vector<TouchOutcome> outcomes = run_touch(
      setup, judgements, recording != nullptr ? Until::end_of_hold : Until::all_are_certain, recording);
  return outcomes.front().unstable() ? outcomes.front() : outcomes.back();
}

std::vector<TouchOutcome> judge_touch(const TouchSetup& setup, std::span<const TouchJudgement> judgements) {
  return run_touch(setup, judgements, Until::each_is_certain, nullptr);
}

}  // namespace kmax::experiment
