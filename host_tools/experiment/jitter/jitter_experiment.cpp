#include "host_tools/experiment/jitter/jitter_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/rank_correlation.hpp"
#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/encoder_model.hpp"

namespace kmax::experiment {

JitterMeasure measure_jitter(std::span<const JitterSample> samples, const JitterWall& wall) {
  JitterMeasure measure;
  double touch = 0.0, previous = 0.0, last_outside = 0.0;
  std::size_t judged = 0, beyond = 0;
  const double sample_time = 1.0 / wall.haptic_rate;
  for (const JitterSample& sample : samples) {
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
constexpr SettingCheck check("jitter");

void require(const JitterSettings& settings) {
  check("stiffness", settings.wall.stiffness, 1.0, 1e6);
  check("haptic rate", settings.wall.haptic_rate, 10.0, 1e6);
  check("window", settings.wall.window, 0.01, 1000.0);
  check("settled time", settings.wall.settled_time, 0.0, settings.wall.window);
  check("count length", settings.count_length, 1e-9, 1e-2);
  check("reaction", settings.reaction, 0.0, 1.0);
  check("waiting time", settings.waiting_time, 0.0, 1000.0);
  check("touches", settings.touches, 1, 1000);
}

constexpr double start = 0.02;  // m in front of the surface
}  // namespace

JitterMeasure simulate_jitter(const JitterSettings& settings, const simulation::OperatorModel& person,
                              double background, double interference, double phase,
                              std::vector<JitterSample>* recording) {
  require(settings);
  simulation::IntendedMotionConfig motion;
  const double period = 1.0 / settings.wall.haptic_rate;
  motion.start_position = start + phase * settings.approach_speed * period;
  motion.approach_speed = settings.approach_speed;
  motion.push_force = settings.push;
  motion.hold_time = settings.wall.window + 60.0;
  simulation::CoupledHandle handle(settings.device, person, motion);

  control::HapticLoopConfig<float> config =
      touched_wall(settings.wall.haptic_rate, settings.count_length, settings.device.force_limit);
  config.wall.kind = control::WallKind::plain;
  config.wall.stiffness = static_cast<float>(settings.wall.stiffness);
  config.interference.mode = control::InterferenceMode::perpendicular;
  config.interference.force = static_cast<float>(interference);
  config.interference.background_force = static_cast<float>(background);
  const simulation::EncoderModel encoder(settings.count_length);
  using Loop = control::HapticLoop<float>;
  const Loop::Coefficients coefficients =
      Loop::prepare(config, encoder.extended_counts(motion.start_position));
  Loop loop;

  std::vector<JitterSample> own;
  std::vector<JitterSample>& samples = recording != nullptr ? *recording : own;
  samples.clear();
  constexpr double patience = 30.0;  // s of approach
  const double begin = settings.waiting_time;
  bool moving = false;
  double touch = -1.0;
  for (std::uint64_t n = 0;; ++n) {
    const double time = static_cast<double>(n) * period;
    if (!moving && time >= begin) {
      handle.begin_motion();
      moving = true;
    }
    if (touch >= 0.0 ? time > touch + settings.wall.window : time > begin + patience) break;
    const Loop::Output& out = loop.tick(coefficients, encoder.extended_counts(handle.position()), true);
    if (moving && touch < 0.0 && out.inside) touch = time;
    if (moving)
      samples.push_back({time, static_cast<double>(out.outside_distance), static_cast<double>(out.force)});
    const double felt = background + (out.inside ? settings.reaction * interference : 0.0);
    handle.advance(static_cast<double>(out.force), felt, period);
  }
  if (touch >= 0.0)
    for (JitterSample& sample : samples) sample.time -= touch;
  return measure_jitter(samples, settings.wall);
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

std::vector<JitterResult> run_jitter(const JitterSettings& settings,
                                     const std::vector<simulation::OperatorModel>& people,
                                     const ProgressReport& tell) {
  check.require_somebody(people);
  require(settings);
  std::vector<JitterResult> results;
  for (const paper::JitterCell& cell : paper::table_1) {
    if (tell) tell(results.size(), paper::table_1.size());
    std::vector<JitterMeasure> touches;
    for (const simulation::OperatorModel& person : people) {
      for (int touch = 0; touch < settings.touches; ++touch) {
        const double phase = static_cast<double>(touch) / settings.touches;
        touches.push_back(simulate_jitter(settings, person, cell.background, cell.interference, phase));
      }
    }
    results.push_back(mean_jitter(cell, touches));
  }
  return results;
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
