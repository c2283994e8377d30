#include "host_tools/calibration/centring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/calibration/encoder_watch.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"

namespace kmax::calibration {

namespace {
constexpr double near_enough = 0.15;   // of the travel, where there is nothing to do
constexpr double arrived = 0.04;       // of the travel
constexpr double first_piece = 0.04;   // s
constexpr double longest_piece = 0.3;  // s
constexpr int most_pieces = 200;
constexpr std::size_t samples = 60;
// A handle that has coasted out of the travel must come back by more than is left of it.
constexpr double margin = 0.002;  // m

Recording pull(Bench& bench, const MotorKnowledge& known, double stroke, double duration, double reach) {
  ExcitationPlan spring;
  spring.kind = "position";
  spring.stiffness = 500.0;
  spring.damping = 5.0;
  spring.speed = 0.05;
  spring.stroke = stroke;
  spring.duration = duration;
  const int interval = std::max(1, static_cast<int>(duration / known.tick / static_cast<double>(samples)));
  Recording seen = bench.record(spring, {{"count", "voltage", "current"}, samples, interval, 0.0}, reach);
  require_no_trip(seen);
  return seen;
}
}  // namespace

void centre_handle(Bench& bench, const MotorKnowledge& known) {
  // The device excites no torque before.
  if (!known.brushed() && bench.number("measured.commutation_known") == 0.0)
    throw StepFailed({"commutation_unknown", "the rotor's electrical angle is not known in this power cycle",
                      "calibrate the encoder as well: --steps encoder,mechanical"});
  double away = bench.displacement();
  if (std::abs(away) < near_enough * bench.travel()) return;
  bench.disarm();
  const double reach = std::abs(away) + margin;
  double duration = first_piece;
  for (int piece = 0; piece < most_pieces; ++piece) {
    away = bench.displacement();
    if (std::abs(away) < arrived * bench.travel()) break;
    const Recording seen = pull(bench, known, -away, duration, reach);
    if (!stands(seen.of("count"))) {
      duration = first_piece;
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

}  // namespace kmax::calibration
