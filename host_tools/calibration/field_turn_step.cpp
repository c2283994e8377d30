#include "host_tools/calibration/field_turn_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_tools/calibration/direction_verdict.hpp"
#include "host_tools/calibration/field_sweep.hpp"
#include "host_tools/calibration/repeated_value.hpp"

namespace kmax::calibration {

// The fit's cause is the device's defect only after a thought: a motor that follows the field and an encoder
// that does not give its share of it looks like another number of pole pairs.
void FieldTurnStep::judge(const FieldTurnFit& fit) const {
  const std::string words = to_string(fit.finding);
  switch (fit.finding.cause) {
    case FieldTurnCause::none:
    case FieldTurnCause::pole_pairs_differ:
      return;
    case FieldTurnCause::not_whole:
    case FieldTurnCause::slipping:
    case FieldTurnCause::not_meeting:
      throw StepFailed(
          {"encoder_slipping",
           fmt::format("{}; {:.2f} counts per electrical turn", words, fit.counts_per_electrical_turn),
           "tighten the encoder's hub and clean its disc; check encoder.counts_per_turn"});
    case FieldTurnCause::motor_still:
    case FieldTurnCause::direction_differs:
      throw StepFailed({"motor_does_not_follow", words, "raise --current, free the handle"});
    default:
      throw StepFailed({"field_turn_not_resolved", words, "try again; raise --current"});
  }
}

void FieldTurnStep::settle_pole_pairs(Bench& bench, MotorKnowledge& known, const FieldTurnFit& fit,
                                      StepReport& report) {
  report.values.push_back({"motor.pole_pairs", static_cast<double>(fit.whole_pole_pairs), 0.0, "",
                           static_cast<double>(known.pole_pairs)});
  if (fit.whole_pole_pairs == known.pole_pairs) return;
  Diagnosis differ{
      "pole_pairs_differ",
      fmt::format("motor.pole_pairs is {}, the encoder counts {:.3f} electrical turns to a shaft's",
                  known.pole_pairs, fit.pole_pairs.value),
      fmt::format("motor.pole_pairs becomes {}", fit.whole_pole_pairs)};
  if (bench.settings().keep_pole_pairs) {
    differ.advice = "correct motor.pole_pairs or encoder.counts_per_turn, or leave out --keep-pole-pairs";
    throw StepFailed(differ);
  }
  report.remarks.push_back(differ);
  known.pole_pairs = fit.whole_pole_pairs;
}

void FieldTurnStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  FieldSweep sweep(bench, known);
  sweep.prepare();
  std::vector<FieldTurnFit> fits;
  std::vector<Estimate> offsets, lags;
  const int repetitions = bench.settings().repetitions;
  for (int i = 0; i < repetitions; ++i) {
    bench.tell(fmt::format("field: {:.1f} turns to and fro, {} of {}", sweep.turns(), i + 1, repetitions));
    const Recording to = sweep.sweep(true), fro = sweep.sweep(false);
    sweep.require_living_encoder(to, fro);
    FieldTurnConfig config;
    config.counts_per_turn = known.counts_per_turn;
    fits.push_back(fit_field_turn({to.of("electrical_angle"), to.of("count")},
                                  {fro.of("electrical_angle"), fro.of("count")}, config));
    judge(fits.back());
    if (fits.back().direction != fits.front().direction ||
        fits.back().whole_pole_pairs != fits.front().whole_pole_pairs)
      throw StepFailed({"encoder_slipping", "two sweeps give different pole pairs or directions",
                        "tighten the encoder's hub and clean its disc"});
    // Around the first, so that 0 and a whole turn are near each other.
    Estimate offset = fits.back().offset;
    offset.value = fits.front().offset.value +
                   std::remainder(offset.value - fits.front().offset.value, 2.0 * std::numbers::pi);
    offsets.push_back(offset);
    lags.push_back(fits.back().lag);
  }
  sweep.finish();
  const FieldTurnFit& fit = fits.front();
  IdentifiedValue offset = repeated_value("motor.electrical_offset", offsets, "rad", known.electrical_offset);
  constexpr double largest_spread = 0.2;  // rad electrical
  if (offset.spread > largest_spread)
    throw StepFailed(
        {"encoder_slipping",
         fmt::format("the electrical offset differs by {:.3f} rad from sweep to sweep", offset.spread),
         "tighten the encoder's hub and clean its disc"});
  offset.value = std::remainder(offset.value, 2.0 * std::numbers::pi);
  settle_pole_pairs(bench, known, fit, report);
  report.values.push_back(offset);
  report.values.push_back(repeated_value("field.lag", lags, "rad", std::nullopt));
  known.direction = settle_direction(bench, known, fit.direction > 0,
                                     "the shaft turns against the field, as the encoder counts it", report);
  known.electrical_offset = offset.value;
  // First forgotten: what the device then learns is tied to the values below.
  bench.set_result({"motor.commutation_known=no"});
  bench.set_result({fmt::format("motor.pole_pairs={}", fit.whole_pole_pairs),
                    fmt::format("motor.electrical_offset={:.9g}", offset.value),
                    "motor.commutation_known=yes"});
}

}  // namespace kmax::calibration
