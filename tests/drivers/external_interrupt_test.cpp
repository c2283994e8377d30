#include "drivers/stm32f4/external_interrupt.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::external_interrupt_test {

struct FakeExti {
  FakeRegister imr, emr, rtsr, ftsr, swier, pr;
};
struct FakeSyscfg {
  FakeRegister exticr[4];
};

struct Lines {
  FakeExti exti;
  FakeSyscfg syscfg;
  ExternalInterrupts<FakeExti, FakeSyscfg> lines{exti, syscfg};
};

TEST(ExternalInterrupts, PinsOfTheBoard) {
  Lines board;
  ASSERT_TRUE(board.lines.configure({GpioPort::d, 2}, Edge::falling));  // nFAULT
  ASSERT_TRUE(board.lines.configure({GpioPort::c, 4}, Edge::rising));   // emergency stop
  ASSERT_TRUE(board.lines.configure({GpioPort::c, 9}, Edge::rising));   // encoder 0 Z
  ASSERT_TRUE(board.lines.configure({GpioPort::c, 15}, Edge::both));    // encoder 1 Z
  EXPECT_EQ(board.syscfg.exticr[0].value, 0x0300U);
  EXPECT_EQ(board.syscfg.exticr[1].value, 0x0002U);
  EXPECT_EQ(board.syscfg.exticr[2].value, 0x0020U);
  EXPECT_EQ(board.syscfg.exticr[3].value, 0x2000U);
  EXPECT_EQ(board.exti.ftsr.value, 0x8004U);
  EXPECT_EQ(board.exti.rtsr.value, 0x8210U);
  EXPECT_EQ(board.exti.imr.value, 0U) << "nothing comes before enable";
  for (const unsigned line : {2U, 4U, 9U, 15U}) board.lines.enable(line);
  EXPECT_EQ(board.exti.imr.value, 0x8214U);
  board.lines.disable(9);
  EXPECT_EQ(board.exti.imr.value, 0x8014U);
}

TEST(ExternalInterrupts, MaskedWhileRoutedAndForgetsLast) {
  Lines board;
  board.exti.imr.value = 0xFFFF;
  std::string order;
  board.exti.imr.on_write = [&](std::uint32_t word) { order += (word & 4U) != 0 ? 'E' : 'm'; };
  board.syscfg.exticr[0].on_write = [&](std::uint32_t) { order += 'r'; };
  board.exti.rtsr.on_write = [&](std::uint32_t) { order += 'e'; };
  board.exti.ftsr.on_write = [&](std::uint32_t) { order += 'e'; };
  board.exti.pr.on_write = [&](std::uint32_t) { order += 'p'; };
  ASSERT_TRUE(board.lines.configure({GpioPort::d, 2}, Edge::falling));
  EXPECT_EQ(order, "mreep");
  EXPECT_EQ(board.exti.imr.value, 0xFFFBU) << "the neighbours stay as they were";
}

TEST(ExternalInterrupts, RefusesLinesWithoutVector) {
  using Number = std::uint8_t;
  for (const Number number : {Number{0}, Number{1}, Number{3}, Number{16}, Number{255}}) {
    Lines board;
    EXPECT_FALSE(board.lines.configure({GpioPort::a, number}, Edge::rising)) << int{number};
    EXPECT_TRUE(board.exti.imr.writes.empty() && board.exti.pr.writes.empty());
    EXPECT_TRUE(board.syscfg.exticr[0].writes.empty());
  }
}

TEST(ExternalInterrupts, TakesOneLineAndLeavesTheOthersPending) {
  Lines board;
  // Write 1 clears, as the hardware does it.
  board.exti.pr.value = 1U << 4 | 1U << 9;
  std::uint32_t pending = board.exti.pr.value;
  board.exti.pr.on_read = [&](std::uint32_t) { return pending; };
  board.exti.pr.on_write = [&](std::uint32_t word) { pending &= ~word; };
  EXPECT_TRUE(board.lines.ISR_take(4));
  EXPECT_EQ(pending, 1U << 9);
  EXPECT_FALSE(board.lines.ISR_take(4));
  EXPECT_EQ(board.exti.pr.writes.size(), 1U) << "nothing is cleared that was not seen";
  EXPECT_TRUE(board.lines.ISR_take(9));
  EXPECT_EQ(pending, 0U);
}

RC_GTEST_PROP(ExternalInterrupts, ConfigureTouchesItsOwnLineOnly, ()) {
  Lines board;
  const auto word = *rc::gen::inRange<std::uint32_t>(0, 0x10000);
  for (FakeRegister* each : {&board.exti.imr, &board.exti.rtsr, &board.exti.ftsr}) each->value = word;
  for (FakeRegister& each : board.syscfg.exticr) each.value = word;
  const auto line = *rc::gen::element<std::uint8_t>(2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const auto edge = *rc::gen::element(Edge::rising, Edge::falling, Edge::both);
  const auto port = *rc::gen::element(GpioPort::a, GpioPort::b, GpioPort::c, GpioPort::d);
  RC_ASSERT(board.lines.configure({port, line}, edge));
  const std::uint32_t others = ~(1U << line);
  RC_ASSERT((board.exti.imr.value & others) == (word & others));
  RC_ASSERT((board.exti.rtsr.value & others) == (word & others));
  RC_ASSERT((board.exti.ftsr.value & others) == (word & others));
  RC_ASSERT(((board.exti.rtsr.value & ~others) != 0) == (edge != Edge::falling));
  RC_ASSERT(((board.exti.ftsr.value & ~others) != 0) == (edge != Edge::rising));
  RC_ASSERT(board.exti.pr.writes == std::vector<std::uint32_t>{1U << line});
  for (unsigned i = 0; i < 4; ++i) {
    const std::uint32_t own = i == line / 4 ? 0xFU << (4 * (line % 4)) : 0;
    RC_ASSERT((board.syscfg.exticr[i].value & ~own) == (word & ~own));
    if (own != 0)
      RC_ASSERT((board.syscfg.exticr[i].value & own) == static_cast<std::uint32_t>(port) << (4 * (line % 4)));
  }
}

TEST(ExtiInterrupt, VectorOfEachLine) {
  EXPECT_EQ(exti_interrupt(2), Interrupt::exti2);
  EXPECT_EQ(exti_interrupt(4), Interrupt::exti4);
  EXPECT_EQ(exti_interrupt(5), Interrupt::exti9_5);
  EXPECT_EQ(exti_interrupt(9), Interrupt::exti9_5);
  EXPECT_EQ(exti_interrupt(10), Interrupt::exti15_10);
  EXPECT_EQ(exti_interrupt(15), Interrupt::exti15_10);
  for (const unsigned line : {0U, 1U, 3U, 16U, 22U}) EXPECT_EQ(exti_interrupt(line), std::nullopt) << line;
}

}  // namespace kmax::drivers::stm32f4::external_interrupt_test
