#include "host_tools/flash/method_choice.hpp"

#include <gtest/gtest.h>

#include "firmware/usb/descriptors.hpp"
#include "tests/host_tools/flash/board_with_tools.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::flash::method_choice_test {

using usb::UsbDevice;

constexpr const char* swd =
    "lines.swdio = {chip = \"g\", line = 1}\nlines.swclk = {chip = \"g\", line = 2}\n";
constexpr const char* boot =
    "lines.reset = {chip = \"g\", line = 3}\nlines.boot0 = {chip = \"g\", line = 4}\n";
const UsbDevice st_link{0x0483, 0x3748, ""};
const UsbDevice dfu_board{0x0483, 0xDF11, ""};
const UsbDevice mouse{0x046D, 0xC077, ""};
const UsbDevice kmax_on_usb{firmware::usb::identity.vendor, firmware::usb::identity.product, "1F2E3D4C",
                            "Kmax"};

class MethodChoice : public testing::Test {
 protected:
  MethodChoice() { tools.hide_all_but_the_fakes(); }

  Method choose(const std::string& wanted, bool dry = false) {
    const auto config = lines::parse_lines_config(text, "lines.toml");
    return choose_method(wanted, *board, judge_methods(*board, config, devices), dry);
  }
  template <typename Error>
  std::string refusal(const std::string& wanted, bool dry = false) {
    return host_tools_test::thrown_message<Error>([&] { choose(wanted, dry); });
  }

  BoardWithTools tools;
  const BoardProfile* board = board_of_kind("odrive_v3");
  std::string text;
  std::vector<UsbDevice> devices;
};

TEST_F(MethodChoice, AutomaticTakesWhatIsThere) {
  devices = {mouse, dfu_board};
  EXPECT_EQ(choose("auto"), Method::dfu);
  devices.push_back(st_link);
  EXPECT_EQ(choose("auto"), Method::openocd_stlink);
  text = swd;
  EXPECT_EQ(choose("auto"), Method::openocd_gpio);
  EXPECT_EQ(choose("dfu"), Method::dfu);
}

TEST_F(MethodChoice, WithNothingThereEveryWayIsExplained) {
  devices = {mouse};
  const std::string message = refusal<MethodError>("auto");
  EXPECT_CONTAINS(message, "ODrive v3.5 or v3.6 cannot be flashed right now");
  EXPECT_CONTAINS(message, "openocd-gpio    possible: connector J2 has SWCLK");
  EXPECT_CONTAINS(message, "but no ST-Link is on USB");
  EXPECT_CONTAINS(message, "set the DIP switch SW1 to DFU");
  EXPECT_CONTAINS(message, "serial          not on this board: its serial ports on connector J3");
}

TEST_F(MethodChoice, TheODriveIsNeverFlashedOverItsSerialPorts) {
  text = std::string(swd) + boot + "board.serial_port = \"/dev/ttyUSB0\"";
  EXPECT_CONTAINS(refusal<MethodNotOnBoardError>("serial"), "are not ports of the ROM bootloader");
  EXPECT_CONTAINS(refusal<MethodNotOnBoardError>("serial", true), "drive the gates");
}

TEST_F(MethodChoice, OneAskedForMustBeReadyUnlessItIsOnlyShown) {
  EXPECT_CONTAINS(refusal<MethodError>("openocd-stlink"), "--method openocd-stlink: no ST-Link is on USB");
  EXPECT_EQ(choose("openocd-stlink", true), Method::openocd_stlink);
  EXPECT_CONTAINS(refusal<MethodError>("auto", true), "cannot be flashed right now");
}

TEST_F(MethodChoice, AMissingProgramIsNamedWithItsPackage) {
  devices = {dfu_board};
  tools.remove("dfu-util");
  EXPECT_CONTAINS(refusal<MethodError>("dfu"),
                  "the program dfu-util is not installed: apt-get install dfu-util");
  EXPECT_CONTAINS(refusal<MethodError>("auto"), "dfu-util is not installed");
}

TEST_F(MethodChoice, AnotherBoardCanDoSerialWithPortAndLines) {
  board = board_of_kind("generic_stm32f405");
  EXPECT_CONTAINS(refusal<MethodError>("serial"), "[board] serial_port is not set");
  text = "board.serial_port = \"/dev/ttyUSB0\"\n";
  EXPECT_CONTAINS(refusal<MethodError>("serial"), "[lines.boot0] and [lines.reset] are not both set");
  text += boot;
  EXPECT_EQ(choose("serial"), Method::serial);
  EXPECT_EQ(choose("auto"), Method::dfu) << "the lines start the bootloader, USB is faster";
  devices = {st_link};
  EXPECT_EQ(choose("auto"), Method::openocd_stlink);
}

// BOOT0 of the ODrive is a switch, so lines for it do not make DFU ready.
TEST_F(MethodChoice, TheODriveNeedsItsSwitchForDfu) {
  text = boot;
  EXPECT_CONTAINS(refusal<MethodError>("dfu"), "set the DIP switch SW1 to DFU");
}

TEST_F(MethodChoice, FirmwareOnUsbNeedsNoSwitchAndAnAdapterIsPreferred) {
  devices = {mouse, kmax_on_usb};
  EXPECT_EQ(choose("auto"), Method::dfu);
  EXPECT_EQ(choose("dfu"), Method::dfu);
  devices.push_back(st_link);
  EXPECT_EQ(choose("auto"), Method::openocd_stlink);
  devices = {{kmax_on_usb.vendor, kmax_on_usb.product, "1F2E3D4C", "candleLight"}};
  EXPECT_CONTAINS(refusal<MethodError>("dfu"), "set the DIP switch SW1 to DFU") << "any other CAN adapter";
}

TEST_F(MethodChoice, EveryBoardSaysWhyForEveryMethod) {
  for (const BoardProfile& one : all_boards()) {
    EXPECT_EQ(board_of_kind(one.kind), &one);
    for (const MethodFacts& facts : all_methods) EXPECT_GT(one.on(facts.method).why.size(), 10u);
  }
  EXPECT_EQ(board_of_kind("toaster"), nullptr);
  EXPECT_EQ(board_kinds(), "odrive_v3, generic_stm32f405");
}

}  // namespace kmax::flash::method_choice_test
