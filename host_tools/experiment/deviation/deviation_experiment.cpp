#include "host_tools/experiment/deviation/deviation_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/experiment/tested_claim.hpp"

namespace kmax::experiment {

DeviationMeasure measure_deviation(std::span<const RigSample> samples, std::span<const double> begins,
                                   double pulse_on) {
  DeviationMeasure measure;
  std::size_t counted_without = 0, counted_with = 0;
  for (std::size_t pulse = 0; pulse < begins.size(); ++pulse) {
    std::optional<double> origin;
    double largest = 0.0;
    for (const RigSample& sample : samples) {
      if (sample.time < begins[pulse]) continue;
      if (sample.time >= begins[pulse] + pulse_on) break;
      if (!origin) origin = sample.tangential;
      largest = std::max(largest, std::abs(sample.tangential - *origin));
    }
    if (!origin) continue;
    ++measure.pulses;
    const bool second = pulse >= begins.size() / 2;
    (second ? measure.with : measure.without) += largest;
    ++(second ? counted_with : counted_without);
  }
  if (counted_without > 0) measure.without /= static_cast<double>(counted_without);
  if (counted_with > 0) measure.with /= static_cast<double>(counted_with);
  return measure;
}

namespace {
constexpr auto deviation_touch_fields = [](auto& touch, const auto& field) {
  field("deviation_before_m", touch.measure.without);
  field("deviation_m", touch.measure.with);
  field("pulses", touch.measure.pulses);
  field("contact_share", touch.contact_share);
  field("limited_share", touch.limited_share);
  field("aborted", touch.aborted);
  field("lost_records", touch.lost_records);
};

DeviationTouch measured_touch(const RigTouch& touch, const TouchPlan& plan, double pulse_on) {
  std::vector<double> begins;
  for (std::size_t change = 0; change < touch.change_times.size(); ++change)
    if (plan.changes[change].of == ForceChange::Of::interference && plan.changes[change].force > 0.0)
      begins.push_back(touch.change_times[change]);
  return {measure_deviation(touch.samples, begins, pulse_on),
          touch.contact_share,
          touch.beyond_limit_share,
          touch.limited_share,
          touch.touched,
          touch.aborted_at.has_value(),
          touch.lost_records};
}
}  // namespace

TouchPlan deviation_plan(const DeviationProtocol& protocol, const paper::DeviationCell& pair) {
  using Of = ForceChange::Of;
  TouchPlan plan;
  plan.name = fmt::format("F_B = {:g} N, F_I = {:g} N", pair.background, pair.interference);
  const std::string later = pair.background > 0.0 ? fmt::format(", and after {:g} s {:g} N away from it",
                                                                protocol.onset(), pair.background)
                                                  : "";
  plan.request = fmt::format(
      "{}: hold the handle outside the wall; after Enter press it firmly against the wall and keep it on the "
      "spot for {:g} s (pulses of {:g} N act along the wall{})",
      plan.name, protocol.duration() + 0.1, pair.interference, later);
  plan.hold_time = protocol.duration();
  for (int pulse = 0; pulse < 2 * protocol.pulses; ++pulse) {
    if (pulse == protocol.pulses) plan.changes.push_back({protocol.onset(), Of::background, pair.background});
    const double begin = protocol.pulse_begin(pulse);
    plan.changes.push_back({begin, Of::interference, pair.interference});
    plan.changes.push_back({begin + protocol.pulse_on, Of::interference, 0.0});
  }
  return plan;
}

void to_json(RunJournal::Json& json, const DeviationTouch& touch) {
  write_fields(json, touch, deviation_touch_fields);
}

void from_json(const RunJournal::Json& json, DeviationTouch& touch) {
  read_fields(json, touch, deviation_touch_fields);
}

RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const DeviationSettings& settings) {
  const DeviationProtocol& protocol = settings.protocol;
  RunJournal::Json all = touch_settings("deviation", device, limits,
                                        {{"other_axis", device_circumstances(device, along(limits.axis))},
                                         {"stiffness_n_per_m", protocol.stiffness},
                                         {"haptic_rate_hz", protocol.haptic_rate},
                                         {"rest_s", protocol.rest},
                                         {"pulse_on_s", protocol.pulse_on},
                                         {"pulse_off_s", protocol.pulse_off},
                                         {"pulses", protocol.pulses}});
  all["wall_abort_amplitude_m"] = limits.wall_abort_amplitude;
  return all;
}

DeviationResult mean_deviation(const paper::DeviationCell& cell, std::span<const DeviationTouch> touches) {
  DeviationResult result;
  result.paper = cell;
  for (const DeviationTouch& touch : touches) {
    if (!touch.touched || touch.measure.pulses == 0) continue;
    ++result.touches;
    result.deviation += touch.measure.with;
    result.before += touch.measure.without;
    result.contact_share += touch.contact_share;
    result.beyond_limit_share += touch.beyond_limit_share;
  }
  if (result.touches == 0) return result;
  const auto count = static_cast<double>(result.touches);
  result.deviation /= count;
  result.before /= count;
  result.contact_share /= count;
  result.beyond_limit_share /= count;
  return result;
}

DeviationRun run_deviation(Rig& rig, const DeviationSettings& settings, const ProgressReport& progress) {
  const DeviationProtocol& protocol = settings.protocol;
  constexpr SettingCheck check("deviation");
  check("rest", protocol.rest, 0.0, 60.0);
  check("pulse", protocol.pulse_on, 4.0 / protocol.haptic_rate, 60.0);
  check("pause", protocol.pulse_off, 0.0, 60.0);
  check("pulses", protocol.pulses, 1, 1000);
  DeviationRun run;
  for (const paper::DeviationCell& pair : settings.pairs) {
    if (progress) progress(run.results.size(), settings.pairs.size());
    rig.set({protocol.stiffness, protocol.haptic_rate, control::InterferenceMode::parallel});
    TouchPlan plan = deviation_plan(protocol, pair);
    std::vector<DeviationTouch> touches;
    std::size_t aborted = 0, without_contact = 0;
    for (plan.person = 0; plan.person < rig.people(); ++plan.person) {
      DeviationTouch touch = rig.touch<DeviationTouch>(
          plan, [&](const RigTouch& made) { return measured_touch(made, plan, protocol.pulse_on); });
      run.lost_records += touch.lost_records;
      run.limited_share = std::max(run.limited_share, touch.limited_share);
      aborted += touch.aborted ? 1 : 0;
      if (!rig.simulated()) {
        without_contact += touch.counts() ? 0 : 1;
        touch.touched = !touch.aborted && touch.counts();
      }
      touches.push_back(touch);
    }
    run.results.push_back(mean_deviation(pair, touches));
    DeviationResult& result = run.results.back();
    result.aborted = aborted;
    result.without_contact = without_contact;
    if (result.touches == 0) result.contact_share = touches.front().contact_share;
  }
  return run;
}

TestedClaim DeviationVerdict::claim_met() const {
  return all_fall(trends);
}

namespace {
std::vector<BackgroundTrend> trends_of(std::span<const DeviationResult> results) {
  std::vector<BackgroundTrend> trends;
  for (const double interference : paper::interference_forces) {
    const auto undisturbed = paper::deviation(0.0, interference);
    if (!undisturbed || undisturbed->deviation == 0.0) continue;
    trends.push_back(background_trend(interference, results, &DeviationResult::deviation));
  }
  return trends;
}
}  // namespace

DeviationVerdict judge_deviation(std::span<const DeviationResult> results) {
  DeviationVerdict verdict;
  std::vector<double> ours, theirs;
  for (const DeviationResult& result : results) {
    if (result.touches == 0) continue;
    ours.push_back(result.deviation);
    theirs.push_back(result.paper.deviation);
  }
  verdict.rank = rank_correlation(ours, theirs);
  verdict.trends = trends_of(results);
  return verdict;
}

std::vector<BackgroundTrend> printed_deviation_trends() {
  std::vector<DeviationResult> printed;
  for (const paper::DeviationCell& cell : paper::table_2) {
    DeviationResult result;
    result.paper = cell;
    result.deviation = cell.deviation;
    result.touches = 1;
    printed.push_back(result);
  }
  return trends_of(printed);
}

}  // namespace kmax::experiment
