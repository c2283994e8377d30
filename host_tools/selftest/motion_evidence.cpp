#include "host_tools/selftest/motion_evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host_tools/selftest/linear_fit.hpp"
#include "host_tools/selftest/winding_model.hpp"

namespace kmax::selftest {

namespace {
/// A s and A s2: first and second integral of the current from the pulse's begin.
struct Integrals {
  std::vector<double> first, second;
};

Integrals integrate(const std::vector<double>& current, std::size_t from, double tick) {
  Integrals result{std::vector<double>(current.size(), 0.0), std::vector<double>(current.size(), 0.0)};
  for (std::size_t k = from + 1; k < current.size(); ++k) {
    result.first[k] = result.first[k - 1] + 0.5 * (current[k - 1] + current[k]) * tick;
    result.second[k] = result.second[k - 1] + 0.5 * (result.first[k - 1] + result.first[k]) * tick;
  }
  return result;
}

struct OneSwing {
  double back_emf = 0.0, back_emf_deviation = 0.0;  ///< V/(A s)
  double answer = 0.0, answer_deviation = 0.0;      ///< m/(A s2)
  double excursion = 0.0;                           ///< m
  double first_integral = 0.0;                      ///< A s, largest less smallest
  double second_integral = 0.0;                     ///< A s2, likewise, without drift
};

double span_of(const std::vector<double>& values, std::size_t first, std::size_t last) {
  const auto [low, high] = std::minmax_element(values.begin() + static_cast<std::ptrdiff_t>(first),
                                               values.begin() + static_cast<std::ptrdiff_t>(last));
  return *high - *low;
}

std::optional<OneSwing> look_at(const Recording& recording, const AxisFacts& facts) {
  const std::size_t end = end_of_pulse(recording);
  if (end < recording.before + 50) return std::nullopt;
  const auto current = current_along(recording, facts.synchronous);
  const Integrals integrals = integrate(current, recording.before, facts.tick);
  const double noise = mean_and_deviation(current, 0, recording.before).deviation;
  const double band = std::max(2.0 * noise, 0.005 * span_of(current, recording.before, end));
  std::vector<double> sign(current.size()), velocity(current.size(), 0.0);
  for (std::size_t k = 0; k < current.size(); ++k) sign[k] = std::clamp(current[k] / band, -1.0, 1.0);
  for (std::size_t k = 1; k + 1 < current.size(); ++k)
    velocity[k] = (recording.position[k + 1] - recording.position[k - 1]) / (2.0 * facts.tick);

  const auto fit = [&](double time_constant) {
    const auto driven = lagged_voltage(recording.voltage, time_constant, facts.tick);
    const auto moving = lagged(integrals.first, time_constant, facts.tick);
    const auto lost = lagged(sign, time_constant, facts.tick);
    LinearFit<4> circuit;
    for (std::size_t k = recording.before; k < end; ++k)
      circuit.add({driven[k], moving[k], lost[k], 1.0}, current[k]);
    return circuit.solve();
  };
  const double time_constant = best_time_constant(facts.tick, [&](double tried) {
    const auto found = fit(tried);
    return found ? found->residual : 1e9;
  });
  // Once more with how the current changes with the time constant, since the back-EMF depends on that: this
  // finds the rest of it, and what not knowing it better means for the deviations.
  const auto slower = lagged_voltage(recording.voltage, 1.01 * time_constant, facts.tick);
  const auto faster = lagged_voltage(recording.voltage, 0.99 * time_constant, facts.tick);
  const auto driven = lagged_voltage(recording.voltage, time_constant, facts.tick);
  const auto moving = lagged(integrals.first, time_constant, facts.tick);
  const auto lost = lagged(sign, time_constant, facts.tick);
  const auto seen = lagged(velocity, time_constant, facts.tick);
  LinearFit<5> circuit_fit, motion_fit;
  for (std::size_t k = recording.before; k < end; ++k) {
    const std::array<double, 5> row{driven[k], moving[k], lost[k], slower[k] - faster[k], 1.0};
    circuit_fit.add(row, current[k]);
    motion_fit.add(row, seen[k]);
  }
  const auto circuit = circuit_fit.solve();
  const auto motion = motion_fit.solve();
  if (!circuit || !motion || !(circuit->value[0] > 0.0)) return std::nullopt;
  OneSwing result;
  result.back_emf = -circuit->value[1] / circuit->value[0];
  result.back_emf_deviation = circuit->deviation[1] / circuit->value[0];
  result.answer = motion->value[1];
  result.answer_deviation = motion->deviation[1];
  result.excursion = span_of(recording.position, recording.before, end);
  result.first_integral = span_of(integrals.first, recording.before, end);
  result.second_integral = 0.125 * result.first_integral * recording.pulse.half_period * facts.tick * 2.0;
  return result;
}
}  // namespace

bool MotionEvidence::encoder_moved() const {
  return std::abs(by_encoder) > 5.0 * encoder_deviation && counts >= 2.0;
}

bool MotionEvidence::back_emf_moved() const {
  return back_emf > 5.0 * back_emf_deviation && largest_back_emf > 0.02 * largest_voltage &&
         (!calibrated || back_emf > moving_share * free_back_emf);
}

bool MotionEvidence::back_emf_would_show() const {
  return calibrated && 5.0 * back_emf_deviation < 2.0 * moving_share * free_back_emf &&
         2.0 * moving_share * free_back_emf * largest_impulse > 0.02 * largest_voltage;
}

std::optional<MotionEvidence> motion_evidence(const std::vector<Recording>& swings, const AxisFacts& facts) {
  const std::size_t directions = facts.synchronous ? 2 : 1;
  const std::size_t sets = swings.size() / directions;
  if (sets == 0) return std::nullopt;
  MotionEvidence evidence;
  evidence.calibrated = facts.calibrated;
  evidence.free_handle = facts.free_acceleration();
  evidence.free_back_emf = facts.free_back_emf();
  double back_emf_variance = 0.0, answer_variance = 0.0, longest_integral = 0.0;
  std::array<double, 2> answers{};
  for (std::size_t i = 0; i < sets * directions; ++i) {
    const auto swing = look_at(swings[i], facts);
    if (!swing) return std::nullopt;
    const double share = (facts.synchronous ? 1.5 : 1.0) / static_cast<double>(sets);
    evidence.back_emf += share * swing->back_emf;
    back_emf_variance += std::pow(share * swing->back_emf_deviation, 2);
    answers[i % directions] += swing->answer / static_cast<double>(sets);
    answer_variance += std::pow(swing->answer_deviation / static_cast<double>(sets), 2);
    evidence.encoder_excursion = std::max(evidence.encoder_excursion, swing->excursion);
    evidence.largest_voltage = std::max(evidence.largest_voltage, std::abs(swings[i].pulse.voltage));
    longest_integral = std::max(longest_integral, swing->second_integral);
    evidence.largest_impulse = std::max(evidence.largest_impulse, swing->first_integral);
  }
  evidence.by_encoder = facts.synchronous ? std::hypot(answers[0], answers[1]) : answers[0];
  evidence.encoder_deviation = std::sqrt(answer_variance);
  evidence.counts = evidence.encoder_excursion / facts.count_length;
  evidence.back_emf_deviation = std::sqrt(back_emf_variance);
  evidence.largest_back_emf = std::abs(evidence.back_emf) * evidence.largest_impulse;
  evidence.by_back_emf = facts.calibrated ? evidence.back_emf * facts.transmission / facts.torque_constant
                                          : std::sqrt(std::max(evidence.back_emf, 0.0) / facts.mass);
  evidence.back_emf_excursion = std::max(0.0, evidence.by_back_emf) * longest_integral;
  // Along 0: -G sin(rotor), along 90 degrees: G cos(rotor).
  if (facts.synchronous && evidence.encoder_moved())
    evidence.rotor_angle = std::atan2(-answers[0], answers[1]);
  return evidence;
}

}  // namespace kmax::selftest
