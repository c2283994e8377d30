#pragma once
// A number that was identified, and how well; or why there is none.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

namespace kmax::calibration {

// standard_error is one standard deviation of the value under the fit's own assumptions (its header names
// them): 68 of 100 repetitions lie within it, 95 within twice that. It covers random errors only; what the
// model leaves out (a magnetic saturation, say) is not in it, the residual of the fit shows that. A value
// with an infinite standard error is not known.
struct Estimate {
  double value = 0.0;
  double standard_error = std::numeric_limits<double>::infinity();
  std::string_view unit{};

  bool known() const { return std::isfinite(value) && std::isfinite(standard_error); }
  // Of the value's magnitude; infinite for an unknown or zero value.
  double relative_error() const {
    return known() && value != 0.0 ? standard_error / std::abs(value)
                                   : std::numeric_limits<double>::infinity();
  }
};

// Why a fit gave no result, with the numbers that decided it. Every fit has an enum of causes whose first
// enumerator is `none`, and a function to_string(cause) that says what was wrong and what to look at.
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
