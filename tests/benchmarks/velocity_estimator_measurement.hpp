#pragma once
// Velocity estimators on three motions with a known velocity: what each one costs and how far it is off.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "control/velocity_estimator.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"

namespace kmax::benchmark::velocity {

using namespace kmax::control;

struct Motion {
  double position;  // m
  double velocity;  // m/s
};

inline constexpr double ramp_speed =
    0.01037;  // no simple fraction of a quantum per sample: those hide the noise of a filter
inline constexpr double sine_amplitude = 0.005;
inline constexpr double sine_frequency = 2.0;
inline constexpr double impact_speed = 0.200;
inline constexpr double impact_mass = 0.045;
inline constexpr double impact_stiffness = 8000.0;
inline constexpr double impact_flight =
    0.0437;  // s between two contacts; no whole number of samples at either rate
inline constexpr double bandwidth = 100.0;
inline constexpr std::int32_t window = 16;

inline Motion ramp(double time) {
  return {ramp_speed * time, ramp_speed};
}

inline Motion sine(double time) {
  const double omega = 2.0 * std::numbers::pi * sine_frequency;
  return {sine_amplitude * std::sin(omega * time), sine_amplitude * omega * std::cos(omega * time)};
}

// Free flight, half a period of a mass on a spring, free flight back, the same on the other side.
inline Motion impact(double time) {
  const double omega = std::sqrt(impact_stiffness / impact_mass);
  const double contact = std::numbers::pi / omega;
  const double half = impact_flight + contact;
  const double cycles = std::floor(time / half);
  const double side = std::fmod(cycles, 2.0) == 0.0 ? 1.0 : -1.0;
  const double since = time - cycles * half;
  const double wall = 0.5 * impact_speed * impact_flight;
  if (since < impact_flight) return {side * (impact_speed * since - wall), side * impact_speed};
  const double phase = omega * (since - impact_flight);
  return {side * (wall + impact_speed / omega * std::sin(phase)), side * impact_speed * std::cos(phase)};
}

struct Signal {
  const char* name;
  Motion (*motion)(double);
};
struct Estimator {
  const char* name;
  VelocityEstimatorKind kind;
  const char* colour;  // Okabe and Ito's palette
};
struct Row {
  const char* estimator;
  const char* signal;
  double quantum;
  double rate;
  double nanoseconds;
  double error;  // mm/s, root mean square
};

inline constexpr std::array<Signal, 3> signals = {{{"slow ramp", ramp}, {"sine", sine}, {"impact", impact}}};
inline constexpr std::array<Estimator, 6> estimators = {
    {{"difference", VelocityEstimatorKind::difference, "#000000"},
     {"low pass", VelocityEstimatorKind::low_pass, "#E69F00"},
     {"FOAW best-fit", VelocityEstimatorKind::foaw, "#0072B2"},
     {"FOAW end-fit", VelocityEstimatorKind::foaw_end_fit, "#56B4E9"},
     {"tracking", VelocityEstimatorKind::tracking, "#D55E00"},
     {"edge period", VelocityEstimatorKind::edge_period, "#CC79A7"}}};
inline constexpr std::array<double, 2> quanta = {55e-6, 1e-6};
inline constexpr std::array<double, 2> rates = {500.0, 20'000.0};

inline Row measure(const Estimator& estimator, const Signal& signal, double quantum, double rate) {
  const auto samples = static_cast<std::size_t>(4.0 * rate);
  const auto settled = static_cast<std::size_t>(0.2 * rate);
  std::vector<std::int64_t> counts(samples);
  std::vector<double> truth(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const Motion motion = signal.motion(static_cast<double>(k) / rate);
    counts[k] = static_cast<std::int64_t>(std::floor(motion.position / quantum));
    truth[k] = motion.velocity;
  }
  VelocityEstimatorConfig<float> config;
  config.kind = estimator.kind;
  config.window = window;
  config.bandwidth = static_cast<float>(bandwidth);
  const auto coefficients = VelocityEstimator<float>::prepare(config, static_cast<float>(1.0 / rate),
                                                              static_cast<float>(quantum), 1);
  std::vector<float> estimates(samples);
  const std::size_t passes = 1 + 200'000 / samples;
  const double seconds = best_processor_time(9, [&] {
    for (std::size_t pass = 0; pass < passes; ++pass) {
      VelocityEstimator<float> velocity;
      velocity.reset(counts[0]);
      for (std::size_t k = 0; k < samples; ++k)
        estimates[k] = velocity.update(coefficients, counts[k], static_cast<std::uint32_t>(k));
      keep(estimates.back());
    }
  });
  double square = 0.0;
  for (std::size_t k = settled; k < samples; ++k) {
    const double error = static_cast<double>(estimates[k]) - truth[k];
    square += error * error;
  }
  return {estimator.name,
          signal.name,
          quantum,
          rate,
          1e9 * seconds / static_cast<double>(passes * samples),
          1e3 * std::sqrt(square / static_cast<double>(samples - settled))};
}

// Every signal, quantum, rate and estimator, in this order. About 2 s.
inline std::vector<Row> measure_all() {
  std::vector<Row> rows;
  for (const Signal& signal : signals) {
    for (const double quantum : quanta) {
      for (const double rate : rates) {
        for (const Estimator& estimator : estimators)
          rows.push_back(measure(estimator, signal, quantum, rate));
      }
    }
  }
  return rows;
}

}  // namespace kmax::benchmark::velocity
