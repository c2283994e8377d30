#include "host_tools/selftest/pulse_plan.hpp"

#include <algorithm>
#include <cmath>

namespace kmax::selftest {

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

}  // namespace kmax::selftest
