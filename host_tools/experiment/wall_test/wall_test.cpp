#include "host_tools/experiment/wall_test/wall_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/rate_hardness.hpp"
#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

std::string_view to_string(TouchKind kind) {
  constexpr std::array<std::string_view, touch_kinds.size()> names{"slow", "fast", "pulse", "let go"};
  return names.at(static_cast<std::size_t>(kind));
}

std::string_view to_string(StabilityCriterion criterion) {
  constexpr std::array<std::string_view, stability_criteria.size()> names{"position", "force", "both"};
  return names.at(static_cast<std::size_t>(criterion));
}

namespace {

constexpr double swing_window = 0.25;    // s
constexpr double simulated_pause = 2.0;  // s, in which a simulated hand is back at its start

struct Swing {
  bool stable = false, judged = false, touched = false;
  double peak_to_peak = 0.0;
};

/// The same rule for the position and for the force. `margin`: of the position, how far outside the wall is
/// still in contact.
Swing swing_of(const std::vector<RigSample>& samples, double RigSample::*value, double threshold,
               double hold_time, double margin) {
  std::vector<simulation::ContactSample> recording;
  recording.reserve(samples.size());
  for (const RigSample& sample : samples) recording.push_back({sample.time, sample.*value});
  simulation::ContactCriterion criterion;
  criterion.window_begin = hold_time - 1.0;
  criterion.window_end = hold_time;
  criterion.threshold = threshold;
  criterion.contact_margin = margin;
  if (!simulation::can_be_judged(recording, criterion)) return {};
  const simulation::ContactMeasure measure = simulation::measure_contact(recording, criterion);
  return {measure.verdict != simulation::ContactVerdict::unstable, true,
          measure.verdict != simulation::ContactVerdict::no_contact, measure.peak_to_peak};
}

std::optional<double> rate_hardness_of(const RigTouch& touch) {
  std::vector<ContactForce> trace;
  for (const RigSample& sample : touch.samples)
    trace.push_back({sample.time, sample.outside_distance, touch.side * sample.force});
  return rate_hardness(trace, touch.speed);
}

std::optional<double> settling_of(const std::vector<RigSample>& samples, double begin, double end,
                                  double threshold) {
  std::vector<device::TraceSample> positions;
  double last_swing = begin;
  for (const RigSample& sample : samples) {
    if (sample.time < begin || sample.time >= end) continue;
    positions.push_back({sample.time, sample.outside_distance, 0.0, 0.0});
    if (oscillation(positions, swing_window) > threshold * (1.0 + simulation::rounding_allowance))
      last_swing = sample.time;
  }
  if (positions.empty() || last_swing > end - swing_window) return std::nullopt;
  return last_swing - begin;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

void require(const WallTestSettings& settings) {
  const SettingCheck check("wall test");
  if (settings.stiffnesses.empty()) throw std::invalid_argument("wall test: no stiffness; give at least one");
  double before = 0.0;
  for (const double stiffness : settings.stiffnesses) {
    check("stiffness", stiffness, 1.0, 1e6);
    if (stiffness <= before)
      throw std::invalid_argument(fmt::format(
          "wall test: stiffness {:g} N/m after {:g} N/m: list them rising, each once", stiffness, before));
    before = stiffness;
  }
  check("repeats", static_cast<double>(settings.repeats), 1, 1000);
  check("hold time", settings.hold_time, 2.0, 60.0);
  check("threshold", settings.threshold, 1e-9, 1.0);
  check("force threshold", settings.force_threshold, 1e-6, 1000.0);
}

TouchPlan plan_of(TouchKind kind, double stiffness, const WallTestSettings& settings) {
  RigWall wall;
  wall.as_set = true;
  wall.stiffness = stiffness;
  wall.changes = settings.changes.assignments();
  TouchPlan plan;
  plan.name = fmt::format("{:g} N/mm, {}", stiffness / 1e3, to_string(kind));
  plan.request = request_of(kind, stiffness, settings);
  plan.hold_time = settings.hold_time;
  plan.approach_speed = settings.speed(kind);
  if (kind == TouchKind::pulse) {
    wall.interference = control::InterferenceMode::perpendicular;
    const double begin = settings.event_time(), half = settings.pulse_time;
    const auto of = ForceChange::Of::interference;
    plan.changes = {{begin, of, settings.pulse_force},
                    {begin + half, of, -settings.pulse_force},
                    {begin + 2.0 * half, of, 0.0}};
  }
  plan.wall = wall;
  return plan;
}

}  // namespace

WallTouch measure_wall_touch(TouchKind kind, RigTouch touch, const WallTestSettings& settings) {
  WallTouch result;
  result.kind = kind;
  result.contact_speed = touch.speed;
  result.limited_share = touch.limited_share;
  result.aborted_at = touch.aborted_at;
  result.lost_records = touch.lost_records;
  result.rate_hardness = rate_hardness_of(touch);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  double least = low, most = high;
  for (const RigSample& sample : touch.samples) {
    if (sample.time < 0.0 || sample.time >= settings.hold_time) continue;
    result.deepest = std::max(result.deepest, -sample.outside_distance);
    result.peak_force = std::max(result.peak_force, std::abs(sample.force));
    low = std::min(low, sample.outside_distance);
    high = std::max(high, sample.outside_distance);
    least = std::min(least, sample.force);
    most = std::max(most, sample.force);
  }
  if (touch.aborted_at) {
    result.judged = high >= low;
    result.position_swing = std::max(0.0, high - low);
    result.force_swing = std::max(0.0, most - least);
  } else {
    constexpr double anywhere = std::numeric_limits<double>::infinity();
    const Swing position =
        swing_of(touch.samples, &RigSample::outside_distance, settings.threshold, settings.hold_time, 0.0);
    const Swing force =
        swing_of(touch.samples, &RigSample::force, settings.force_threshold, settings.hold_time, anywhere);
    const bool left = kind == TouchKind::let_go && !position.touched;
    result.judged = position.judged && (position.touched || left);
    result.stable_by_position = position.stable;
    result.stable_by_force = force.stable;
    result.position_swing = position.peak_to_peak;
    result.force_swing = force.peak_to_peak;
    double begin = 0.0;
    if (kind == TouchKind::pulse && touch.change_times.size() > 1) {
      begin = touch.change_times.back();
      result.pulse_time =
          (begin - touch.change_times.front()) / static_cast<double>(touch.change_times.size() - 1);
    }
    if (kind != TouchKind::let_go)
      result.settling = settling_of(touch.samples, begin, settings.hold_time, settings.threshold);
  }
  result.samples = std::move(touch.samples);
  return result;
}

std::string request_of(TouchKind kind, double stiffness, const WallTestSettings& settings) {
  const std::string name = fmt::format("{:g} N/mm, {}", stiffness / 1e3, to_string(kind));
  std::string request = press_request(name, settings.hold_time);
  request += fmt::format("; meet it at about {:g} m/s", settings.speed(kind));
  if (kind == TouchKind::slow) request += " (10 cm in 2 s)";
  if (kind == TouchKind::pulse)
    request +=
        fmt::format("; after {:g} s the device pushes: keep pressing as before", settings.event_time());
  if (kind == TouchKind::let_go)
    request += fmt::format("; after {:g} s open the hand and let the handle go", settings.event_time());
  return request;
}

simulation::Scene scene_of(TouchKind kind, const WallTestSettings& settings) {
  simulation::Scene scene = settings.changes.simulated_device();
  simulation::IntendedMotionConfig& motion = scene.axes.front().motion.value();
  motion.approach_speed = settings.speed(kind);
  // 20 mm are too short to reach half a metre per second.
  if (kind == TouchKind::fast && !settings.changes.changes("motion.start_position"))
    motion.start_position = motion.wall_position + motion.wall_side * 0.06;
  motion.hold_time = settings.hold_time + 0.5;
  if (kind == TouchKind::let_go) {
    motion.hold_time = settings.event_time();
    motion.open_time = settings.hold_time;
  }
  return scene;
}

TouchLimits wall_test_limits() {
  TouchLimits limits = contact_limits();
  limits.abort_amplitude = 15e-3;
  return limits;
}

void make_wall_touches(Rig& rig, TouchKind kind, const WallTestSettings& settings,
                       const std::function<void(std::size_t number)>& made,
                       const std::function<void(WallTouch touch)>& touched) {
  require(settings);
  std::size_t number = 0;
  bool cut_short = false;
  for (const double stiffness : settings.stiffnesses) {
    TouchPlan plan = plan_of(kind, stiffness, settings);
    for (std::size_t repeat = 1; repeat <= settings.repeats; ++repeat) {
      made(number++);
      // A simulated person goes on pressing for the whole hold.
      plan.pause = simulated_pause + (cut_short ? settings.hold_time : 0.0);
      WallTouch touch = rig.touch<WallTouch>(
          plan, [&](RigTouch recorded) { return measure_wall_touch(kind, std::move(recorded), settings); });
      cut_short = touch.aborted_at.has_value();
      touch.stiffness = stiffness;
      touch.number = repeat;
      touched(std::move(touch));
    }
  }
}

std::vector<WallCell> wall_cells(const std::vector<WallTouch>& touches, const WallTestSettings& settings) {
  std::vector<WallCell> cells;
  for (const TouchKind kind : touch_kinds) {
    for (const double stiffness : settings.stiffnesses) {
      WallCell cell;
      cell.kind = kind;
      cell.stiffness = stiffness;
      std::vector<double> speeds, hardnesses;
      bool all_settled = true;
      double longest = 0.0;
      for (const WallTouch& touch : touches) {
        if (touch.kind != kind || touch.stiffness != stiffness || !touch.counts()) continue;
        ++cell.touches;
        for (const StabilityCriterion criterion : stability_criteria)
          cell.stable[static_cast<std::size_t>(criterion)] += touch.stable(criterion) ? 1 : 0;
        speeds.push_back(touch.contact_speed);
        if (touch.rate_hardness) hardnesses.push_back(*touch.rate_hardness);
        cell.deepest = std::max(cell.deepest, touch.deepest);
        cell.peak_force = std::max(cell.peak_force, touch.peak_force);
        cell.limited_share = std::max(cell.limited_share, touch.limited_share);
        cell.aborted += touch.aborted_at ? 1 : 0;
        all_settled = all_settled && touch.settling.has_value();
        longest = std::max(longest, touch.settling.value_or(0.0));
      }
      cell.contact_speed = median(speeds);
      if (!hardnesses.empty()) cell.rate_hardness = median(hardnesses);
      if (cell.touches > 0 && all_settled) cell.settling = longest;
      cells.push_back(cell);
    }
  }
  return cells;
}

StableLimit stable_limit(const std::vector<WallCell>& cells, StabilityCriterion criterion,
                         const std::optional<TouchKind>& kind) {
  std::vector<double> stiffnesses;
  for (const WallCell& cell : cells) stiffnesses.push_back(cell.stiffness);
  std::sort(stiffnesses.begin(), stiffnesses.end());
  stiffnesses.erase(std::unique(stiffnesses.begin(), stiffnesses.end()), stiffnesses.end());
  StableLimit limit;
  for (const double stiffness : stiffnesses) {
    bool stable = true, judged = true;
    for (const WallCell& cell : cells) {
      if (cell.stiffness != stiffness || (kind && cell.kind != *kind)) continue;
      stable = stable && cell.stable_by(criterion) == cell.touches;
      judged = judged && cell.touches > 0;
    }
    limit.next = stiffness;
    // One touch that is unstable is enough, whatever could not be judged beside it.
    if (!stable || !judged) {
      limit.end = stable ? StableLimit::End::unjudged : StableLimit::End::unstable;
      return limit;
    }
    limit.largest = stiffness;
  }
  limit.end = stiffnesses.empty() ? StableLimit::End::unjudged : StableLimit::End::nothing;
  return limit;
}

std::string limit_text(const StableLimit& limit) {
  using End = StableLimit::End;
  const double next = limit.next / 1e3;
  if (limit.end == End::unjudged) {
    if (!limit.largest) return fmt::format("unknown: no touch at {:g} N/mm could be judged", next);
    return fmt::format("at least {:g} N/mm: no touch at {:g} N/mm could be judged", *limit.largest / 1e3,
                       next);
  }
  if (!limit.largest) return fmt::format("below {:g} N/mm: unstable already there", next);
  if (limit.end == End::nothing)
    return fmt::format("at least {:g} N/mm: nothing was unstable", *limit.largest / 1e3);
  return fmt::format("{:g} N/mm", *limit.largest / 1e3);
}

}  // namespace kmax::experiment
