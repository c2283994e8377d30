#pragma once
// The largest and the root mean square of errors.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace kmax::benchmark {

class ErrorStatistics {
 public:
  void add(long double error) {
    const long double magnitude = std::fabs(error);
    largest_ = std::max(largest_, magnitude);
    squares_ += magnitude * magnitude;
    ++count_;
  }
  double largest() const { return static_cast<double>(largest_); }
  double root_mean_square() const {
    return count_ == 0 ? 0.0 : static_cast<double>(std::sqrt(squares_ / static_cast<long double>(count_)));
  }

 private:
  long double largest_ = 0.0L, squares_ = 0.0L;
  std::size_t count_ = 0;
};

// The unit in the last place of numbers of this size in Scalar's format: the distance to the next larger
// magnitude, without the narrowing below the smallest normal number.
template <typename Scalar>
long double unit_in_last_place(long double value) {
  int exponent = 0;
  std::frexp(value, &exponent);  // value = m 2^exponent, 1/2 <= |m| < 1
  exponent = std::max(exponent, std::numeric_limits<Scalar>::min_exponent);
  return std::ldexp(1.0L, exponent - std::numeric_limits<Scalar>::digits);
}

}  // namespace kmax::benchmark
