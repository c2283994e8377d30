#pragma once
// Why a fit gave no result, with the numbers that decided it. Every fit has an enum of causes whose first
// enumerator is `none`, and a function to_string(cause) that says what was wrong and what to look at.

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace kmax::calibration {

template <typename Cause>
struct Finding {
  Cause cause = Cause::none;
  double found = 0.0;       // what was measured
  double allowed = 0.0;     // the bound that it crossed
  std::string_view unit{};  // of both

  bool is_none() const { return cause == Cause::none; }
};

// The cause in words, then "(found ..., bound ...)". "" for none.
template <typename Cause>
std::string to_string(const Finding<Cause>& finding) {
  if (finding.is_none()) return "";
  return fmt::format("{} (found {:.4g} {}, bound {:.4g} {})", to_string(finding.cause), finding.found,
                     finding.unit, finding.allowed, finding.unit);
}

}  // namespace kmax::calibration
