// A failure in a copy of the process is one of the test, whatever it is, and nothing else is.
#include "tests/shared_beginning.hpp"

#include <csignal>
#include <functional>
#include <stdexcept>

namespace kmax::shared_beginning_test {

/// A test of which a copy does `continuation`. Ends this process with the number of its failures; 100: there
/// was no copy.
[[noreturn]] void end_as_a_test_with(const std::function<void()>& continuation, bool fails_before = false) {
  EXPECT_FALSE(fails_before);
  std::size_t copies = 0;
  SharedBeginning::run([&](SharedBeginning& beginning) {
    if (beginning.fork("the copy")) return continuation();
    copies = beginning.copies();
  });
  const testing::TestResult& result = *testing::UnitTest::GetInstance()->current_test_info()->result();
  std::fflush(nullptr);
  _exit(copies == 1 ? result.total_part_count() : 100);
}

TEST(SharedBeginning, ACopyThatPassesIsNoFailure) {
  EXPECT_EXIT(end_as_a_test_with([] { EXPECT_TRUE(true); }), testing::ExitedWithCode(0), "");
}

TEST(SharedBeginning, WhateverFailsInACopyFailsHere) {
  EXPECT_EXIT(end_as_a_test_with([] { EXPECT_TRUE(false); }), testing::ExitedWithCode(1), "");
  EXPECT_EXIT(end_as_a_test_with([] { throw std::runtime_error("thrown"); }), testing::ExitedWithCode(1), "");
  EXPECT_EXIT(end_as_a_test_with([] { throw 5; }), testing::ExitedWithCode(1), "");
  EXPECT_EXIT(end_as_a_test_with([] { std::raise(SIGKILL); }), testing::ExitedWithCode(1), "");
}

TEST(SharedBeginning, WhatFailedBeforeIsNoFailureOfACopy) {
  EXPECT_EXIT(end_as_a_test_with([] { EXPECT_TRUE(true); }, true), testing::ExitedWithCode(1), "");
  EXPECT_EXIT(end_as_a_test_with([] { EXPECT_TRUE(false); }, true), testing::ExitedWithCode(2), "");
}

TEST(SharedBeginning, ACopyHasNoCopies) {
  EXPECT_EXIT(SharedBeginning::run([](SharedBeginning& beginning) {
                if (beginning.fork("the copy")) _exit(beginning.fork("one of its own") ? 7 : 0);
                _exit(testing::Test::HasFailure() ? 1 : 0);
              }),
              testing::ExitedWithCode(0), "");
}

}  // namespace kmax::shared_beginning_test
