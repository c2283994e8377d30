#include "host_tools/lines/lines_config.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::lines::lines_config_test {

std::string refusal(const std::string& text) {
  return host_tools_test::thrown_message<LinesConfigError>([&] { parse_lines_config(text, "lines.toml"); });
}

constexpr const char* whole = R"([board]
kind = "generic_stm32f405"
serial_port = "/dev/ttyUSB0"

[lines.reset]
chip = "gpiochip0"
line = 17

[lines.emergency_stop]
name = "ESTOP"
bias = "pull_up"

[lines.fault]
chip = "pinctrl-bcm2711"
name = "FAULT"
active = "high"
)";

TEST(LinesConfig, ReadsWhatIsWiredToWhat) {
  const LinesConfig config = parse_lines_config(whole, "lines.toml");
  EXPECT_EQ(config.board_kind, "generic_stm32f405");
  EXPECT_EQ(config.serial_port, "/dev/ttyUSB0");
  EXPECT_EQ(config.file, "lines.toml");
  ASSERT_EQ(config.lines.size(), 3u);
  const LineSettings& reset = config.required(LineRole::reset);
  EXPECT_EQ(reset.chip, "gpiochip0");
  EXPECT_EQ(reset.offset, 17u);
  EXPECT_EQ(text_of(reset), "gpiochip0 line 17");
  const LineSettings& stop = config.required(LineRole::emergency_stop);
  EXPECT_EQ(stop.name, "ESTOP");
  EXPECT_EQ(stop.bias, Bias::pull_up);
  EXPECT_EQ(text_of(stop), "line \"ESTOP\"");
  EXPECT_EQ(text_of(config.required(LineRole::fault)), "pinctrl-bcm2711 line \"FAULT\"");
  EXPECT_EQ(config.find(LineRole::boot0), nullptr);
}

// NRST must never be pushed high: the chip pulls it low itself. A line behind a transistor is another matter.
TEST(LinesConfig, PolarityAndDriveComeFromTheRole) {
  LinesConfig config = parse_lines_config(whole, "lines.toml");
  EXPECT_EQ(config.required(LineRole::reset).polarity, Polarity::active_low);
  EXPECT_EQ(config.required(LineRole::reset).drive, Drive::open_drain);
  EXPECT_EQ(config.required(LineRole::reset).bias, Bias::as_is);
  EXPECT_EQ(config.required(LineRole::emergency_stop).polarity, Polarity::active_high);
  EXPECT_EQ(config.required(LineRole::emergency_stop).drive, Drive::open_drain);
  EXPECT_EQ(config.required(LineRole::fault).polarity, Polarity::active_high);
  config = parse_lines_config("lines.reset = {chip = \"c\", line = 0, active = \"high\"}", "f");
  EXPECT_EQ(config.required(LineRole::reset).drive, Drive::push_pull);
  config = parse_lines_config(
      "lines.reset = {chip = \"c\", line = 0, active = \"high\", drive = \"open_source\"}", "f");
  EXPECT_EQ(config.required(LineRole::reset).drive, Drive::open_source);
}

TEST(LinesConfig, ErrorsNameThePlace) {
  EXPECT_CONTAINS(refusal("[lines.reset]\nchip = \"a\"\nline = -1\n"),
                  "lines.toml:3:8: lines.reset.line = -1: allowed is a whole number from 0 to 65535");
  EXPECT_CONTAINS(refusal("[lines.reset]\nchip = \"a\"\nline = 1.5\n"), "lines.reset.line = 1.5");
  EXPECT_CONTAINS(refusal("[lines.reset]\nchip = \"a\"\nline = 65536\n"), "from 0 to 65535");
  EXPECT_CONTAINS(
      refusal("[lines.rest]\nname = \"a\"\n"),
      "lines.toml:1:8: lines.rest: there is no such line; allowed are reset, boot0, emergency_stop");
  EXPECT_CONTAINS(refusal("[lines.reset]\nname = \"a\"\npin = 3\n"),
                  "lines.toml:3:1: lines.reset.pin: unknown key; allowed here: chip, line, name");
  EXPECT_CONTAINS(refusal("[lines.reset]\nname = \"a\"\nactive = \"Low\"\n"),
                  "lines.toml:3:10: lines.reset.active = 'Low': allowed is \"low\", \"high\"");
  EXPECT_CONTAINS(refusal("[lines.reset]\nname = \"a\"\nactive = 0\n"), "lines.reset.active = 0: allowed is");
  EXPECT_CONTAINS(refusal("[lines.reset]\nname = 5\n"),
                  "lines.toml:2:8: lines.reset.name = 5: allowed is a text");
  EXPECT_CONTAINS(refusal("[lines.reset]\nname = \"\"\n"), "not empty");
  EXPECT_CONTAINS(refusal("lines = 5\n"), "lines.toml:1:9: lines = 5: allowed is a table");
  EXPECT_CONTAINS(refusal("lines.reset = 5\n"), "lines.reset = 5: allowed is a table, [lines.reset]");
  EXPECT_CONTAINS(refusal("board = []\n"), "board = [array]: allowed is a table");
  EXPECT_CONTAINS(refusal("[boards]\n"), "boards: unknown key; allowed here: board, lines");
  EXPECT_CONTAINS(refusal("[board]\nname = \"a\"\n"), "board.name: unknown key");
  EXPECT_CONTAINS(refusal("[lines.reset\n"), "lines.toml:1:");
}

TEST(LinesConfig, ALineNeedsOneAddress) {
  EXPECT_CONTAINS(refusal("[lines.reset]\nline = 3\n"), "[lines.reset]: line = 3 needs chip");
  EXPECT_CONTAINS(refusal("[lines.reset]\nchip = \"a\"\n"), "say which line it is");
  EXPECT_CONTAINS(refusal("[lines.reset]\nchip = \"a\"\nline = 3\nname = \"b\"\n"),
                  "give line or name, not both");
  EXPECT_CONTAINS(refusal("[lines.boot0]\nchip = \"a\"\nline = 3\n[lines.reset]\nchip = \"a\"\nline = 3\n"),
                  "a line 3 is [lines.");
}

TEST(LinesConfig, AMissingLineSaysWhatToWrite) {
  const std::string message = host_tools_test::thrown_message<LinesConfigError>(
      [] { parse_lines_config("", "lines.toml").required(LineRole::boot0); });
  EXPECT_CONTAINS(message, "lines.toml: no line for boot0");
  EXPECT_CONTAINS(message, "[lines.boot0]");
}

class LinesFile : public testing::Test {
 protected:
  void SetUp() override {
    setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
    unsetenv("KMAX_LINES");
  }
  void TearDown() override {
    unsetenv("XDG_CONFIG_HOME");
    unsetenv("KMAX_LINES");
  }
  host_tools_test::TemporaryFolder folder;
};

TEST_F(LinesFile, IsTheOneGivenOrOfTheEnvironmentOrOfTheUser) {
  EXPECT_EQ(find_lines_config("").file, "");
  EXPECT_TRUE(find_lines_config("").lines.empty());
  std::filesystem::create_directory(folder / "kmax");
  folder.write("kmax/lines.toml", "board.kind = \"user\"");
  EXPECT_EQ(find_lines_config("").board_kind, "user");
  setenv("KMAX_LINES", folder.write("e.toml", "board.kind = \"environment\"").c_str(), 1);
  EXPECT_EQ(find_lines_config("").board_kind, "environment");
  EXPECT_EQ(find_lines_config(folder.write("g.toml", "board.kind = \"given\"")).board_kind, "given");
  setenv("KMAX_LINES", "", 1);
  EXPECT_EQ(find_lines_config("").board_kind, "user");
}

TEST_F(LinesFile, OneThatIsNamedMustBeThere) {
  for (const std::string& name : {(folder / "none.toml").string(), folder.path().string()}) {
    EXPECT_CONTAINS(host_tools_test::thrown_message<LinesConfigError>([&] { find_lines_config(name); }),
                    "cannot be read");
  }
  setenv("KMAX_LINES", (folder / "none.toml").c_str(), 1);
  EXPECT_THROW(find_lines_config(""), LinesConfigError);
}

TEST_F(LinesFile, TheDefaultIsInTheHomeWithoutXdg) {
  setenv("XDG_CONFIG_HOME", "relative", 1);
  setenv("HOME", "/home/somebody", 1);
  EXPECT_EQ(default_lines_file(), "/home/somebody/.config/kmax/lines.toml");
  unsetenv("XDG_CONFIG_HOME");
  EXPECT_EQ(default_lines_file(), "/home/somebody/.config/kmax/lines.toml");
}

}  // namespace kmax::lines::lines_config_test
