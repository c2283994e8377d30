#include "host_tools/serve/pace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace kmax::serve {

void Pace::passed(Time real) {
  constexpr Time most_behind = std::chrono::milliseconds(50);
  due_ += real;
  const Time beyond = std::max(due_ - most_behind, Time{});
  due_ -= beyond;
  given_up_ += beyond;
  if (say_) watch(real, beyond);
}

void Pace::watch(Time real, Time given_up) {
  constexpr Time window = std::chrono::seconds(5), longest_hold_up = std::chrono::milliseconds(500);
  constexpr double slow = 0.8;
  watched_ += std::min(real, longest_hold_up);
  given_up_meanwhile_ += std::min(given_up, longest_hold_up);
  if (watched_ < window) return;
  const double share =
      static_cast<double>((watched_ - given_up_meanwhile_).count()) / static_cast<double>(watched_.count());
  watched_ = given_up_meanwhile_ = {};
  if (share >= slow) return;
  std::exchange(say_, nullptr)(fmt::format(
      "this machine is too slow or busy: over the last 5 s the simulation ran at {:.0f} % of real time, so a "
      "second of it takes {:.1f} s. Waits take that much longer, and links may report errors",
      100.0 * share, 1.0 / share));
}

}  // namespace kmax::serve
