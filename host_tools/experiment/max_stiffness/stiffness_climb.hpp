#pragma once
// Paper 1's way to the largest stable stiffness (section 4.2): from a start in equal steps upwards until a
// touch is unstable; the last stable stiffness is the result. A start that is already unstable, which the
// paper does not speak of, is left downwards until a touch is stable.

#include <optional>
#include <stdexcept>

namespace kmax::experiment {

class StiffnessClimb {
 public:
  /// N/m: 0 < step, 0 < first <= last. Throws std::invalid_argument.
  StiffnessClimb(double first, double step, double last) : first_(first), step_(step), last_(last) {
    if (!(step > 0.0 && first > 0.0 && last >= first && last <= 1e7))
      throw std::invalid_argument(
          "the stiffness search needs a start and a step above 0, and an end from the start to 1e7 N/m");
  }

  /// The stiffness to touch next, N/m; none: the search is over.
  std::optional<double> next() const {
    if (given_up_ || (unstable_seen_ && stable_seen_)) return std::nullopt;
    const double stiffness = at(number_);
    if (stiffness > last_ * (1.0 + 1e-12) || stiffness < rounding * step_) return std::nullopt;
    return stiffness;
  }

  /// What next() has been found to be.
  void tell(bool stable) {
    if (stable) {
      stable_seen_ = true;
      best_ = at(number_);
    } else {
      unstable_seen_ = true;
    }
    number_ += unstable_seen_ ? -1 : 1;
  }

  /// Ends the search where it is: the touches say nothing any more.
  void give_up() { given_up_ = true; }

  /// The largest stable stiffness so far, N/m; 0: none was.
  double result() const { return best_; }
  /// Nothing was unstable up to the end.
  bool beyond_last() const { return stable_seen_ && !unstable_seen_ && !given_up_ && !next(); }

 private:
  /// Of a step: what is left of it where the way down ends at 0.
  static constexpr double rounding = 1e-9;
  /// Counted in steps, so that they add no rounding.
  double at(int number) const { return first_ + step_ * number; }

  double first_, step_, last_;
  int number_ = 0;
  bool stable_seen_ = false, unstable_seen_ = false, given_up_ = false;
  double best_ = 0.0;
};

}  // namespace kmax::experiment
