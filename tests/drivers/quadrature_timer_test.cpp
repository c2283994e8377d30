#include "drivers/stm32f4/quadrature_timer.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::quadrature_timer_test {

TEST(QuadratureTimer, CountsAllFourEdgesOnBothInputs) {
  TimerRegisters timer{};
  timer.cr1 = 0xFFFF;
  timer.ccmr[1] = 0xFFFF;
  QuadratureTimer<> encoder{timer};
  ASSERT_TRUE(encoder.configure({}));
  EXPECT_EQ(timer.smcr, 3U);
  EXPECT_EQ(timer.ccmr[0], 0xB1B1U) << "CC1S = CC2S = 1, ICxF = 11";
  EXPECT_EQ(timer.ccmr[1], 0U);
  EXPECT_EQ(timer.ccer, 0U);
  EXPECT_EQ(timer.arr, 0xFFFFU);
  EXPECT_EQ(timer.psc, 0U);
  EXPECT_EQ(timer.cr1, 1U | 1U << 2) << "CEN, URS";
  timer.cnt = 0x1'2345;
  EXPECT_EQ(encoder.count(), 0x2345);
}

TEST(QuadratureTimer, ThirtyTwoBitTimerUsesItsWholeRange) {
  TimerRegisters timer{};
  QuadratureTimer<TimerRegisters, std::uint32_t> encoder{timer};
  ASSERT_TRUE(encoder.configure({.input_filter = 0}));
  EXPECT_EQ(timer.arr, 0xFFFF'FFFFU);
  EXPECT_EQ(timer.ccmr[0], 0x0101U);
  timer.cnt = 0x8000'0000;
  EXPECT_EQ(encoder.count(), 0x8000'0000U);
}

// RM0090: CCxS only while the channel is off, the direction only outside encoder mode.
TEST(QuadratureTimer, IsSetUpInTheManualsOrder) {
  for (const bool reversed : {false, true}) {
    FakeTimer timer;
    WriteOrder order;
    timer.add_to(order);
    QuadratureTimer<FakeTimer> encoder{timer};
    ASSERT_TRUE(encoder.configure({.input_filter = 15, .reversed = reversed}));
    EXPECT_EQ(order.all, (WriteOrder::Writes{{"cr1", 0},
                                             {"ccer", 0},
                                             {"cr2", 0},
                                             {"smcr", 0},
                                             {"dier", 0},
                                             {"ccmr1", 0xF1F1},
                                             {"ccmr2", 0},
                                             {"psc", 0},
                                             {"arr", 0xFFFF},
                                             {"cr1", 1U << 2},
                                             {"egr", 1},
                                             {"sr", 0},
                                             {"smcr", 3},
                                             {"ccer", reversed ? 2 : 0},
                                             {"cr1", 1U | 1U << 2}}));
  }
}

TEST(QuadratureTimer, RefusesWithoutTouchingAnything) {
  FakeTimer timer;
  QuadratureTimer<FakeTimer> encoder{timer};
  EXPECT_FALSE(encoder.configure({.input_filter = 16}));
  EXPECT_TRUE(timer.cr1.writes.empty());
  EXPECT_TRUE(timer.ccer.writes.empty());
  EXPECT_TRUE(timer.smcr.writes.empty());
}

}  // namespace kmax::drivers::stm32f4::quadrature_timer_test
