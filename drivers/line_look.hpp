#pragma once

#include <concepts>

// A bridge's edges disturb lines that have no filter, for less than a microsecond. One look at such a line
// proves nothing; looks in a row do.
//
// As the virtual board counts, a look at a line of the gates takes 0.12 us at 168 MHz: 10 of them 1.2 us, 26
// of them 3 us. While the bridges are off for that, a motor loses a tenth of an ampere. A look at an index
// takes half as long. Contexts: any.

namespace kmax::drivers {

inline constexpr unsigned looks_that_agree = 10, most_looks = 26;
inline constexpr unsigned looks_that_prove = 24;

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
  for (unsigned look = 0; look < looks_that_prove; ++look) {
    if (!active()) return false;
  }
  return true;
}

}  // namespace kmax::drivers
