// Do both current sensors read nothing when nothing flows, and the right thing when something does?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

using firmware::Fault;
using firmware::Refusal;

namespace {
/// What the pulses say about a sensor; nullptr if nothing against it.
struct SensorFault {
  Circuit circuit;
  const char* part;
  const char* words;
};
constexpr SensorFault sensor_faults[] = {
    {Circuit::sense_b_inverted, "current sensor B",
     "sensor B reads with the wrong sign: its shunt's or amplifier's wires are exchanged"},
    {Circuit::sense_c_inverted, "current sensor C",
     "sensor C reads with the wrong sign: its shunt's or amplifier's wires are exchanged"},
    {Circuit::both_inverted, "current sensors B and C", "both sensors read with the wrong sign"},
    {Circuit::sense_b_dead, "current sensor B",
     "sensor B reads nothing although the current of C shows that it flows through B too"},
    {Circuit::sense_c_dead, "current sensor C",
     "sensor C reads nothing although the current of B shows that it flows through C too"},
};

std::string numbers(const PhaseResponse& response) {
  std::string text;
  for (std::size_t i = 0; i < response.b.size(); ++i)
    text += fmt::format("{}{:+.2f} and {:+.2f}", i == 0 ? "" : "; ", response.b[i], response.c[i]);
  return text;
}
}  // namespace

CheckResult check_current_sense(const Evidence& evidence) {
  CheckResult result{"current sense", Verdict::pass, "", {}, ""};
  const auto fail = [&](const std::string& part, const std::string& message) {
    result.verdict = Verdict::fail;
    result.part = part;
    result.message = message;
    return result;
  };
  if (!evidence.measures_currents()) {
    result.verdict = Verdict::not_judged;
    result.message = reason_without_pulses(evidence);
    return result;
  }
  if (evidence.arming.refusal == Refusal::current_sense_invalid ||
      evidence.arming.fault == Fault::current_sense || evidence.pulse_fault == Fault::current_sense)
    return fail(
        "current sense",
        "an amplifier reads current while the bridge is off, or reads against its rail: check the shunts, "
        "the gate driver's amplifiers and their reference");
  const double limit = evidence.facts.current_limit;
  const double allowed = std::max(0.15, 0.03 * limit);
  std::string at_rest = "not looked at with the bridge off";
  if (evidence.rest && evidence.rest->size() > 0) {
    const auto& rest = *evidence.rest;
    const MeanAndDeviation b = mean_and_deviation(rest.current_b, 0, rest.size());
    const MeanAndDeviation c = mean_and_deviation(rest.current_c, 0, rest.size());
    result.values = {{"offset_b", b.mean, "A"},
                     {"offset_c", c.mean, "A"},
                     {"noise_b", b.deviation, "A"},
                     {"noise_c", c.deviation, "A"}};
    at_rest = fmt::format(
        "bridge off: B {:+.3f} A, noise {:.3f} A; C {:+.3f} A, noise {:.3f} A; allowed is {:.2f} A each",
        b.mean, b.deviation, c.mean, c.deviation, allowed);
    const bool bad_b = !(std::abs(b.mean) <= allowed && b.deviation <= allowed);
    const bool bad_c = !(std::abs(c.mean) <= allowed && c.deviation <= allowed);
    if (evidence.arming.armed && (bad_b || bad_c))
      return fail(bad_b && bad_c ? "current sensors B and C"
                  : bad_b        ? "current sensor B"
                                 : "current sensor C",
                  at_rest + ": check the shunt and its amplifier, and what disturbs them");
  }
  if (!evidence.response) {
    result.verdict = Verdict::not_judged;
    result.message =
        fmt::format("{}; not looked at with current: {}", at_rest, reason_without_pulses(evidence));
    return result;
  }
  const PhaseResponse& response = *evidence.response;
  const std::string seen = fmt::format("{}; under pulses B and C answered with {} of the winding's current",
                                       at_rest, numbers(response));
  for (const SensorFault& one : sensor_faults) {
    if (response.circuit == one.circuit) return fail(one.part, fmt::format("{}: {}", seen, one.words));
  }
  switch (response.circuit) {
    case Circuit::nothing_flows:
      result.verdict = Verdict::not_judged;
      result.message = at_rest + "; no current flowed that they could have shown";
      return result;
    case Circuit::unclear:
      if (evidence.pulse_fault == Fault::current_sum)
        return fail(
            "current sense",
            fmt::format("{}: the currents do not add up to zero ({:.2f} A are missing): one sensor's gain "
                        "is wrong, or current leaks from the motor to ground; unplug the motor to tell",
                        seen, evidence.pulse_fault_value));
      result.verdict = Verdict::not_judged;
      result.message = seen + ": that fits no single fault";
      return result;
    default:
      result.message =
          seen + (response.circuit == Circuit::healthy ? ": signs and gains agree"
                                                       : ": both sensors answer with the right sign");
      return result;
  }
}

}  // namespace kmax::selftest
