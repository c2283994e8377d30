#include "host_tools/bench/circuit.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace kmax::bench {

namespace {
struct Hypothesis {
  Circuit circuit;
  std::array<double, 3> conductance;  // of the phases A, B, C
  double sense_b, sense_c;            // gain of the sensors
};

constexpr Hypothesis hypotheses[] = {{Circuit::healthy, {1, 1, 1}, 1, 1},
                                     {Circuit::open_a, {0, 1, 1}, 1, 1},
                                     {Circuit::open_b, {1, 0, 1}, 1, 1},
                                     {Circuit::open_c, {1, 1, 0}, 1, 1},
                                     {Circuit::sense_b_inverted, {1, 1, 1}, -1, 1},
                                     {Circuit::sense_c_inverted, {1, 1, 1}, 1, -1},
                                     {Circuit::both_inverted, {1, 1, 1}, -1, -1},
                                     {Circuit::sense_b_dead, {1, 1, 1}, 0, 1},
                                     {Circuit::sense_c_dead, {1, 1, 1}, 1, 0}};

bool is_open(const Hypothesis& hypothesis) {
  return hypothesis.conductance != std::array<double, 3>{1, 1, 1};
}

SensorAnswer predicted(const Hypothesis& hypothesis, bool brushed, double direction) {
  if (brushed) return {hypothesis.sense_b, -hypothesis.sense_c};
  constexpr double third = 2.0 * std::numbers::pi / 3.0;
  const auto& [a, b, c] = hypothesis.conductance;
  const double va = std::cos(direction), vb = std::cos(direction - third), vc = std::cos(direction + third);
  const double star = (a * va + b * vb + c * vc) / (a + b + c);
  return {hypothesis.sense_b * b * (vb - star), hypothesis.sense_c * c * (vc - star)};
}
}  // namespace

CircuitMatch match_circuit(bool brushed, std::span<const double> directions,
                           std::span<const SensorAnswer> seen) {
  CircuitMatch best;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (brushed && is_open(hypothesis)) continue;
    double cross = 0.0, own = 0.0, square = 0.0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const SensorAnswer expected = predicted(hypothesis, brushed, directions[i]);
      cross += seen[i].b * expected.b + seen[i].c * expected.c;
      own += expected.b * expected.b + expected.c * expected.c;
      square += seen[i].b * seen[i].b + seen[i].c * seen[i].c;
    }
    if (!(cross > 0.0)) continue;
    const double residual = 1.0 - cross * cross / (own * square);
    if (residual < best.residual) {
      best = {hypothesis.circuit, cross / own, residual, best.residual};
    } else if (residual < best.runner_up) {
      best.runner_up = residual;
    }
  }
  return best;
}

}  // namespace kmax::bench
