#include "host_tools/calibration/encoder_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "host_tools/calibration/field_sweep.hpp"
#include "host_tools/calibration/step_report.hpp"

namespace kmax::calibration {

bool InducedVoltage::sure(const MotorKnowledge& known, double current) const {
  constexpr double share = 0.1;   // of the voltage that the resistance takes
  constexpr double errors = 5.0;  // standard errors
  return volts > std::max(share * known.resistance * std::abs(current), errors * error);
}

InducedVoltage induced_in_waves(const Recording& seen, const MotorKnowledge& known, std::size_t half_period,
                                std::size_t first, std::size_t end) {
  constexpr std::size_t fewest_samples = 10;
  InducedVoltage none{0.0, std::numeric_limits<double>::infinity()};
  const auto voltage = seen.of("voltage"), current = seen.of("current");
  end = std::min(end, voltage.size());
  if (half_period < fewest_samples) return none;
  const auto mean_over = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    for (std::size_t k = from; k < to; ++k) sum += voltage[k] - known.resistance * current[k];
    return sum / static_cast<double>(to - from);
  };
  std::vector<double> rises;
  for (std::size_t begin = first; begin + half_period <= end; begin += half_period) {
    const double direction =
        mean_of(current.subspan(begin + 3 * half_period / 10, half_period * 6 / 10)) < 0.0 ? -1.0 : 1.0;
    const double early = mean_over(begin + 3 * half_period / 10, begin + 6 * half_period / 10);
    const double late = mean_over(begin + 7 * half_period / 10, begin + half_period);
    // Their middles are four tenths of a half wave apart.
    rises.push_back(direction * (late - early) / 0.4);
  }
  if (rises.size() < 2) return none;
  // Of the samples, not of the rises: a synchronous motor under a dead encoder swings, and each wave differs.
  double square = 0.0;
  for (const double rise : rises) square += rise * rise;
  std::vector<double> steps;
  for (std::size_t k = first + 1; k < end; ++k)
    if ((current[k] < 0.0) == (current[k - 1] < 0.0))
      steps.push_back(voltage[k] - voltage[k - 1] - known.resistance * (current[k] - current[k - 1]));
  const double noise = deviation_of(steps) / std::numbers::sqrt2;
  const double error = noise * std::sqrt(2.0 / (0.3 * static_cast<double>(half_period))) / 0.4;
  return {std::sqrt(square / static_cast<double>(rises.size())),
          error * (1.0 / std::sqrt(static_cast<double>(rises.size())) + 0.2)};
}

InducedVoltage induced_in_push(const Recording& seen, const MotorKnowledge& known) {
  const auto voltage = seen.of("voltage"), current = seen.of("current");
  const std::size_t length = voltage.size() / 3;
  if (length < 2) return {0.0, std::numeric_limits<double>::infinity()};
  const double direction = mean_of(current.last(length)) < 0.0 ? -1.0 : 1.0;
  const double lost =
      (known.brushed() ? 2.0 : 4.0 / 3.0) * known.supply * known.pwm_frequency * known.dead_time;
  std::vector<double> induced;
  for (std::size_t k = voltage.size() - length; k < voltage.size(); ++k)
    induced.push_back(direction * (voltage[k] - known.resistance * current[k]) - lost);
  return {mean_of(induced), deviation_of(induced) / std::sqrt(static_cast<double>(length))};
}

bool stands(std::span<const double> count) {
  return span_of(count) < 2.0;
}

void throw_standing(Bench& bench, const MotorKnowledge& known, bool induced, const std::string& evidence) {
  // A synchronous motor whose field stands still has come to rest in it. Dragged along by a field that turns
  // it shows whether it can turn.
  if (!induced && !known.brushed()) {
    bench.disarm();
    FieldSweep(bench, known).prepare();
  }
  if (induced)
    throw StepFailed({"encoder_dead", evidence + ": the motor turns, the encoder does not",
                      "check the encoder's cable, supply and mounting, and encoder.kind"});
  throw StepFailed({"motor_blocked", evidence + ": the motor stands",
                    "free the handle, move it away from its stops, or raise --current"});
}

}  // namespace kmax::calibration
