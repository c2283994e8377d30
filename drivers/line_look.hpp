#pragma once

#include <concepts>

// A bridge's edges disturb lines that have no filter, for less than a microsecond. One look at such a line
// proves nothing; looks in a row do.
//
// A look is a load from a port and the loop around it, about 8 cycles at 168 MHz: 24 of them take 1.1 us, 64
// take 3 us. Contexts: any.

namespace kmax::drivers {

inline constexpr unsigned looks_that_agree = 24, most_looks = 64;

/// `active` was seen, or an edge towards it. False: it has gone again, and not come back within the looks
/// that must agree. A line that is at rest for none of that long is meant, too.
template <std::predicate Line>
constexpr bool ISR_is_meant(Line active) {
  unsigned quiet = 0;
  for (unsigned look = 0; look < most_looks; ++look) {
    quiet = active() ? 0 : quiet + 1;
    if (quiet == looks_that_agree) return false;
  }
  return true;
}

/// False at the first look at which `active` is not so.
template <std::predicate Line>
[[gnu::noinline]] constexpr bool ISR_stays(Line active) {
  for (unsigned look = 0; look < looks_that_agree; ++look) {
    if (!active()) return false;
  }
  return true;
}

}  // namespace kmax::drivers
