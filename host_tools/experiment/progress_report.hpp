#pragma once

#include <cstddef>
#include <functional>

namespace kmax::experiment {

/// Told how many of the jobs are done. What it throws ends the run: so Ctrl-C is noticed.
using ProgressReport = std::function<void(std::size_t done, std::size_t count)>;

/// A part of a whole that takes `shares` equal times, as the whole's progress: `before` shares come before
/// the part, which takes `own` of them. `whole` may be empty; it must live as long as what is returned.
inline ProgressReport part_of(const ProgressReport& whole, std::size_t before, std::size_t own,
                              std::size_t shares) {
  return [tell = &whole, before, own, shares](std::size_t done, std::size_t count) {
    if (*tell) (*tell)(before * count + own * done, shares * count);
  };
}

}  // namespace kmax::experiment
