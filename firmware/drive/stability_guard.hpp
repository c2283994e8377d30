#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "control/closed_form_criteria.hpp"
#include "firmware/drive/armed_axes.hpp"
#include "firmware/drive/stability_case.hpp"
#include "firmware/parameters/parameter_rules.hpp"

namespace kmax::firmware {

/// guard.mode, in its numbers.
enum class GuardMode : std::uint8_t { off = 0, warn = 1, refuse = 2 };

/// What the stability check says of an axis' parameters; its members are the readings guard.*.
struct GuardFinding {
  enum class Verdict : std::uint8_t { not_judged = 0, pass = 1, fail = 2 };

  Verdict verdict = Verdict::not_judged;
  /// The one with the least margin: among the failed ones, or among all that apply when none failed.
  control::Criterion criterion = control::Criterion::colgate;
  std::uint16_t failed = 0;  ///< bit n: criterion number n
  float value = 0.0f;        ///< in the criterion's unit, see control/closed_form_criteria.hpp
  float bound = 0.0f;

  friend constexpr bool operator==(const GuardFinding&, const GuardFinding&) = default;
};

/// The criteria that are judged before arming: the closed ones that say something of stability. Those that
/// need to know the hand or eigenvalues are the host's ('kmax check').
inline constexpr std::array guard_criteria = {
    control::Criterion::colgate, control::Criterion::abbott_okamura, control::Criterion::resolution,
    control::Criterion::resolution_speed, control::Criterion::field_slope};

/// What of an axis the check reads, the wall first: the entries of the dictionary, of which an armed axis may
/// change some.
inline constexpr auto guard_entries = [] {
  constexpr auto guarded = std::ranges::count_if(case_parameters, &CaseParameter::guard);
  std::array<std::uint8_t, guarded + 2> entries{};
  std::size_t count = 0;
  for (const CaseParameter& parameter : case_parameters) {
    if (parameter.guard) entries[count++] = parameter.entry;
  }
  entries[count++] = entry_of<"guard.mode">();
  entries[count] = entry_of<"drive.mode">();
  return entries;
}();

/// The stability check of one axis' parameters (stability_case.hpp). Not judged where guard.mode is off,
/// where drive.mode renders no wall, and for a law that makes no force. Value and bound are finite for every
/// set of allowed parameters.
///
/// Main loop: two divisions in double, a dozen in float. No failure.
GuardFinding guard_finding(const ParameterValues& values, std::size_t axis);

/// The rule for armed axes whose guard.mode is refuse: no change from `now` may break a criterion, or the
/// check before arming could be walked round. Reported on the first of guard_entries that would change.
BrokenRule check_guard(const ParameterValues& wanted, const ParameterValues& now, const ArmedAxes& armed);

static_assert(
    [] {
      for (const NamedValue& name : names::guard_criterion) {
        if (static_cast<std::size_t>(name.value) >= control::criterion_count) return false;
      }
      return std::size(names::guard_criterion) == control::criterion_count;
    }(),
    "guard.criterion names every criterion");

}  // namespace kmax::firmware
