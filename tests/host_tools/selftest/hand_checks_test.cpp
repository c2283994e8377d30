#include "host_tools/selftest/selftest.hpp"

#include "tests/host_tools/selftest/tested_axis.hpp"

namespace kmax::selftest::hand_checks_test {

TEST(HandChecks, AnEmergencyStopThatIsPressedAndReleased) {
  TestedAxis tested("dc_coreless_a");
  Probe probe(*tested.device, 0, [](const std::string&) {});
  auto& power = tested.link->hardware().power();
  std::vector<std::string> asked;
  const CheckResult result = check_hand_stop(probe, {.patience = 2.0}, [&](const std::string& text) {
    asked.push_back(text);
    power.press_emergency_stop(text.starts_with("press"));
  });
  EXPECT_EQ(result.verdict, Verdict::pass) << result.message;
  EXPECT_EQ(asked.size(), 2U);
  EXPECT_TRUE(probe.restore().in_order);
  EXPECT_TRUE(tested.disarmed());
  EXPECT_FALSE(device::Drive(*tested.device, 0).status().faulty());
}

TEST(HandChecks, AnEmergencyStopThatDoesNothing) {
  TestedAxis tested("dc_coreless_a");
  Probe probe(*tested.device, 0, [](const std::string&) {});
  const CheckResult result = check_hand_stop(probe, {.patience = 0.2}, [](const std::string&) {});
  EXPECT_EQ(result.verdict, Verdict::fail);
  EXPECT_EQ(result.part, "emergency stop");
  EXPECT_TRUE(tested.disarmed());
}

TEST(HandChecks, AHandleThatNobodyMoves) {
  TestedAxis tested("dc_coreless_a");
  Probe probe(*tested.device, 0, [](const std::string&) {});
  const CheckResult result = check_hand_motion(probe, {.patience = 0.2}, [](const std::string&) {});
  EXPECT_EQ(result.verdict, Verdict::fail);
  EXPECT_EQ(result.part, "encoder");
}

}  // namespace kmax::selftest::hand_checks_test
