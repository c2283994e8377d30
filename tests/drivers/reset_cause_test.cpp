#include "drivers/stm32f4/reset_cause.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::reset_cause_test {

TEST(ResetCause, EachAsTheChipShowsIt) {
  EXPECT_EQ(reset_cause(0x0E00'0000), ResetCause::power_on);
  EXPECT_EQ(reset_cause(0x0600'0000), ResetCause::brown_out);
  EXPECT_EQ(reset_cause(0x0400'0000), ResetCause::pin);
  EXPECT_EQ(reset_cause(0x1400'0000), ResetCause::software);
  EXPECT_EQ(reset_cause(0x2400'0000), ResetCause::independent_watchdog);
  EXPECT_EQ(reset_cause(0x4400'0000), ResetCause::window_watchdog);
  EXPECT_EQ(reset_cause(0x8400'0000), ResetCause::low_power);
  EXPECT_EQ(reset_cause(0), ResetCause::none);
  EXPECT_EQ(reset_cause(3), ResetCause::none) << "LSION, LSIRDY";
}

TEST(ResetCause, TheLaterOneCountsWhenThePowerOnFlagIsStillThere) {
  EXPECT_EQ(reset_cause(0x2E00'0000), ResetCause::independent_watchdog);
  EXPECT_EQ(reset_cause(0x1E00'0000), ResetCause::software);
}

TEST(ResetCause, TakingItRemovesTheFlagsAndLeavesTheOscillatorOn) {
  struct {
    FakeRegister csr;
  } rcc;
  rcc.csr.value = 0x2400'0003;
  EXPECT_EQ(take_reset_cause(rcc), ResetCause::independent_watchdog);
  ASSERT_EQ(rcc.csr.writes.size(), 2U);
  EXPECT_EQ(rcc.csr.writes[0] & 0x0100'0003U, 0x0100'0003U) << "RMVF";
  EXPECT_EQ(rcc.csr.writes[1] & 0x0100'0003U, 0x0000'0003U)
      << "or the flags of the next reset are removed too";
}

TEST(ResetCause, AClockThatAResetTurnsOffSaysThatTheProgramBeginsBehindAJump) {
  struct {
    std::uint32_t cr, cfgr, ahb2enr;
  } rcc{.cr = 0x0000'7D83, .cfgr = 0, .ahb2enr = 0};
  EXPECT_FALSE(begins_behind_a_jump(rcc)) << "the internal oscillator alone, RM0090, RCC_CR reset value";
  for (const std::uint32_t on : {1U << 16, 1U << 24}) {
    auto other = rcc;
    other.cr |= on;
    EXPECT_TRUE(begins_behind_a_jump(other)) << on;
  }
  auto other = rcc;
  other.cfgr = 0x0000'000A;
  EXPECT_TRUE(begins_behind_a_jump(other)) << "on the PLL";
  other = rcc;
  other.ahb2enr = 1U << 7;
  EXPECT_TRUE(begins_behind_a_jump(other)) << "USB";
}

}  // namespace kmax::drivers::stm32f4::reset_cause_test
