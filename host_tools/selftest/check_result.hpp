#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware/fault.hpp"

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

/// A number that a check has measured; SI units.
struct MeasuredValue {
  std::string name;
  double value = 0.0;
  std::string unit;
};

/// What one check found. `message` says what was measured, what is allowed, and what to do.
struct CheckResult {
  std::string name;
  Verdict verdict = Verdict::not_judged;
  std::string message;
  std::vector<MeasuredValue> values{};
  std::string part{};  ///< what is faulty, in words, when the verdict is `fail`
};

/// A fault that the axis had before the test, which a test cannot leave as it is.
struct FaultAtStart {
  firmware::Fault fault = firmware::Fault::none;  ///< none: one that this program does not know
  std::string words;                              ///< with the number that tripped it
  bool cleared = false;                           ///< else its cause remains
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

}  // namespace kmax::selftest
