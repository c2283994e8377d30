#include "host_tools/experiment/deviation/deviation_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "control/haptic_loop.hpp"
#include "host_tools/experiment/rank_correlation.hpp"
#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/encoder_model.hpp"

namespace kmax::experiment {

DeviationMeasure measure_deviation(std::span<const DeviationSample> samples, std::span<const double> begins,
                                   double pulse_on) {
  DeviationMeasure measure;
  std::size_t counted_without = 0, counted_with = 0;
  for (std::size_t pulse = 0; pulse < begins.size(); ++pulse) {
    std::optional<double> origin;
    double largest = 0.0;
    for (const DeviationSample& sample : samples) {
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
constexpr SettingCheck check("deviation");

void require(const DeviationSettings& settings, double background) {
  const DeviationProtocol& protocol = settings.protocol;
  check("stiffness", protocol.stiffness, 1.0, 1e6);
  check("haptic rate", protocol.haptic_rate, 10.0, 1e6);
  check("rest", protocol.rest, 0.0, 60.0);
  check("pulse", protocol.pulse_on, 4.0 / protocol.haptic_rate, 60.0);
  check("pause", protocol.pulse_off, 0.0, 60.0);
  check("pulses", protocol.pulses, 1, 1000);
  check("count length", settings.count_length, 1e-9, 1e-2);
  if (!(settings.push > background))
    throw std::invalid_argument(
        fmt::format("deviation: a push of {} N loses the wall against F_B = {} N: push harder than every F_B",
                    settings.push, background));
}

bool pulse_at(const DeviationProtocol& protocol, double time) {
  for (int pulse = 0; pulse < 2 * protocol.pulses; ++pulse) {
    const double begin = protocol.pulse_begin(pulse);
    if (time >= begin && time < begin + protocol.pulse_on) return true;
  }
  return false;
}
}  // namespace

DeviationTouch simulate_deviation(const DeviationSettings& settings, const simulation::OperatorModel& person,
                                  double background, double interference,
                                  std::vector<DeviationSample>* recording) {
  require(settings, background);
  const DeviationProtocol& protocol = settings.protocol;
  simulation::IntendedMotionConfig motion, still;
  motion.start_position = 0.02;
  motion.approach_speed = settings.approach_speed;
  motion.push_force = settings.push;
  motion.hold_time = protocol.duration() + 60.0;
  still.start_position = 0.0;  // begin_motion() is never called: the person intends to stay there
  simulation::CoupledHandle normal(settings.device, person, motion);
  simulation::CoupledHandle tangential(settings.device, person, still);
  normal.begin_motion();

  control::HapticLoopConfig<float> config =
      touched_wall(protocol.haptic_rate, settings.count_length, settings.device.force_limit);
  config.wall.kind = control::WallKind::plain;
  config.wall.stiffness = static_cast<float>(protocol.stiffness);
  config.interference.mode = control::InterferenceMode::parallel;
  const simulation::EncoderModel encoder(settings.count_length);
  using Loop = control::HapticLoop<float>;
  // By what acts inside: F_I in a pulse, F_B in the second half.
  std::array<std::array<Loop::Coefficients, 2>, 2> coefficients;
  for (const bool on : {false, true}) {
    for (const bool second : {false, true}) {
      config.interference.force = on ? static_cast<float>(interference) : 0.0F;
      config.interference.background_force = second ? static_cast<float>(background) : 0.0F;
      coefficients[on ? 1 : 0][second ? 1 : 0] =
          Loop::prepare(config, encoder.extended_counts(motion.start_position));
    }
  }
  Loop loop;

  DeviationTouch result;
  std::vector<DeviationSample> own;
  std::vector<DeviationSample>& samples = recording != nullptr ? *recording : own;
  samples.clear();
  const double period = 1.0 / protocol.haptic_rate;
  constexpr double patience = 30.0;  // s of approach
  std::uint64_t waited = 0, since_touch = 0, inside = 0, beyond = 0;
  while (static_cast<double>(waited) * period < patience) {
    const double time = static_cast<double>(since_touch) * period;
    if (result.touched && time >= protocol.duration()) break;
    const bool on = result.touched && pulse_at(protocol, time);
    const bool second = result.touched && time >= protocol.onset();
    const Loop::Output& out =
        loop.tick(coefficients[on ? 1 : 0][second ? 1 : 0], encoder.extended_counts(normal.position()), true);
    const double felt = second && out.inside ? background : 0.0;
    result.touched = result.touched || out.inside;
    const auto force = static_cast<double>(out.force);
    const auto along = static_cast<double>(out.tangential_force);
    if (result.touched) {
      samples.push_back(
          {time, static_cast<double>(encoder.extended_counts(tangential.position())) * settings.count_length,
           along});
      inside += out.inside ? 1 : 0;
      beyond +=
          std::abs(force) > paper::touch_force_limit || std::abs(along) > paper::touch_force_limit ? 1 : 0;
      ++since_touch;
    } else {
      ++waited;
    }
    normal.advance(force, felt, period);
    tangential.advance(along, felt, period);
  }
  if (!result.touched) return result;
  std::vector<double> begins;
  for (int number = 0; number < 2 * protocol.pulses; ++number)
    begins.push_back(protocol.pulse_begin(number) - 0.5 * period);
  result.measure = measure_deviation(samples, begins, protocol.pulse_on);
  result.contact_share = static_cast<double>(inside) / static_cast<double>(since_touch);
  result.beyond_limit_share = static_cast<double>(beyond) / static_cast<double>(since_touch);
  return result;
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

std::vector<DeviationResult> run_deviation(const DeviationSettings& settings,
                                           const std::vector<simulation::OperatorModel>& people,
                                           const ProgressReport& tell) {
  check.require_somebody(people);
  std::vector<DeviationResult> results;
  for (const paper::DeviationCell& cell : paper::table_2) {
    if (tell) tell(results.size(), paper::table_2.size());
    std::vector<DeviationTouch> touches;
    for (const simulation::OperatorModel& person : people)
      touches.push_back(simulate_deviation(settings, person, cell.background, cell.interference));
    results.push_back(mean_deviation(cell, touches));
  }
  return results;
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
