#include "host_tools/selftest/evidence.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kmax::selftest {

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
  if (!evidence.response && evidence.handle_was_moved()) return "something else moved the handle";
  if (!evidence.response) return "no pulse could be given";
  return {};
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
