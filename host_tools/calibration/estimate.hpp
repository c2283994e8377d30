#pragma once
// A number that was identified, and how well.
//
// standard_error is one standard deviation of the value under the fit's own assumptions (its header names
// them): 68 of 100 repetitions lie within it, 95 within twice that. It covers random errors
// only; what the model leaves out (a magnetic saturation, say) is not in it, the residual of the fit shows
// that. A value with an infinite standard error is not known.

#include <cmath>
#include <limits>
#include <string_view>

namespace kmax::calibration {

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

}  // namespace kmax::calibration
