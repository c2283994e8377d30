// The emergency stop's line and the gate driver, by what the device says when it is asked to arm.
#include <fmt/format.h>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

using firmware::Fault;
using firmware::Refusal;

namespace {
bool supply_is_missing(const Evidence& evidence) {
  return check_supply(evidence).verdict == Verdict::fail;
}

bool stopped(const Evidence& evidence) {
  return evidence.arming.refusal == Refusal::emergency_stop ||
         evidence.arming.fault == Fault::emergency_stop || evidence.pulse_fault == Fault::emergency_stop;
}
}  // namespace

CheckResult check_emergency_stop(const Evidence& evidence) {
  CheckResult result{"emergency stop", Verdict::pass, "", {}, ""};
  if (stopped(evidence)) {
    result.verdict = Verdict::fail;
    result.part = "emergency stop";
    result.message =
        "the line is open: release the button; if it is released, check its contact, plug and cable. What "
        "needs "
        "force cannot be tested meanwhile";
  } else if (evidence.arming.armed) {
    result.message = "the line is closed (whether it opens shows 'kmax selftest --hand')";
  } else {
    result.verdict = Verdict::not_judged;
    result.message = fmt::format("the device names another obstacle first: {}", evidence.arming.words());
  }
  return result;
}

CheckResult check_gate_driver(const Evidence& evidence) {
  CheckResult result{"gate driver", Verdict::pass, "", {}, ""};
  const ArmingTrial& arming = evidence.arming;
  if (!evidence.measures_currents()) {
    result.verdict = Verdict::not_judged;
    result.message = reason_without_pulses(evidence);
    return result;
  }
  const auto is = [&](Refusal refusal, Fault fault) {
    return arming.refusal == refusal || arming.fault == fault || evidence.pulse_fault == fault;
  };
  const bool reports = is(Refusal::gate_driver_fault, Fault::gate_driver);
  const bool silent = is(Refusal::power_stage_not_ready, Fault::power_stage);
  if (reports || silent) {
    if (supply_is_missing(evidence)) {
      result.verdict = Verdict::not_judged;
      result.message = "it needs the supply to answer";
      return result;
    }
    result.verdict = Verdict::fail;
    result.part = "gate driver";
    result.message =
        reports
            ? "it pulls its fault line: look for a short between phases, to ground or to the supply with the "
              "motor unplugged; if the fault stays, the driver or a transistor is broken"
            : "the power stage does not become ready although the supply is there: a gate driver does not "
              "answer or does not keep its settings; switch the board off and on, then replace it";
    return result;
  }
  if (!arming.armed) {
    result.verdict = Verdict::not_judged;
    result.message = fmt::format("the axis cannot be armed: {}", arming.words());
    return result;
  }
  result.message = "ready, no fault, before and during the pulses";
  return result;
}

}  // namespace kmax::selftest
