// Compiled for size: it runs when parameters change, and flash is what it costs.
#include "firmware/drive/stability_guard.hpp"

#include "firmware/drive/axis.hpp"

namespace kmax::firmware {

namespace {
using control::Criterion;
using control::CriterionResult;

/// Whether `a` is farther beyond its bound, or nearer to it, than `b` is to its own: value / bound compared
/// without a division. Of two bounds that no value can keep, the greater value.
bool has_less_margin(const CriterionResult<float>& a, const CriterionResult<float>& b) {
  if (a.bound <= 0.0f && b.bound <= 0.0f) return a.value > b.value;
  return a.value * b.bound > b.value * a.bound;
}

/// guard_criteria, as bits.
constexpr unsigned guard_criteria_bits = [] {
  unsigned bits = 0;
  for (const Criterion criterion : guard_criteria) bits |= 1U << static_cast<unsigned>(criterion);
  return bits;
}();

/// A failed one before any that passes.
bool is_worse(const CriterionResult<float>& a, const CriterionResult<float>& b) {
  return a.pass == b.pass ? has_less_margin(a, b) : b.pass;
}
}  // namespace

GuardFinding guard_finding(const ParameterValues& values, std::size_t axis) {
  GuardFinding finding;
  if (values.choice<GuardMode, "guard.mode">(axis) == GuardMode::off ||
      values.choice<DriveMode, "drive.mode">(axis) != DriveMode::haptic)
    return finding;
  const auto judged = stability_case(values, axis);
  CriterionResult<float> worst;
  for (const Criterion criterion : guard_criteria) {
    const auto result = control::judge_closed_form<float, guard_criteria_bits>(criterion, judged);
    if (!result.applies) continue;
    if (!result.pass)
      finding.failed = static_cast<std::uint16_t>(finding.failed | 1U << static_cast<unsigned>(criterion));
    if (!worst.applies || is_worse(result, worst)) worst = result;
  }
  if (!worst.applies) return finding;
  finding.verdict = finding.failed == 0 ? GuardFinding::Verdict::pass : GuardFinding::Verdict::fail;
  finding.criterion = worst.criterion;
  finding.value = worst.value;
  finding.bound = worst.bound;
  return finding;
}

BrokenRule check_guard(const ParameterValues& wanted, const ParameterValues& now, const ArmedAxes& armed) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    if (!armed.axis[axis] || wanted.choice<GuardMode, "guard.mode">(axis) != GuardMode::refuse) continue;
    if (guard_finding(wanted, axis).verdict != GuardFinding::Verdict::fail) continue;
    for (const std::size_t entry : guard_entries) {
      const std::size_t slot = slot_of(entry, axis);
      if (wanted.raw(slot) != now.raw(slot)) return {Refusal::guard_refused, slot};
    }
    return {Refusal::guard_refused, slot_of(guard_entries[0], axis)};
  }
  return {};
}

}  // namespace kmax::firmware
