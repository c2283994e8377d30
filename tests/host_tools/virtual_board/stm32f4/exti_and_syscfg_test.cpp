// RM0090, chapters Interrupts and events (section External interrupt/event controller) and System
// configuration controller (section SYSCFG external interrupt configuration registers).
#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

namespace kmax::virtual_board::exti_and_syscfg_test {
namespace {

using drivers::stm32f4::ExtiRegisters;
using drivers::stm32f4::GpioPort;
using drivers::stm32f4::Interrupt;
using drivers::stm32f4::SyscfgRegisters;

constexpr std::uint32_t imr = offsetof(ExtiRegisters, imr), emr = offsetof(ExtiRegisters, emr),
                        rtsr = offsetof(ExtiRegisters, rtsr), ftsr = offsetof(ExtiRegisters, ftsr),
                        swier = offsetof(ExtiRegisters, swier), pr = offsetof(ExtiRegisters, pr);
constexpr std::uint32_t exticr = offsetof(SyscfgRegisters, exticr);

struct Lines {
  testing::RecordedInterrupts interrupts;
  SyscfgModel syscfg;
  ExtiModel exti{syscfg, interrupts};

  std::uint32_t get(std::uint32_t offset) { return exti.read({offset, 4, 1}); }
  void set(std::uint32_t offset, std::uint32_t value) { exti.write({offset, 4, 1}, value); }
  void route(unsigned line, GpioPort port) {
    const std::uint32_t offset = exticr + 4 * (line / 4);
    const std::uint32_t old = syscfg.read({offset, 4, 1}) & ~(0xFU << (4 * (line % 4)));
    syscfg.write({offset, 4, 1}, old | static_cast<std::uint32_t>(port) << (4 * (line % 4)));
  }
};

TEST(SyscfgModel, ExternalInterruptConfigurationRegisters) {
  Lines board;
  for (unsigned line = 0; line < 16; ++line) EXPECT_EQ(board.syscfg.port_of(line), 0U);
  board.route(2, GpioPort::d);
  board.route(9, GpioPort::c);
  board.route(15, GpioPort::b);
  EXPECT_EQ(board.syscfg.port_of(2), 3U);
  EXPECT_EQ(board.syscfg.port_of(9), 2U);
  EXPECT_EQ(board.syscfg.port_of(15), 1U);
  EXPECT_EQ(board.syscfg.read({exticr, 4, 1}), 0x300U);
  board.syscfg.reset(2);
  EXPECT_EQ(board.syscfg.port_of(2), 0U);
  EXPECT_THROW(board.syscfg.write({exticr, 4, 1}, 0x4), RefusedAccess) << "port E has no pins";
  EXPECT_THROW(board.syscfg.write({exticr, 4, 1}, 0x1'0000), RefusedAccess);
  EXPECT_THROW(board.syscfg.write({0, 4, 1}, 0), RefusedAccess) << "MEMRMP";
  EXPECT_THROW(board.syscfg.read({4, 4, 1}), RefusedAccess) << "PMC";
  EXPECT_THROW(board.syscfg.read({0x18, 4, 1}), RefusedAccess);
  EXPECT_THROW(board.syscfg.read({exticr, 2, 1}), RefusedAccess);
}

TEST(ExtiModel, TriggerSelection_OnlyTheSelectedEdgeOfTheRoutedPin) {
  Lines board;
  board.route(4, GpioPort::c);
  board.set(rtsr, 1U << 4);
  board.exti.set_pin(GpioPort::a, 4, true, 2);
  EXPECT_EQ(board.get(pr), 0U) << "another port's pin";
  board.exti.set_pin(GpioPort::c, 4, true, 2);
  EXPECT_EQ(board.get(pr), 1U << 4);
  board.set(pr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  EXPECT_EQ(board.get(pr), 0U) << "falling is not selected";
  board.set(ftsr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, true, 3);
  board.set(pr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  EXPECT_EQ(board.get(pr), 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  board.set(pr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  EXPECT_EQ(board.get(pr), 0U) << "no edge without a change";
}

TEST(ExtiModel, BlockDiagram_MaskComesAfterThePendingRegister) {
  Lines board;
  board.set(ftsr, 1U << 2);
  board.exti.set_pin(GpioPort::a, 2, true, 1);
  board.exti.set_pin(GpioPort::a, 2, false, 1);
  EXPECT_EQ(board.get(pr), 1U << 2);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  board.set(imr, 1U << 2);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti2)) << "an edge from before comes when unmasked";
  board.set(imr, 0);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  EXPECT_EQ(board.get(pr), 1U << 2);
}

TEST(ExtiModel, PendingRegister_WriteOneClearsThatLineOnly) {
  Lines board;
  board.set(rtsr, 0xFFFF);
  board.set(imr, 1U << 5 | 1U << 9);
  board.exti.set_pin(GpioPort::a, 5, true, 1);
  board.exti.set_pin(GpioPort::a, 9, true, 1);
  board.exti.set_pin(GpioPort::a, 0, true, 1);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti9_5));
  board.set(pr, 0);
  EXPECT_EQ(board.get(pr), 1U << 9 | 1U << 5 | 1U);
  board.set(pr, 1U << 5);
  EXPECT_EQ(board.get(pr), 1U << 9 | 1U);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti9_5)) << "line 9 still asks";
  board.set(pr, 1U << 9);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti9_5));
  EXPECT_EQ(board.interrupts.rises(Interrupt::exti9_5), 1U);
}

TEST(ExtiModel, VectorTable_EachLineHasItsVector) {
  for (unsigned line = 0; line < 16; ++line) {
    Lines board;
    board.set(rtsr, 1U << line);
    if (line == 0 || line == 1 || line == 3) {
      EXPECT_THROW(board.set(imr, 1U << line), RefusedAccess) << line;
      continue;
    }
    board.set(imr, 1U << line);
    board.exti.set_pin(GpioPort::a, line, true, 1);
    EXPECT_EQ(board.interrupts.level(Interrupt::exti2), line == 2);
    EXPECT_EQ(board.interrupts.level(Interrupt::exti4), line == 4);
    EXPECT_EQ(board.interrupts.level(Interrupt::exti9_5), line >= 5 && line <= 9) << line;
    EXPECT_EQ(board.interrupts.level(Interrupt::exti15_10), line >= 10) << line;
  }
}

TEST(ExtiModel, SoftwareInterruptEventRegister) {
  Lines board;
  EXPECT_THROW(board.set(swier, 1U << 4), RefusedAccess) << "masked";
  board.set(imr, 1U << 4);
  board.set(swier, 1U << 4);
  EXPECT_EQ(board.get(pr), 1U << 4);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti4));
  EXPECT_EQ(board.get(swier), 1U << 4);
  board.set(pr, 1U << 4);
  EXPECT_EQ(board.get(swier), 0U) << "falls with the pending bit";
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti4));
}

TEST(ExtiModel, MultiplexerChangeCanBeAnEdge) {
  Lines board;
  board.set(rtsr, 1U << 2);
  board.exti.set_pin(GpioPort::d, 2, true, 1);
  EXPECT_EQ(board.get(pr), 0U);
  board.route(2, GpioPort::d);
  EXPECT_EQ(board.get(pr), 1U << 2);
}

TEST(ExtiModel, RefusesEventsAndUpperLines) {
  Lines board;
  EXPECT_THROW(board.set(emr, 1), RefusedAccess);
  EXPECT_NO_THROW(board.set(emr, 0));
  EXPECT_THROW(board.set(imr, 1U << 16), RefusedAccess);
  EXPECT_THROW(board.set(rtsr, 1U << 22), RefusedAccess);
  EXPECT_THROW(board.get(0x18), RefusedAccess);
  EXPECT_THROW(board.exti.read({imr, 1, 1}), RefusedAccess);
}

TEST(ExtiModel, ResetForgetsButPinsStay) {
  Lines board;
  board.set(rtsr, 1U << 4);
  board.set(imr, 1U << 4);
  board.exti.set_pin(GpioPort::a, 4, true, 1);
  board.exti.reset(2);
  EXPECT_EQ(board.get(pr) | board.get(imr) | board.get(rtsr), 0U);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti4));
  board.set(rtsr, 1U << 4);
  board.exti.set_pin(GpioPort::a, 4, true, 3);
  EXPECT_EQ(board.get(pr), 0U) << "it was high all the time";
}

}  // namespace
}  // namespace kmax::virtual_board::exti_and_syscfg_test
