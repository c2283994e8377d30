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
  WindowJudge(double begin, double end, bool by_force, const TouchSetup& setup)
      : begin_(begin),
        quarter_length_((end - begin) / 4.0),
        by_force_(by_force),
        threshold_(by_force ? setup.force_threshold : setup.threshold),
        setup_(setup) {
    low_.fill(std::numeric_limits<double>::infinity());
    high_.fill(-std::numeric_limits<double>::infinity());
  }

  void take(double time, double position, double force) {
    if (time < begin_) return;
    const double judged = by_force_ ? force : position;
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
    outcome.by_force = by_force_;
    if (!touched_) {
      outcome.verdict = simulation::ContactVerdict::no_contact;
    } else {
      outcome.verdict = still_ ? simulation::ContactVerdict::stable : simulation::ContactVerdict::unstable;
    }
  }

 private:
  void close_quarters(std::size_t next) {
    for (; quarter_ < next; ++quarter_) still_ = still_ || !(high_[quarter_] - low_[quarter_] > threshold_);
  }

  double begin_, quarter_length_;
  bool by_force_;
  double threshold_;
  const TouchSetup& setup_;
  std::array<double, 4> low_{}, high_{};
  std::size_t quarter_ = 0;
  double deepest_ = -std::numeric_limits<double>::infinity();
  bool touched_ = false, still_ = false;
};

void require(const TouchSetup& setup) {
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
  if (!(setup.threshold > 0.0) || !(setup.force_threshold >= 0.0))
    throw std::invalid_argument(fmt::format(
        "threshold of {} m or {} N peak to peak: the first must be above 0, the second 0 (not used) or above",
        setup.threshold, setup.force_threshold));
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

TouchOutcome simulate_touch(const TouchSetup& setup, std::vector<TouchSample>* recording) {
  require(setup);
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

  TouchOutcome outcome;
  const double period = 1.0 / setup.wall.tick_rate;
  std::uint64_t saturated = 0, since_contact = 0;
  std::optional<WindowJudge> judge, second;
  double end = std::numeric_limits<double>::infinity();
  for (;; ++outcome.samples) {
    const double time = handle.motion().elapsed();
    if (!judge && handle.motion().hold_end()) {
      end = *handle.motion().hold_end();
      const bool by_force = setup.force_threshold > 0.0;
      judge.emplace(end - setup.window, end, by_force && !setup.judges_both, setup);
      if (by_force && setup.judges_both) second.emplace(end - setup.window, end, true, setup);
    }
    if (time >= end - 1e-9) break;
    const double position = handle.position();
    const std::int64_t count = counts(position, per_metre);
    const auto more = added ? static_cast<float>(added(count, loop.output())) : 0.0F;
    const Loop::Output& out = loop.tick(coefficients, count, true, more);
    const Resisted resisted = resisted_force(loop, coefficients);
    handle.resist_across(resisted.across);
    if (out.inside && since_contact == 0) {
      outcome.contact_speed = -setup.motion.wall_side * handle.velocity();
      outcome.coefficient_at_contact = static_cast<double>(out.magnetic_coefficient);
    }
    const auto force = static_cast<double>(out.force);
    if (judge) {
      judge->take(time, position, force);
      if (second) second->take(time, position, force);
      if (recording == nullptr && judge->certain() && (!second || second->certain())) break;
    }
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
  judge->finish(outcome);
  if (second && !outcome.unstable()) second->finish(outcome);
  outcome.event_limit_hits = handle.event_limit_hits();
  if (since_contact > 0)
    outcome.saturated_share = static_cast<double>(saturated) / static_cast<double>(since_contact);
  return outcome;
}

}  // namespace kmax::experiment
