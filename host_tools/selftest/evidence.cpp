#include "host_tools/selftest/evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <span>

#include "host_tools/bench/circuit.hpp"
#include "host_tools/bench/excitation.hpp"
#include "host_tools/bench/least_squares.hpp"
#include "host_tools/bench/winding_model.hpp"

namespace kmax::selftest {

namespace {
/// A s: integral of the current from the pulse's begin.
std::vector<double> integral_of(const std::vector<double>& current, std::size_t from, double tick) {
  std::vector<double> result(current.size(), 0.0);
  for (std::size_t k = from + 1; k < current.size(); ++k)
    result[k] = result[k - 1] + 0.5 * (current[k - 1] + current[k]) * tick;
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
  return bench::span_of(std::span(values).subspan(first, last - first));
}

/// `target` from the samples of `columns` and a constant, from `first` to `last`; nothing if they do not
/// determine it.
std::optional<bench::LinearFit> fit(std::initializer_list<std::vector<double>> columns,
                                    const std::vector<double>& target, std::size_t first, std::size_t last) {
  const auto rows = static_cast<Eigen::Index>(last - first);
  Eigen::MatrixXd matrix(rows, static_cast<Eigen::Index>(columns.size()) + 1);
  Eigen::Index column = 0;
  const auto samples = [&](const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data() + first, rows);
  };
  for (const std::vector<double>& values : columns) matrix.col(column++) = samples(values);
  matrix.col(column).setOnes();
  bench::LinearFit found = bench::solve_least_squares(matrix, samples(target));
  return found.standard_error.allFinite() ? std::optional(found) : std::nullopt;
}

std::optional<OneSwing> look_at(const PulseResponse& response, const AxisFacts& facts) {
  const std::size_t end = response.end();
  if (end < response.before + 50) return std::nullopt;
  const auto current = response.current_along(facts.synchronous);
  const std::vector<double> integral = integral_of(current, response.before, facts.tick);
  const double noise = mean_and_deviation(current, 0, response.before).deviation;
  const double band = std::max(2.0 * noise, 0.005 * span_of(current, response.before, end));
  std::vector<double> sign(current.size()), velocity(current.size(), 0.0);
  for (std::size_t k = 0; k < current.size(); ++k) sign[k] = std::clamp(current[k] / band, -1.0, 1.0);
  for (std::size_t k = 1; k + 1 < current.size(); ++k)
    velocity[k] = (response.position[k + 1] - response.position[k - 1]) / (2.0 * facts.tick);

  const auto lag = [&](const std::vector<double>& values, double time_constant) {
    return bench::lagged(values, time_constant, facts.tick);
  };
  const auto drive = [&](double time_constant) {
    return bench::lagged_voltage(response.voltage, time_constant, facts.tick);
  };
  const double time_constant = bench::best_time_constant(facts.tick, [&](double tried) {
    const auto found =
        fit({drive(tried), lag(integral, tried), lag(sign, tried)}, current, response.before, end);
    return found ? found->residual : 1e9;
  });
  // Once more with how the current changes with the time constant, since the back-EMF depends on that: this
  // finds the rest of it, and what not knowing it better means for the deviations.
  std::vector<double> change = drive(1.01 * time_constant);
  const std::vector<double> faster = drive(0.99 * time_constant);
  for (std::size_t k = 0; k < change.size(); ++k) change[k] -= faster[k];
  const auto columns = {drive(time_constant), lag(integral, time_constant), lag(sign, time_constant), change};
  const auto circuit = fit(columns, current, response.before, end);
  const auto motion = fit(columns, lag(velocity, time_constant), response.before, end);
  if (!circuit || !motion || !(circuit->value[0] > 0.0)) return std::nullopt;
  OneSwing result;
  result.back_emf = -circuit->value[1] / circuit->value[0];
  result.back_emf_deviation = circuit->standard_error[1] / circuit->value[0];
  result.answer = motion->value[1];
  result.answer_deviation = motion->standard_error[1];
  result.excursion = span_of(response.position, response.before, end);
  result.first_integral = span_of(integral, response.before, end);
  result.second_integral = 0.125 * result.first_integral * response.pulse.half_period * facts.tick * 2.0;
  return result;
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

std::optional<MotionEvidence> motion_evidence(const std::vector<PulseResponse>& swings,
                                              const AxisFacts& facts) {
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

PhaseFinding judge_phases(const std::vector<PulseResponse>& pulses, const AxisFacts& facts) {
  constexpr double least_answer = 0.05, clear_enough = 0.2, shorted = 3.0;
  PhaseFinding finding;
  finding.judged_resistance = facts.resistance;
  std::vector<double> directions;
  bool any = false;
  for (const PulseResponse& response : pulses) {
    auto model = bench::lagged_voltage(response.voltage, facts.inductance / facts.resistance, facts.tick);
    for (double& current : model) current /= facts.resistance;
    const auto answer = [&](const std::vector<double>& current) {
      const MeanAndDeviation rest = mean_and_deviation(current, 0, response.before);
      const Answer found = project(current, rest.mean, rest.deviation, model, response.end());
      any = any || (std::abs(found.factor) > least_answer && std::abs(found.factor) > 3.0 * found.deviation);
      return found.factor;
    };
    directions.push_back(response.pulse.angle);
    finding.answers.push_back({answer(response.current_b), answer(response.current_c)});
  }
  if (!any) {
    finding.circuit = Circuit::nothing_flows;
    return finding;
  }
  const bench::CircuitMatch match = bench::match_circuit(!facts.synchronous, directions, finding.answers);
  finding.circuit = match.circuit;
  finding.admittance = match.factor;
  finding.residual = match.residual;
  if (match.residual > clear_enough || match.runner_up < 2.0 * match.residual) {
    finding.circuit = Circuit::unclear;
  } else if (facts.calibrated && match.factor > shorted) {
    finding.circuit = when_shorted(match.circuit);
  }
  return finding;
}

std::string ArmingTrial::words() const {
  if (armed) return "it was armed";
  if (fault != firmware::Fault::none) return std::string(firmware::text_of(fault).what);
  return std::string(firmware::to_string(refusal));
}

bool Evidence::measures_currents() const {
  return !arming.armed || std::any_of(supply.begin(), supply.end(), [](double v) { return v != 0.0; });
}

bool Evidence::handle_was_moved() const {
  const auto moved = firmware::Fault::excitation_travel;
  // Of the trip's tick the capture may have missed some counts.
  const bool left = pulse_fault == moved && largest_displacement > 0.9 * travel;
  return pulse_withheld || arming.fault == moved || left || largest_displacement > most_displacement;
}

std::string reason_without_pulses(const Evidence& evidence) {
  if (!evidence.measures_currents())
    return "this board measures neither supply nor currents: there is no power stage to test";
  if (!evidence.arming.armed) return fmt::format("the axis cannot be armed: {}", evidence.arming.words());
  if (!evidence.phases && evidence.handle_was_moved()) return "something else moved the handle";
  if (!evidence.phases) return "no pulse could be given";
  return {};
}

}  // namespace kmax::selftest
