// kmax lines, lines watch, lines set, reset, bootloader, on GPIO lines that are not real.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/host_tools/kmax/board/board_command_line.hpp"

namespace kmax::cli::lines_commands_test {

using Words = std::vector<std::string>;

constexpr const char* wiring = R"(
[lines.reset]
chip = "gpiochip0"
line = 1
[lines.emergency_stop]
chip = "gpiochip0"
line = 2
[lines.fault]
chip = "gpiochip0"
line = 3
[lines.healthy]
name = "OK"
)";

class LinesCommands : public BoardCommandLine {
 protected:
  LinesCommands() { configure(wiring); }
};

TEST_F(LinesCommands, ShowEveryLineWithItsState) {
  gpio.lines["gpiochip0 line 3"].high = true;
  gpio.lines["gpiochip0 line 1"].consumer = "openocd";
  ASSERT_EQ(kmax({"lines"}), base::done) << said;
  EXPECT_CONTAINS(output, "reset           gpiochip7 line 1, input: held by openocd\n");
  EXPECT_CONTAINS(output, "emergency_stop  gpiochip7 line 2, input: low, run\n");
  EXPECT_CONTAINS(output, "fault           gpiochip7 line 3, input: high, none\n");
  EXPECT_CONTAINS(output, "healthy         gpiochip7 line 42 \"OK\", input: low, not ready\n");
  ASSERT_EQ(kmax({"lines", "--json"}), base::done);
  EXPECT_EQ(document()["fault"]["level"], "high");
  EXPECT_EQ(document()["fault"]["active"], false);
  EXPECT_EQ(document()["reset"]["held_by"], "openocd");
  EXPECT_EQ(document()["reset"]["level"], nullptr);
  EXPECT_TRUE(gpio.history.empty()) << "nothing was driven";
}

TEST_F(LinesCommands, OneBrokenLineDoesNotHideTheOthers) {
  gpio.broken = "gpiochip0 line 2";
  EXPECT_EQ(kmax({"lines"}), base::failed);
  EXPECT_CONTAINS(output, "healthy");
  EXPECT_CONTAINS(said, "busy");
  EXPECT_EQ(kmax({"lines", "--json"}), base::failed);
  EXPECT_CONTAINS(document()["emergency_stop"]["error"].get<std::string>(), "busy");
  EXPECT_EQ(document()["fault"]["state"], "fault");
}

TEST_F(LinesCommands, WatchPrintsEdgesWithTheKernelsTime) {
  gpio.lines["gpiochip0 line 3"].high = true;
  gpio.edges = {{0, true, std::chrono::nanoseconds(12'345'000'000'678)},
                {1, true, std::chrono::nanoseconds(12'345'900'000'000)}};
  gpio.at_wait = [this] {
    if (gpio.edges.empty()) std::raise(SIGINT);
  };
  ASSERT_EQ(kmax({"lines", "watch"}), base::done) << said;
  EXPECT_EQ(output,
            "                 now  fault           none\n"
            "                 now  healthy         not ready\n"
            "     12345.000000678  fault           fault\n"
            "     12345.900000000  healthy         healthy\n");
  EXPECT_EQ(gpio.watched.size(), 2u);
}

TEST_F(LinesCommands, WatchOfANamedLineEndsByItself) {
  gpio.edges = {{0, true, std::chrono::nanoseconds(5)}};
  ASSERT_EQ(kmax({"lines", "watch", "--line", "reset", "--line", "healthy", "--for", "0.05", "--json"}),
            base::done)
      << said;
  EXPECT_EQ(document()["start"]["reset"], "reset");
  EXPECT_EQ(document()["start"].size(), 2u);
  EXPECT_EQ(document()["edges"][0]["line"], "reset");
  EXPECT_EQ(document()["edges"][0]["time_ns"], 5);
}

TEST_F(LinesCommands, WatchRefusesWhatIsNotThere) {
  EXPECT_EQ(kmax({"lines", "watch", "--line", "resett"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "there is no line 'resett'; lines are reset, boot0");
  EXPECT_EQ(kmax({"lines", "watch", "--line", "boot0"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "no line for boot0");
  configure("lines.reset = {name = \"R\"}");
  EXPECT_EQ(kmax({"lines", "watch"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "neither fault nor healthy is configured");
}

TEST_F(LinesCommands, TheEmergencyStopEndsAtStop) {
  int turns = 0;
  at_sleep = [&] {
    EXPECT_EQ(gpio.lines["gpiochip0 line 2"].high, false) << "closed contact";
    if (++turns == 3) std::raise(SIGINT);
  };
  ASSERT_EQ(kmax({"lines", "set", "emergency_stop=run"}), base::done) << said;
  EXPECT_EQ(output, "emergency_stop = run\n");
  EXPECT_CONTAINS(said, "normally closed contact to ground: open is stop");
  EXPECT_CONTAINS(said, "in series with the button");
  EXPECT_CONTAINS(said, "until Ctrl-C; then the lines are let go and fall back to their pulls");
  EXPECT_EQ(gpio.history,
            (Words{"gpiochip0 line 2 low", "gpiochip0 line 2 high", "gpiochip0 line 2 released"}));
  EXPECT_EQ(turns, 3);
}

TEST_F(LinesCommands, ALineThatCannotBeDrivenLeavesNoOtherAtRun) {
  configure(
      "lines.emergency_stop = {chip = \"gpiochip0\", line = 2}\n"
      "lines.reset = {chip = \"gpiochip0\", line = 9}\n");
  gpio.broken = "gpiochip0 line 9";
  EXPECT_EQ(kmax({"lines", "set", "emergency_stop=run", "reset=reset"}), base::failed);
  EXPECT_CONTAINS(said, "busy");
  EXPECT_EQ(gpio.history,
            (Words{"gpiochip0 line 2 low", "gpiochip0 line 2 high", "gpiochip0 line 2 released"}));
}

TEST_F(LinesCommands, NoNumberIsNoDuration) {
  EXPECT_EQ(kmax({"lines", "set", "emergency_stop=stop", "--for", "nan"}), base::wrong_usage);
  EXPECT_TRUE(gpio.history.empty());
}

TEST_F(LinesCommands, TheResetLineEndsAtRun) {
  ASSERT_EQ(kmax({"lines", "set", "reset=reset", "emergency_stop=stop", "--for", "0.01", "--json"}),
            base::done)
      << said;
  EXPECT_EQ(document()["reset"], "reset");
  EXPECT_EQ(gpio.history[0], "gpiochip0 line 1 low");
  EXPECT_EQ(gpio.history[1], "gpiochip0 line 2 high");
  EXPECT_EQ(gpio.history[2], "gpiochip0 line 1 high") << "and the stop stays";
}

TEST_F(LinesCommands, SetRefusesWhatItCannotDoAndMovesNothing) {
  const auto refused = [this](Words arguments, const std::string& part) {
    arguments.insert(arguments.begin(), {"lines", "set"});
    EXPECT_EQ(kmax(arguments), base::wrong_usage);
    EXPECT_CONTAINS(said, part);
  };
  refused({"emergency_stop"}, "write NAME=STATE");
  refused({}, "write NAME=STATE");
  refused({"emergency_stop=on"}, "emergency_stop is set to stop or run");
  refused({"healthy=healthy"}, "the board drives this line");
  refused({"swclk=1"}, "debug port's");
  refused({"emergency_stop=run", "emergency_stop=stop"}, "named twice");
  refused({"emergency_stop=run", "boot0=bootloader"}, "no line for boot0");
  refused({"emergency_stop=run", "--for", "-1"}, "--for");
  EXPECT_TRUE(gpio.history.empty());
}

TEST_F(LinesCommands, ResetPulsesNrst) {
  ASSERT_EQ(kmax({"reset"}), base::done) << said;
  EXPECT_EQ(gpio.history,
            (Words{"gpiochip0 line 1 low", "gpiochip0 line 1 high", "gpiochip0 line 1 released"}));
  EXPECT_EQ(output, "the board was reset\n");
  gpio.lines["gpiochip0 line 1"].consumer = "openocd";
  EXPECT_EQ(kmax({"reset"}), base::failed);
  EXPECT_CONTAINS(said, "held by openocd");
}

TEST_F(LinesCommands, TheODrivesBootloaderNeedsItsSwitch) {
  EXPECT_EQ(kmax({"bootloader"}), base::failed);
  EXPECT_CONTAINS(said, "BOOT0 of ODrive v3.5 or v3.6 is a switch");
  EXPECT_CONTAINS(said, "set the DIP switch SW1 to DFU");
  EXPECT_TRUE(gpio.history.empty());
}

TEST_F(LinesCommands, TheBootloaderOfAnotherBoardNeedsTheLine) {
  EXPECT_EQ(kmax({"bootloader", "--board", "generic_stm32f405"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "no line for boot0");
  configure(std::string("board.kind = \"generic_stm32f405\"\nlines.boot0 = {name = \"B\"}\n") + wiring);
  ASSERT_EQ(kmax({"bootloader"}), base::done) << said;
  EXPECT_EQ(gpio.history.front(), "line \"B\" high");
  EXPECT_EQ(gpio.history[1], "gpiochip0 line 1 low");
  EXPECT_EQ(gpio.history.back(), "line \"B\" released");
}

TEST_F(LinesCommands, WithoutAConfigurationTheyTellWhatToWrite) {
  unsetenv("KMAX_LINES");
  for (const Words& command : {Words{"lines"}, Words{"lines", "watch"}, Words{"reset"}}) {
    EXPECT_EQ(kmax(command), base::wrong_usage);
    EXPECT_CONTAINS(said, (board.folder / "kmax/lines.toml").string());
    EXPECT_CONTAINS(said, "[lines.reset]");
  }
  EXPECT_EQ(kmax({"lines", "--lines", "/no/such/file"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "/no/such/file: cannot be read");
  configure("board.kind = \"toaster\"");
  EXPECT_EQ(kmax({"bootloader"}), base::wrong_usage);
  EXPECT_CONTAINS(said, lines_file + ": [board] kind: there is no board 'toaster'");
}

}  // namespace kmax::cli::lines_commands_test
