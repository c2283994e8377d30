#pragma once

#include <cstddef>
#include <functional>
#include <type_traits>
#include <vector>

#include "host_tools/experiment/progress_report.hpp"

namespace kmax::experiment {

/// Calls job(0) .. job(count - 1), up to `jobs` of them at a time, each in some thread of its own but begun
/// in that order. A job writes its result where its index says: then results do not depend on the threads.
/// `jobs` 0: default_jobs(). `report` is called in the calling thread, before the first job, after jobs have
/// ended and at least five times a second while they run.
///
/// When a job or the report throws, no further job begins, those under way are waited for, and the exception
/// comes out: the report's, else that of the failed job with the lowest index, which is the same however many
/// threads there are. Cost: some microseconds per job; a job should take a millisecond or more. Throws
/// std::system_error if not even one thread can be made.
void run_jobs(std::size_t count, std::size_t jobs, const std::function<void(std::size_t)>& job,
              const ProgressReport& report = {});

/// Processors that this process may use, at least 1.
std::size_t default_jobs();

/// The results of make(0) .. make(count - 1), in this order.
template <typename Result, typename Make>
std::vector<Result> collect_jobs(std::size_t count, std::size_t jobs, const Make& make,
                                 const ProgressReport& report = {}) {
  static_assert(!std::is_same_v<Result, bool>, "threads cannot write single bits of a vector side by side");
  std::vector<Result> results(count);
  run_jobs(
      count, jobs, [&](std::size_t index) { results[index] = make(index); }, report);
  return results;
}

}  // namespace kmax::experiment
