#include "drivers/cortex_m/interrupt_controller.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "drivers/stm32f4/interrupts.hpp"

namespace kmax::drivers::cortex_m::interrupt_controller_test {

using stm32f4::Interrupt;

struct Blocks {
  NvicRegisters nvic{};
  ScbRegisters scb{};
  InterruptController<> controller{nvic, scb};
};

// A read-modify-write of ICER or ISPR would disable or pend all the others: these registers read back their
// state.
TEST(InterruptController, Usart2IsBit6OfTheSecondWordAndOnlyThatIsStored) {
  Blocks b;
  for (auto* words : {&b.nvic.icer, &b.nvic.ispr, &b.nvic.iser, &b.nvic.icpr}) (*words)[1] = 0xFFFF'FFFF;
  b.controller.disable(Interrupt::usart2);
  b.controller.pend(Interrupt::usart2);
  b.controller.enable(Interrupt::usart2);
  b.controller.clear_pending(Interrupt::usart2);
  for (auto* words : {&b.nvic.icer, &b.nvic.ispr, &b.nvic.iser, &b.nvic.icpr}) {
    EXPECT_EQ((*words)[0], 0U);
    EXPECT_EQ((*words)[1], 1U << 6);
  }
}

TEST(InterruptController, PriorityLivesInTheUpperFourBits) {
  Blocks b;
  b.controller.set_priority(Interrupt::usart2, 8);  // byte 38 = word 9, byte 2
  EXPECT_EQ(b.nvic.ipr[9], 0x0080'0000U);
  b.controller.set_priority(Interrupt::usart2, 255);
  EXPECT_EQ(b.nvic.ipr[9], 0x00F0'0000U) << "too large means least urgent, never most urgent";
}

TEST(InterruptController, SystemTickIsTheTopByteOfTheThirdWord) {
  Blocks b;
  b.controller.set_priority(SystemException::system_tick, 1);
  EXPECT_EQ(b.scb.shpr[2], 0x1000'0000U);
  b.controller.set_priority(SystemException::memory_management, 2);
  EXPECT_EQ(b.scb.shpr[0], 0x0000'0020U);
  b.controller.set_priority(SystemException::supervisor_call, 3);
  EXPECT_EQ(b.scb.shpr[1], 0x3000'0000U);
}

RC_GTEST_PROP(InterruptController, PriorityLeavesItsNeighboursAlone,
              (std::uint32_t before, std::uint8_t priority)) {
  Blocks b;
  const auto interrupt = *rc::gen::element(Interrupt::exti2, Interrupt::adc, Interrupt::can1_tx,
                                           Interrupt::usart2, Interrupt::tim8_up_tim13, Interrupt::uart4);
  const auto number = static_cast<unsigned>(interrupt);
  b.nvic.ipr[number / 4] = before;
  b.controller.set_priority(interrupt, priority);
  const std::uint32_t mask = 0xFFU << (8 * (number % 4));
  RC_ASSERT((b.nvic.ipr[number / 4] & ~mask) == (before & ~mask));
  RC_ASSERT(((b.nvic.ipr[number / 4] & mask) >> (8 * (number % 4))) == std::min<unsigned>(priority, 15) * 16);
}

}  // namespace kmax::drivers::cortex_m::interrupt_controller_test
