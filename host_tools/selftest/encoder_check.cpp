// Does the encoder answer, and does it see the motion that the motor makes?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

using firmware::Fault;
using firmware::Refusal;

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
  CheckResult result{"encoder", Verdict::pass, "", {}, ""};
  const AxisFacts& facts = evidence.facts;
  const auto say = [&](Verdict verdict, const char* part, const std::string& message) {
    result.verdict = verdict;
    result.part = part;
    result.message = message;
    return result;
  };
  if (evidence.arming.refusal == Refusal::encoder_invalid || evidence.arming.fault == Fault::encoder ||
      evidence.pulse_fault == Fault::encoder)
    return say(
        Verdict::fail, "encoder",
        "it gives no valid count: check its plug, cable and supply, and encoder.kind; then switch the device "
        "off and on");
  std::string at_rest = "its count is valid";
  if (evidence.rest && !evidence.rest->position.empty()) {
    const double noise = jitter(evidence);
    result.values.push_back({"jitter_at_rest", noise, "counts"});
    at_rest += fmt::format(", at rest it jumps by {:.0f} counts at most", noise);
    if (noise > 5.0)
      return say(Verdict::fail, "encoder",
                 at_rest +
                     " from one tick to the next; allowed is 5: check its cable, shield and supply, and the "
                     "magnet of a magnetic one");
  }
  if (!evidence.motion) {
    std::string reason = reason_without_pulses(evidence);
    if (reason.empty())
      reason = evidence.pulse_fault == Fault::none
                   ? "the motor's circuit must be right first"
                   : fmt::format("a pulse was ended by a fault ({})",
                                 firmware::text_of(evidence.pulse_fault).what);
    return say(Verdict::not_judged, "",
               fmt::format("{}; whether it sees motion is not judged: {}", at_rest, reason));
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
      return say(
          Verdict::fail, "encoder",
          seen +
              ": the motor turns and the encoder does not see it: check its plug and cable, and whether "
              "its disc, magnet or hub is loose");
    if (motion.back_emf_would_show())
      return say(
          Verdict::fail, "handle (blocked or held)",
          seen +
              ": a handle that moves would induce a voltage, and there is none: something blocks the handle "
              "or motor, or a hand holds it; the encoder cannot be judged meanwhile");
    return say(
        Verdict::fail, "encoder or handle (no motion seen)",
        seen +
            ": no motion was seen, and the motor's back-EMF is too small here to tell a dead encoder from "
            "a blocked handle; move the handle by hand with 'kmax selftest --hand'");
  }
  if (!facts.calibrated)
    return say(Verdict::pass, "",
               seen + ": it moves; its direction and scale are for 'kmax calibrate' to find");
  if (!facts.synchronous && motion.by_encoder < 0.0)
    return say(
        Verdict::fail, "direction of the encoder or the motor leads",
        seen +
            ", but against the force: the encoder's lines A and B or the motor's two leads are exchanged "
            "(for a DC motor that is the same), or encoder.direction is wrong: run 'kmax calibrate'");
  if (motion.back_emf_moved()) {
    const EncoderScale scale = encoder_scale(motion);
    result.values.push_back({"encoder_to_back_emf", scale.ratio, ""});
    if (scale.wrong())
      return say(
          Verdict::fail, "encoder (slips or wrong scale)",
          fmt::format(
              "{}: {:.2f} of the motor's motion; allowed is 0.8 .. 1.25: its hub or coupling slips, or "
              "encoder.counts_per_turn or motor.torque_constant is wrong",
              seen, scale.ratio));
  }
  if (!facts.synchronous) return say(Verdict::pass, "", seen + ", in the direction of the force");
  if (!facts.commutation_known)
    return say(
        Verdict::pass, "",
        seen +
            "; whether its direction fits the phases is not judged, since the commutation is not known "
            "since the last start");
  const double error = commutation_error(evidence);
  result.values.push_back({"commutation_error", error, "rad"});
  const double degrees = std::abs(error) * 180.0 / std::numbers::pi;
  if (degrees > 150.0)
    return say(
        Verdict::fail, "direction of the encoder",
        fmt::format(
            "{}, but against the force (the commutation is off by {:.0f} degrees): the encoder's lines "
            "A and B are exchanged, or encoder.direction is wrong: run 'kmax calibrate'",
            seen, degrees));
  if (degrees > allowed_degrees)
    return say(
        Verdict::fail, "order of the phases or motor.electrical_offset",
        fmt::format(
            "{}, but the rotor stands {:.0f} electrical degrees from where the commutation takes it to "
            "be; allowed are {:.0f}: two phases are exchanged, or the encoder has moved on the shaft: run "
            "'kmax calibrate'",
            seen, degrees, allowed_degrees));
  return say(Verdict::pass, "",
             fmt::format("{}; the commutation is off by {:.0f} electrical degrees, allowed are {:.0f}", seen,
                         degrees, allowed_degrees));
}

}  // namespace kmax::selftest
