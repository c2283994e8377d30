#include "host_tools/serve/pace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace kmax::serve::pace_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A machine that takes `cost` of its own time for a millisecond of simulation, for `real` of its own time.
void run(Pace& pace, Pace::Time cost, Pace::Time real) {
  for (Pace::Time now{}; now < real; now += cost) {
    pace.passed(cost);
    pace.ran(std::min<Pace::Time>(pace.due(), milliseconds(1)));
  }
}

struct Watched {
  std::vector<std::string> said;
  Pace pace{[this](const std::string& words) { said.push_back(words); }};
};

TEST(Pace, IsDueWhatHasPassedAndWasNotRun) {
  Pace pace;
  pace.passed(milliseconds(30));
  pace.ran(milliseconds(10));
  pace.passed(milliseconds(5));
  EXPECT_EQ(pace.due(), milliseconds(25));
  EXPECT_EQ(pace.behind_s(), 0.0);
}

TEST(Pace, GivesUpWhatIsMoreThanFiftyMillisecondsBehind) {
  Pace pace;
  pace.passed(milliseconds(30));
  pace.passed(milliseconds(40));
  EXPECT_EQ(pace.due(), milliseconds(50));
  EXPECT_DOUBLE_EQ(pace.behind_s(), 0.02);
}

TEST(Pace, OwesNothingForATimeThatWasHeld) {
  Pace pace;
  pace.passed(milliseconds(30));
  pace.hold();
  EXPECT_EQ(pace.due(), Pace::Time{});
  EXPECT_EQ(pace.behind_s(), 0.0);
}

TEST(Pace, SaysOnceAndEarlyHowSlowItIs) {
  Watched watched;
  run(watched.pace, milliseconds(4), milliseconds(4900));
  EXPECT_TRUE(watched.said.empty());
  run(watched.pace, milliseconds(4), seconds(60));
  ASSERT_EQ(watched.said.size(), 1u);
  // A quarter, and the 50 ms of the beginning that it has not given up: 26 %.
  EXPECT_EQ(
      watched.said[0],
      "this machine is too slow or busy: over the last 5 s the simulation ran at 26 % of real time, so a "
      "second of it takes 3.8 s. Waits take that much longer, and links may report errors");
}

TEST(Pace, SaysSoOfAMachineThatGetsSlowLater) {
  Watched watched;
  run(watched.pace, milliseconds(1), seconds(60));
  EXPECT_TRUE(watched.said.empty());
  run(watched.pace, milliseconds(2), seconds(10));
  EXPECT_EQ(watched.said.size(), 1u);
}

TEST(Pace, SaysNothingOfAMachineThatKeepsUp) {
  Watched watched;
  run(watched.pace, milliseconds(1), seconds(60));
  // Slower than real time by a tenth, which nobody feels.
  run(watched.pace, std::chrono::microseconds(1100), seconds(60));
  EXPECT_TRUE(watched.said.empty());
}

TEST(Pace, DoesNotTakeAComputerThatSleptForASlowOne) {
  Watched watched;
  watched.pace.passed(std::chrono::hours(1));
  run(watched.pace, milliseconds(1), seconds(60));
  EXPECT_TRUE(watched.said.empty());
  EXPECT_NEAR(watched.pace.behind_s(), 3600.0, 0.06);
}

}  // namespace kmax::serve::pace_test
