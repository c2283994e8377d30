#include "host_tools/lines/board_reset.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/lines/fake_gpio_lines.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::lines::board_reset_test {

using Words = std::vector<std::string>;

class BoardReset : public testing::Test {
 protected:
  Sleep sleep = [this](std::chrono::milliseconds duration) {
    gpio.history.push_back(std::to_string(duration.count()) + " ms");
  };
  FakeGpio gpio;
  LinesConfig config = parse_lines_config(
      "lines.reset = {chip = \"g\", line = 1}\nlines.boot0 = {chip = \"g\", line = 2}", "lines.toml");
};

TEST_F(BoardReset, HoldsNrstLowAndDrivesItBackBeforeLettingGo) {
  pulse_reset(*gpio.open(), config, sleep);
  EXPECT_EQ(gpio.history, (Words{"g line 1 low", "20 ms", "g line 1 high", "100 ms", "g line 1 released"}));
}

TEST_F(BoardReset, PolarityTurnsThePulseAround) {
  config.lines.at(LineRole::reset).polarity = Polarity::active_high;
  pulse_reset(*gpio.open(), config, sleep);
  EXPECT_EQ(gpio.history.front(), "g line 1 high");
}

// RM0090, boot configuration: the BOOT pins are latched after the reset, so BOOT0 must be there before and
// during it.
TEST_F(BoardReset, Boot0SurroundsTheResetOfTheBootloader) {
  enter_bootloader(*gpio.open(), config, sleep);
  EXPECT_EQ(gpio.history, (Words{"g line 2 high", "g line 1 low", "20 ms", "g line 1 high", "100 ms",
                                 "g line 1 released", "g line 2 low", "g line 2 released"}));
}

TEST_F(BoardReset, NothingMovesWhileALineIsMissing) {
  config.lines.erase(LineRole::reset);
  EXPECT_THROW(enter_bootloader(*gpio.open(), config, sleep), LinesConfigError);
  EXPECT_THROW(pulse_reset(*gpio.open(), config, sleep), LinesConfigError);
  EXPECT_EQ(gpio.history, Words{});
}

TEST_F(BoardReset, Boot0IsLetGoWhenTheResetLineCannotBeHad) {
  gpio.lines["g line 1"].consumer = "openocd";
  EXPECT_CONTAINS(
      host_tools_test::thrown_message<LineError>([&] { enter_bootloader(*gpio.open(), config, sleep); }),
      "held by openocd");
  EXPECT_EQ(gpio.history, (Words{"g line 2 high", "g line 2 released"}));
}

}  // namespace kmax::lines::board_reset_test
