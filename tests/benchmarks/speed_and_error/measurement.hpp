#pragma once
// Processor time of the calling thread, which other programs on the machine do not count towards.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <limits>

namespace kmax::benchmark {

inline double processor_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Seconds of the fastest of `repetitions` calls: what disturbs a call only makes it slower.
template <typename Call>
double best_processor_time(int repetitions, Call call) {
  double best = std::numeric_limits<double>::infinity();
  for (int n = 0; n < repetitions; ++n) {
    const double begin = processor_time();
    call();
    best = std::min(best, processor_time() - begin);
  }
  return best;
}

// The compiler must compute `value`, and may not know what memory holds afterwards.
template <typename Value>
void keep(const Value& value) {
  asm volatile("" : : "m"(value) : "memory");
}

// The largest and the root mean square of errors.

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
