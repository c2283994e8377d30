#pragma once
// Processor time of the calling thread, which other programs on the machine do not count towards.

#include <algorithm>
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

}  // namespace kmax::benchmark
