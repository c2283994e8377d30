#pragma once

#include <array>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

/// Which axes make force.
struct ArmedAxes {
  std::array<bool, axis_count> axis{};

  constexpr ArmedAxes() = default;
  /// All or none.
  constexpr ArmedAxes(bool all) { axis.fill(all); }  // NOLINT(google-explicit-constructor)

  constexpr bool any() const {
    bool some = false;
    for (const bool one : axis) some = some || one;
    return some;
  }
};

}  // namespace kmax::firmware
