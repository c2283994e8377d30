#pragma once

#include <algorithm>
#include <array>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

/// Which axes make force.
struct ArmedAxes {
  std::array<bool, axis_count> axis{};

  constexpr ArmedAxes() = default;
  /// All or none.
  constexpr ArmedAxes(bool all) { axis.fill(all); }  // NOLINT(google-explicit-constructor)

  constexpr bool any() const { return std::find(axis.begin(), axis.end(), true) != axis.end(); }
};

}  // namespace kmax::firmware
