#pragma once
// What Table II says about the hand, taken as quasi-static:
//
//   Dev = max(0, F_I - D - c F_B) / (k (1 + gamma F_B))
//
// k: stiffness of the hand along the surface without F_B; D: the force that it resists without moving; gamma:
// how F_B raises the stiffness; c: how F_B raises the force resisted instead. The question is whether the
// table tells gamma from c. Least squares over its sixteen cells by Levenberg and Marquardt's method, from
// several starts; the standard errors are those of the linearised problem.

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {

struct HandResistance {
  double stiffness = 240.0;     ///< k, N/m
  double threshold = 2.75;      ///< D, N
  double stiffening = 0.0;      ///< gamma, 1/N
  double threshold_rise = 0.0;  ///< c
};

/// m
double quasi_static_deviation(const HandResistance& hand, double background, double interference);

struct FitKind {
  std::string_view name;
  bool stiffening, threshold_rise;  ///< which of gamma and c are fitted; the others are 0
};
inline constexpr FitKind fit_neither{"neither", false, false};
inline constexpr FitKind fit_stiffening{"stiffening (gamma)", true, false};
inline constexpr FitKind fit_threshold{"rising threshold (c)", false, true};
inline constexpr FitKind fit_both{"both", true, true};

struct DeviationFit {
  FitKind kind;
  HandResistance hand;
  HandResistance error;  ///< standard errors; 0 for what was not fitted
  double rms = 0.0;      ///< m, root of the mean square residual
  std::size_t cells = 0;
};

/// Throws std::invalid_argument for fewer cells than fitted numbers.
DeviationFit fit_deviation(std::span<const paper::DeviationCell> cells, const FitKind& kind);

/// The four kinds for the paper's table.
std::vector<DeviationFit> fit_table_2();

}  // namespace kmax::experiment
