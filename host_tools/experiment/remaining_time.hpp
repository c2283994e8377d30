#pragma once

#include <cstddef>
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

}  // namespace kmax::experiment
