#pragma once
// A constant delay between a command and its force. Commands are held, so the delayed force is a staircase
// whose steps come later by the delay, which need not be a multiple of the command's interval: within one
// interval the force may change once or more, and the one who integrates stops at each change.
//
//   delay.command(force, duration);                 // this is commanded for the next `duration` seconds
//   for (double left = duration; left > 0.0;) {
//     const double piece = delay.piece(left);       // the force is constant for so long
//     ... delay.force() acts for `piece` ...
//     delay.pass(piece);
//     left = piece == left ? 0.0 : left - piece;
//   }
//
// Before the first command arrives the force is 0. A change that would fall within 1e-12 of the interval
// (plus the rounding of the delay) of either end of a piece is taken to fall on it, so no slivers arise when
// the delay is a whole number of intervals. For equal intervals the pieces are equal too, to the last bit,
// from the second interval on. Memory: one entry per command under way; grows to the largest number of them
// and stays.

#include <cstddef>
#include <limits>
#include <vector>

namespace kmax::simulation {

class ForceDelay {
 public:
  // `delay` >= 0, s.
  explicit ForceDelay(double delay = 0.0) : delay_(delay) {}

  double delay() const { return delay_; }

  void command(double force, double duration) {
    if (size_ == ring_.size()) grow();
    // Steps are as far apart as their commands were.
    const double gap = size_ == 0 ? delay_ : last_duration_;
    ring_[(first_ + size_) & (ring_.size() - 1)] = {force, gap};
    if (size_++ == 0) until_next_ = gap;
    last_duration_ = duration;
    tolerance_ = 1e-12 * duration + 4.0 * std::numeric_limits<double>::epsilon() * delay_;
    take_what_is_due();
  }

  // N, now.
  double force() const { return force_; }

  // How long the force stays as it is, at most `left`; > 0.
  double piece(double left) const {
    return size_ == 0 || until_next_ >= left - tolerance_ ? left : until_next_;
  }

  void pass(double piece) {
    if (size_ == 0) return;
    until_next_ -= piece;
    take_what_is_due();
  }

 private:
  struct Step {
    double force;
    double gap;  // s, after the step before
  };

  void take_what_is_due() {
    while (size_ != 0 && until_next_ <= tolerance_) {
      force_ = ring_[first_].force;
      first_ = (first_ + 1) & (ring_.size() - 1);
      if (--size_ != 0) until_next_ += ring_[first_].gap;
    }
  }

  void grow() {
    std::vector<Step> larger(ring_.empty() ? 8 : 2 * ring_.size());
    for (std::size_t n = 0; n < size_; ++n) larger[n] = ring_[(first_ + n) & (ring_.size() - 1)];
    ring_.swap(larger);
    first_ = 0;
  }

  double delay_;
  double force_ = 0.0;
  double until_next_ = 0.0;
  double last_duration_ = 0.0;
  double tolerance_ = 0.0;
  std::vector<Step> ring_;  // a power of two
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace kmax::simulation
