// RM0090, chapter General-purpose I/Os (GPIO). Test names say which section they hold the model against.
#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "drivers/stm32f4/gpio.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::gpio_port_test {

using drivers::stm32f4::GpioMode;
using drivers::stm32f4::GpioPort;
using drivers::stm32f4::GpioPull;
using Registers = drivers::stm32f4::GpioRegisters;

constexpr std::uint32_t moder = offsetof(Registers, moder), otyper = offsetof(Registers, otyper),
                        pupdr = offsetof(Registers, pupdr), idr = offsetof(Registers, idr),
                        odr = offsetof(Registers, odr), bsrr = offsetof(Registers, bsrr);

struct Port : testing::ModelBench {
  explicit Port(GpioPort which = GpioPort::c) : ModelBench({&model}, 5), model(which) {}
  GpioPortModel model;
};

TEST(GpioPortModel, GpioRegisters_ResetValuesOfEachPort) {
  struct Row {
    GpioPort port;
    std::uint32_t moder, ospeedr, pupdr;
  };
  for (const Row& row : {Row{GpioPort::a, 0xA800'0000, 0, 0x6400'0000}, Row{GpioPort::b, 0x280, 0xC0, 0x100},
                         Row{GpioPort::c, 0, 0, 0}, Row{GpioPort::d, 0, 0, 0}}) {
    Port port{row.port};
    for (int round = 0; round < 2; ++round) {
      EXPECT_EQ(port.read(moder), row.moder);
      EXPECT_EQ(port.read(offsetof(Registers, ospeedr)), row.ospeedr);
      EXPECT_EQ(port.read(pupdr), row.pupdr);
      for (const std::size_t offset : {offsetof(Registers, otyper), offsetof(Registers, odr),
                                       offsetof(Registers, afr), offsetof(Registers, afr) + 4}) {
        EXPECT_EQ(port.read(static_cast<std::uint32_t>(offset)), 0U) << offset;
      }
      port.write(moder, 0x5555'5555);
      port.write(odr, 0xFFFF);
      port.write(pupdr, 0);
      port.write(offsetof(Registers, ospeedr), 0xFFFF'FFFF);
      port.write(offsetof(Registers, afr) + 4, 0x1234'5678);
      port.write(otyper, 0xF0F0);
      port.model.reset(9);
    }
  }
}

TEST(GpioPortModel, GpioRegisters_DebugPinsPullAsTheyComeOutOfReset) {
  Port port{GpioPort::a};
  EXPECT_EQ(port.read(idr), 1U << 13 | 1U << 15) << "SWDIO and JTDI up, SWCLK down";
  EXPECT_EQ(port.model.mode(13), GpioMode::alternate);
  EXPECT_EQ(port.model.mode(0), GpioMode::input);
}

TEST(GpioPortModel, InputConfiguration_FloatingInputIsDecidedByThePull) {
  Port port{GpioPort::d};
  EXPECT_TRUE(port.model.floats(2));
  EXPECT_FALSE(port.model.level(2));
  port.write(pupdr, 1U << 4);
  EXPECT_EQ(port.read(idr), 1U << 2) << "nFAULT open, pull-up";
  EXPECT_FALSE(port.model.floats(2));
  port.model.drive(2, PinDrive::low, 6);
  EXPECT_EQ(port.read(idr), 0U);
  port.model.drive(2, PinDrive::floating, 7);
  EXPECT_EQ(port.read(idr), 1U << 2);
  port.write(pupdr, 2U << 4);
  EXPECT_EQ(port.read(idr), 0U);
  EXPECT_FALSE(port.model.floats(2));
  port.model.drive(2, PinDrive::high, 8);
  EXPECT_EQ(port.read(idr), 1U << 2);
}

TEST(GpioPortModel, InputConfiguration_ResistorOnTheBoardBeatsThePullInside) {
  Port port;
  port.write(pupdr, 2U);
  port.model.drive(0, PinDrive::pulled_up, 1);
  EXPECT_TRUE(port.model.level(0));
  port.write(pupdr, 1U);
  port.model.drive(0, PinDrive::pulled_down, 1);
  EXPECT_FALSE(port.model.level(0));
  port.write(odr, 1);
  port.write(moder, 1);
  EXPECT_TRUE(port.model.level(0)) << "an output beats a resistor";
}

TEST(GpioPortModel, OutputConfiguration_PushPullAndOpenDrain) {
  Port port;
  port.write(moder, 1U << 10);
  EXPECT_EQ(port.model.output(5), PinOutput::low);
  port.write(bsrr, 1U << 5);
  EXPECT_EQ(port.model.output(5), PinOutput::high);
  EXPECT_EQ(port.read(idr), 1U << 5) << "the input buffer stays on";
  port.write(otyper, 1U << 5);
  EXPECT_EQ(port.model.output(5), PinOutput::released);
  EXPECT_TRUE(port.model.floats(5));
  port.write(pupdr, 1U << 10);
  EXPECT_TRUE(port.model.level(5));
  port.model.drive(5, PinDrive::low, 6);
  EXPECT_FALSE(port.model.level(5)) << "wired or";
  port.write(bsrr, 1U << 21);
  EXPECT_EQ(port.model.output(5), PinOutput::low);
}

TEST(GpioPortModel, OutputConfiguration_ShortCircuitIsRefused) {
  Port port;
  port.model.drive(5, PinDrive::high, 1);
  EXPECT_THROW(port.write(moder, 1U << 10), RefusedAccess);
  Port other;
  other.write(moder, 1U << 10);
  EXPECT_NO_THROW(other.model.drive(5, PinDrive::low, 1));
  EXPECT_THROW(other.model.drive(5, PinDrive::high, 1), RefusedAccess);
  Port drain;
  drain.write(otyper, 1U << 5);
  drain.write(odr, 1U << 5);
  drain.write(moder, 1U << 10);
  EXPECT_NO_THROW(drain.model.drive(5, PinDrive::low, 1)) << "an open drain that is off is no short circuit";
}

TEST(GpioPortModel, AnalogConfiguration_ReadsZeroAndDoesNotPull) {
  Port port;
  port.model.drive(1, PinDrive::high, 1);
  port.write(moder, 3U << 2);
  EXPECT_EQ(port.read(idr), 0U);
  port.model.drive(1, PinDrive::floating, 1);
  port.write(pupdr, 1U << 2);
  EXPECT_TRUE(port.model.floats(1));
  port.write(moder, 0);
  EXPECT_EQ(port.read(idr), 2U);
}

TEST(GpioPortModel, BitSetResetRegister_SetWinsAndZeroLeavesAlone) {
  Port port;
  port.write(odr, 0x00F0);
  port.write(bsrr, 0x0030'0011U);
  EXPECT_EQ(port.read(odr), 0x00D1U) << "pins 4 set and reset: set wins";
  EXPECT_EQ(port.read(bsrr), 0U) << "write only";
}

TEST(GpioPortModel, GpioRegisters_ByteAndHalfWordAccess) {
  Port port;
  port.write(moder, 0x5555'5555);
  port.write(odr, 0xA5, 1);
  port.write(odr + 1, 0x3C, 1);
  EXPECT_EQ(port.read(odr), 0x3CA5U);
  EXPECT_EQ(port.read(idr + 1, 1), 0x3CU);
  EXPECT_EQ(port.read(idr, 2), 0x3CA5U);
  port.write(bsrr + 2, 0x00FF, 2);
  EXPECT_EQ(port.read(odr), 0x3C00U) << "the upper half resets";
  port.write(bsrr + 1, 0x03, 1);
  EXPECT_EQ(port.read(odr), 0x3F00U);
  EXPECT_THROW(port.write(moder, 0, 2), RefusedAccess);
  EXPECT_THROW(port.read(pupdr, 1), RefusedAccess);
}

TEST(GpioPortModel, RefusesWhatIsNotModelled) {
  Port port;
  EXPECT_THROW(port.write(offsetof(Registers, lckr), 0x1'0001), RefusedAccess);
  EXPECT_THROW(port.read(offsetof(Registers, lckr)), RefusedAccess);
  EXPECT_THROW(port.write(idr, 0), RefusedAccess);
  EXPECT_THROW(port.write(pupdr, 3U << 6), RefusedAccess);
  EXPECT_THROW(port.write(odr, 0x1'0000), RefusedAccess);
  EXPECT_THROW(port.write(otyper, 0x1'0000), RefusedAccess);
  EXPECT_THROW(port.read(0x28), RefusedAccess);
  EXPECT_THROW(port.write(0x28, 0), RefusedAccess);
}

struct Change {
  unsigned pin;
  int level;
  BoardTime now;
  friend bool operator==(const Change&, const Change&) = default;
};

TEST(GpioPortModel, TellsChangesOnce) {
  Port port;
  std::vector<Change> outputs, inputs;
  port.model.on_output_change([&](unsigned pin, PinOutput output, BoardTime now) {
    outputs.push_back({pin, static_cast<int>(output), now});
  });
  port.model.on_input_change([&](unsigned pin, bool level, BoardTime now) {
    inputs.push_back({pin, level, now});
  });
  port.write(bsrr, 1U << 3);
  EXPECT_TRUE(outputs.empty()) << "not an output yet";
  port.write(moder, 1U << 6);
  port.write(bsrr, 1U << 3);
  port.model.drive(7, PinDrive::high, 11);
  port.model.drive(7, PinDrive::high, 12);
  port.model.drive(7, PinDrive::pulled_up, 13);
  port.model.reset(14);
  EXPECT_EQ(outputs, (std::vector<Change>{{3, static_cast<int>(PinOutput::high), 5},
                                          {3, static_cast<int>(PinOutput::released), 14}}));
  EXPECT_EQ(inputs, (std::vector<Change>{{3, 1, 5}, {7, 1, 11}, {3, 0, 14}}));
}

TEST(GpioPortModel, ListenerLearnsWhatIsHighAlready) {
  Port port{GpioPort::a};
  std::vector<unsigned> high;
  port.model.on_input_change([&](unsigned pin, bool level, BoardTime) {
    EXPECT_TRUE(level);
    high.push_back(pin);
  });
  EXPECT_EQ(high, (std::vector<unsigned>{13, 15}));
}

// A gate driver that answers on another pin of the port from inside the callback.
TEST(GpioPortModel, ListenerMayDriveBack) {
  Port port;
  std::uint32_t seen = 0;
  port.model.drive(9, PinDrive::high, 1);
  port.model.on_output_change([&](unsigned pin, PinOutput output, BoardTime now) {
    if (pin != 2) return;
    port.model.drive(9, output == PinOutput::high ? PinDrive::low : PinDrive::high, now);
    port.model.drive(1, PinDrive::high, now);
  });
  port.model.on_input_change(
      [&](unsigned pin, bool level, BoardTime) { seen = level ? seen | 1U << pin : seen & ~(1U << pin); });
  port.write(moder, 1U << 4);
  for (const std::uint32_t word : {1U << 2, 1U << 18, 1U << 2}) {
    port.write(bsrr, word);
    EXPECT_EQ(seen, port.read(idr));
  }
  EXPECT_EQ(seen, 1U << 2 | 1U << 1);
}

// drivers/stm32f4/gpio.hpp against this model.
struct PortOnModel {
  testing::RegisterOnModel moder, otyper, ospeedr, pupdr, idr, odr, bsrr, lckr, afr[2];
};

TEST(GpioPortModel, DriverNeverShowsAWrongLevelOnTheWay) {
  Port port{GpioPort::b};
  auto registers = testing::block_on_model<PortOnModel>(port, port.model);
  std::vector<PinOutput> seen;
  port.model.on_output_change([&](unsigned, PinOutput output, BoardTime) { seen.push_back(output); });
  drivers::stm32f4::GpioPin pin{registers, 12};
  pin.configure({.mode = GpioMode::output, .initial_level = true});
  EXPECT_EQ(seen, std::vector{PinOutput::high});
  EXPECT_TRUE(pin.read());
  pin.write(false);
  EXPECT_EQ(seen, (std::vector{PinOutput::high, PinOutput::low}));
  drivers::stm32f4::GpioPin input{registers, 3};
  input.configure({.mode = GpioMode::input, .pull = GpioPull::up});
  EXPECT_TRUE(input.read());
}

}  // namespace kmax::virtual_board::gpio_port_test
