#pragma once
// Whether tests try all that they can, for hours if need be, or what is worth minutes at each change.

#include <cstdlib>

namespace kmax {

/// KMAX_SOAK is in the environment: docs/soak.md. Tests pass either way; a soak tries more of the same.
inline bool in_a_soak() {
  return std::getenv("KMAX_SOAK") != nullptr;
}

}  // namespace kmax
