#include "host_tools/calibration/torque_constant_step.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "host_tools/calibration/back_emf_fit.hpp"
#include "host_tools/calibration/repeated_value.hpp"
#include "host_tools/calibration/shaking.hpp"

namespace kmax::calibration {

namespace {
constexpr std::size_t samples = 2000;
constexpr double stroke_share = 0.25;  // of the travel, peak to peak

BackEmfConfig config_of(const MotorKnowledge& known) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  BackEmfConfig config;
  config.tick = known.tick;
  config.synchronous = !known.brushed();
  config.pole_pairs = known.brushed() ? 1 : known.pole_pairs;
  config.inductance = known.inductance_q > 0.0 ? known.inductance_q : known.inductance;
  config.inductance_d = known.inductance;
  config.resistance = known.resistance;
  config.resistance_error = known.resistance_error > 0.0 ? known.resistance_error : unknown;
  const double volts = known.supply * known.pwm_frequency;
  config.dead_time_voltage = volts * known.dead_time;
  config.dead_time_voltage_error = known.dead_time_error > 0.0 ? volts * known.dead_time_error : unknown;
  config.dead_time_current = known.dead_time_band();
  config.counts_per_turn = known.counts_per_turn;
  return config;
}

[[noreturn]] void fail(const BackEmfFit& fit) {
  const std::string words = to_string(fit.finding);
  switch (fit.finding.cause) {
    case BackEmfCause::no_motion:
      throw StepFailed({"motor_blocked", words, "free the handle, or raise --current"});
    case BackEmfCause::reversed:
      throw StepFailed({"direction_wrong", words, "calibrate the encoder first: --steps encoder"});
    case BackEmfCause::no_voltage:
      throw StepFailed({"encoder_without_motor", words,
                        "the encoder turns and the motor does not: check the coupling between them"});
    default:
      throw StepFailed({"torque_constant_not_resolved", words, "raise --current or --travel"});
  }
}
}  // namespace

void TorqueConstantStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  Shaking shaking(bench, known, known.current, stroke_share * bench.travel());
  shaking.prepare();
  const double radian_per_count = 2.0 * std::numbers::pi / known.counts_per_turn;
  std::vector<Estimate> constants;
  for (int i = 0; i < bench.settings().repetitions; ++i) {
    bench.tell(fmt::format("torque constant: {} of {}", i + 1, bench.settings().repetitions));
    std::vector<std::string> channels = {"voltage", "current", "count"};
    if (!known.brushed()) channels.push_back("electrical_angle");
    const Recording seen = shaking.record(channels, samples, 1);
    std::vector<double> shaft;
    for (const double count : seen.of("count")) shaft.push_back(count * radian_per_count);
    BackEmfRecord record{seen.of("voltage"), seen.of("current"), shaft, {}, {}};
    if (!known.brushed()) record.electrical_angle = seen.of("electrical_angle");
    const BackEmfFit fit = fit_back_emf({&record, 1}, config_of(known));
    if (!fit.finding.is_none()) fail(fit);
    constants.push_back(fit.torque_constant);
  }
  const IdentifiedValue value =
      repeated_value("motor.torque_constant", constants, "N m/A", known.torque_constant);
  report.values.push_back(value);
  constexpr double largest_spread = 0.1;
  if (value.spread > largest_spread * value.value)
    throw StepFailed({"encoder_slipping",
                      fmt::format("the torque constant differs by {:.0f} % from one measurement to the next",
                                  100.0 * value.spread / value.value),
                      "tighten the encoder's hub and clean its disc; nobody may hold the handle"});
  // Lost travel scales everything that is measured alike: only a reference can show it.
  constexpr double largest_change = 0.2;
  const double before = known.torque_constant;
  if (known.calibrated && std::abs(value.value - before) > largest_change * before)
    throw StepFailed(
        {"encoder_slipping",
         fmt::format("the torque constant is {:.3g} N m/A and was {:.3g} N m/A when this motor was last "
                     "calibrated: the encoder loses a share of the travel",
                     value.value, before),
         "tighten the encoder's hub; after an exchange of motor or encoder: 'kmax set "
         "motor.calibrated=no', and calibrate again"});
  known.torque_constant = value.value;
  bench.set_result({fmt::format("motor.torque_constant={:.9g}", value.value)});
}

}  // namespace kmax::calibration
