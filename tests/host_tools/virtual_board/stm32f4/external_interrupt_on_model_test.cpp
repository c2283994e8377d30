// drivers/stm32f4/external_interrupt.hpp on the models of GPIO, SYSCFG and EXTI, wired as the board wires
// them.
#include <gtest/gtest.h>

#include <cstddef>
#include <memory>

#include "drivers/stm32f4/external_interrupt.hpp"
#include "drivers/stm32f4/gpio.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"
#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

namespace kmax::virtual_board::external_interrupt_on_model_test {
namespace {

using drivers::stm32f4::Edge;
using drivers::stm32f4::ExtiRegisters;
using drivers::stm32f4::GpioPort;
using drivers::stm32f4::Interrupt;
using drivers::stm32f4::PinLocation;
using drivers::stm32f4::SyscfgRegisters;
using testing::RegisterOnModel;

constexpr PinLocation fault{GpioPort::d, 2}, emergency_stop{GpioPort::c, 4}, index0{GpioPort::c, 9};

struct ExtiOnModel {
  ExtiOnModel(Peripheral& model, const BoardTime& now)
      : imr{model, offsetof(ExtiRegisters, imr), now},
        rtsr{model, offsetof(ExtiRegisters, rtsr), now},
        ftsr{model, offsetof(ExtiRegisters, ftsr), now},
        pr{model, offsetof(ExtiRegisters, pr), now} {}
  RegisterOnModel imr, rtsr, ftsr, pr;
};
struct SyscfgOnModel {
  SyscfgOnModel(Peripheral& model, const BoardTime& now)
      : exticr{{model, offsetof(SyscfgRegisters, exticr), now},
               {model, offsetof(SyscfgRegisters, exticr) + 4, now},
               {model, offsetof(SyscfgRegisters, exticr) + 8, now},
               {model, offsetof(SyscfgRegisters, exticr) + 12, now}} {}
  RegisterOnModel exticr[4];
};

struct Board {
  Board() {
    for (const GpioPort each : {GpioPort::a, GpioPort::b, GpioPort::c, GpioPort::d}) {
      ports[static_cast<unsigned>(each)] = std::make_unique<GpioPortModel>(each);
      port(each).on_input_change(
          [this, each](unsigned pin, bool level, BoardTime when) { exti.set_pin(each, pin, level, when); });
    }
  }
  GpioPortModel& port(GpioPort which) { return *ports[static_cast<unsigned>(which)]; }
  void pull_up(PinLocation pin) {
    port(pin.port).write({offsetof(drivers::stm32f4::GpioRegisters, pupdr), 4, now}, 1U << (2 * pin.number));
  }

  BoardTime now = 1;
  testing::RecordedInterrupts interrupts;
  SyscfgModel syscfg;
  ExtiModel exti{syscfg, interrupts};
  std::unique_ptr<GpioPortModel> ports[4];
  ExtiOnModel exti_registers{exti, now};
  SyscfgOnModel syscfg_registers{syscfg, now};
  drivers::stm32f4::ExternalInterrupts<ExtiOnModel, SyscfgOnModel> lines{exti_registers, syscfg_registers};
};

TEST(ExternalInterruptOnModel, FloatingFaultWithPullUpReadsHighAndIsQuiet) {
  Board board;
  board.pull_up(fault);
  ASSERT_TRUE(board.lines.configure(fault, Edge::falling));
  board.lines.enable(2);
  EXPECT_TRUE(board.port(GpioPort::d).level(2));
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  EXPECT_FALSE(board.lines.ISR_take(2));
}

TEST(ExternalInterruptOnModel, ShortPulseOnFaultStaysPending) {
  Board board;
  board.pull_up(fault);
  ASSERT_TRUE(board.lines.configure(fault, Edge::falling));
  board.lines.enable(2);
  board.port(GpioPort::d).drive(2, PinDrive::low, 100);
  board.port(GpioPort::d).drive(2, PinDrive::floating, 101);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti2));
  EXPECT_TRUE(board.lines.ISR_take(2));
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  EXPECT_FALSE(board.lines.ISR_take(2));
}

TEST(ExternalInterruptOnModel, EmergencyStopContactOpens) {
  Board board;
  board.pull_up(emergency_stop);
  board.port(GpioPort::c).drive(4, PinDrive::low, 1);  // contact closed
  ASSERT_TRUE(board.lines.configure(emergency_stop, Edge::rising));
  board.lines.enable(4);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti4));
  board.port(GpioPort::c).drive(4, PinDrive::floating, 5);  // pressed, or the cable is off
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti4));
  EXPECT_TRUE(board.lines.ISR_take(4));
}

TEST(ExternalInterruptOnModel, RoutingToAHighPinIsNotReportedAsAnEdge) {
  Board board;
  board.port(GpioPort::c).drive(9, PinDrive::high, 1);
  ASSERT_TRUE(board.lines.configure(index0, Edge::rising));
  board.lines.enable(9);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti9_5));
  // Configured anew with the edges already selected: the route's change is an edge, and is forgotten.
  ASSERT_TRUE(board.lines.configure({GpioPort::a, 9}, Edge::both));
  ASSERT_TRUE(board.lines.configure(index0, Edge::both));
  board.lines.enable(9);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti9_5));
  EXPECT_EQ(board.interrupts.rises(Interrupt::exti9_5), 0U);
}

TEST(ExternalInterruptOnModel, EdgeBetweenConfigureAndEnableIsNotLost) {
  Board board;
  board.pull_up(fault);
  ASSERT_TRUE(board.lines.configure(fault, Edge::falling));
  board.port(GpioPort::d).drive(2, PinDrive::low, 2);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  board.lines.enable(2);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti2));
}

}  // namespace
}  // namespace kmax::virtual_board::external_interrupt_on_model_test
