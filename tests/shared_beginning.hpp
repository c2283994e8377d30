#pragma once
// Several runs that begin alike: the beginning is computed once.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <exception>

namespace kmax {

/// Lets a test go on from one place in several ways, each in a copy of the process, as fork() makes it: it is
/// declared before all that the runs share, and its end is theirs. The process must have one thread.
class SharedBeginning {
 public:
  SharedBeginning() = default;
  SharedBeginning(const SharedBeginning&) = delete;
  SharedBeginning& operator=(const SharedBeginning&) = delete;
  /// In a copy, the end of its process.
  ~SharedBeginning() {
    if (!in_copy_) return;
    const bool thrown = std::uncaught_exceptions() > 0;
    if (thrown) std::fputs("an exception leaves a copy of the process\n", stderr);
    std::fflush(nullptr);
    _exit(thrown || testing::Test::HasFailure() ? 1 : 0);
  }

  /// True in a new copy. False here, once the copy has ended, and in a copy, which has none of its own. A
  /// copy that fails has written why, and is a failure here.
  bool fork() {
    if (in_copy_) return false;
    std::fflush(nullptr);
    const pid_t copy = ::fork();
    if (copy < 0) {
      ADD_FAILURE() << "the process cannot be copied";
      return false;
    }
    in_copy_ = copy == 0;
    if (in_copy_) return true;
    ++copies_;
    int status = 0;
    EXPECT_EQ(waitpid(copy, &status, 0), copy);
    const bool passed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    EXPECT_TRUE(passed) << "in copy " << copies_ << ": see above";
    return false;
  }

  bool in_copy() const { return in_copy_; }
  std::size_t copies() const { return copies_; }

 private:
  bool in_copy_ = false;
  std::size_t copies_ = 0;
};

}  // namespace kmax
