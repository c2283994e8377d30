#include "host_tools/selftest/phase_response.hpp"

#include <array>
#include <cmath>
#include <optional>

#include "host_tools/selftest/winding_model.hpp"

namespace kmax::selftest {

namespace {
using Pattern = std::array<double, 6>;  // b and c for each pulse; a DC motor uses the first two

struct Hypothesis {
  Circuit circuit;
  Pattern pattern;
};

constexpr std::array synchronous_hypotheses = std::to_array<Hypothesis>({
    {Circuit::healthy, {-0.5, -0.5, 1.0, -0.5, -0.5, 1.0}},
    {Circuit::open_a, {0.0, 0.0, 0.75, -0.75, -0.75, 0.75}},
    {Circuit::open_b, {0.0, -0.75, 0.0, 0.0, 0.0, 0.75}},
    {Circuit::open_c, {-0.75, 0.0, 0.75, 0.0, 0.0, 0.0}},
    {Circuit::sense_b_inverted, {0.5, -0.5, -1.0, -0.5, 0.5, 1.0}},
    {Circuit::sense_c_inverted, {-0.5, 0.5, 1.0, 0.5, -0.5, -1.0}},
    {Circuit::both_inverted, {0.5, 0.5, -1.0, 0.5, 0.5, -1.0}},
    {Circuit::sense_b_dead, {0.0, -0.5, 0.0, -0.5, 0.0, 1.0}},
    {Circuit::sense_c_dead, {-0.5, 0.0, 1.0, 0.0, -0.5, 0.0}},
});

constexpr std::array dc_hypotheses = std::to_array<Hypothesis>({
    {Circuit::healthy, {1.0, -1.0}},
    {Circuit::sense_b_inverted, {-1.0, -1.0}},
    {Circuit::sense_c_inverted, {1.0, 1.0}},
    {Circuit::both_inverted, {-1.0, 1.0}},
    {Circuit::sense_b_dead, {0.0, -1.0}},
    {Circuit::sense_c_dead, {1.0, 0.0}},
});

/// Share of the square of `seen` that the pattern leaves unexplained, and the factor; none for a factor that
/// is not positive.
struct Match {
  double factor, residual;
};
std::optional<Match> match(const Pattern& seen, const Pattern& pattern) {
  double cross = 0.0, own = 0.0, square = 0.0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    cross += seen[i] * pattern[i];
    own += pattern[i] * pattern[i];
    square += seen[i] * seen[i];
  }
  if (!(cross > 0.0)) return std::nullopt;
  return Match{cross / own, 1.0 - cross * cross / (own * square)};
}

struct Answer {
  double factor = 0.0, deviation = 0.0;
};
Answer project(const std::vector<double>& seen, double offset, double noise, const std::vector<double>& model,
               std::size_t end) {
  double cross = 0.0, square = 0.0;
  for (std::size_t k = 0; k < end; ++k) {
    cross += (seen[k] - offset) * model[k];
    square += model[k] * model[k];
  }
  if (!(square > 0.0)) return {};
  return {cross / square, noise / std::sqrt(square)};
}

Circuit when_shorted(Circuit circuit) {
  switch (circuit) {
    case Circuit::open_a:
      return Circuit::short_bc;
    case Circuit::open_b:
      return Circuit::short_ca;
    case Circuit::open_c:
      return Circuit::short_ab;
    case Circuit::healthy:
      return Circuit::short_circuit;
    default:
      return circuit;
  }
}
}  // namespace

PhaseResponse judge_phases(const std::vector<Recording>& recordings, const AxisFacts& facts) {
  constexpr double least_answer = 0.05, clear_enough = 0.2, shorted = 3.0;
  PhaseResponse response;
  response.judged_resistance = facts.resistance;
  Pattern seen{};
  bool any = false;
  for (std::size_t i = 0; i < recordings.size() && i < 3; ++i) {
    const Recording& recording = recordings[i];
    auto model = lagged_voltage(recording.voltage, facts.inductance / facts.resistance, facts.tick);
    for (double& current : model) current /= facts.resistance;
    const std::size_t end = end_of_pulse(recording);
    const auto answer = [&](const std::vector<double>& current) {
      const MeanAndDeviation rest = mean_and_deviation(current, 0, recording.before);
      const Answer found = project(current, rest.mean, rest.deviation, model, end);
      any = any || (std::abs(found.factor) > least_answer && std::abs(found.factor) > 3.0 * found.deviation);
      return found.factor;
    };
    response.b.push_back(seen[2 * i] = answer(recording.current_b));
    response.c.push_back(seen[2 * i + 1] = answer(recording.current_c));
  }
  if (!any) {
    response.circuit = Circuit::nothing_flows;
    return response;
  }
  const auto consider = [&](const Hypothesis& hypothesis) {
    const auto found = match(seen, hypothesis.pattern);
    if (!found) return;
    if (found->residual < response.residual) {
      response.runner_up = response.residual;
      response.residual = found->residual;
      response.admittance = found->factor;
      response.circuit = hypothesis.circuit;
    } else if (found->residual < response.runner_up) {
      response.runner_up = found->residual;
    }
  };
  if (facts.synchronous) {
    for (const Hypothesis& hypothesis : synchronous_hypotheses) consider(hypothesis);
  } else {
    for (const Hypothesis& hypothesis : dc_hypotheses) consider(hypothesis);
  }
  if (response.residual > clear_enough || response.runner_up < 2.0 * response.residual) {
    response.circuit = Circuit::unclear;
  } else if (facts.calibrated && response.admittance > shorted) {
    response.circuit = when_shorted(response.circuit);
  }
  return response;
}

}  // namespace kmax::selftest
