#include "host_tools/experiment/job_pool.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>

namespace kmax::experiment {

namespace {
constexpr std::chrono::milliseconds report_interval{200};

/// What the threads share.
class Jobs {
 public:
  Jobs(std::size_t count, const std::function<void(std::size_t)>& job) : count_(count), job_(job) {}

  /// A thread's life: one job after the other until there is none left or one has failed.
  void work() {
    std::unique_lock lock(mutex_);
    while (!stopped_ && next_ < count_) {
      const std::size_t index = next_++;
      lock.unlock();
      std::exception_ptr failure;
      try {
        job_(index);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      ++ended_;
      if (failure) {
        stopped_ = true;
        // Jobs begin in order: whichever has a lower index is under way, and will be heard of.
        if (index < failed_) {
          failed_ = index;
          failure_ = failure;
        }
      } else {
        ++done_;
      }
      changed_.notify_one();
    }
  }

  /// Reports until all jobs have ended or no more will begin.
  void watch(const ProgressReport& report) {
    std::size_t reported = std::numeric_limits<std::size_t>::max();
    for (;;) {
      std::unique_lock lock(mutex_);
      const auto over = [&] { return ended_ == next_ && (stopped_ || next_ == count_); };
      changed_.wait_for(lock, report_interval, [&] { return over() || done_ != reported; });
      const bool last = over();
      const std::size_t done = done_;
      lock.unlock();
      if (report) report(done, count_);
      reported = done;
      if (last) return;
    }
  }

  void stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }

  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  const std::size_t count_;
  const std::function<void(std::size_t)>& job_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t next_ = 0, ended_ = 0, done_ = 0;
  bool stopped_ = false;
  std::size_t failed_ = std::numeric_limits<std::size_t>::max();
  std::exception_ptr failure_;
};
}  // namespace

std::size_t default_jobs() {
  return std::max<std::size_t>(1, std::thread::hardware_concurrency());
}

void run_jobs(std::size_t count, std::size_t jobs, const std::function<void(std::size_t)>& job,
              const ProgressReport& report) {
  if (report) report(0, count);
  if (count == 0) return;
  Jobs shared(count, job);
  {
    std::vector<std::jthread> threads;
    struct StopAtTheEnd {
      Jobs& jobs;
      ~StopAtTheEnd() { jobs.stop(); }  // before the threads are joined, whatever has been thrown
    } const stop{shared};
    const std::size_t wanted = std::min(count, jobs == 0 ? default_jobs() : jobs);
    for (std::size_t i = 0; i < wanted; ++i) {
      try {
        threads.emplace_back([&shared] { shared.work(); });
      } catch (const std::system_error&) {
        // Fewer threads than wished for do as well.
        if (threads.empty()) throw;
        break;
      }
    }
    shared.watch(report);
  }
  shared.rethrow_failure();
}

}  // namespace kmax::experiment
