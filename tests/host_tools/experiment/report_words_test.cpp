#include "host_tools/experiment/report_words.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace kmax::experiment::report_words_test {

TEST(ReportWords, AreThoseOfEveryReport) {
  EXPECT_EQ(yes_no(true), "yes");
  EXPECT_EQ(yes_no(false), "no");
  EXPECT_EQ(rank_text(0.874), "+0.87");
  EXPECT_EQ(rank_text(-1.0), "-1.00");
  EXPECT_EQ(rank_text({}), "-");
  EXPECT_EQ(yes_no(TestedClaim(true), "not shown"), "yes");
  EXPECT_EQ(yes_no(TestedClaim(false), "not shown"), "no");
  EXPECT_EQ(yes_no(TestedClaim(), "not shown"), "not shown");
  EXPECT_EQ(fall_words(true, "not shown"), "falls");
  EXPECT_EQ(fall_words(false, "not shown"), "does not fall");
  EXPECT_EQ(fall_words({}, "not shown"), "not shown");
  EXPECT_EQ(touch_words(0), "0 touches");
  EXPECT_EQ(touch_words(1), "1 touch");
  EXPECT_EQ(touch_words(4), "4 touches");
  EXPECT_EQ(people_words(1), "1 person");
  EXPECT_EQ(people_words(12), "12 people");
  simulation::DeviceModel device;
  device.force_limit = 3.3;
  EXPECT_EQ(clipping_words(device), "clipped at 3.3 N");
  device.force_limit = 0.0;
  EXPECT_EQ(clipping_words(device), "not clipped");
}

TEST(ReportWords, TheStiffeningIsTheCauseOnlyOfWhatFallsWithItAndNotWithoutIt) {
  EXPECT_EQ(cause_words("Jit", true, false),
            "With a hand that does not stiffen Jit does not fall: in this model the trend is the stiffening "
            "and nothing else.");
  EXPECT_EQ(cause_words("it", true, true),
            "With a hand that does not stiffen it falls all the same: something else than the stiffening "
            "makes the trend.");
  EXPECT_EQ(cause_words("it", false, true),
            "With a hand that does not stiffen it falls at every F_I: the stiffening is not what would make "
            "the trend.");
  EXPECT_EQ(cause_words("it", false, false),
            "With a hand that does not stiffen it does not either: there is no trend to explain.");
  for (const auto& [falls, falls_without] :
       {std::pair<TestedClaim, TestedClaim>{true, {}}, {{}, false}, {{}, {}}})
    EXPECT_NE(cause_words("it", falls, falls_without).find("nothing to compare with"), std::string::npos);
}

TEST(ModelWords, NameWhatDecidesHowStiffAWallCanBe) {
  EXPECT_EQ(model_words({.mass = 0.05, .friction = 0.1}, {.activation_gain = 0.4}),
            "The handle has 50 g and 0.1 N of friction, the hand's gamma is 0.4 /N.");
}

}  // namespace kmax::experiment::report_words_test
