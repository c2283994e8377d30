// The drivers of the core's own peripherals on the models: drivers/cortex_m/system_tick.hpp and
// interrupt_controller.hpp.

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <utility>

#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/cortex_m/system_tick.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

namespace kmax::virtual_board::core_peripherals_on_model_test {
namespace {

using namespace drivers::cortex_m;
using namespace drivers::cortex_m;
using namespace drivers::cortex_m;
using namespace drivers::stm32f4;
using testing::RegisterOnModel;

template <std::size_t... index>
auto row(Peripheral& model, std::size_t offset, const BoardTime& now,
         std::index_sequence<index...> /*indices*/) {
  return std::array<RegisterOnModel, sizeof...(index)>{RegisterOnModel(model, offset + 4 * index, now)...};
}

struct Core {
  Core() : peripherals(bus, clocks) {
    clocks.core = 2;
    peripherals.reset(0);
  }
  void pass(BoardTime cycles) {
    now += 2 * cycles;
    while (peripherals.system_tick.next_event() <= now) {
      peripherals.system_tick.advance(peripherals.system_tick.next_event());
    }
  }

  Bus bus;
  BoardClocks clocks;
  BoardTime now = 0;
  CorePeripherals peripherals;
};

struct NvicOnModel {
  explicit NvicOnModel(Core& owner) : core(owner) {}
  Core& core;
  std::array<RegisterOnModel, 3> iser =
      row(core.peripherals.nvic, 0x000, core.now, std::make_index_sequence<3>());
  std::array<RegisterOnModel, 3> icer =
      row(core.peripherals.nvic, offsetof(NvicRegisters, icer), core.now, std::make_index_sequence<3>());
  std::array<RegisterOnModel, 3> ispr =
      row(core.peripherals.nvic, offsetof(NvicRegisters, ispr), core.now, std::make_index_sequence<3>());
  std::array<RegisterOnModel, 3> icpr =
      row(core.peripherals.nvic, offsetof(NvicRegisters, icpr), core.now, std::make_index_sequence<3>());
  std::array<RegisterOnModel, 21> ipr =
      row(core.peripherals.nvic, offsetof(NvicRegisters, ipr), core.now, std::make_index_sequence<21>());
};

struct ScbOnModel {
  explicit ScbOnModel(Core& core)
      : icsr(core.peripherals.system_control, offsetof(ScbRegisters, icsr), core.now),
        shpr(row(core.peripherals.system_control, offsetof(ScbRegisters, shpr), core.now,
                 std::make_index_sequence<3>())) {}
  RegisterOnModel icsr;
  std::array<RegisterOnModel, 3> shpr;
};

struct SystemTickOnModel {
  explicit SystemTickOnModel(Core& core)
      : ctrl(core.peripherals.system_tick, offsetof(SystemTickRegisters, ctrl), core.now),
        load(core.peripherals.system_tick, offsetof(SystemTickRegisters, load), core.now),
        val(core.peripherals.system_tick, offsetof(SystemTickRegisters, val), core.now) {}
  RegisterOnModel ctrl;
  RegisterOnModel load;
  RegisterOnModel val;
};

TEST(InterruptControllerOnModel, SetsPrioritiesEnablesAndPends) {
  Core core;
  NvicOnModel nvic(core);
  ScbOnModel scb(core);
  InterruptController<NvicOnModel, ScbOnModel> controller(nvic, scb);
  ExceptionTable& table = core.peripherals.exceptions;
  controller.set_priority(Interrupt::adc, 1);
  controller.set_priority(Interrupt::usart2, 9);
  controller.set_priority(SystemException::system_tick, 14);
  controller.enable(Interrupt::adc);
  controller.enable(Interrupt::usart2);
  EXPECT_EQ(table.priority(16 + 18), 0x10);
  EXPECT_EQ(table.priority(16 + 38), 0x90);
  EXPECT_EQ(table.priority(exception_number::system_tick), 0xE0);
  controller.pend(Interrupt::usart2);
  EXPECT_EQ(table.candidate(), 16U + 38);
  controller.pend(Interrupt::adc);
  EXPECT_EQ(table.candidate(), 16U + 18);
  controller.clear_pending(Interrupt::adc);
  controller.disable(Interrupt::usart2);
  EXPECT_EQ(table.candidate(), 0U);
}

TEST(SystemTickOnModel, GivesMicroseconds) {
  Core core;
  SystemTickOnModel registers(core);
  ScbOnModel scb(core);
  drivers::cortex_m::SystemTick<SystemTickOnModel, ScbOnModel> driver(registers, scb);
  ASSERT_TRUE(driver.start(168'000'000, 1000));
  std::uint32_t served = 0;
  for (std::uint32_t microsecond = 1; microsecond < 5000; ++microsecond) {
    core.pass(168);
    ASSERT_EQ(driver.now_us(), microsecond) << "pending ticks included";
    if (core.peripherals.exceptions.pending(exception_number::system_tick) && microsecond % 7 == 0) {
      core.peripherals.exceptions.clear_pending(exception_number::system_tick);
      driver.ISR_count();
      ++served;
      ASSERT_EQ(driver.now_us(), microsecond);
    }
  }
  EXPECT_EQ(served, 4U);
}

}  // namespace
}  // namespace kmax::virtual_board::core_peripherals_on_model_test
