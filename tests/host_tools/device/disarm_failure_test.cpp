#include "host_tools/device/disarm_failure.hpp"

#include <gtest/gtest.h>

namespace kmax::device::disarm_failure_test {

TEST(DisarmFailure, SaysWhatBecomesOfTheForce) {
  EXPECT_EQ(words_for_disarm_failure(0.5),
            "the axis could not be disarmed; link.timeout removes its force after 0.5 s without a message");
  EXPECT_EQ(words_for_disarm_failure(1, "no answer"),
            "the axis could not be disarmed (no answer); link.timeout removes its force after 1 s without a "
            "message");
  EXPECT_EQ(words_for_disarm_failure(0, "no answer"),
            "the axis could not be disarmed (no answer); link.timeout is 0: its force MAY STILL BE ON, cut "
            "its power");
}

}  // namespace kmax::device::disarm_failure_test
