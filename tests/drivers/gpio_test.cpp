#include "drivers/stm32f4/gpio.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::gpio_test {

GpioRegisters filled_with(std::uint32_t word) {
  GpioRegisters port{};
  for (auto* each : {&port.moder, &port.otyper, &port.ospeedr, &port.pupdr, &port.afr[0], &port.afr[1]})
    *each = word;
  return port;
}

RC_GTEST_PROP(GpioPin, ConfigureLeavesNeighboursAlone, (std::uint32_t before)) {
  const auto number = *rc::gen::inRange(0U, 16U);
  GpioRegisters port = filled_with(before);
  const GpioConfig config{
      .mode = *rc::gen::element(GpioMode::input, GpioMode::output, GpioMode::alternate, GpioMode::analog),
      .pull = *rc::gen::element(GpioPull::none, GpioPull::up, GpioPull::down),
      .speed = *rc::gen::element(GpioSpeed::low, GpioSpeed::medium, GpioSpeed::high, GpioSpeed::very_high),
      .output = *rc::gen::element(GpioOutput::push_pull, GpioOutput::open_drain),
      .initial_level = *rc::gen::arbitrary<bool>(),
      .alternate_function = *rc::gen::inRange<std::uint8_t>(0, 16),
  };
  GpioPin{port, number}.configure(config);

  const std::uint32_t two = 3U << (2 * number);
  RC_ASSERT((port.moder & ~two) == (before & ~two));
  RC_ASSERT((port.ospeedr & ~two) == (before & ~two));
  RC_ASSERT((port.pupdr & ~two) == (before & ~two));
  RC_ASSERT((port.otyper & ~(1U << number)) == (before & ~(1U << number)));
  RC_ASSERT(((port.moder & two) >> (2 * number)) == static_cast<std::uint32_t>(config.mode));
  RC_ASSERT(((port.ospeedr & two) >> (2 * number)) == static_cast<std::uint32_t>(config.speed));
  RC_ASSERT(((port.pupdr & two) >> (2 * number)) == static_cast<std::uint32_t>(config.pull));
  RC_ASSERT(((port.otyper >> number) & 1U) == static_cast<std::uint32_t>(config.output));

  const std::uint32_t four = 0xFU << (4 * (number % 8));
  RC_ASSERT(port.afr[1 - number / 8] == before);
  RC_ASSERT((port.afr[number / 8] & ~four) == (before & ~four));
  if (config.mode == GpioMode::alternate) {
    RC_ASSERT(((port.afr[number / 8] & four) >> (4 * (number % 8))) == config.alternate_function);
  } else {
    RC_ASSERT(port.afr[number / 8] == before);
  }
}

TEST(GpioPin, DebugPinsOfPortASurvive) {
  GpioRegisters port{};
  port.moder = 0xA800'0000;  // reset values: PA13 to PA15 are the debug port
  port.pupdr = 0x6400'0000;
  GpioPin{port, 2}.configure({.mode = GpioMode::alternate, .alternate_function = 7});
  GpioPin{port, 3}.configure({.mode = GpioMode::alternate, .pull = GpioPull::up, .alternate_function = 7});
  EXPECT_EQ(port.moder, 0xA800'00A0U);
  EXPECT_EQ(port.pupdr, 0x6400'0040U);
  EXPECT_EQ(port.afr[0], 0x0000'7700U);
  EXPECT_EQ(port.afr[1], 0U);
}

TEST(GpioPin, WriteIsOneAtomicStore) {
  GpioRegisters port{};
  GpioPin pin{port, 12};
  pin.write(true);
  EXPECT_EQ(port.bsrr, 1U << 12);
  pin.write(false);
  EXPECT_EQ(port.bsrr, 1U << 28);
  EXPECT_EQ(port.odr, 0U);
}

TEST(GpioPin, ReadsItsOwnBit) {
  GpioRegisters port{};
  port.idr = 1U << 15;
  EXPECT_TRUE((GpioPin{port, 15}.read()));
  EXPECT_FALSE((GpioPin{port, 14}.read()));
}

struct RecordingPort {
  FakeRegister moder, otyper, ospeedr, pupdr, idr, bsrr;
  FakeRegister afr[2];
};

TEST(GpioPin, LevelBeforeDirectionAndFunctionBeforeHandOver) {
  RecordingPort port;
  std::string order;
  port.moder.on_write = [&](std::uint32_t) { order += 'm'; };
  port.bsrr.on_write = [&](std::uint32_t) { order += 'b'; };
  port.pupdr.on_write = [&](std::uint32_t) { order += 'p'; };
  port.afr[0].on_write = [&](std::uint32_t) { order += 'a'; };
  GpioPin<RecordingPort>{port, 1}.configure({.mode = GpioMode::output, .initial_level = true});
  EXPECT_EQ(order, "bpm");
  EXPECT_EQ(port.bsrr.value, 2U);
  GpioPin<RecordingPort>{port, 1}.configure({.mode = GpioMode::output});
  EXPECT_EQ(port.bsrr.value, 2U << 16U) << "low unless said otherwise";
  order.clear();
  GpioPin<RecordingPort>{port, 1}.configure({.mode = GpioMode::alternate, .alternate_function = 7});
  EXPECT_EQ(order, "pam") << "an output level must not be touched by a pin that is no output";
}

}  // namespace kmax::drivers::stm32f4::gpio_test
