// PM0214, nested vectored interrupt controller.

#include "host_tools/virtual_board/cortex_m/nvic.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::nvic_test {

using drivers::cortex_m::NvicRegisters;
using drivers::stm32f4::Interrupt;

struct Controller : testing::ModelBench {
  Controller() : ModelBench({&nvic}) { exceptions.reset(); }
  static unsigned exception(unsigned interrupt) { return 16 + interrupt; }

  ExceptionTable exceptions{82};
  Nvic nvic{exceptions};
  SoftwareTrigger trigger{exceptions};
};

constexpr std::size_t iser = offsetof(NvicRegisters, iser);
constexpr std::size_t icer = offsetof(NvicRegisters, icer);
constexpr std::size_t ispr = offsetof(NvicRegisters, ispr);
constexpr std::size_t icpr = offsetof(NvicRegisters, icpr);
constexpr std::size_t iabr = offsetof(NvicRegisters, iabr);
constexpr std::size_t ipr = offsetof(NvicRegisters, ipr);

TEST(Nvic, HasAsManyInterruptsAsTheChip) {
  ExceptionTable exceptions{40};
  exceptions.reset();
  Nvic nvic{exceptions};
  const auto enable = [&](unsigned interrupt) {
    nvic.write({static_cast<std::uint32_t>(iser + 4 * (interrupt / 32)), 4, 0}, 1U << (interrupt % 32));
  };
  enable(39);
  EXPECT_TRUE(exceptions.enabled(Controller::exception(39)));
  exceptions.set_line(Controller::exception(39), true);
  EXPECT_EQ(exceptions.candidate(), Controller::exception(39));
  EXPECT_THROW(enable(40), RefusedAccess);
}

TEST(Nvic, SetsAndClearsEnablesByOnes_IserIcer) {
  Controller controller;
  for (unsigned interrupt = 0; interrupt < 82; ++interrupt) {
    const std::size_t word = 4 * (interrupt / 32);
    const std::uint32_t bit = 1U << (interrupt % 32);
    controller.write(iser + word, bit);
    EXPECT_TRUE(controller.exceptions.enabled(Controller::exception(interrupt)));
    EXPECT_EQ(controller.read(iser + word), bit);
    EXPECT_EQ(controller.read(icer + word), bit);
    controller.write(iser + word, 0);
    EXPECT_EQ(controller.read(iser + word), bit);
    controller.write(icer + word, bit);
    EXPECT_EQ(controller.read(iser + word), 0U);
  }
}

TEST(Nvic, PendsAndClears_IsprIcprIabr) {
  Controller controller;
  controller.write(ispr + 4, 1U << 6 | 1U << 31);
  EXPECT_TRUE(controller.exceptions.pending(Controller::exception(38)));
  EXPECT_EQ(controller.read(ispr + 4), 1U << 6 | 1U << 31);
  controller.write(icpr + 4, 1U << 31);
  EXPECT_EQ(controller.read(icpr + 4), 1U << 6);
  controller.exceptions.activate(Controller::exception(38));
  EXPECT_EQ(controller.read(iabr + 4), 1U << 6);
  EXPECT_EQ(controller.read(ispr + 4), 0U);
}

TEST(Nvic, TakesPrioritiesAsBytesHalfWordsAndWords_Ipr) {
  Controller controller;
  controller.write(ipr + 38, 0x5F, 1);
  EXPECT_EQ(controller.exceptions.priority(Controller::exception(38)), 0x50);
  EXPECT_EQ(controller.read(ipr + 38, 1), 0x50U);
  controller.write(ipr + 40, 0x1122'3344);
  EXPECT_EQ(controller.read(ipr + 40), 0x1020'3040U);
  EXPECT_EQ(controller.read(ipr + 42, 2), 0x1020U);
  controller.write(ipr + 42, 0xF0E0, 2);
  EXPECT_EQ(controller.read(ipr + 40), 0xF0E0'3040U);
  EXPECT_EQ(controller.exceptions.priority(Controller::exception(39)), 0) << "neighbours keep theirs";
  EXPECT_EQ(controller.exceptions.priority(Controller::exception(44)), 0);
  controller.write(ipr + 80, 0xFFFF'FFFF);  // 82 and 83 do not exist
  EXPECT_EQ(controller.read(ipr + 80), 0x0000'F0F0U);
}

TEST(Nvic, RefusesInterruptsThatDoNotExist) {
  Controller controller;
  EXPECT_NO_THROW(controller.write(iser + 8, 1U << 17));  // 81
  EXPECT_THROW(controller.write(iser + 8, 1U << 18), RefusedAccess);
  EXPECT_THROW(controller.write(ispr + 12, 1), RefusedAccess);
  EXPECT_NO_THROW(controller.write(icer + 8, 0xFFFF'FFFF)) << "clearing all is what boot code does";
  EXPECT_NO_THROW(controller.write(icpr + 28, 0xFFFF'FFFF));
}

TEST(Nvic, RefusesWhatIsNoRegister) {
  Controller controller;
  EXPECT_THROW(controller.read(0x20), RefusedAccess);
  EXPECT_THROW(controller.write(0x20, 0), RefusedAccess);
  EXPECT_THROW(controller.read(iser, 1), RefusedAccess);
  EXPECT_THROW(controller.write(ispr, 1, 2), RefusedAccess);
  EXPECT_THROW(controller.write(iabr, 1), RefusedAccess);
}

TEST(Nvic, PendsByNumber_Stir) {
  Controller controller;
  controller.trigger.write({0, 4, 0}, 81);
  EXPECT_TRUE(controller.exceptions.pending(Controller::exception(81)));
  EXPECT_THROW(controller.trigger.write({0, 4, 0}, 82), RefusedAccess);
  EXPECT_THROW(controller.trigger.read({0, 4, 0}), RefusedAccess);
}

TEST(Nvic, TakesLinesOfPeripherals) {
  Controller controller;
  InterruptLines& lines = controller.nvic;
  lines.set_level(Interrupt::can1_rx0, true);
  EXPECT_EQ(controller.read(ispr), 1U << 20);
  controller.write(icpr, 1U << 20);
  EXPECT_EQ(controller.read(ispr), 1U << 20) << "the line is still high";
  lines.set_level(Interrupt::can1_rx0, false);
  controller.write(icpr, 1U << 20);
  EXPECT_EQ(controller.read(ispr), 0U);
}

}  // namespace kmax::virtual_board::nvic_test
