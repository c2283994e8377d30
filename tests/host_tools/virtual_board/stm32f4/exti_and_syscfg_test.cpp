// RM0090, chapters Interrupts and events (section External interrupt/event controller) and System
// configuration controller (section SYSCFG external interrupt configuration registers). And the driver on the
// models.
#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>

#include "drivers/stm32f4/external_interrupt.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"
#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::exti_and_syscfg_test {

using drivers::stm32f4::Edge;
using drivers::stm32f4::ExtiRegisters;
using drivers::stm32f4::GpioPort;
using drivers::stm32f4::Interrupt;
using drivers::stm32f4::PinLocation;
using drivers::stm32f4::SyscfgRegisters;
using testing::RegisterOnModel;

constexpr std::uint32_t imr = offsetof(ExtiRegisters, imr), emr = offsetof(ExtiRegisters, emr),
                        rtsr = offsetof(ExtiRegisters, rtsr), ftsr = offsetof(ExtiRegisters, ftsr),
                        swier = offsetof(ExtiRegisters, swier), pr = offsetof(ExtiRegisters, pr);
constexpr std::uint32_t exticr = offsetof(SyscfgRegisters, exticr);

struct Lines : testing::ModelBench {
  Lines() : ModelBench({&exti}, 1) {}
  void route(unsigned line, GpioPort port) {
    const std::uint32_t offset = exticr + 4 * (line / 4);
    const std::uint32_t old = syscfg.read({offset, 4, 1}) & ~(0xFU << (4 * (line % 4)));
    syscfg.write({offset, 4, 1}, old | static_cast<std::uint32_t>(port) << (4 * (line % 4)));
  }

  SyscfgModel syscfg;
  ExtiModel exti{syscfg, interrupts};
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
  EXPECT_THROW(board.syscfg.read({4, 4, 1}), RefusedAccess) << "PMC";
  EXPECT_THROW(board.syscfg.read({0x18, 4, 1}), RefusedAccess);
  EXPECT_THROW(board.syscfg.read({exticr, 2, 1}), RefusedAccess);
}

TEST(SyscfgModel, MemoryRemapRegister) {
  Lines board;
  std::vector<bool> shown;
  board.syscfg.on_memory_at_zero([&shown](bool sram) { shown.push_back(sram); });
  for (const std::uint32_t mode : {3U, 1U, 3U, 0U, 3U}) {
    board.syscfg.write({0, 4, 1}, mode);
    EXPECT_EQ(board.syscfg.read({0, 4, 1}), mode);
  }
  EXPECT_THROW(board.syscfg.write({0, 4, 1}, 2), RefusedAccess) << "external memory";
  EXPECT_THROW(board.syscfg.write({0, 4, 1}, 7), RefusedAccess) << "a bit that the part does not have";
  EXPECT_EQ(board.syscfg.read({0, 4, 1}), 3U);
  board.syscfg.reset(2);
  EXPECT_EQ(board.syscfg.read({0, 4, 1}), 0U);
  EXPECT_EQ(shown, (std::vector{true, false, true, false, true, false}));
}

TEST(ExtiModel, TriggerSelection_OnlyTheSelectedEdgeOfTheRoutedPin) {
  Lines board;
  board.route(4, GpioPort::c);
  board.write(rtsr, 1U << 4);
  board.exti.set_pin(GpioPort::a, 4, true, 2);
  EXPECT_EQ(board.read(pr), 0U) << "another port's pin";
  board.exti.set_pin(GpioPort::c, 4, true, 2);
  EXPECT_EQ(board.read(pr), 1U << 4);
  board.write(pr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  EXPECT_EQ(board.read(pr), 0U) << "falling is not selected";
  board.write(ftsr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, true, 3);
  board.write(pr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  EXPECT_EQ(board.read(pr), 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  board.write(pr, 1U << 4);
  board.exti.set_pin(GpioPort::c, 4, false, 3);
  EXPECT_EQ(board.read(pr), 0U) << "no edge without a change";
}

TEST(ExtiModel, BlockDiagram_MaskComesAfterThePendingRegister) {
  Lines board;
  board.write(ftsr, 1U << 2);
  board.exti.set_pin(GpioPort::a, 2, true, 1);
  board.exti.set_pin(GpioPort::a, 2, false, 1);
  EXPECT_EQ(board.read(pr), 1U << 2);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  board.write(imr, 1U << 2);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti2)) << "an edge from before comes when unmasked";
  board.write(imr, 0);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti2));
  EXPECT_EQ(board.read(pr), 1U << 2);
}

TEST(ExtiModel, PendingRegister_WriteOneClearsThatLineOnly) {
  Lines board;
  board.write(rtsr, 0xFFFF);
  board.write(imr, 1U << 5 | 1U << 9);
  board.exti.set_pin(GpioPort::a, 5, true, 1);
  board.exti.set_pin(GpioPort::a, 9, true, 1);
  board.exti.set_pin(GpioPort::a, 0, true, 1);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti9_5));
  board.write(pr, 0);
  EXPECT_EQ(board.read(pr), 1U << 9 | 1U << 5 | 1U);
  board.write(pr, 1U << 5);
  EXPECT_EQ(board.read(pr), 1U << 9 | 1U);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti9_5)) << "line 9 still asks";
  board.write(pr, 1U << 9);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti9_5));
  EXPECT_EQ(board.interrupts.rises(Interrupt::exti9_5), 1U);
}

TEST(ExtiModel, VectorTable_EachLineHasItsVector) {
  for (unsigned line = 0; line < 16; ++line) {
    Lines board;
    board.write(rtsr, 1U << line);
    if (line == 0 || line == 1 || line == 3) {
      EXPECT_THROW(board.write(imr, 1U << line), RefusedAccess) << line;
      continue;
    }
    board.write(imr, 1U << line);
    board.exti.set_pin(GpioPort::a, line, true, 1);
    EXPECT_EQ(board.interrupts.level(Interrupt::exti2), line == 2);
    EXPECT_EQ(board.interrupts.level(Interrupt::exti4), line == 4);
    EXPECT_EQ(board.interrupts.level(Interrupt::exti9_5), line >= 5 && line <= 9) << line;
    EXPECT_EQ(board.interrupts.level(Interrupt::exti15_10), line >= 10) << line;
  }
}

TEST(ExtiModel, SoftwareInterruptEventRegister) {
  Lines board;
  EXPECT_THROW(board.write(swier, 1U << 4), RefusedAccess) << "masked";
  board.write(imr, 1U << 4);
  board.write(swier, 1U << 4);
  EXPECT_EQ(board.read(pr), 1U << 4);
  EXPECT_TRUE(board.interrupts.level(Interrupt::exti4));
  EXPECT_EQ(board.read(swier), 1U << 4);
  board.write(pr, 1U << 4);
  EXPECT_EQ(board.read(swier), 0U) << "falls with the pending bit";
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti4));
}

TEST(ExtiModel, MultiplexerChangeCanBeAnEdge) {
  Lines board;
  board.write(rtsr, 1U << 2);
  board.exti.set_pin(GpioPort::d, 2, true, 1);
  EXPECT_EQ(board.read(pr), 0U);
  board.route(2, GpioPort::d);
  EXPECT_EQ(board.read(pr), 1U << 2);
}

TEST(ExtiModel, RefusesEventsAndUpperLines) {
  Lines board;
  EXPECT_THROW(board.write(emr, 1), RefusedAccess);
  EXPECT_NO_THROW(board.write(emr, 0));
  EXPECT_THROW(board.write(imr, 1U << 16), RefusedAccess);
  EXPECT_THROW(board.write(rtsr, 1U << 22), RefusedAccess);
  EXPECT_THROW(board.read(0x18), RefusedAccess);
  EXPECT_THROW(board.read(imr, 1), RefusedAccess);
}

TEST(ExtiModel, ResetForgetsButPinsStay) {
  Lines board;
  board.write(rtsr, 1U << 4);
  board.write(imr, 1U << 4);
  board.exti.set_pin(GpioPort::a, 4, true, 1);
  board.exti.reset(2);
  EXPECT_EQ(board.read(pr) | board.read(imr) | board.read(rtsr), 0U);
  EXPECT_FALSE(board.interrupts.level(Interrupt::exti4));
  board.write(rtsr, 1U << 4);
  board.exti.set_pin(GpioPort::a, 4, true, 3);
  EXPECT_EQ(board.read(pr), 0U) << "it was high all the time";
}

// drivers/stm32f4/external_interrupt.hpp on these models and those of the ports, wired as the board wires
// them.
constexpr PinLocation fault{GpioPort::d, 2}, emergency_stop{GpioPort::c, 4}, index0{GpioPort::c, 9};

struct ExtiOnModel {
  RegisterOnModel imr, emr, rtsr, ftsr, swier, pr;
};
struct SyscfgOnModel {
  RegisterOnModel memrmp, pmc, exticr[4];
};

struct Board : Lines {
  Board() {
    for (const GpioPort each : {GpioPort::a, GpioPort::b, GpioPort::c, GpioPort::d}) {
      port(each).on_input_change(
          [this, each](unsigned pin, bool level, BoardTime when) { exti.set_pin(each, pin, level, when); });
    }
  }
  GpioPortModel& port(GpioPort which) { return ports[static_cast<unsigned>(which)]; }
  void pull_up(PinLocation pin) {
    port(pin.port).write({offsetof(drivers::stm32f4::GpioRegisters, pupdr), 4, now}, 1U << (2 * pin.number));
  }

  std::array<GpioPortModel, 4> ports{GpioPortModel{GpioPort::a}, GpioPortModel{GpioPort::b},
                                     GpioPortModel{GpioPort::c}, GpioPortModel{GpioPort::d}};
  ExtiOnModel exti_registers = block_on_model<ExtiOnModel>(*this, exti);
  SyscfgOnModel syscfg_registers = block_on_model<SyscfgOnModel>(*this, syscfg);
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
  // Configured again with the edges already selected: the route's change is an edge, and is forgotten.
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

}  // namespace kmax::virtual_board::exti_and_syscfg_test
