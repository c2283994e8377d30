#pragma once
// Paper 1's way to the largest stable stiffness (section 4.2), with simulated people and on a device: from a
// start upwards until a touch is unstable; the last stable stiffness is the result. Of a start that is
// already unstable the paper says nothing.

#include <optional>

namespace kmax::experiment {

/// The default begins far below the paper's 3.0 N/mm (5.0 for the adaptive wall): for a third of the
/// simulated people the plain wall is unstable there already, and a search from there says nothing of what
/// lies below.
struct StiffnessSteps {
  double first = 1000.0;  ///< N/m
  double step = 100.0;    ///< N/m: paper 1's
  double growth = 0.0;    ///< >= 0: a step of at least this share of the stiffness, for wide ranges
  double last = 40e3;     ///< N/m: the search ends there
  std::optional<double> first_adaptive{};  ///< N/m, of a law that follows the velocity; none: the first
  /// From a first stiffness that is unstable in equal steps downwards, to the largest one that is not; else
  /// the result is 0 there.
  bool goes_down = false;

  double first_of(bool adaptive) const { return adaptive ? first_adaptive.value_or(first) : first; }
};

class StiffnessClimb {
 public:
  /// `adaptive`: the law follows the velocity. Throws std::invalid_argument with the values and what is
  /// allowed.
  StiffnessClimb(const StiffnessSteps& steps, bool adaptive);

  /// The stiffness to touch next, N/m; none: the search is over.
  std::optional<double> next() const;
  /// What next() has been found to be.
  void record(bool stable);
  /// Ends the search where it is: the touches say nothing any more.
  void give_up() { given_up_ = true; }

  /// The largest stable stiffness so far, N/m; 0: none was.
  double result() const { return best_; }
  /// Nothing was unstable up to the end.
  bool beyond_last() const { return stable_seen_ && !unstable_seen_ && !given_up_ && !next(); }

 private:
  StiffnessSteps steps_;
  double first_, stiffness_;
  int number_ = 0;  ///< of steps from the first
  bool stable_seen_ = false, unstable_seen_ = false, given_up_ = false;
  double best_ = 0.0;
};

}  // namespace kmax::experiment
