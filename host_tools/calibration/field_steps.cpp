// What a field that turns slowly in the stator of a synchronous motor shows: index, pole pairs and offset.
#include "host_tools/calibration/field_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "host_tools/calibration/field_turn_fit.hpp"

namespace kmax::calibration {

namespace {
constexpr double whole_turn = 2.0 * std::numbers::pi;
constexpr double settle_angle = 1.0;    // rad at the beginning of a sweep that the fit leaves out
constexpr double usable_travel = 0.93;  // the rest is for cogging, overshoot and lag
constexpr double alignment_time = 0.6;  // s
// A handle that has left the travel must come back by more than is left of it.
constexpr double margin = 0.002;  // m
}  // namespace

Waveforms FieldSweep::turn(double by, const std::vector<std::string>& channels, std::size_t samples) {
  // Before that nobody knows which way back is; the whole step is short then.
  if (metres_per_radian_ == 0.0) return turn_once(by, channels, samples);
  const double from = angle_;
  bool cut_off = false;
  return bench_.repeat([&] {
    if (std::exchange(cut_off, true)) go_back(from);
    return turn_once(by, channels, samples);
  });
}

double FieldSweep::angle_by_count() {
  return known_angle_ + (bench_.displacement() - known_displacement_) / metres_per_radian_;
}

// The rotor has lost the vector. It falls in again where the count says that it is, and is led to `angle` by
// way of the middle, from where all of the travel can be used again.
void FieldSweep::go_back(double angle) {
  const double away = bench_.displacement();
  angle_ = angle_by_count();
  align(std::abs(away) + margin);
  turn_once(-away / metres_per_radian_, {"count"}, 100);
  bench_.disarm();
  align();
  // Far from the middle the count may have meant another turn of the field.
  angle_ += whole_turn * std::round((angle_by_count() - angle_) / whole_turn);
  turn_once(angle - angle_, {"count"}, 100);
}

Waveforms FieldSweep::turn_once(double by, const std::vector<std::string>& channels, std::size_t samples) {
  const double length = std::abs(by) / rate;
  ExcitationPlan plan;
  plan.kind = "current";
  plan.bias = known_.current;
  plan.angle = angle_;
  plan.angle_rate = by < 0.0 ? -rate : rate;
  plan.angle_span = std::abs(by);
  plan.duration = std::min(length + 20.0, 60.0);
  const int interval =
      std::max(1, static_cast<int>(std::ceil(length / known_.tick / static_cast<double>(samples))));
  const auto count = static_cast<std::size_t>(length / known_.tick / interval);
  Waveforms seen = bench_.record(plan, {channels, std::max<std::size_t>(count, 2), interval, 0.0});
  require_no_trip(seen);
  angle_ += by;
  return seen;
}

void FieldSweep::diagnose_still(double counts, const Waveforms& to, const Waveforms& fro) {
  // Across the current, less what the inductance takes; the dead time's share has no mean over half a turn.
  const double across = (bench::mean_of(to.of("voltage_d")) - bench::mean_of(fro.of("voltage_d"))) / 2.0;
  const double flux = across / rate - known_.inductance * known_.current;
  const std::string evidence = fmt::format(
      "a turning field moves the count by {:.0f}; it induces {:.2f} mV across the current, of which {:.2f} "
      "mV are the inductance's",
      counts, 1000.0 * across, 1000.0 * rate * known_.inductance * known_.current);
  if (flux > 0.7 * known_.inductance * known_.current) throw_encoder_dead(evidence);
  throw_motor_blocked(evidence);
}

void FieldSweep::align(double reach) {
  ExcitationPlan vector;
  vector.kind = "current";
  vector.bias = known_.current;
  vector.angle = angle_;
  vector.ramp = 0.5 * alignment_time;
  vector.duration = 20.0;
  require_no_trip(bench_.record(vector, {{"count"}, 10, 10, alignment_time}, reach));
}

void FieldSweep::require_half_turn() {
  bench_.progress("field: letting the rotor fall in");
  angle_ = 0.0;
  align();
  const double before = bench_.displacement();
  const double half_turn = std::numbers::pi;
  const Waveforms to = turn(half_turn, {"count", "voltage_d"}, 600);
  const double after = bench_.displacement();
  const double counts = std::abs(after - before) / known_.count_length();
  // An encoder that died on the way would make the way of a radian of the field too short, and what is turned
  // by it far too long: a handle was led 217 mm away.
  const auto count = to.of("count");
  const double at_last = bench::span_of(count.last(count.size() / 3));
  constexpr double steady = 0.3;  // of a third of the way: cogging holds the rotor back and lets it go
  // 64 pole pairs are the most there are.
  if (counts < std::max(2.0, 0.3 * known_.counts_per_turn / 64.0 / 2.0) || at_last < steady * counts / 3.0) {
    const Waveforms fro = turn(-half_turn, {"count", "voltage_d"}, 600);
    diagnose_still(at_last, to, fro);
  }
  metres_per_radian_ = (after - before) / half_turn;
  known_angle_ = angle_;
  known_displacement_ = after;
}

void FieldSweep::prepare() {
  require_half_turn();
  const double per_radian = metres_per_radian_;
  double after = known_displacement_;
  // The travel counts from where the axis is armed: with the handle in the middle all of it can be used.
  turn(-after / per_radian, {"count"}, 100);
  bench_.disarm();
  align();
  after = bench_.displacement();
  const double room = 2.0 * usable_travel * bench_.travel() / std::abs(per_radian);
  const double least = 2.0 * whole_turn + settle_angle + 0.2;
  if (room < least)
    throw StepFailed(
        {"travel_too_small",
         fmt::format("two electrical turns move the handle by {:.1f} mm, and it may move by {:.1f} mm",
                     1000.0 * least * std::abs(per_radian), 2000.0 * bench_.travel()),
         fmt::format("allow --travel {:.3f} or more",
                     least * std::abs(per_radian) / (2.0 * usable_travel) + 0.0005)});
  // Whole turns, and what the fit leaves out.
  span_ =
      std::floor((std::min(room, 4.0 * whole_turn + settle_angle + 0.3) - settle_angle - 0.2) / whole_turn) *
          whole_turn +
      settle_angle + 0.2;
  const double begin = (per_radian > 0.0 ? -0.5 : 0.5) * span_ * std::abs(per_radian);
  turn((begin - after) / per_radian, {"count"}, 100);
}

Waveforms FieldSweep::sweep(bool forwards) {
  const auto samples = static_cast<std::size_t>(std::ceil(360.0 * turns()));
  return turn(forwards ? span_ : -span_, {"electrical_angle", "count", "voltage_d"}, samples);
}

void FieldSweep::require_living_encoder(const Waveforms& to, const Waveforms& fro) {
  const auto count = fro.of("count");
  const auto end = count.last(std::max<std::size_t>(count.size() / 8, 2));
  if (bench::span_of(end) >= 2.0) return;
  diagnose_still(bench::span_of(end), to, fro);
}

void FieldSweep::finish() {
  turn(0.5 * span_, {"count"}, 100);
}

void search_index(Calibration& run) {
  Bench& bench = run.bench;
  StepReport& report = run.report;
  // What was found before without the index is not asked for: of an identified motor
  // measured.commutation_known then tells whether the index has been passed.
  bench.set_result({"motor.commutation_known=no"});
  bench.set_temporary({"motor.calibrated=yes"});
  const auto passed = [&] { return bench.number("measured.commutation_known") != 0.0; };
  double before = bench.number("measured.count");
  if (!passed()) {
    FieldSweep sweep(bench, run.known);
    sweep.prepare();
    bench.progress("index: sweeping over the travel");
    const Waveforms to = sweep.sweep(true), fro = sweep.sweep(false);
    sweep.require_living_encoder(to, fro);
    sweep.finish();
    const double displacement = bench.displacement();
    before = bench.number("measured.count");
    // Counts are referred to the index while no force acts.
    bench.disarm();
    bench.wait(0.05);
    if (!passed())
      throw StepFailed({"index_not_found",
                        fmt::format("the index has not been seen within {:.1f} mm of travel to either side",
                                    1000.0 * bench.travel()),
                        "move the handle nearer to the index, allow more --travel, or check the index line"});
    bench.rehome(displacement);
  }
  report.values.push_back({"measured.count", bench.number("measured.count"), 0.0, "counts", before});
}

namespace {
// The fit's cause is the device's defect only after a thought: a motor that follows the field and an encoder
// that does not give its share of it looks like another number of pole pairs.
void require_sound(const FieldTurnFit& fit) {
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

void settle_pole_pairs(Calibration& run, const FieldTurnFit& fit) {
  MotorKnowledge& known = run.known;
  run.report.values.push_back({"motor.pole_pairs", static_cast<double>(fit.whole_pole_pairs), 0.0, "",
                               static_cast<double>(known.pole_pairs)});
  if (fit.whole_pole_pairs == known.pole_pairs) return;
  Diagnosis differ{
      "pole_pairs_differ",
      fmt::format("motor.pole_pairs is {}, the encoder counts {:.3f} electrical turns to a shaft's",
                  known.pole_pairs, fit.pole_pairs.value),
      fmt::format("motor.pole_pairs becomes {}", fit.whole_pole_pairs)};
  if (run.settings.keep_pole_pairs) {
    differ.advice = "correct motor.pole_pairs or encoder.counts_per_turn, or leave out --keep-pole-pairs";
    throw StepFailed(differ);
  }
  run.report.remarks.push_back(differ);
  known.pole_pairs = fit.whole_pole_pairs;
}
}  // namespace

void find_field_angle(Calibration& run) {
  Bench& bench = run.bench;
  MotorKnowledge& known = run.known;
  StepReport& report = run.report;
  FieldSweep sweep(bench, known);
  sweep.prepare();
  std::vector<FieldTurnFit> fits;
  std::vector<Estimate> offsets, lags;
  const int repetitions = run.settings.repetitions;
  for (int i = 0; i < repetitions; ++i) {
    bench.progress(
        fmt::format("field: {:.1f} turns to and fro, {} of {}", sweep.turns(), i + 1, repetitions));
    const Waveforms to = sweep.sweep(true), fro = sweep.sweep(false);
    sweep.require_living_encoder(to, fro);
    FieldTurnConfig config;
    config.counts_per_turn = known.counts_per_turn;
    fits.push_back(fit_field_turn({to.of("electrical_angle"), to.of("count")},
                                  {fro.of("electrical_angle"), fro.of("count")}, config));
    require_sound(fits.back());
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
  settle_pole_pairs(run, fit);
  report.values.push_back(offset);
  report.values.push_back(repeated_value("field.lag", lags, "rad", std::nullopt));
  settle_direction(run, fit.direction > 0, "the shaft turns against the field, as the encoder counts it");
  known.electrical_offset = offset.value;
  known.commutation_found = true;
  // First forgotten: what the device then learns is tied to the values below.
  bench.set_result({"motor.commutation_known=no"});
  bench.set_result({fmt::format("motor.pole_pairs={}", fit.whole_pole_pairs),
                    fmt::format("motor.electrical_offset={:.9g}", offset.value),
                    "motor.commutation_known=yes"});
}

}  // namespace kmax::calibration
