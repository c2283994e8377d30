#pragma once
// How far a share that was counted may lie from the true one: the score interval of E. B. Wilson, "Probable
// inference, the law of succession, and statistical inference", 1927, doi:10.1080/01621459.1927.10502953. It
// says something of 3 out of 3, too, where the usual p +- 1.96 s says nothing.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace kmax::experiment {

struct ShareInterval {
  double low, high;  ///< 0 to 1
};

/// The 95 % confidence interval of a share of which `hits` of `trials` were seen, each by itself. Throws
/// std::invalid_argument without trials, or for more hits than trials.
inline ShareInterval wilson_interval(std::size_t hits, std::size_t trials) {
  if (trials == 0 || hits > trials)
    throw std::invalid_argument(
        fmt::format("confidence interval of {} of {}: needs at least one trial and no more hits than trials",
                    hits, trials));
  constexpr double z = 1.959963984540054;  // the normal distribution's 97.5 % point
  const auto n = static_cast<double>(trials);
  const double share = static_cast<double>(hits) / n, scale = 1.0 + z * z / n;
  const double middle = (share + z * z / (2.0 * n)) / scale;
  const double half = z / scale * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n));
  // The ends of 0 and of all are exact; they would be off by a rounding.
  return {hits == 0 ? 0.0 : std::max(0.0, middle - half),
          hits == trials ? 1.0 : std::min(1.0, middle + half)};
}

}  // namespace kmax::experiment
