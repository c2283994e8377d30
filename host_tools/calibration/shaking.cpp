#include "host_tools/calibration/shaking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/calibration/centring.hpp"
#include "host_tools/calibration/encoder_watch.hpp"
#include "host_tools/calibration/step_report.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"

namespace kmax::calibration {

namespace {
constexpr int ramp_waves = 8;  // half periods
constexpr int longest_half_period = 3000;
}  // namespace

// In the middle of a half wave the handle turns back: there the wave ends, since nothing brakes it
// afterwards.
ExcitationPlan Shaking::wave(std::size_t ticks) const {
  const std::size_t waves = ticks / static_cast<std::size_t>(half_period_) + 1;
  ExcitationPlan plan;
  plan.kind = "torque";
  plan.alternation = current_;
  plan.half_period = half_period_;
  plan.ramp = ramp_waves * half_period_ * known_.tick;
  plan.duration = plan.ramp + (static_cast<double>(waves) + 0.5) * half_period_ * known_.tick;
  return plan;
}

// Longer ones would take a free handle through all of the travel, by what this axis was found to weigh.
int Shaking::longest() const {
  if (!(known_.mass_known && known_.mass > 0.0 && known_.torque_constant > 0.0)) return longest_half_period;
  // A square wave of force swings a free mass by force x T^2 / (4 mass), peak to peak.
  const double time = 2.0 * std::sqrt(bench_.travel() * known_.mass / (known_.force_per_ampere() * current_));
  return static_cast<int>(std::clamp(time / known_.tick, 20.0, static_cast<double>(longest_half_period)));
}

void Shaking::require_living_encoder(const Recording& seen, int interval) const {
  if (seen.empty()) throw_standing(bench_, known_, false, "shaken, the encoder counts nothing");
  const auto half = static_cast<std::size_t>(half_period_ / interval);
  // The last one and a half waves: whatever went before, there the encoder stands.
  const std::size_t part = std::min(seen.samples(), std::max(seen.samples() / 5, 3 * half / 2));
  if (!seen.stood && !stands(seen.of("count").last(part))) return;
  // The wave's phase is not known there: its edges are where the current changes its sign.
  const auto current = seen.of("current");
  std::size_t edge = seen.samples() - std::min(seen.samples() - 1, std::max(part, 4 * half));
  while (edge + 1 < seen.samples() && (current[edge] < 0.0) == (current[edge - 1] < 0.0)) ++edge;
  const InducedVoltage induced = induced_in_waves(seen, known_, half, edge, seen.samples());
  throw_standing(
      bench_, known_, induced.sure(known_, current_),
      fmt::format("{:.3g} A to and fro, for {:.1f} ms each, induce {:.3f} V +- {:.3f} V and move the count "
                  "by less than 2",
                  current_, 1000.0 * half_period_ * known_.tick, induced.volts, induced.error));
}

Recording Shaking::record_centred(const ExcitationPlan& excitation, const RecordPlan& plan) {
  return bench_.repeat([&] {
    centre_handle(bench_, known_);
    return bench_.record_alone(excitation, plan);
  });
}

void Shaking::prepare() {
  int blind = 0;
  for (int attempt = 0; attempt < 40; ++attempt) {
    bench_.tell(fmt::format("shaking: {:.1f} ms half period", 1000.0 * half_period_ * known_.tick));
    const auto ticks = static_cast<std::size_t>((ramp_waves + 6) * half_period_);
    const int interval = static_cast<int>(std::max<std::size_t>(1, ticks / 280));
    // The wave drifts where friction, cogging or gravity want it.
    const Recording seen = record_centred(
        wave(5 * static_cast<std::size_t>(half_period_)),
        {{"count", "voltage", "current"}, ticks / static_cast<std::size_t>(interval), interval, 0.0});
    if (seen.trip && seen.trip->fault == firmware::Fault::excitation_travel &&
        stroke_ > 0.02 * bench_.travel()) {
      stroke_ *= 0.6;
      half_period_ = std::max(20, half_period_ * 2 / 3);
      continue;
    }
    require_no_trip(seen);
    const auto count = seen.of("count");
    const auto moving = count.last(count.size() * 4 / (ramp_waves + 6));
    seen_ = span_of(moving) * known_.count_length();
    double largest_factor = 2.0;
    if (stands(moving)) {
      const auto half = static_cast<std::size_t>(half_period_ / interval);
      const InducedVoltage induced = induced_in_waves(seen, known_, half, ramp_waves * half, seen.samples());
      // A coarse encoder may not yet show what the voltage does: twice the stroke shows whether it is that.
      if (induced.sure(known_, current_)) {
        largest_factor = 1.4;
        if (++blind == 2)
          throw_standing(
              bench_, known_, true,
              fmt::format("{:.3g} A to and fro, for {:.1f} ms each, induce {:.3f} V +- {:.3f} V and "
                          "move the count by less than 2",
                          current_, 1000.0 * half_period_ * known_.tick, induced.volts, induced.error));
      }
    }
    if (seen_ >= 0.7 * stroke_ && seen_ <= 1.4 * stroke_) return;
    if (half_period_ >= longest()) break;
    const double factor =
        seen_ > 0.0 ? std::clamp(std::sqrt(stroke_ / seen_), 0.4, largest_factor) : largest_factor;
    half_period_ = std::clamp(static_cast<int>(std::lround(half_period_ * factor)), 20, longest());
  }
  if (seen_ > 0.3 * stroke_) return;
  throw StepFailed({"motor_blocked",
                    fmt::format("{:.3g} A to and fro, for {:.0f} ms each, move the handle by {:.3f} mm",
                                current_, 1000.0 * half_period_ * known_.tick, 1000.0 * seen_),
                    "free the handle, or raise --current"});
}

Recording Shaking::record(const std::vector<std::string>& channels, std::size_t samples, int interval) {
  const std::size_t ticks = samples * static_cast<std::size_t>(interval);
  constexpr int attempts = 5;
  for (int attempt = 1;; ++attempt) {
    // The link takes up to a tenth of a second until the capture begins.
    const ExcitationPlan plan = wave(ticks + 6000);
    // A synchronous motor runs on in the field of a frozen angle; a brushed one only shakes, and is judged by
    // the record.
    const double still = known_.brushed() ? 0.0 : std::max(0.1, 4.0 * half_period_ * known_.tick);
    Recording seen = record_centred(plan, {channels, samples, interval, plan.ramp, still});
    // A long record may drift out of the travel: a shorter wave drifts less.
    if (seen.trip && seen.trip->fault == firmware::Fault::excitation_travel && attempt < attempts) {
      half_period_ = std::max(20, half_period_ * 4 / 5);
      continue;
    }
    require_no_trip(seen);
    require_living_encoder(seen, interval);
    bench_.wait_until_finished(still);
    return seen;
  }
}

}  // namespace kmax::calibration
