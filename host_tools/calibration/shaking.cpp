#include "host_tools/calibration/shaking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_tools/calibration/field_sweep.hpp"

namespace kmax::calibration {

bool InducedVoltage::sure(const MotorKnowledge& known, double current) const {
  constexpr double share = 0.1;   // of the voltage that the resistance takes
  constexpr double errors = 5.0;  // standard errors
  return volts > std::max(share * known.resistance * std::abs(current), errors * error);
}

namespace {
// Of one component of the voltage; the resistance takes its share along `current` alone. Rises and noise add
// up over the components.
struct Rises {
  std::vector<double> squares;  // V^2 for each half wave
  double noise_square = 0.0;    // V^2 of a sample
};

void add_component(Rises& rises, std::span<const double> voltage, std::span<const double> current,
                   double resistance, std::size_t half_period, std::size_t first, std::size_t end) {
  const auto mean_over = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    for (std::size_t k = from; k < to; ++k) sum += voltage[k] - resistance * current[k];
    return sum / static_cast<double>(to - from);
  };
  std::size_t wave = 0;
  for (std::size_t begin = first; begin + half_period <= end; begin += half_period, ++wave) {
    const double early = mean_over(begin + 3 * half_period / 10, begin + 6 * half_period / 10);
    const double late = mean_over(begin + 7 * half_period / 10, begin + half_period);
    // Their middles are four tenths of a half wave apart.
    const double rise = (late - early) / 0.4;
    if (wave == rises.squares.size()) rises.squares.push_back(0.0);
    rises.squares[wave] += rise * rise;
  }
  std::vector<double> steps;
  for (std::size_t k = first + 1; k < end; ++k)
    if ((current[k] < 0.0) == (current[k - 1] < 0.0))
      steps.push_back(std::abs(voltage[k] - voltage[k - 1] - resistance * (current[k] - current[k - 1])));
  if (steps.empty()) return;
  // The median, since the first sample after an edge may still have the voltage that turns the current
  // around: one step in ten made 2 V of the 0.3 V of a gimbal motor's noise.
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  constexpr double deviation_of_median = 1.4826;  // of a normal distribution
  const double deviation = deviation_of_median * *middle;
  rises.noise_square += 0.5 * deviation * deviation;
}
}  // namespace

InducedVoltage induced_in_waves(const Waveforms& seen, const MotorKnowledge& known, std::size_t half_period,
                                std::size_t first, std::size_t end) {
  constexpr std::size_t fewest_samples = 10;
  InducedVoltage none{0.0, std::numeric_limits<double>::infinity()};
  const auto current = seen.of("current");
  end = std::min(end, current.size());
  // In shorter ones the current controller is still at it: 2 V of a standing motor's in 2 ms, 0.3 V in 4 ms.
  constexpr double shortest_wave = 0.0035;  // s
  if (half_period < fewest_samples || static_cast<double>(half_period) * seen.interval < shortest_wave)
    return none;
  Rises rises;
  add_component(rises, seen.of("voltage"), current, known.resistance, half_period, first, end);
  if (seen.channels.contains("voltage_d"))
    add_component(rises, seen.of("voltage_d"), current, 0.0, half_period, first, end);
  const auto whole_waves = static_cast<double>(rises.squares.size());
  if (whole_waves < 2.0) return none;
  // Of the samples, not of the rises: a synchronous motor under a dead encoder swings, and each wave differs.
  double square = 0.0;
  for (const double one : rises.squares) square += one;
  const double error =
      std::sqrt(rises.noise_square) * std::sqrt(2.0 / (0.3 * static_cast<double>(half_period))) / 0.4;
  return {std::sqrt(square / whole_waves), error * (1.0 / std::sqrt(whole_waves) + 0.2)};
}

InducedVoltage induced_in_push(const Waveforms& seen, const MotorKnowledge& known) {
  const auto voltage = seen.of("voltage"), current = seen.of("current");
  const std::size_t length = voltage.size() / 3;
  if (length < 2) return {0.0, std::numeric_limits<double>::infinity()};
  const double direction = bench::mean_of(current.last(length)) < 0.0 ? -1.0 : 1.0;
  const double lost =
      (known.brushed() ? 2.0 : 4.0 / 3.0) * known.supply * known.electronics->pwm_hz() * known.dead_time;
  std::vector<double> induced;
  for (std::size_t k = voltage.size() - length; k < voltage.size(); ++k)
    induced.push_back(direction * (voltage[k] - known.resistance * current[k]) - lost);
  return {bench::mean_of(induced), bench::deviation_of(induced) / std::sqrt(static_cast<double>(length))};
}

namespace {
// Index of the last sample that differs from the one before; 0: none does.
std::size_t last_change(std::span<const double> count) {
  for (std::size_t k = count.size(); k > 1; --k)
    if (count[k - 1] != count[k - 2]) return k - 1;
  return 0;
}

// Of a synchronous motor, half an electrical turn. Throws StepFailed if the encoder does not see it.
void require_turn_by_field(Bench& bench, const MotorKnowledge& known) {
  bench.disarm();
  FieldSweep(bench, known).require_half_turn();
  bench.disarm();
}
}  // namespace

bool stands(std::span<const double> count) {
  return bench::span_of(count) < 2.0;
}

void throw_standing(Bench& bench, const MotorKnowledge& known, bool induced, const std::string& evidence) {
  // A synchronous motor whose field stands still has come to rest in it. Dragged along by a field that turns
  // it shows whether it can turn.
  if (!induced && !known.brushed()) require_turn_by_field(bench, known);
  if (induced) throw_encoder_dead(evidence);
  throw_motor_blocked(evidence);
}

namespace {
constexpr double near_enough = 0.15;   // of the travel, where there is nothing to do
constexpr double arrived = 0.04;       // of the travel
constexpr double progress = 0.01;      // of the travel, by a piece that need not be longer
constexpr double first_piece = 0.04;   // s
constexpr double longest_piece = 0.3;  // s
constexpr int most_pieces = 200;
constexpr std::size_t pull_samples = 60;
// A handle that has coasted out of the travel must come back by more than is left of it; a light one, or one
// that little damps, swings past the middle and is still within the travel there.
constexpr double overshoot = 0.5;  // of the travel

Waveforms pull(Bench& bench, const MotorKnowledge& known, double stroke, double duration, double reach) {
  ExcitationPlan spring;
  spring.kind = "position";
  spring.stiffness = 500.0;
  spring.damping = 5.0;
  spring.speed = 0.05;
  spring.stroke = stroke;
  spring.duration = duration;
  const int interval =
      std::max(1, static_cast<int>(duration / known.tick / static_cast<double>(pull_samples)));
  Waveforms seen =
      bench.record(spring, {{"count", "voltage", "current"}, pull_samples, interval, 0.0}, reach);
  require_no_trip(seen);
  return seen;
}
}  // namespace

void centre_handle(Bench& bench, const MotorKnowledge& known) {
  // The device excites no torque before.
  const bool lost = !known.brushed() && bench.number("measured.commutation_known") == 0.0;
  if (lost && known.commutation_found)
    throw StepFailed({"encoder_dead",
                      "the rotor's electrical angle, which this run has found, is not known any more",
                      "check the encoder's cable and supply, and encoder.kind"});
  if (lost)
    throw StepFailed({"commutation_unknown", "the rotor's electrical angle is not known in this power cycle",
                      "calibrate the encoder as well: --steps encoder,mechanical"});
  double away = bench.displacement();
  if (std::abs(away) < near_enough * bench.travel()) return;
  bench.disarm();
  const double reach = std::abs(away) + overshoot * bench.travel();
  double duration = first_piece;
  for (int piece = 0; piece < most_pieces; ++piece) {
    away = bench.displacement();
    if (std::abs(away) < arrived * bench.travel()) break;
    const Waveforms seen = pull(bench, known, -away, duration, reach);
    if (!stands(seen.of("count"))) {
      // A detent that gives way but does not let go wants a longer pull as well.
      const bool nearer = std::abs(away) - std::abs(bench.displacement()) >= progress * bench.travel();
      duration = nearer ? first_piece : 1.4 * duration;
      if (duration > longest_piece) break;
      continue;
    }
    const bool induced = induced_in_push(seen, known).sure(known, known.current);
    duration *= 1.4;
    if (induced)
      throw_standing(bench, known, true,
                     fmt::format("pulled back by {:.1f} mm for {:.0f} ms the encoder counts nothing",
                                 1000.0 * std::abs(away), 1000.0 * duration));
    // Friction and cogging may hold it where the spring is no match for them; it is within the travel.
    if (duration > longest_piece) break;
  }
  // A spring that goes nowhere takes the rest of the speed away.
  pull(bench, known, 0.0, 0.1, reach);
  bench.disarm();
}

namespace {
constexpr int ramp_waves = 8;  // half periods
constexpr int slowest_half_period = 3000;
// Of the stroke: a swing that leaves no doubt that the handle is free. A gimbal motor's slid by 0.5 mm of the
// 5 mm into a detent.
constexpr double clear_swing = 0.25;
}  // namespace

// In the middle of a half wave the handle turns back: there the wave ends, so that little is left to brake.
ExcitationPlan Shaking::wave(std::size_t ticks) const {
  const std::size_t half_waves = ticks / static_cast<std::size_t>(half_period_) + 1;
  ExcitationPlan plan;
  plan.kind = "torque";
  plan.alternation = current_;
  plan.half_period = half_period_;
  plan.ramp = ramp_waves * half_period_ * known_.tick;
  plan.duration = plan.ramp + (static_cast<double>(half_waves) + 0.5) * half_period_ * known_.tick;
  return plan;
}

// A square wave of force swings a free mass by force x T^2 / (4 mass), peak to peak.
int Shaking::half_period_of(double stroke) const {
  if (!(known_.mass_known && known_.mass > 0.0 && known_.torque_constant > 0.0)) return slowest_half_period;
  const double time = 2.0 * std::sqrt(stroke * known_.mass / (known_.force_per_ampere() * current_));
  return static_cast<int>(std::clamp(time / known_.tick, 20.0, static_cast<double>(slowest_half_period)));
}

// Under an encoder that stands. A synchronous motor runs on in the field of a frozen angle; a brushed one
// only shakes, and is judged by the record.
bool Shaking::runs_on() const {
  return !known_.brushed();
}

// Friction holds the handle while the wave comes up; later it turns back in each half wave.
StillLimits Shaking::still_in_wave() const {
  const double half_wave = half_period_ * known_.tick;
  return {std::max(0.1, 4.0 * half_wave), std::max(0.03, 2.0 * half_wave),
          clear_swing * stroke_ / known_.count_length()};
}

std::string Shaking::evidence(const InducedVoltage& induced) const {
  std::string text =
      fmt::format("{:.3g} A to and fro, for {:.1f} ms each, ", current_, 1000.0 * half_period_ * known_.tick);
  if (std::isfinite(induced.error))
    text += fmt::format("induce {:.3f} V +- {:.3f} V and ", induced.volts, induced.error);
  return text + "move the count by less than 2";
}

void Shaking::require_living_encoder(const Waveforms& seen, int interval) const {
  if (seen.empty()) throw_standing(bench_, known_, false, "the encoder of the shaken handle counts nothing");
  const auto half = static_cast<std::size_t>(half_period_ / interval);
  // The last one and a half waves: whatever went before, there the encoder stands.
  const std::size_t part = std::min(seen.samples(), std::max(seen.samples() / 5, 3 * half / 2));
  if (!seen.stood && !stands(seen.of("count").last(part))) return;
  // The wave's phase is not known there: its edges are where the current changes its sign.
  const auto current = seen.of("current");
  std::size_t edge = seen.samples() - std::min(seen.samples() - 1, std::max(part, 4 * half));
  while (edge + 1 < seen.samples() && (current[edge] < 0.0) == (current[edge - 1] < 0.0)) ++edge;
  const InducedVoltage induced = induced_in_waves(seen, known_, half, edge, seen.samples());
  throw_standing(bench_, known_, induced.sure(known_, current_), evidence(induced));
}

Waveforms Shaking::record_centred(const ExcitationPlan& excitation, const CapturePlan& plan) {
  return bench_.repeat([&] {
    centre_handle(bench_, known_);
    return bench_.record_alone(excitation, plan);
  });
}

void Shaking::prepare() {
  std::vector<std::string> channels = {"count", "voltage", "current"};
  // Under a dead encoder its rotor turns away from the frame that stands, and the voltage with it.
  if (!known_.brushed()) channels.push_back("voltage_d");
  int blind = 0;
  // Longer waves would take a free handle through all of the travel, by what this axis was found to weigh.
  const int longest = half_period_of(bench_.travel());
  const int longest_standing = half_period_of(stroke_);
  bool moved_before = false;  // by a wave that was no longer than this one
  for (int attempt = 0; attempt < 40; ++attempt) {
    bench_.progress(fmt::format("shaking: {:.1f} ms half period", 1000.0 * half_period_ * known_.tick));
    const auto ticks = static_cast<std::size_t>((ramp_waves + 6) * half_period_);
    const int interval = static_cast<int>(std::max<std::size_t>(1, ticks / 280));
    // The wave drifts where friction, cogging or gravity want it.
    StillLimits still;
    // A wave that has moved the handle before does so again before it is up.
    if (runs_on()) {
      still = still_in_wave();
      if (!moved_before) still.from_start = 0.0;
    }
    const Waveforms seen =
        record_centred(wave(5 * static_cast<std::size_t>(half_period_)),
                       {channels, ticks / static_cast<std::size_t>(interval), interval, 0.0, still, true});
    if (seen.trip && seen.trip->fault == firmware::Fault::excitation_travel &&
        stroke_ > 0.02 * bench_.travel()) {
      stroke_ *= 0.6;
      moved_before = false;
      half_period_ = std::max(20, half_period_ * 2 / 3);
      continue;
    }
    require_no_trip(seen);
    if (seen.empty())
      throw_standing(bench_, known_, false, "the encoder of the shaken handle counts nothing");
    if (seen.stood_afterwards) require_turn_by_field(bench_, known_);
    const auto count = seen.of("count");
    const auto moving = count.last(count.size() * 4 / (ramp_waves + 6));
    seen_ = bench::span_of(moving) * known_.count_length();
    double largest_factor = 2.0;
    if (seen.stood || stands(moving)) {
      const auto half = static_cast<std::size_t>(half_period_ / interval);
      // Of a wave that was cut off, what comes after the last thing that the encoder counted.
      const std::size_t first = seen.stood ? (last_change(count) / half + 1) * half : ramp_waves * half;
      const InducedVoltage induced = induced_in_waves(seen, known_, half, first, seen.samples());
      const bool turns = induced.sure(known_, current_);
      if (runs_on()) {
        // What a shorter wave has moved, a longer one moves too, and what induces a voltage turns: but a
        // detent may hold it meanwhile. Led by a field it goes no farther than that, in a longer wave it
        // would run on.
        if (turns || seen.stood || moved_before) require_turn_by_field(bench_, known_);
      } else if (turns) {
        // A coarse encoder may not yet show what the voltage does: twice the stroke shows whether it is that.
        largest_factor = 1.4;
        if (++blind == 2 || half_period_ >= longest) throw_standing(bench_, known_, true, evidence(induced));
      }
      // What holds a handle that would long have swung holds it however long the wave is.
      if (!turns && half_period_ >= longest_standing) break;
    }
    if (seen_ >= 0.7 * stroke_ && seen_ <= 1.4 * stroke_) return;
    if (half_period_ >= longest) break;
    const double factor =
        seen_ > 0.0 ? std::clamp(std::sqrt(stroke_ / seen_), 0.4, largest_factor) : largest_factor;
    constexpr double fewest_counts_moved = 10.0;
    moved_before = factor >= 1.0 && seen_ >= fewest_counts_moved * known_.count_length();
    half_period_ = std::clamp(static_cast<int>(std::lround(half_period_ * factor)), 20, longest);
  }
  if (seen_ > 0.3 * stroke_) return;
  throw StepFailed({"motor_blocked",
                    fmt::format("{:.3g} A to and fro, for {:.0f} ms each, move the handle by {:.3f} mm",
                                current_, 1000.0 * half_period_ * known_.tick, 1000.0 * seen_),
                    "free the handle, or raise --current"});
}

Waveforms Shaking::record(const std::vector<std::string>& channels, std::size_t samples, int interval) {
  const std::size_t ticks = samples * static_cast<std::size_t>(interval);
  constexpr int attempts = 5;
  for (int attempt = 1;; ++attempt) {
    // The link takes up to a tenth of a second until the capture begins.
    const ExcitationPlan plan = wave(ticks + 6000);
    StillLimits still;
    if (runs_on()) still = still_in_wave();
    Waveforms seen = record_centred(plan, {channels, samples, interval, plan.ramp, still, true});
    // A long record may drift out of the travel: a shorter wave drifts less.
    if (seen.trip && seen.trip->fault == firmware::Fault::excitation_travel && attempt < attempts) {
      half_period_ = std::max(20, half_period_ * 4 / 5);
      continue;
    }
    require_no_trip(seen);
    require_living_encoder(seen, interval);
    // The samples are sound, but the next wave would begin under an encoder that may have died.
    if (seen.stood_afterwards) require_turn_by_field(bench_, known_);
    return seen;
  }
}

}  // namespace kmax::calibration
