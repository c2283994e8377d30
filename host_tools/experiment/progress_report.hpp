#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

namespace kmax::experiment {

/// How long jobs that take about equally long will still take, from how long those have taken that ended
/// since this began. Time is an argument: seconds of any clock that does not run backwards (a step back
/// counts as no time).
class RemainingTime {
 public:
  /// `done`: jobs of an earlier run, which cost nothing now.
  explicit RemainingTime(double now, std::size_t done = 0) : begin_(now), before_(done) {}

  /// Seconds; nothing as long as no job has ended, 0 when all have.
  std::optional<double> seconds(double now, std::size_t done, std::size_t count) const;

 private:
  double begin_;
  std::size_t before_;
};

/// As precise as an estimate is: "5 s", "50 s", "4 min", "2 h 10 min", "3 days". Not finite or negative:
/// "some time".
std::string duration_words(double seconds);

/// "12 of 96 done, 40 s left".
std::string progress_words(std::size_t done, std::size_t count, const std::optional<double>& remaining);

/// Told how many of the jobs are done. What it throws ends the run: so Ctrl-C is noticed.
using ProgressReport = std::function<void(std::size_t done, std::size_t count)>;

/// A part of a whole that takes `shares` equal times, as the whole's progress: `before` shares come before
/// the part, which takes `own` of them. `whole` may be empty; it must live as long as what is returned.
inline ProgressReport part_of(const ProgressReport& whole, std::size_t before, std::size_t own,
                              std::size_t shares) {
  return [progress = &whole, before, own, shares](std::size_t done, std::size_t count) {
    if (*progress) (*progress)(before * count + own * done, shares * count);
  };
}

}  // namespace kmax::experiment
