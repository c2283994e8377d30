#include "host_tools/experiment/setting_check.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::setting_check_test {

using host_tools_test::thrown_message;

constexpr SettingCheck check("jitter");

TEST(SettingCheck, BothBoundsAreAllowed) {
  EXPECT_NO_THROW(check("touches", 1, 1, 1000));
  EXPECT_NO_THROW(check("touches", 1000, 1, 1000));
}

TEST(SettingCheck, SaysWhatWasWrongAndWhatIsAllowed) {
  EXPECT_EQ(thrown_message<std::invalid_argument>([] { check("touches", 0, 1, 1000); }),
            "jitter: touches = 0: allowed is 1 to 1000");
  EXPECT_EQ(thrown_message<std::invalid_argument>([] { check("window", 0.25, 0.01, 0.2); }),
            "jitter: window = 0.25: allowed is 0.01 to 0.2");
}

TEST(SettingCheck, WhatIsNoNumberIsNotAllowed) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>([] { check("window", nan, 0.0, 1.0); }),
                  "window = nan");
}

TEST(SettingCheck, SomebodyMustHoldTheHandle) {
  EXPECT_NO_THROW(check.require_somebody(std::vector<simulation::OperatorModel>(1)));
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>([] { check.require_somebody({}); }),
                  "jitter: nobody to hold the handle");
}

}  // namespace kmax::experiment::setting_check_test
