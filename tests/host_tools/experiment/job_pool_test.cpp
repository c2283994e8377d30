#include "host_tools/experiment/job_pool.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <atomic>
#include <latch>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

namespace kmax::experiment::job_pool_test {

RC_GTEST_PROP(JobPoolProperty, ResultsAreInOrderWhateverTheThreads, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(0, 60);
  const auto jobs = *rc::gen::inRange<std::size_t>(0, 9);
  std::vector<std::atomic<int>> calls(count);
  const auto results = collect_jobs<std::size_t>(count, jobs, [&](std::size_t index) {
    ++calls[index];
    return index * index;
  });
  RC_ASSERT(results.size() == count);
  for (std::size_t i = 0; i < count; ++i) {
    RC_ASSERT(results[i] == i * i);
    RC_ASSERT(calls[i] == 1);
  }
}

TEST(JobPool, SoManyRunAtATimeAsWasSaid) {
  // Would wait for ever with fewer than three.
  std::latch together(3);
  run_jobs(3, 3, [&](std::size_t) { together.arrive_and_wait(); });
  std::atomic<int> running = 0, most = 0;
  run_jobs(40, 2, [&](std::size_t) {
    const int now = ++running;
    for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
    }
    std::this_thread::yield();
    --running;
  });
  EXPECT_LE(most, 2);
}

TEST(JobPool, MoreThreadsThanJobsAreNotMade) {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  run_jobs(3, 1'000'000, [&](std::size_t) {
    const std::lock_guard lock(mutex);
    threads.insert(std::this_thread::get_id());
  });
  EXPECT_LE(threads.size(), 3u);
  EXPECT_FALSE(threads.contains(std::this_thread::get_id()));
}

TEST(JobPool, NoJobsAreDoneAtOnce) {
  int reports = 0;
  run_jobs(
      0, 4, [](std::size_t) { FAIL(); },
      [&](std::size_t done, std::size_t count) {
        EXPECT_EQ(done + count, 0u);
        ++reports;
      });
  EXPECT_EQ(reports, 1);
}

TEST(JobPool, ReportsRiseFromNoneToAllInTheCallersThread) {
  std::vector<std::size_t> reported;
  const auto here = std::this_thread::get_id();
  run_jobs(
      20, 3, [](std::size_t) {},
      [&](std::size_t done, std::size_t count) {
        EXPECT_EQ(count, 20u);
        EXPECT_EQ(std::this_thread::get_id(), here);
        reported.push_back(done);
      });
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_EQ(reported.front(), 0u);
  EXPECT_EQ(reported.back(), 20u);
}

// Otherwise nobody could press Ctrl-C during a long job.
TEST(JobPool, ReportsComeWhileAJobRunsToo) {
  std::atomic<int> reports = 0;
  run_jobs(
      1, 1,
      [&](std::size_t) {
        while (reports < 4) std::this_thread::yield();
      },
      [&](std::size_t, std::size_t) { ++reports; });
  EXPECT_GE(reports, 4);
}

RC_GTEST_PROP(JobPoolProperty, TheFailureWithTheLowestIndexComesOut, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(1, 40);
  const auto jobs = *rc::gen::inRange<std::size_t>(1, 9);
  auto failing = *rc::gen::container<std::set<std::size_t>>(rc::gen::inRange<std::size_t>(0, count));
  failing.insert(count - 1);
  std::vector<std::atomic<bool>> ended(count);
  std::string what;
  try {
    run_jobs(count, jobs, [&](std::size_t index) {
      std::this_thread::yield();
      ended[index] = true;
      if (failing.contains(index)) throw std::runtime_error(std::to_string(index));
    });
  } catch (const std::runtime_error& error) {
    what = error.what();
  }
  RC_ASSERT(what == std::to_string(*failing.begin()));
  for (std::size_t i = 0; i < *failing.begin(); ++i) RC_ASSERT(ended[i]);
}

/// So many that they are not through before a thread that a busy machine holds up has stopped the others.
constexpr int very_many = 1'000'000'000;

TEST(JobPool, AfterAFailureNoJobBeginsAndThoseUnderWayEnd) {
  std::atomic<int> begun = 0, ended = 0;
  std::atomic<bool> thrown = false;
  EXPECT_THROW(run_jobs(very_many, 4,
                        [&](std::size_t index) {
                          ++begun;
                          if (index == 2) {
                            thrown = true;
                            throw std::logic_error("2");
                          }
                          while (!thrown) std::this_thread::yield();
                          ++ended;
                        }),
               std::logic_error);
  EXPECT_EQ(begun, ended + 1);
  EXPECT_LT(begun, very_many);
}

TEST(JobPool, WhatIsNoStandardExceptionComesOutToo) {
  EXPECT_THROW(run_jobs(5, 2, [](std::size_t) { throw 7; }), int);
}

TEST(JobPool, AReportThatThrowsStopsBetweenJobs) {
  struct Interrupted {};
  std::atomic<int> begun = 0, ended = 0;
  EXPECT_THROW(run_jobs(
                   very_many, 3,
                   [&](std::size_t) {
                     ++begun;
                     std::this_thread::sleep_for(std::chrono::milliseconds(1));
                     ++ended;
                   },
                   [&](std::size_t done, std::size_t) {
                     if (done >= 5) throw Interrupted();
                   }),
               Interrupted);
  EXPECT_EQ(begun, ended);
  EXPECT_LT(ended, very_many);
  EXPECT_GE(ended, 5);
  begun = 0;
  EXPECT_THROW(
      run_jobs(
          10, 3, [&](std::size_t) { ++begun; }, [](std::size_t, std::size_t) { throw Interrupted(); }),
      Interrupted);
  EXPECT_EQ(begun, 0);
}

TEST(JobPool, WithoutANumberThereAreAsManyAsProcessors) {
  EXPECT_GE(default_jobs(), 1u);
  std::latch together(static_cast<std::ptrdiff_t>(default_jobs()));
  run_jobs(default_jobs(), 0, [&](std::size_t) { together.arrive_and_wait(); });
}

}  // namespace kmax::experiment::job_pool_test
