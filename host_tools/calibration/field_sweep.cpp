#include "host_tools/calibration/field_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "host_tools/calibration/step_report.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"

namespace kmax::calibration {

namespace {
constexpr double whole_turn = 2.0 * std::numbers::pi;
constexpr double settle_angle = 1.0;    // rad at the beginning of a sweep that the fit leaves out
constexpr double usable_travel = 0.93;  // the rest is for cogging, overshoot and lag
constexpr double alignment_time = 0.6;  // s
// A handle that has left the travel must come back by more than is left of it.
constexpr double margin = 0.002;  // m
}  // namespace

Recording FieldSweep::turn(double by, const std::vector<std::string>& channels, std::size_t samples) {
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

Recording FieldSweep::turn_once(double by, const std::vector<std::string>& channels, std::size_t samples) {
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
  Recording seen = bench_.record(plan, {channels, std::max<std::size_t>(count, 2), interval, 0.0});
  require_no_trip(seen);
  angle_ += by;
  return seen;
}

void FieldSweep::diagnose_still(double counts, const Recording& to, const Recording& fro) {
  // Across the current, less what the inductance takes; the dead time's share has no mean over half a turn.
  const double across = (mean_of(to.of("voltage_d")) - mean_of(fro.of("voltage_d"))) / 2.0;
  const double flux = across / rate - known_.inductance * known_.current;
  const std::string evidence = fmt::format(
      "a turning field moves the count by {:.0f}; it induces {:.2f} mV across the current, of "
      "which "
      "{:.2f} mV are the inductance's",
      counts, 1000.0 * across, 1000.0 * rate * known_.inductance * known_.current);
  if (flux > 0.7 * known_.inductance * known_.current)
    throw StepFailed({"encoder_dead", evidence + ": the motor turns, the encoder does not",
                      "check the encoder's cable, supply and mounting, and encoder.kind"});
  throw StepFailed({"motor_blocked", evidence + ": the motor stands",
                    "free the handle, move it away from its stops, or raise --current"});
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

void FieldSweep::prepare() {
  bench_.tell("field: letting the rotor fall in");
  angle_ = 0.0;
  align();
  const double before = bench_.displacement();
  const double half_turn = std::numbers::pi;
  const Recording to = turn(half_turn, {"count", "voltage_d"}, 600);
  double after = bench_.displacement();
  const double counts = std::abs(after - before) / known_.count_length();
  // 64 pole pairs are the most there are.
  if (counts < std::max(2.0, 0.3 * known_.counts_per_turn / 64.0 / 2.0)) {
    const Recording fro = turn(-half_turn, {"count", "voltage_d"}, 600);
    diagnose_still(counts, to, fro);
  }
  const double per_radian = (after - before) / half_turn;  // m
  metres_per_radian_ = per_radian;
  known_angle_ = angle_;
  known_displacement_ = after;
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

Recording FieldSweep::sweep(bool forwards) {
  const auto samples = static_cast<std::size_t>(std::ceil(360.0 * turns()));
  return turn(forwards ? span_ : -span_, {"electrical_angle", "count", "voltage_d"}, samples);
}

void FieldSweep::require_living_encoder(const Recording& to, const Recording& fro) {
  const auto count = fro.of("count");
  const auto end = count.last(std::max<std::size_t>(count.size() / 8, 2));
  if (span_of(end) >= 2.0) return;
  diagnose_still(span_of(end), to, fro);
}

void FieldSweep::finish() {
  turn(0.5 * span_, {"count"}, 100);
}

}  // namespace kmax::calibration
