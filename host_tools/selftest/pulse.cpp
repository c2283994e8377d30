#include "host_tools/selftest/pulse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware/drive/motor_control.hpp"
#include "host_tools/bench/least_squares.hpp"
#include "host_tools/bench/winding_model.hpp"

namespace kmax::selftest {

using firmware::MotorKind;

AxisFacts read_facts(device::Device& device, std::size_t axis) {
  const auto number = [&](const char* name) {
    return device.read_number(fmt::format("axis{}.{}", axis, name));
  };
  AxisFacts facts;
  facts.synchronous =
      device.read(device::Parameter::of<"motor.kind">(axis)) == static_cast<std::uint32_t>(MotorKind::pmsm);
  facts.resistance = number("motor.resistance");
  facts.inductance = number("motor.inductance");
  facts.torque_constant = number("motor.torque_constant");
  facts.pole_pairs = static_cast<int>(number("motor.pole_pairs"));
  facts.electrical_offset = number("motor.electrical_offset");
  facts.calibrated = number("motor.calibrated") != 0.0;
  facts.commutation_known = number("measured.commutation_known") != 0.0;
  facts.current_limit = number("current.limit");
  facts.mass = number("device.mass");
  facts.transmission = number("device.transmission");
  facts.counts_per_turn = number("encoder.counts_per_turn");
  facts.count_length = number("measured.count_length");
  facts.tick = 1.0 / device.read_number("info.tick_rate");
  facts.supply_min = device.read_number("supply.voltage_min");
  facts.supply_max = device.read_number("supply.voltage_max");
  facts.temperature_limit = number("temperature.limit");
  return facts;
}

namespace {
std::uint32_t ticks(const AxisFacts& facts, double seconds) {
  return static_cast<std::uint32_t>(std::max(2.0, std::floor(seconds / facts.tick + 1e-6)));
}

void set_voltage(const AxisFacts& facts, double current, double displacement, double supply, Pulse& pulse) {
  const double fits = displacement / bound_on_displacement(facts, pulse, current);
  pulse.voltage = current * std::min(fits, 1.0) * facts.resistance;
  if (supply > 0.0) pulse.voltage = std::min(pulse.voltage, 0.4 * supply);
}
}  // namespace

double bound_on_displacement(const AxisFacts& facts, const Pulse& pulse, double current) {
  const double half = pulse.half_period * facts.tick;
  const double way = facts.free_acceleration() * std::abs(current) * half * half;
  if (pulse.ramp >= 4 * pulse.half_period) return 0.25 * way;
  const double periods = std::ceil(0.5 * pulse.duration / pulse.half_period);
  return way * periods;
}

Pulse plan_pulse(const AxisFacts& facts, double current, double displacement, double supply) {
  Pulse pulse;
  const double half = std::sqrt(displacement / (facts.free_acceleration() * current));
  pulse.half_period = ticks(facts, std::clamp(half, 0.25e-3, 1e-3));
  pulse.duration = 2 * pulse.half_period;
  set_voltage(facts, current, displacement, supply, pulse);
  return pulse;
}

Pulse plan_swing(const AxisFacts& facts, double current, double displacement, double supply) {
  Pulse pulse;
  const double half = std::sqrt(4.0 * displacement / (facts.free_acceleration() * current));
  pulse.half_period = ticks(facts, std::clamp(half, 0.5e-3, 4e-3));
  const std::uint32_t halves = facts.synchronous ? 12 : 20;
  pulse.duration = halves * pulse.half_period - pulse.half_period / 2;
  pulse.ramp = pulse.duration / 2;
  set_voltage(facts, current, displacement, supply, pulse);
  return pulse;
}

MeanAndDeviation mean_and_deviation(const std::vector<double>& values, std::size_t first, std::size_t last) {
  last = std::min(last, values.size());
  if (first >= last) return {};
  const auto count = static_cast<double>(last - first);
  MeanAndDeviation result;
  for (std::size_t k = first; k < last; ++k) result.mean += values[k] / count;
  for (std::size_t k = first; k < last; ++k)
    result.deviation += (values[k] - result.mean) * (values[k] - result.mean) / count;
  result.deviation = std::sqrt(result.deviation);
  return result;
}

std::size_t PulseResponse::end() const {
  std::size_t last = size();
  if (!tripped()) return std::min(last, before + pulse.duration + 2);
  while (last > before && voltage[last - 1] == 0.0) --last;
  return std::min(last + 1, size());
}

std::vector<double> PulseResponse::current_along(bool synchronous) const {
  const double offset_b = mean_and_deviation(current_b, 0, before).mean;
  const double offset_c = mean_and_deviation(current_c, 0, before).mean;
  const double cosine = std::cos(pulse.angle), sine = std::sin(pulse.angle);
  std::vector<double> along(size());
  for (std::size_t k = 0; k < along.size(); ++k) {
    const double b = current_b[k] - offset_b, c = current_c[k] - offset_c;
    along[k] = synchronous ? -(b + c) * cosine + (b - c) / std::numbers::sqrt3 * sine : 0.5 * (b - c);
  }
  return along;
}

namespace {
/// A: mean of the last quarter of every half, each with the sign of its voltage.
double amplitude_of(const std::vector<double>& current, double offset, const PulseResponse& response,
                    std::size_t end) {
  const std::size_t half = response.pulse.half_period;
  const std::size_t quarter = std::max<std::size_t>(1, half / 4);
  double sum = 0.0, samples = 0.0;
  for (std::size_t k = response.before + 1; k < end; ++k) {
    // The current of this sample was made by the voltage of the ticks before.
    const std::size_t since = k - response.before - 1;
    if (since % half < half - quarter && !response.tripped()) continue;
    const double voltage = response.voltage[k - 1];
    if (voltage == 0.0) continue;
    sum += voltage > 0.0 ? current[k] - offset : offset - current[k];
    samples += 1.0;
  }
  return samples > 0.0 ? sum / samples : 0.0;
}
}  // namespace

WindingEstimate estimate_winding(const PulseResponse& response, double tick) {
  WindingEstimate estimate;
  const std::size_t end = response.end();
  const std::vector<double>* strongest = nullptr;
  double offset = 0.0;
  for (const auto* current : {&response.current_b, &response.current_c}) {
    const MeanAndDeviation rest = mean_and_deviation(*current, 0, response.before);
    const double amplitude = std::abs(amplitude_of(*current, rest.mean, response, end));
    estimate.noise = std::max(estimate.noise, rest.deviation);
    if (amplitude <= estimate.amplitude && strongest != nullptr) continue;
    estimate.amplitude = amplitude;
    strongest = current;
    offset = rest.mean;
  }
  estimate.time_constant = bench::best_time_constant(tick, [&](double tried) {
    const auto driven = bench::lagged_voltage(response.voltage, tried, tick);
    if (end < response.before + 3) return 1e9;
    const auto rows = static_cast<Eigen::Index>(end - response.before);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Ones(rows, 2);
    Eigen::VectorXd right(rows);
    for (Eigen::Index n = 0; n < rows; ++n) {
      const std::size_t k = response.before + static_cast<std::size_t>(n);
      columns(n, 0) = driven[k];
      right[n] = (*strongest)[k] - offset;
    }
    return bench::solve_least_squares(columns, right).residual;
  });
  return estimate;
}

}  // namespace kmax::selftest
