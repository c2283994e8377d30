// The very table that goes into flash, linked here with handlers of the test: overriding works, and the
// positions are right.

#include "board/stm32f405/vectors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "board/odrive_v3/pins.hpp"
#include "board/stm32f405/unique_id.hpp"
#include "drivers/cortex_m/fault_handler.hpp"
#include "drivers/stm32f4/interrupts.hpp"

extern "C" {
std::uint32_t kmax_stack_top[1];
}
void ISR_reset() {
  throw std::logic_error("reset");
}
void ISR_hard_fault() {}
void ISR_system_tick() {}
void ISR_usart2() {}
void ISR_fpu() {}

namespace kmax::drivers::cortex_m {

void stop_on_unexpected_interrupt() {
  throw std::runtime_error("unexpected interrupt");
}

}  // namespace kmax::drivers::cortex_m

namespace kmax::board::vectors_test {

using drivers::stm32f4::Interrupt;

TEST(Vectors, HeadOfTheTable) {
  EXPECT_EQ(vector_table.initial_stack_pointer, kmax_stack_top);
  EXPECT_EQ(vector_table.at(1), &ISR_reset);
  EXPECT_EQ(vector_table.at(3), &ISR_hard_fault);
  for (const std::size_t fault : {4U, 5U, 6U}) EXPECT_EQ(vector_table.at(fault), &ISR_hard_fault);
  for (const std::size_t reserved : {7U, 8U, 9U, 10U, 13U}) EXPECT_EQ(vector_table.at(reserved), nullptr);
  EXPECT_EQ(vector_table.at(15), &ISR_system_tick);
}

TEST(Vectors, HandlersAreAtTheirInterruptNumbers) {
  EXPECT_EQ(vector_table.at(Interrupt::usart2), &ISR_usart2);
  EXPECT_EQ(vector_table.at(16 + 38), &ISR_usart2);
  EXPECT_EQ(vector_table.at(16 + 81), &ISR_fpu) << "the last entry: nothing in between is missing or doubled";
  EXPECT_EQ(vector_table.at(Interrupt::uart4), &ISR_uart4);
  EXPECT_EQ(std::count(std::begin(vector_table.exception), std::end(vector_table.exception), &ISR_usart2), 1);
}

TEST(Vectors, EverythingElseStops) {
  unsigned defaults = 0;
  for (std::size_t number = 16; number < 98; ++number) {
    if (number == 16 + 38 || number == 16 + 81) continue;
    ASSERT_NE(vector_table.at(number), nullptr) << number;
    EXPECT_THROW(vector_table.at(number)(), std::runtime_error) << number;
    ++defaults;
  }
  EXPECT_EQ(defaults, 80U);
  for (const std::size_t number : {2U, 11U, 12U, 14U}) {
    EXPECT_THROW(vector_table.at(number)(), std::runtime_error) << number;
  }
}

TEST(UniqueId, OneChangedBitChangesTheSerialNumber) {
  const volatile std::uint32_t words[3] = {0x0027'0032, 0x3137'5103, 0x3233'3637};
  const std::uint32_t serial = fold_unique_id(words);
  for (unsigned bit = 0; bit < 96; ++bit) {
    volatile std::uint32_t changed[3] = {words[0], words[1], words[2]};
    changed[bit / 32] = changed[bit / 32] ^ (1U << (bit % 32));
    EXPECT_NE(fold_unique_id(changed), serial) << bit;
  }
  const volatile std::uint32_t zero[3] = {0, 0, 0};
  EXPECT_NE(fold_unique_id(zero), 0U) << "0 means unknown";
}

TEST(OdriveV3Pins, GatesAreOffAndTheMasterSwitchComesFirst) {
  using namespace odrive_v3;
  EXPECT_EQ(power_stage_off.front().pin, pins::gate_enable);
  unsigned gates = 0;
  for (const PinState& state : power_stage_off) {
    const bool driven_high = state.config.mode == GpioMode::output && state.config.initial_level;
    const bool select = state.pin == pins::gate_driver0_select || state.pin == pins::gate_driver1_select;
    EXPECT_EQ(driven_high, select) << "only chip selects may be high";
    EXPECT_NE(state.config.mode, GpioMode::alternate);
    gates += state.config.mode == GpioMode::input && state.config.pull == GpioPull::down ? 1 : 0;
    // PA13 and PA14 are the debug port.
    EXPECT_FALSE(state.pin.port == GpioPort::a && (state.pin.number == 13 || state.pin.number == 14));
  }
  EXPECT_EQ(gates, 12U);
}

}  // namespace kmax::board::vectors_test
