// kmax flash, with tools that write into a file instead of a board.
#include <gtest/gtest.h>

#include <cerrno>

#include "tests/host_tools/kmax/board/board_command_line.hpp"

namespace kmax::cli::flash_command_test {

using Words = std::vector<std::string>;

constexpr const char* swd_lines = R"(
[lines.swdio]
chip = "/dev/gpiochip4"
line = 24
[lines.swclk]
name = "SWCLK"
[lines.reset]
chip = "gpiochip4"
line = 18
)";

constexpr const char* serial_board = R"(
[board]
kind = "generic_stm32f405"
serial_port = "/dev/ttyUSB0"
[lines.boot0]
chip = "gpiochip0"
line = 5
[lines.reset]
chip = "gpiochip0"
line = 6
)";

class FlashCommand : public BoardCommandLine {
 protected:
  bool touched() const { return board.flash().substr(0, 4) != "ZZZZ"; }
};

TEST_F(FlashCommand, WithAnStLinkWritesVerifiesAndStarts) {
  plug_in("0483", "3748");
  ASSERT_EQ(kmax({"flash", image}), base::done) << said;
  EXPECT_CONTAINS(said, "ODrive v3.5 or v3.6: openocd-stlink because an ST-Link is on USB");
  EXPECT_CONTAINS(output, "flashed 20808 bytes, read back equal, CRC-32 0x");
  EXPECT_CONTAINS(output, "the stored parameters are as they were");
  EXPECT_CONTAINS(board.calls().back(), "reset run");
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["method"], "openocd-stlink");
  EXPECT_EQ(document()["verified"], true);
  EXPECT_EQ(document()["parameters_kept"], true);
  EXPECT_EQ(document()["started"], true);
  EXPECT_EQ(document()["pieces"][1]["address"], "0x0800c000");
}

// OpenOCD takes chips by number: from the name in the configuration, or from the kernel.
TEST_F(FlashCommand, OverGpioLinesByTheirNumbers) {
  configure(swd_lines);
  ASSERT_EQ(kmax({"flash", image, "--speed", "200"}), base::done) << said;
  const std::string call = board.calls().front();
  EXPECT_CONTAINS(call, "adapter gpio swdio 24 -chip 4");
  EXPECT_CONTAINS(call, "adapter gpio swclk 42 -chip 7");
  EXPECT_CONTAINS(call, "adapter gpio srst 18 -chip 4 -c");
  EXPECT_CONTAINS(call, "adapter speed 200");
  EXPECT_TRUE(gpio.history.empty()) << "OpenOCD holds the lines itself";
}

TEST_F(FlashCommand, OverUsbSaysWhatThePersonDoes) {
  EXPECT_EQ(kmax({"flash", image, "--method", "dfu"}), base::failed);
  EXPECT_CONTAINS(said, "set the DIP switch SW1 to DFU");
  EXPECT_TRUE(board.calls().empty());
  plug_in("0483", "df11");
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["method"], "dfu");
  EXPECT_EQ(document()["started"], false);
  EXPECT_CONTAINS(said, "to start it: set the DIP switch SW1 back to RUN");
}

/// A board that runs the firmware, at USB port 1-1: it restarts when asked, and appears in DFU mode after
/// some pauses; dfu-util's "leave" brings it back.
class FlashOverUsb : public FlashCommand {
 protected:
  FlashOverUsb() {
    plug_in_kmax();
    services.restart_into_boot_loader = [this](const usb::UsbDevice& asked,
                                               const std::filesystem::path& nodes) {
      EXPECT_EQ(nodes, usb_tree.nodes());
      restarted.push_back(asked.address());
      if (armed) throw usb::RequestError(usb::request_failure(asked, "node", EPIPE));
      usb_tree.pull_out(asked.port);
      pauses = 0;
      calls_before = board.calls().size();
    };
    at_sleep = [this] {
      ++pauses;
      const auto calls = board.calls();
      const bool left = calls.size() > calls_before && calls.back().ends_with(":leave");
      if (pauses == 8 && appears && !restarted.empty() && !left) usb_tree.plug_in("1-1", "0483", "df11");
      if (left && comes_back) plug_in_kmax();
    };
  }
  void plug_in_kmax() {
    usb_tree.pull_out("1-1");
    usb_tree.plug_in_kmax("1-1", "1F2E3D4C");
    usb_tree.bind_serial("1-1", "ttyACM0");
  }

  bool armed = false, appears = true, comes_back = true;
  int pauses = 0;
  std::size_t calls_before = 0;
  Words restarted;
};

TEST_F(FlashOverUsb, TheFirmwareRestartsIntoTheBootloaderAndBack) {
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(restarted, Words{"usb:1F2E3D4C"});
  EXPECT_EQ(document()["method"], "dfu");
  EXPECT_EQ(document()["started"], true);
  EXPECT_EQ(document()["verified"], true);
  EXPECT_CONTAINS(said, "dfu because the firmware on USB can restart into its ROM bootloader");
  EXPECT_CONTAINS(said, "start the ROM bootloader: usb:1F2E3D4C restarts");
  EXPECT_EQ(said.find("to start it"), std::string::npos);
  for (const std::string& call : board.calls()) EXPECT_CONTAINS(call, " -p 1-1 ");
  EXPECT_TRUE(gpio.history.empty());
  EXPECT_TRUE(touched());
}

TEST_F(FlashOverUsb, RefusedByTheFirmwareNothingIsChanged) {
  armed = true;
  EXPECT_EQ(kmax({"flash", image}), base::failed);
  EXPECT_CONTAINS(said, "it refuses, because an axis is armed");
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashOverUsb, WithoutPermissionForTheRequestItSaysWhatToInstall) {
  services.restart_into_boot_loader = [](const usb::UsbDevice& asked, const std::filesystem::path&) {
    throw usb::RequestError(usb::request_failure(asked, "/dev/bus/usb/003/001", EACCES));
  };
  EXPECT_EQ(kmax({"flash", image}), base::failed);
  EXPECT_CONTAINS(said, "/dev/bus/usb/003/001 may not be opened: install the udev rules");
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashOverUsb, WithoutPermissionForTheBootloaderItWaitsForUdevAndSaysWhatToInstall) {
  int asked = 0;
  services.may_open = [&asked](const std::filesystem::path& node) {
    EXPECT_EQ(node.filename(), "002");
    return ++asked == 3;
  };
  ASSERT_EQ(kmax({"flash", image}), base::done) << said;
  EXPECT_EQ(asked, 3);
  plug_in_kmax();
  services.may_open = [](const std::filesystem::path&) { return false; };
  EXPECT_EQ(kmax({"flash", image}), base::failed);
  EXPECT_CONTAINS(said, "the board is in DFU mode, but ");
  EXPECT_CONTAINS(said, "may not be opened: install the udev rules");
}

TEST_F(FlashOverUsb, ABootloaderThatDoesNotAppearIsNotWaitedForLong) {
  appears = false;
  EXPECT_EQ(kmax({"flash", image}), base::failed);
  EXPECT_CONTAINS(said,
                  "no board in DFU mode (0483:df11) appeared at its USB port 1-1 within 5 s; nothing on");
  EXPECT_EQ(pauses, 50);
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashOverUsb, ABootloaderAtAnotherPortIsAnotherBoard) {
  appears = false;
  usb_tree.plug_in("1-9", "0483", "df11");
  EXPECT_EQ(kmax({"flash", image, "--device", "usb:1F2E3D4C"}), base::failed);
  EXPECT_CONTAINS(said, "appeared at its USB port 1-1");
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashOverUsb, ABoardThatDoesNotComeBackIsWrittenAllTheSame) {
  comes_back = false;
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["started"], false);
  EXPECT_CONTAINS(said, "the firmware did not come back on USB within 10 s");
  EXPECT_CONTAINS(said, "to start it: switch the DC supply off and on");
}

TEST_F(FlashOverUsb, ABoardThatVanishesUnderDfuUtilHasLeftAllTheSame) {
  board.misbehave("fail_at_leave");
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["started"], true);
  EXPECT_EQ(said.find("failed with exit code"), std::string::npos) << "it has worked";
  comes_back = false;
  plug_in_kmax();
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["started"], false);
  EXPECT_CONTAINS(said, "dfu-util failed with exit code 74; the image is written and verified");
}

TEST_F(FlashOverUsb, OfTwoBoardsOneMustBeNamed) {
  usb_tree.plug_in_kmax("1-2", "5A6B7C8D");
  EXPECT_EQ(kmax({"flash", image}), base::failed);
  EXPECT_CONTAINS(said, "which board? On USB there is usb:1F2E3D4C, usb:5A6B7C8D; name one");
  EXPECT_EQ(kmax({"flash", image, "--usb-serial", "0000"}), base::failed);
  EXPECT_CONTAINS(said, "which board?");
  EXPECT_EQ(kmax({"flash", image, "--device", "usb:0000"}), base::failed);
  EXPECT_CONTAINS(said, "which board?");
  EXPECT_TRUE(restarted.empty());
  for (const Words& naming : {Words{"--usb-serial", "1f2e3d4c"}, Words{"--device", "usb:1F2E3D4C"},
                              Words{"--device", "serial:/dev/ttyACM0"}}) {
    ASSERT_EQ(kmax({"flash", image, naming[0], naming[1]}), base::done) << said;
    EXPECT_EQ(restarted.back(), "usb:1F2E3D4C");
  }
}

TEST_F(FlashOverUsb, ABoardThatIsInDfuModeAlreadyIsTakenUnlessAnotherIsNamed) {
  usb_tree.plug_in("1-9", "0483", "df11");
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["started"], false);
  EXPECT_TRUE(restarted.empty());
  ASSERT_EQ(kmax({"flash", image, "--device", "usb"}), base::done) << said;
  EXPECT_EQ(restarted, Words{"usb:1F2E3D4C"});
}

TEST_F(FlashOverUsb, TheBoardOfAnotherLinkMustBeTheSame) {
  device = std::make_shared<host_tools_test::FakeDevice>();
  device->registers.values().set_whole<"info.serial_number">(0x5A6B7C8D);
  EXPECT_EQ(kmax({"flash", image, "--device", "serial:/dev/ttyUSB0"}), base::failed);
  EXPECT_CONTAINS(said, "the board of --device has the serial number 5A6B7C8D, and the one on USB 1F2E3D4C");
  EXPECT_TRUE(restarted.empty());
  device->registers.values().set_whole<"info.serial_number">(0x1F2E3D4C);
  ASSERT_EQ(kmax({"flash", image, "--device", "serial:/dev/ttyUSB0"}), base::done) << said;
  EXPECT_EQ(restarted.size(), 1u);
}

TEST_F(FlashOverUsb, ABoardThatIsNamedAndSilentMayBeAnotherThanTheOnlyOneOnUsb) {
  EXPECT_EQ(kmax({"flash", image, "--device", "serial:/dev/ttyUSB0"}), base::failed);
  EXPECT_CONTAINS(said, "does not answer, so it may be another board than usb:1F2E3D4C");
  std::filesystem::create_directory(board.folder.path() / "kmax");
  board.folder.write("kmax/config.toml", "device = \"serial:/dev/ttyUSB0\"\n");
  EXPECT_EQ(kmax({"flash", image}), base::failed) << "in the settings file as well";
  EXPECT_CONTAINS(said, "does not answer, so it may be another board");
  EXPECT_TRUE(restarted.empty());
}

TEST_F(FlashOverUsb, ABoardThatIsNamedAndAbsentIsNotAnyInDfuMode) {
  usb_tree.pull_out("1-1");
  usb_tree.plug_in("1-9", "0483", "df11");
  EXPECT_EQ(kmax({"flash", image, "--device", "usb:1F2E3D4C"}), base::failed);
  EXPECT_CONTAINS(said, "usb:1F2E3D4C is not on USB; is it the board in DFU mode?");
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashOverUsb, WhoNamesABoardOnUsbDoesNotMeanTheOneAtADebugAdapter) {
  usb_tree.plug_in("1-5", "0483", "374b");
  for (const char* named : {"usb", "usb:1F2E3D4C", "serial:/dev/ttyACM0"}) {
    ASSERT_EQ(kmax({"flash", image, "--device", named, "--json"}), base::done) << said;
    EXPECT_EQ(document()["method"], "dfu") << named;
  }
  ASSERT_EQ(kmax({"flash", image, "--json"}), base::done) << said;
  EXPECT_EQ(document()["method"], "openocd-stlink");
}

TEST_F(FlashOverUsb, AFailureSaysThatTheBootloaderGoesOn) {
  board.misbehave("fail");
  EXPECT_EQ(kmax({"flash", image}), base::failed);
  EXPECT_CONTAINS(said, "the board may still be in its ROM bootloader");
}

TEST_F(FlashOverUsb, WithoutDfuUtilItIsNotRestarted) {
  board.remove("dfu-util");
  board.hide_all_but_the_fakes();
  EXPECT_EQ(kmax({"flash", image, "--method", "dfu"}), base::failed);
  EXPECT_CONTAINS(said, "the program dfu-util is not installed: apt-get install dfu-util");
  EXPECT_TRUE(restarted.empty());
}

TEST_F(FlashOverUsb, ADryRunRestartsNothing) {
  ASSERT_EQ(kmax({"flash", image, "--dry-run"}), base::done) << said;
  EXPECT_CONTAINS(output, "# start the ROM bootloader: usb:1F2E3D4C restarts\n");
  EXPECT_CONTAINS(output, " -p 1-1 -s 0x08000000:leave\n");
  EXPECT_TRUE(restarted.empty());
}

TEST_F(FlashOverUsb, AFactoryResetGoesTheSameWay) {
  ASSERT_EQ(kmax({"flash", "--factory-reset", "--json"}), base::done) << said;
  EXPECT_EQ(document()["started"], true);
  EXPECT_EQ(board.parameters(), std::string(0x8000, '\xFF'));
  EXPECT_FALSE(touched());
}

TEST_F(FlashOverUsb, TheODrivesSwitchIsNoLineAndOtherBoardsHaveOne) {
  configure(serial_board + std::string());
  ASSERT_EQ(kmax({"flash", image, "--board", "odrive_v3"}), base::done) << said;
  EXPECT_EQ(restarted.size(), 1u);
  EXPECT_TRUE(gpio.history.empty());
}

TEST_F(FlashCommand, OverSerialTheLinesEnterAndLeaveTheBootloader) {
  configure(serial_board);
  ASSERT_EQ(kmax({"flash", image, "--method", "serial"}), base::done) << said;
  EXPECT_EQ(gpio.history,
            (Words{"gpiochip0 line 5 high", "gpiochip0 line 6 low", "gpiochip0 line 6 high",
                   "gpiochip0 line 6 released", "gpiochip0 line 5 low", "gpiochip0 line 5 released",
                   "gpiochip0 line 6 low", "gpiochip0 line 6 high", "gpiochip0 line 6 released"}));
  EXPECT_TRUE(touched());
}

TEST_F(FlashCommand, OverUsbTheLinesEnterTheBootloaderAndUsbIsWaitedFor) {
  configure(serial_board);
  int pauses = 0;
  at_sleep = [&] {
    if (++pauses == 8) plug_in("0483", "df11");
  };
  ASSERT_EQ(kmax({"flash", image, "--method", "dfu"}), base::done) << said;
  EXPECT_EQ(gpio.history.front(), "gpiochip0 line 5 high");
  EXPECT_EQ(gpio.history.size(), 9u) << "and the application is started";
  EXPECT_TRUE(touched());
}

TEST_F(FlashCommand, ABoardThatDoesNotAppearOnUsbIsNotFlashed) {
  configure(serial_board);
  EXPECT_EQ(kmax({"flash", image, "--method", "dfu"}), base::failed);
  EXPECT_CONTAINS(said, "no board in DFU mode (0483:df11) appeared on USB within 5 s; nothing");
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashCommand, AfterAFailureTheBootloaderIsNotLeft) {
  configure(serial_board);
  board.misbehave("fail");
  EXPECT_EQ(kmax({"flash", image, "--method", "serial"}), base::failed);
  EXPECT_CONTAINS(said, "PARTLY WRITTEN");
  EXPECT_EQ(gpio.history.size(), 6u) << "no second reset";
}

TEST_F(FlashCommand, SerialIsWrongUsageOnTheODrive) {
  EXPECT_EQ(kmax({"flash", image, "--method", "serial"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "are not ports of the ROM bootloader");
}

TEST_F(FlashCommand, ADryRunShowsTheCommandLinesAndDoesNothing) {
  configure(serial_board);
  ASSERT_EQ(kmax({"flash", image, "--method", "serial", "--dry-run"}), base::done) << said;
  EXPECT_CONTAINS(output,
                  "stm32flash -b 115200 -m 8e1 -w image_0800c000.bin -v -S 0x0800c000:20408 /dev/ttyUSB0\n");
  EXPECT_CONTAINS(output, "# start the ROM bootloader: [lines.boot0], [lines.reset]\n");
  ASSERT_EQ(kmax({"flash", image, "--method", "openocd-stlink", "--dry-run", "--json"}), base::done) << said;
  EXPECT_EQ(document()["commands"].size(), 2u);
  EXPECT_EQ(document()["dry_run"], true);
  EXPECT_TRUE(board.calls().empty());
  EXPECT_TRUE(gpio.history.empty());
  EXPECT_FALSE(touched());
}

TEST_F(FlashCommand, AFactoryResetErasesTheParametersAndLeavesTheProgram) {
  EXPECT_EQ(kmax({"flash", "--factory-reset", "--method", "dfu"}), base::failed);
  EXPECT_CONTAINS(said, "set the DIP switch SW1 to DFU");
  plug_in("0483", "df11");
  ASSERT_EQ(kmax({"flash", "--factory-reset", "--dry-run"}), base::done) << said;
  EXPECT_CONTAINS(output, "-s 0x08008000 -D blank.bin\n");
  EXPECT_TRUE(board.calls().empty());
  ASSERT_EQ(kmax({"flash", "--factory-reset"}), base::done) << said;
  EXPECT_CONTAINS(output, "the stored parameters and the write lock's code are erased, read back blank");
  EXPECT_CONTAINS(said, "to start it: set the DIP switch SW1 back to RUN");
  EXPECT_EQ(board.parameters(), std::string(0x8000, '\xFF'));
  EXPECT_FALSE(touched());
  ASSERT_EQ(kmax({"flash", "--factory-reset", "--json"}), base::done) << said;
  EXPECT_EQ(document()["factory_reset"], true);
  EXPECT_EQ(document()["parameters_kept"], false);
  EXPECT_EQ(kmax({"flash", image, "--factory-reset"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "excludes");
}

TEST_F(FlashCommand, AFactoryResetOverSerialGoesThroughTheBootloader) {
  configure(serial_board);
  ASSERT_EQ(kmax({"flash", "--factory-reset", "--method", "serial"}), base::done) << said;
  EXPECT_EQ(gpio.history.size(), 9u);
  EXPECT_EQ(board.parameters(), std::string(0x8000, '\xFF'));
  EXPECT_FALSE(touched());
}

TEST_F(FlashCommand, RefusedWhileAnAxisIsArmed) {
  plug_in("0483", "3748");
  device = std::make_shared<host_tools_test::FakeDevice>();
  for (const std::uint16_t word : {std::uint16_t{0x6}, std::uint16_t{0x7}, std::uint16_t{0xF}})
    device->machines[1].command(word, firmware::Link::serial, firmware::Refusal::none, false);
  ASSERT_TRUE(device->armed());
  EXPECT_EQ(kmax({"flash", image, "--device", "serial:/dev/fake"}), base::failed);
  EXPECT_CONTAINS(said, "axis 1 is armed");
  EXPECT_CONTAINS(said, "Nothing was changed");
  EXPECT_TRUE(board.calls().empty());
  device->machines[1].command(0, firmware::Link::serial, firmware::Refusal::none, false);
  EXPECT_EQ(kmax({"flash", image, "--device", "serial:/dev/fake"}), base::done) << said;
  EXPECT_EQ(said.find("not asked"), std::string::npos);
}

TEST_F(FlashCommand, ABoardThatDoesNotAnswerCanStillBeFlashed) {
  plug_in("0483", "3748");
  EXPECT_EQ(kmax({"flash", image, "--device", "serial:/dev/fake"}), base::done) << said;
  EXPECT_CONTAINS(said,
                  "the board does not answer, so it was not asked whether an axis is armed: nobody answers");
  EXPECT_EQ(kmax({"flash", image}), base::done);
  EXPECT_CONTAINS(said, "no --device is given, so the board was not asked");
}

TEST_F(FlashCommand, AnImageThatTouchesTheParametersIsRefused) {
  plug_in("0483", "3748");
  auto segments = flash::made_image();
  segments.push_back({0x0800'8000, {1, 2, 3, 4}});
  const auto bad = board.folder.write("bad.elf", flash::made_elf(segments)).string();
  EXPECT_EQ(kmax({"flash", bad}), base::wrong_usage);
  EXPECT_CONTAINS(said, "covers the parameter sectors");
  EXPECT_EQ(kmax({"flash", (board.folder / "none.elf").string()}), base::wrong_usage);
  EXPECT_CONTAINS(said, "cannot be read");
  EXPECT_TRUE(board.calls().empty());
}

TEST_F(FlashCommand, ArgumentsAreChecked) {
  EXPECT_EQ(kmax({"flash", image, "--method", "magic"}), base::wrong_usage);
  EXPECT_EQ(kmax({"flash", image, "--board", "toaster"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "--board: there is no board 'toaster'; boards are odrive_v3, generic_stm32f405");
  EXPECT_EQ(kmax({"flash", image, "--usb-serial", "1; shutdown"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "allowed are letters and digits");
  EXPECT_EQ(kmax({"flash", image, "--speed", "0"}), base::wrong_usage);
  EXPECT_EQ(kmax({"flash", "--board", "generic_stm32f405"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "name the image");
  configure("[lines.swdio]\nline = 3\n");
  EXPECT_EQ(kmax({"flash", image}), base::wrong_usage);
  EXPECT_CONTAINS(said, "lines.toml:1:");
}

TEST_F(FlashCommand, AHangingToolIsEndedAfterTheTimeout) {
  plug_in("0483", "3748");
  board.misbehave("hang");
  EXPECT_EQ(kmax({"flash", image, "--timeout", "0.5"}), base::failed);
  EXPECT_CONTAINS(said, "took too long and was ended");
}

}  // namespace kmax::cli::flash_command_test
