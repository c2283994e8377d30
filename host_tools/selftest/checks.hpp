#pragma once
// The verdicts of the self-test, each on one part of the axis.

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

enum class Verdict { pass, fail, not_judged };

constexpr const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::fail:
      return "fail";
    case Verdict::not_judged:
      return "not judged";
  }
  return "unknown";
}

/// A number that a check has measured, and where it should be; SI units.
struct MeasuredValue {
  std::string name;
  double value = 0.0;
  std::string unit;
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

/// What one check found. `message` says what was measured, what is allowed, and what to do.
struct CheckResult {
  std::string name{};
  Verdict verdict = Verdict::not_judged;
  std::string message{};
  std::vector<MeasuredValue> values{};
  std::string part{};  ///< what is faulty, in words, when the verdict is `fail`

  CheckResult& conclude(Verdict reached, std::string why, std::string faulty_part = {}) {
    verdict = reached;
    message = std::move(why);
    part = std::move(faulty_part);
    return *this;
  }
  CheckResult& pass(std::string why) { return conclude(Verdict::pass, std::move(why)); }
  CheckResult& fail(std::string faulty_part, std::string why) {
    return conclude(Verdict::fail, std::move(why), std::move(faulty_part));
  }
  CheckResult& not_judged(std::string why) { return conclude(Verdict::not_judged, std::move(why)); }
};

/// All checks in the order in which faults act: what stands earlier explains what stands later.
struct Report {
  std::vector<CheckResult> checks;
  double largest_displacement = 0.0;  ///< m, of the handle from where it was at the start, by the encoder
  std::optional<FaultAtStart> fault_at_start{};

  /// The first check that failed, if any.
  const CheckResult* first_failure() const {
    for (const CheckResult& check : checks) {
      if (check.verdict == Verdict::fail) return &check;
    }
    return nullptr;
  }
  bool pass() const { return first_failure() == nullptr; }
};

// A check says `not_judged` with the reason when what it needs could not be measured.
CheckResult check_link(const Evidence& evidence);
CheckResult check_supply(const Evidence& evidence);
CheckResult check_emergency_stop(const Evidence& evidence);
CheckResult check_gate_driver(const Evidence& evidence);
CheckResult check_temperature(const Evidence& evidence);
CheckResult check_handle(const Evidence& evidence);
CheckResult check_current_sense(const Evidence& evidence);
CheckResult check_phases(const Evidence& evidence);
CheckResult check_encoder(const Evidence& evidence);

/// In the order in which faults act on what follows.
std::vector<CheckResult> run_checks(const Evidence& evidence);

/// One sentence: the faulty part and what it explains, or that none was found.
std::string conclusion(const Report& report);

}  // namespace kmax::selftest
