// Is there a winding between all legs, and nothing else?
#include <fmt/format.h>

#include <cmath>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

using firmware::Fault;

namespace {
struct CircuitFault {
  Circuit circuit;
  const char* part;
  const char* words;
};
constexpr CircuitFault circuit_faults[] = {
    {Circuit::open_a, "phase A (open)", "no current flows through phase A"},
    {Circuit::open_b, "phase B (open)", "no current flows through phase B"},
    {Circuit::open_c, "phase C (open)", "no current flows through phase C"},
    {Circuit::short_ab, "phases A and B (short)",
     "far more current than the winding allows flows from A to B"},
    {Circuit::short_bc, "phases B and C (short)",
     "far more current than the winding allows flows from B to C"},
    {Circuit::short_ca, "phases C and A (short)",
     "far more current than the winding allows flows from C to A"},
};
}  // namespace

CheckResult check_phases(const Evidence& evidence) {
  CheckResult result{"phases", Verdict::pass, "", {}, ""};
  const AxisFacts& facts = evidence.facts;
  const auto say = [&](Verdict verdict, const std::string& part, const std::string& message) {
    result.verdict = verdict;
    result.part = part;
    result.message = message;
    return result;
  };
  if (!evidence.response) return say(Verdict::not_judged, "", reason_without_pulses(evidence));
  const PhaseResponse& response = *evidence.response;
  const double resistance =
      response.admittance > 0.0 ? response.judged_resistance / response.admittance : 0.0;
  if (response.admittance > 0.0)
    result.values = {{"resistance", resistance, "ohm"}, {"pattern_residual", response.residual, ""}};
  for (const CircuitFault& one : circuit_faults) {
    if (response.circuit != one.circuit) continue;
    const bool open = response.circuit == Circuit::open_a || response.circuit == Circuit::open_b ||
                      response.circuit == Circuit::open_c;
    return say(Verdict::fail, one.part,
               fmt::format("{}: check {}", one.words,
                           open ? "its wire, plug, solder joint and winding"
                                : "cable and winding, with the motor unplugged from the board first"));
  }
  const bool over_current = evidence.pulse_fault == Fault::over_current;
  switch (response.circuit) {
    case Circuit::nothing_flows: {
      const std::string seen = fmt::format("no current flows at {:.2f} V", evidence.largest_pulse_voltage);
      return facts.synchronous ? say(Verdict::fail, "motor cable (two or three phases open)",
                                     seen + " between any two phases: is the motor plugged in?")
                               : say(Verdict::fail, "motor winding or cable (B to C open)",
                                     seen +
                                         ": is the motor plugged in? A DC motor is one circuit: whether the "
                                         "lead of B, that "
                                         "of C, the brushes or the winding is open cannot be told from here");
    }
    case Circuit::short_circuit:
      return say(
          Verdict::fail,
          facts.synchronous ? "motor winding (short)" : "motor winding or cable (B to C short)",
          fmt::format("the circuit has {:.3f} ohm where motor.resistance says {:.3f} ohm: a short in cable "
                      "or winding, unless motor.resistance is wrong",
                      resistance, facts.resistance));
    case Circuit::healthy:
      break;
    case Circuit::unclear:
      if (over_current)
        return say(Verdict::fail, "motor winding or cable (short)",
                   fmt::format("{:.1f} A flowed at {:.2f} V: a short in cable or winding",
                               evidence.pulse_fault_value, evidence.largest_pulse_voltage));
      return say(Verdict::not_judged, "", "the currents fit no single fault; see current sense");
    default:
      return say(Verdict::not_judged, "", "the current sensors must be right first");
  }
  if (over_current)
    return say(
        Verdict::fail, "motor winding or cable (short)",
        fmt::format("{:.1f} A flowed at {:.2f} V: a short in cable or winding, or motor.resistance ({:.3f} "
                    "ohm) is far too large",
                    evidence.pulse_fault_value, evidence.largest_pulse_voltage, facts.resistance));
  result.message =
      fmt::format("{} carry current in the winding's pattern, {:.3f} ohm with the bridge's losses",
                  facts.synchronous ? "all three phases" : "both legs", resistance);
  if (facts.calibrated) {
    result.message += fmt::format(" (motor.resistance {:.3f} ohm)", facts.resistance);
    if (resistance > 3.0 * facts.resistance)
      return say(Verdict::fail, "motor cable (high resistance)",
                 result.message + ": three times is allowed; look for a loose plug or a broken strand");
  } else {
    result.message += "; the motor is not calibrated, so nothing is known to compare it with";
  }
  return result;
}

}  // namespace kmax::selftest
