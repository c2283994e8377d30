#pragma once
// Several runs that begin alike: the beginning is computed once.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <exception>
#include <functional>
#include <optional>
#include <string>

namespace kmax {

/// Lets a test go on from one place in several ways, each in a copy of the process, as fork() makes it. The
/// process must have one thread, and nothing outside its memory (files, sockets) that the ways would share.
class SharedBeginning {
 public:
  /// Carries out `test`, which calls fork(). A copy's process ends with it.
  static void run(const std::function<void(SharedBeginning&)>& test) {
    SharedBeginning beginning;
    try {
      test(beginning);
    } catch (const std::exception& error) {
      if (!beginning.in_copy()) throw;
      ADD_FAILURE() << "left by an exception: " << error.what();
    } catch (...) {
      if (!beginning.in_copy()) throw;
      ADD_FAILURE() << "left by an exception";
    }
    if (!beginning.in_copy()) return;
    std::fflush(nullptr);
    _exit(failures() > beginning.failures_before_ ? 1 : 0);
  }

  /// True in a new copy. False here, once the copy has ended, and in a copy, which has none of its own. A
  /// copy that fails writes why, under `name`, and is a failure here.
  bool fork(const std::string& name) {
    if (in_copy_) return false;
    std::fflush(nullptr);
    const pid_t copy = ::fork();
    if (copy < 0) {
      ADD_FAILURE() << name << ": the process cannot be copied";
      return false;
    }
    if (copy == 0) {
      in_copy_ = true;
      failures_before_ = failures();
      trace_.emplace(__FILE__, __LINE__, name);
      return true;
    }
    ++copies_;
    int status = 0;
    EXPECT_EQ(waitpid(copy, &status, 0), copy);
    const bool passed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    EXPECT_TRUE(passed) << name << ": wait status " << status;
    return false;
  }

  bool in_copy() const { return in_copy_; }
  std::size_t copies() const { return copies_; }

 private:
  /// Of the test that runs. A copy begins with those that were there before.
  static int failures() {
    const testing::TestResult& result = *testing::UnitTest::GetInstance()->current_test_info()->result();
    int failed = 0;
    for (int part = 0; part < result.total_part_count(); ++part)
      failed += result.GetTestPartResult(part).failed() ? 1 : 0;
    return failed;
  }

  bool in_copy_ = false;
  int failures_before_ = 0;
  std::size_t copies_ = 0;
  std::optional<testing::ScopedTrace> trace_;
};

}  // namespace kmax
