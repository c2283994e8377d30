// The handle, the current sensors, the phases and the encoder: what the pulses show of the motor.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_tools/selftest/checks.hpp"

namespace kmax::selftest {

using firmware::Fault;
using firmware::Refusal;

CheckResult check_handle(const Evidence& evidence) {
  CheckResult result{"handle"};
  if (evidence.arming.refusal == Refusal::encoder_invalid || evidence.arming.fault == Fault::encoder ||
      evidence.pulse_fault == Fault::encoder)
    return result.not_judged("where it is nobody knows: the encoder gives no valid count");
  result.values = {
      {"largest_displacement", evidence.largest_displacement, "m", 0.0, Evidence::most_displacement}};
  const std::string seen = fmt::format("it moved by {:.2f} mm at most", evidence.largest_displacement * 1e3);
  const std::string allowed = fmt::format("allowed is {:.0f} mm", Evidence::most_displacement * 1e3);
  if (!evidence.handle_was_moved())
    return result.pass(
        fmt::format("{}; {}{}", seen, allowed,
                    evidence.pulse_fault == Fault::excitation_travel
                        ? "; a pulse moved it far enough for excitation.travel to end the test there"
                        : ""));
  const bool tripped =
      evidence.arming.fault == Fault::excitation_travel || evidence.pulse_fault == Fault::excitation_travel;
  const char* how = tripped                   ? ", and excitation.travel took the axis out of operation"
                    : evidence.pulse_withheld ? ", and stood where the test had not left it"
                                              : "";
  return result.fail(
      "handle",
      fmt::format(
          "{}{}; {}: something else moved the handle; let go of it, see that nothing pulls at it, and start "
          "again. If nobody touched it, the encoder counts what is not there, or the motor is far stronger "
          "or the handle far lighter than motor.torque_constant and device.mass say",
          seen, how, allowed));
}

namespace {
struct CircuitFault {
  Circuit circuit;
  const char* part;
  const char* words;
};
constexpr CircuitFault sensor_faults[] = {
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

std::string numbers(const PhaseFinding& phases) {
  std::string text;
  for (const bench::SensorAnswer& answer : phases.answers)
    text += fmt::format("{}{:+.2f} and {:+.2f}", text.empty() ? "" : "; ", answer.b, answer.c);
  return text;
}
}  // namespace

CheckResult check_current_sense(const Evidence& evidence) {
  CheckResult result{"current sense"};
  if (!evidence.measures_currents()) return result.not_judged(reason_without_pulses(evidence));
  if (evidence.arming.refusal == Refusal::current_sense_invalid ||
      evidence.arming.fault == Fault::current_sense || evidence.pulse_fault == Fault::current_sense)
    return result.fail(
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
    result.values = {{"offset_b", b.mean, "A", -allowed, allowed},
                     {"offset_c", c.mean, "A", -allowed, allowed},
                     {"noise_b", b.deviation, "A", 0.0, allowed},
                     {"noise_c", c.deviation, "A", 0.0, allowed}};
    at_rest = fmt::format(
        "bridge off: B {:+.3f} A, noise {:.3f} A; C {:+.3f} A, noise {:.3f} A; allowed is {:.2f} A each",
        b.mean, b.deviation, c.mean, c.deviation, allowed);
    const bool bad_b = !(std::abs(b.mean) <= allowed && b.deviation <= allowed);
    const bool bad_c = !(std::abs(c.mean) <= allowed && c.deviation <= allowed);
    if (evidence.arming.armed && (bad_b || bad_c))
      return result.fail(bad_b && bad_c ? "current sensors B and C"
                         : bad_b        ? "current sensor B"
                                        : "current sensor C",
                         at_rest + ": check the shunt and its amplifier, and what disturbs them");
  }
  if (!evidence.phases)
    return result.not_judged(
        fmt::format("{}; not looked at with current: {}", at_rest, reason_without_pulses(evidence)));
  const PhaseFinding& phases = *evidence.phases;
  const std::string seen = fmt::format("{}; under pulses B and C answered with {} of the winding's current",
                                       at_rest, numbers(phases));
  for (const CircuitFault& one : sensor_faults) {
    if (phases.circuit == one.circuit) return result.fail(one.part, fmt::format("{}: {}", seen, one.words));
  }
  switch (phases.circuit) {
    case Circuit::nothing_flows:
      return result.not_judged(at_rest + "; no current flowed that they could have shown");
    case Circuit::unclear:
      if (evidence.pulse_fault == Fault::current_sum)
        return result.fail(
            "current sense",
            fmt::format("{}: the currents do not add up to zero ({:.2f} A are missing): one sensor's gain "
                        "is wrong, or current leaks from the motor to ground; unplug the motor to tell",
                        seen, evidence.pulse_fault_value));
      return result.not_judged(seen + ": that fits no single fault");
    default:
      return result.pass(seen + (phases.circuit == Circuit::healthy
                                     ? ": signs and gains agree"
                                     : ": both sensors answer with the right sign"));
  }
}

namespace {
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
  CheckResult result{"phases"};
  const AxisFacts& facts = evidence.facts;
  if (!evidence.phases) return result.not_judged(reason_without_pulses(evidence));
  const PhaseFinding& phases = *evidence.phases;
  const double resistance = phases.admittance > 0.0 ? phases.judged_resistance / phases.admittance : 0.0;
  if (phases.admittance > 0.0)
    result.values = {{"resistance", resistance, "ohm"}, {"pattern_residual", phases.residual, ""}};
  for (const CircuitFault& one : circuit_faults) {
    if (phases.circuit != one.circuit) continue;
    const bool open = phases.circuit == Circuit::open_a || phases.circuit == Circuit::open_b ||
                      phases.circuit == Circuit::open_c;
    return result.fail(
        one.part, fmt::format("{}: check {}", one.words,
                              open ? "its wire, plug, solder joint and winding"
                                   : "cable and winding, with the motor unplugged from the board first"));
  }
  const bool over_current = evidence.pulse_fault == Fault::over_current;
  switch (phases.circuit) {
    case Circuit::nothing_flows: {
      const std::string seen = fmt::format("no current flows at {:.2f} V", evidence.largest_pulse_voltage);
      return facts.synchronous
                 ? result.fail("motor cable (two or three phases open)",
                               seen + " between any two phases: is the motor plugged in?")
                 : result.fail(
                       "motor winding or cable (B to C open)",
                       seen +
                           ": is the motor plugged in? A DC motor is one circuit: whether the lead of B, "
                           "that of C, the brushes or the winding is open cannot be seen from here");
    }
    case Circuit::short_circuit:
      return result.fail(
          facts.synchronous ? "motor winding (short)" : "motor winding or cable (B to C short)",
          fmt::format("the circuit has {:.3f} ohm where motor.resistance says {:.3f} ohm: a short in cable "
                      "or winding, unless motor.resistance is wrong",
                      resistance, facts.resistance));
    case Circuit::healthy:
      break;
    case Circuit::unclear:
      if (over_current)
        return result.fail("motor winding or cable (short)",
                           fmt::format("{:.1f} A flowed at {:.2f} V: a short in cable or winding",
                                       evidence.pulse_fault_value, evidence.largest_pulse_voltage));
      return result.not_judged("the currents fit no single fault; see current sense");
    default:
      return result.not_judged("the current sensors must be right first");
  }
  if (over_current)
    return result.fail(
        "motor winding or cable (short)",
        fmt::format("{:.1f} A flowed at {:.2f} V: a short in cable or winding, or motor.resistance ({:.3f} "
                    "ohm) is far too large",
                    evidence.pulse_fault_value, evidence.largest_pulse_voltage, facts.resistance));
  const std::string measured =
      fmt::format("{} carry current in the winding's pattern, {:.3f} ohm with the bridge's losses",
                  facts.synchronous ? "all three phases" : "both legs", resistance);
  if (!facts.calibrated)
    return result.pass(measured + "; the motor is not calibrated, so nothing is known to compare it with");
  const std::string compared = fmt::format("{} (motor.resistance {:.3f} ohm)", measured, facts.resistance);
  if (resistance > 3.0 * facts.resistance)
    return result.fail("motor cable (high resistance)",
                       compared + ": three times is allowed; look for a loose plug or a broken strand");
  return result.pass(compared);
}

namespace {
/// Counts from one sample to the next at rest: noise, whatever a hand does.
double jitter(const Evidence& evidence) {
  double largest = 0.0;
  const auto& position = evidence.rest->position;
  for (std::size_t k = 1; k < position.size(); ++k)
    largest = std::max(largest, std::abs(position[k] - position[k - 1]));
  return largest / evidence.facts.count_length;
}

/// Electrical angle that the commutation would use here, less the one that the pulses have found, -pi .. pi.
double commutation_error(const Evidence& evidence) {
  const AxisFacts& facts = evidence.facts;
  const double turn = 2.0 * std::numbers::pi;
  const double counts = evidence.swings.front().position.front() / facts.count_length;
  const double used = counts / facts.counts_per_turn * facts.pole_pairs * turn + facts.electrical_offset;
  return std::remainder(used - *evidence.motion->rotor_angle, turn);
}
}  // namespace

EncoderScale encoder_scale(const MotionEvidence& motion) {
  EncoderScale scale;
  scale.ratio = std::abs(motion.by_encoder) / motion.by_back_emf;
  scale.deviation = scale.ratio * std::hypot(motion.back_emf_deviation / motion.back_emf,
                                             motion.encoder_deviation / motion.by_encoder);
  return scale;
}

CheckResult check_encoder(const Evidence& evidence) {
  constexpr double allowed_degrees = 20.0;
  CheckResult result{"encoder"};
  const AxisFacts& facts = evidence.facts;
  if (evidence.arming.refusal == Refusal::encoder_invalid || evidence.arming.fault == Fault::encoder ||
      evidence.pulse_fault == Fault::encoder)
    return result.fail(
        "encoder",
        "it gives no valid count: check its plug, cable and supply, and encoder.kind; then switch the device "
        "off and on");
  std::string at_rest = "its count is valid";
  if (evidence.rest && !evidence.rest->position.empty()) {
    const double noise = jitter(evidence);
    result.values.push_back({"jitter_at_rest", noise, "counts", 0.0, 5.0});
    at_rest += fmt::format(", at rest it jumps by {:.0f} counts at most", noise);
    if (noise > 5.0)
      return result.fail(
          "encoder",
          at_rest +
              " from one tick to the next; allowed is 5: check its cable, shield and supply, and the magnet "
              "of a magnetic one");
  }
  if (!evidence.motion) {
    std::string reason = reason_without_pulses(evidence);
    if (reason.empty())
      reason = evidence.pulse_fault == Fault::none
                   ? "the motor's circuit must be right first"
                   : fmt::format("a pulse was ended by a fault ({})",
                                 firmware::text_of(evidence.pulse_fault).what);
    return result.not_judged(fmt::format("{}; whether it sees motion is not judged: {}", at_rest, reason));
  }
  const MotionEvidence& motion = *evidence.motion;
  result.values.insert(result.values.end(), {{"motion_by_encoder", motion.encoder_excursion, "m"},
                                             {"motion_by_back_emf", motion.back_emf_excursion, "m"},
                                             {"free_handle_answer", motion.free_handle, "m/(A s2)"},
                                             {"encoder_answer", motion.by_encoder, "m/(A s2)"},
                                             {"back_emf_answer", motion.by_back_emf, "m/(A s2)"}});
  const std::string seen =
      fmt::format("{}; in the swing the encoder saw {:.3f} mm, the motor's back-EMF stands for {:.3f} mm",
                  at_rest, motion.encoder_excursion * 1e3, motion.back_emf_excursion * 1e3);
  if (!motion.encoder_moved()) {
    if (motion.back_emf_moved())
      return result.fail(
          "encoder",
          seen +
              ": the motor turns and the encoder does not see it: check its plug and cable, and whether its "
              "disc, magnet or hub is loose");
    if (motion.back_emf_would_show())
      return result.fail(
          "handle (blocked or held)",
          seen +
              ": a handle that moves would induce a voltage, and there is none: something blocks the handle "
              "or motor, or a hand holds it; the encoder cannot be judged meanwhile");
    return result.fail(
        "encoder or handle (no motion seen)",
        seen +
            ": no motion was seen, and the motor's back-EMF is too small here to tell a dead encoder from a "
            "blocked handle; move the handle by hand with 'kmax selftest --hand'");
  }
  if (!facts.calibrated)
    return result.pass(seen + ": it moves; its direction and scale are for 'kmax calibrate' to find");
  if (!facts.synchronous && motion.by_encoder < 0.0)
    return result.fail(
        "direction of the encoder or the motor leads",
        seen +
            ", but against the force: the encoder's lines A and B or the motor's two leads are exchanged "
            "(for a DC motor that is the same), or encoder.direction is wrong: run 'kmax calibrate'");
  if (motion.back_emf_moved()) {
    const EncoderScale scale = encoder_scale(motion);
    result.values.push_back(
        {"encoder_to_back_emf", scale.ratio, "", EncoderScale::least, EncoderScale::most});
    if (scale.wrong())
      return result.fail(
          "encoder (slips or wrong scale)",
          fmt::format(
              "{}: {:.2f} of the motor's motion; allowed is 0.8 .. 1.25: its hub or coupling slips, or "
              "encoder.counts_per_turn or motor.torque_constant is wrong",
              seen, scale.ratio));
  }
  if (!facts.synchronous) return result.pass(seen + ", in the direction of the force");
  if (!facts.commutation_known)
    return result.pass(
        seen +
        "; whether its direction fits the phases is not judged, since the commutation is not known since the "
        "last start");
  const double error = commutation_error(evidence);
  constexpr double allowed_error = allowed_degrees * std::numbers::pi / 180.0;
  result.values.push_back({"commutation_error", error, "rad", -allowed_error, allowed_error});
  const double degrees = std::abs(error) * 180.0 / std::numbers::pi;
  if (degrees > 150.0)
    return result.fail(
        "direction of the encoder",
        fmt::format(
            "{}, but against the force (the commutation is off by {:.0f} degrees): the encoder's lines A and "
            "B are exchanged, or encoder.direction is wrong: run 'kmax calibrate'",
            seen, degrees));
  if (degrees > allowed_degrees)
    return result.fail(
        "order of the phases or motor.electrical_offset",
        fmt::format(
            "{}, but the rotor stands {:.0f} electrical degrees from where the commutation takes it to be; "
            "allowed are {:.0f}: two phases are exchanged, or the encoder has moved on the shaft: run 'kmax "
            "calibrate'",
            seen, degrees, allowed_degrees));
  return result.pass(
      fmt::format("{}; the commutation is off by {:.0f} electrical degrees, allowed are {:.0f}", seen,
                  degrees, allowed_degrees));
}

std::vector<CheckResult> run_checks(const Evidence& evidence) {
  return {check_link(evidence),          check_supply(evidence),      check_emergency_stop(evidence),
          check_gate_driver(evidence),   check_temperature(evidence), check_handle(evidence),
          check_current_sense(evidence), check_phases(evidence),      check_encoder(evidence)};
}

std::string conclusion(const Report& report) {
  const CheckResult* failure = report.first_failure();
  if (failure == nullptr) {
    std::string unjudged;
    for (const CheckResult& check : report.checks) {
      if (check.verdict == Verdict::not_judged) unjudged += (unjudged.empty() ? "" : ", ") + check.name;
    }
    return unjudged.empty() ? "No fault was found."
                            : fmt::format("No fault was found; not judged: {}.", unjudged);
  }
  std::string explained;
  for (const CheckResult& check : report.checks) {
    if (&check == failure) continue;
    if (check.verdict == Verdict::fail) explained += (explained.empty() ? "" : ", ") + check.name;
  }
  if (explained.empty()) return fmt::format("The faulty part is: {}.", failure->part);
  return fmt::format("The faulty part is: {}; mend it first, it may explain what else failed ({}).",
                     failure->part, explained);
}

}  // namespace kmax::selftest
