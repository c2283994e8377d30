// A host that cannot fetch the trace as fast as the device writes it sees gaps, and a jitter that fell into
// one was never seen.
#include <gtest/gtest.h>

#include <algorithm>

#include "host_tools/experiment/jitter/jitter_device.hpp"
#include "tests/host_tools/experiment/asked_person.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"

namespace kmax::experiment::jitter_lost_records_test {
namespace {

class JitterOverASlowLink : public TouchedBoard {
 protected:
  JitterOverASlowLink() {
    settings.wall.window = 2.0;
    settings.touches = 2;
    settings.pairs = {*paper::jitter(0, 1)};
    cable().before_request = [this] {
      const bool on = forceful();
      if (on && !was_on_) ++touches;
      was_on_ = on;
      // A request brings 15 records of 500 that are written in a second.
      if (on && slow(touches)) cable().sim.wait(std::chrono::milliseconds(100));
    };
  }
  JitterDeviceResult run() {
    touches = 0;
    return run_jitter_on_device(device, settings, &person, tell, nullptr, notice);
  }

  std::function<bool(int touch)> slow = [](int) { return false; };  ///< touches are counted from 1
  int touches = 0;
  JitterDeviceSettings settings;
  AskedPerson person;
  std::vector<std::string> notices;
  const Tell notice = [this](const std::string& text) { notices.push_back(text); };

 private:
  bool was_on_ = false;
};

TEST_F(JitterOverASlowLink, ATouchWithLostRecordsIsMadeAgain) {
  const JitterResult whole = run().results.front();
  ASSERT_EQ(touches, 2);
  slow = [](int touch) { return touch == 1; };
  const JitterDeviceResult result = run();
  EXPECT_EQ(touches, 3);
  EXPECT_EQ(person.requests.size(), 5u);
  EXPECT_EQ(result.lost_records, 0u) << "of the touches that count";
  EXPECT_EQ(result.results.front().touches, 2u);
  EXPECT_EQ(result.results.front().unsettled, whole.unsettled);
  EXPECT_NEAR(result.results.front().amplitude, whole.amplitude, 0.05 * whole.amplitude);
  EXPECT_TRUE(notices.empty());
  const auto why = std::find_if(told.begin(), told.end(), [](const std::string& text) {
    return text.find("records of its trace were lost; once more") != std::string::npos;
  });
  EXPECT_NE(why, told.end());
}

TEST_F(JitterOverASlowLink, OneThatAlwaysLosesSomeIsNotCountedAndIsTold) {
  slow = [](int touch) { return touch <= touch_attempts; };
  const JitterDeviceResult result = run();
  EXPECT_EQ(touches, touch_attempts + 1);
  EXPECT_EQ(result.results.front().touches, 1u) << "the second one";
  EXPECT_GT(result.lost_records, 0u);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find("touch 1 of 2: not counted, "), std::string::npos) << notices[0];
}

}  // namespace
}  // namespace kmax::experiment::jitter_lost_records_test
