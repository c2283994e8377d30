#pragma once

#include <string>
#include <string_view>

#include "firmware/drive/stability_guard.hpp"

namespace kmax::device {

/// The name of a criterion as guard.criterion has it: "colgate".
std::string_view name_of(control::Criterion criterion);
/// "not_judged", "pass" or "fail", as guard.verdict has it.
std::string_view name_of(firmware::GuardFinding::Verdict verdict);
/// Unit of guard.value and guard.bound.
std::string_view unit_of(control::Criterion criterion);

/// What a failed stability check says: the number, its bound, the rule in short, and what to do about it;
/// which others fail too. Empty for a finding that has not failed.
std::string guard_words(const firmware::GuardFinding& finding);

}  // namespace kmax::device
