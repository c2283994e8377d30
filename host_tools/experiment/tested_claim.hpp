#pragma once
// What an experiment answers to a claim: that it holds, that it does not, or that nothing it did tests it.
// The third is no finding, and a "no" in its place would be one.

#include <algorithm>
#include <optional>
#include <vector>

namespace kmax::experiment {

/// Nothing: not tested. Compare with `== true` or `== false`: as a condition it tells only whether it was.
using TestedClaim = std::optional<bool>;

/// Does each of them hold? One that does not is enough for a no; without one, the answer is open as long as
/// any is, and when there are none.
inline TestedClaim all_hold(const std::vector<TestedClaim>& claims) {
  const auto contains = [&](const TestedClaim& claim) {
    return std::find(claims.begin(), claims.end(), claim) != claims.end();
  };
  if (contains(false)) return false;
  if (claims.empty() || contains(std::nullopt)) return std::nullopt;
  return true;
}

}  // namespace kmax::experiment
