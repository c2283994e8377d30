#include "host_tools/experiment/jitter/jitter_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/experiment/tested_claim.hpp"

namespace kmax::experiment {

JitterMeasure measure_jitter(std::span<const RigSample> samples, const JitterWall& wall) {
  JitterMeasure measure;
  double touch = 0.0, previous = 0.0, last_outside = 0.0;
  std::size_t judged = 0, beyond = 0;
  const double sample_time = 1.0 / wall.haptic_rate;
  for (const RigSample& sample : samples) {
    if (!measure.touched && sample.outside_distance <= 0.0) {
      measure.touched = true;
      touch = last_outside = sample.time;
    }
    if (!measure.touched) continue;
    if (sample.time > touch + wall.window + 0.5 * sample_time) break;
    previous = sample.time;
    ++judged;
    beyond += std::abs(sample.force) > paper::touch_force_limit ? 1 : 0;
    if (sample.outside_distance <= 0.0) continue;
    measure.amplitude = std::max(measure.amplitude, sample.outside_distance);
    last_outside = sample.time + sample_time;
  }
  if (!measure.touched) return measure;
  measure.adjustment_time = last_outside - touch;
  measure.settled = previous - last_outside >= wall.settled_time - 0.5 * sample_time;
  measure.beyond_limit_share = static_cast<double>(beyond) / static_cast<double>(judged);
  return measure;
}

namespace {
constexpr auto jitter_touch_fields = [](auto& touch, const auto& field) {
  field("touched", touch.measure.touched);
  field("settled", touch.measure.settled);
  field("jitter_m", touch.measure.amplitude);
  field("adjustment_time_s", touch.measure.adjustment_time);
  field("beyond_limit_share", touch.measure.beyond_limit_share);
  field("aborted", touch.aborted);
  field("limited_share", touch.limited_share);
  field("lost_records", touch.lost_records);
};

TouchPlan plan_of(const paper::JitterCell& pair, const JitterSettings& settings, int number) {
  TouchPlan plan;
  plan.name = fmt::format("F_B = {:g} N, F_I = {:g} N, touch {} of {}", pair.background, pair.interference,
                          number + 1, settings.touches);
  const std::string at_once =
      pair.background > 0.0 ? fmt::format("{:g} N act at once, ", pair.background) : "";
  plan.request = fmt::format(
      "{}: hold the handle outside the wall; after Enter touch the wall and keep the handle there for {:g} s "
      "({}inside {:g} N push it back)",
      plan.name, settings.wall.window, at_once, pair.background + pair.interference);
  plan.hold_time = settings.wall.window;
  plan.phase = static_cast<double>(number) / settings.touches;
  return plan;
}
}  // namespace

void to_json(RunJournal::Json& json, const JitterTouch& touch) {
  write_fields(json, touch, jitter_touch_fields);
}

void from_json(const RunJournal::Json& json, JitterTouch& touch) {
  read_fields(json, touch, jitter_touch_fields);
}

RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const JitterSettings& settings) {
  return touch_settings("jitter", device, limits,
                        {{"stiffness_n_per_m", settings.wall.stiffness},
                         {"haptic_rate_hz", settings.wall.haptic_rate},
                         {"window_s", settings.wall.window},
                         {"settled_time_s", settings.wall.settled_time},
                         {"touches", settings.touches}});
}

JitterResult mean_jitter(const paper::JitterCell& cell, std::span<const JitterMeasure> touches) {
  JitterResult result;
  result.paper = cell;
  for (const JitterMeasure& touch : touches) {
    if (!touch.touched) {
      ++result.without_touch;
      continue;
    }
    ++result.touches;
    result.unsettled += touch.settled ? 0 : 1;
    result.amplitude += touch.amplitude;
    result.adjustment_time += touch.adjustment_time;
    result.beyond_limit_share += touch.beyond_limit_share;
  }
  if (result.touches == 0) return result;
  const auto count = static_cast<double>(result.touches);
  result.amplitude /= count;
  result.adjustment_time /= count;
  result.beyond_limit_share /= count;
  return result;
}

JitterRun run_jitter(Rig& rig, const JitterSettings& settings, const ProgressReport& progress) {
  const JitterWall& wall = settings.wall;
  constexpr SettingCheck check("jitter");
  check("window", wall.window, 0.01, 1000.0);
  check("settled time", wall.settled_time, 0.0, wall.window);
  check("touches", settings.touches, 1, 1000);
  const auto measured = [&](const RigTouch& touch) {
    return JitterTouch{touch.aborted_at ? JitterMeasure{} : measure_jitter(touch.samples, wall),
                       touch.aborted_at.has_value(), touch.limited_share, touch.lost_records};
  };
  JitterRun run;
  for (const paper::JitterCell& pair : settings.pairs) {
    if (progress) progress(run.results.size(), settings.pairs.size());
    rig.set({wall.stiffness, wall.haptic_rate, control::InterferenceMode::perpendicular, pair.interference,
             pair.background});
    std::vector<JitterMeasure> measures;
    std::size_t aborted = 0;
    for (std::size_t person = 0; person < rig.people(); ++person) {
      for (int number = 0; number < settings.touches; ++number) {
        TouchPlan plan = plan_of(pair, settings, number);
        plan.person = person;
        const auto touch = rig.touch<JitterTouch>(plan, measured);
        run.lost_records += touch.lost_records;
        run.limited_share = std::max(run.limited_share, touch.limited_share);
        if (touch.aborted) {
          ++aborted;
        } else if (touch.lost_records > 0) {
          rig.note(fmt::format("{}: not counted, {} records of its trace were lost", plan.name,
                               touch.lost_records));
        } else {
          measures.push_back(touch.measure);
        }
      }
    }
    run.results.push_back(mean_jitter(pair, measures));
    run.results.back().aborted = aborted;
  }
  return run;
}

TestedClaim JitterVerdict::amplitude_falls() const {
  return all_fall(amplitude);
}
TestedClaim JitterVerdict::time_falls() const {
  return all_settled ? all_fall(time) : std::nullopt;
}

JitterVerdict judge_jitter(std::span<const JitterResult> results) {
  JitterVerdict verdict;
  std::vector<double> amplitude, time, paper_amplitude, paper_time;
  for (const JitterResult& result : results) {
    verdict.all_settled =
        verdict.all_settled && result.unsettled == 0 && result.touches > 0 && result.aborted == 0;
    if (result.touches == 0) continue;
    amplitude.push_back(result.amplitude);
    time.push_back(result.adjustment_time);
    paper_amplitude.push_back(result.paper.amplitude);
    paper_time.push_back(result.paper.adjustment_time);
  }
  verdict.amplitude_rank = rank_correlation(amplitude, paper_amplitude);
  verdict.time_rank = rank_correlation(time, paper_time);
  for (const double interference : paper::interference_forces) {
    const auto undisturbed = paper::jitter(0.0, interference);
    if (!undisturbed || undisturbed->amplitude == 0.0) continue;
    verdict.amplitude.push_back(background_trend(interference, results, &JitterResult::amplitude));
    verdict.time.push_back(background_trend(interference, results, &JitterResult::adjustment_time));
  }
  return verdict;
}

}  // namespace kmax::experiment
