#include "host_tools/flash/flash_run.hpp"

#include <gtest/gtest.h>

#include "host_tools/flash/chip_memory.hpp"
#include "tests/host_tools/flash/board_with_tools.hpp"
#include "tests/host_tools/flash/made_elf.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::flash::flash_run_test {

class FlashRun : public testing::TestWithParam<Method> {
 protected:
  FlashRun() : before_(board.flash()) {
    hooks.say = [this](const std::string& text) { said += text + "\n"; };
    hooks.limits.grace = std::chrono::milliseconds(20);
  }
  FlashPlan plan() const {
    FlashTarget target;
    target.program = find_program(std::string(facts_of(GetParam()).program))->string();
    target.serial_port = "/dev/ttyUSB0";
    return plan_flash(GetParam(), image, target);
  }
  FlashReport flash() {
    WorkFolder folder;
    const FlashPlan planned = plan();
    const FlashReport report = write_and_verify(planned, image, folder, hooks);
    start_application(planned, folder, hooks);
    return report;
  }
  std::string failure() {
    return host_tools_test::thrown_message<FlashError>([this] { flash(); });
  }
  bool openocd() const { return GetParam() == Method::openocd_gpio || GetParam() == Method::openocd_stlink; }

  BoardWithTools board;
  FlashImage image = FlashImage::load(board.folder.write("image.elf", made_elf(made_image())));
  FlashHooks hooks;
  std::string said;
  std::string before_;
};

INSTANTIATE_TEST_SUITE_P(, FlashRun,
                         testing::Values(Method::openocd_gpio, Method::openocd_stlink, Method::dfu,
                                         Method::serial),
                         [](const auto& test) {
                           std::string name(facts_of(test.param).name);
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(FlashRun, PutsTheImageInPlaceAndKeepsAllElse) {
  const FlashReport report = flash();
  EXPECT_EQ(report.image_crc, image.crc());
  const std::string after = board.flash();
  for (const FlashPiece& piece : image.pieces())
    EXPECT_EQ(after.substr(piece.address - flash_begin, piece.bytes.size()),
              std::string(piece.bytes.begin(), piece.bytes.end()));
  EXPECT_EQ(after.substr(0x4000, 0x8000), before_.substr(0x4000, 0x8000));
  EXPECT_EQ(after.substr(0x20000), before_.substr(0x20000)) << "sectors the image does not need";
  EXPECT_EQ(board.temporary_folders(), 0u);
}

TEST_P(FlashRun, AFailureBeforeTheFirstWriteChangesNothing) {
  board.misbehave("fail_early");
  const std::string message = failure();
  EXPECT_CONTAINS(message, "failed with exit code 74; nothing on the board was changed");
  EXPECT_CONTAINS(message, "| Error: no device found");
  EXPECT_EQ(board.flash(), before_);
  EXPECT_EQ(board.calls().size(), 1u);
}

TEST_P(FlashRun, AFailedWriteSaysSoAndLeavesABoardThatDoesNotStart) {
  board.misbehave("fail");
  const std::string message = failure();
  EXPECT_CONTAINS(message, "failed with exit code 1; the flash may be PARTLY WRITTEN");
  EXPECT_CONTAINS(message, "| Error: flash write failed");
  EXPECT_CONTAINS(message, "parameters_before.bin");
  EXPECT_EQ(board.parameters(), before_.substr(0x4000, 0x8000));
  if (GetParam() != Method::dfu) {
    EXPECT_EQ(board.flash().substr(0, 8), std::string(8, '\xFF'));
  }
  EXPECT_EQ(board.temporary_folders(), 1u) << "the log and the parameters are kept";
}

TEST_P(FlashRun, TheVectorTableIsWrittenLast) {
  flash();
  std::string all;
  for (const std::string& call : board.calls()) all += call + "\n";
  const auto written = [&](const std::string& name) {
    for (const char* way : {"write_image erase ", "-D ", "-w "}) {
      const auto at = all.find(way + name);
      if (at != std::string::npos) return at;
    }
    return std::string::npos;
  };
  ASSERT_NE(written("image_08000000.bin"), std::string::npos);
  EXPECT_LT(written("image_0800c000.bin"), written("image_08000000.bin"));
}

TEST_P(FlashRun, ABitThatTheToolDidNotSeeIsFound) {
  board.misbehave("flip_quietly");
  const std::string message = failure();
  EXPECT_CONTAINS(message, "the flash is NOT what was written: at 0x08000005 there is 0xc4 instead of 0xc0");
  EXPECT_CONTAINS(message, "CRC-32");
  EXPECT_CONTAINS(message, "Do not use the board");
  for (const std::string& call : board.calls()) EXPECT_EQ(call.find("reset run"), std::string::npos);
}

TEST_P(FlashRun, ABitThatTheToolSawIsReported) {
  board.misbehave("flip");
  const std::string message = failure();
  if (GetParam() == Method::dfu) {
    EXPECT_CONTAINS(message, "NOT what was written") << "dfu-util has no check of its own";
  } else {
    EXPECT_CONTAINS(message, "| Error: checksum mismatch");
    EXPECT_CONTAINS(message, "PARTLY WRITTEN");
  }
}

TEST_P(FlashRun, ChangedParametersAreFoundAndTheOldOnesKept) {
  board.misbehave("wipe");
  const std::string message = failure();
  EXPECT_CONTAINS(message, "the stored parameters CHANGED: at 0x08004321");
  const auto at = message.find("What they were is in ");
  ASSERT_NE(at, std::string::npos);
  std::ifstream kept(message.substr(at + 21), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(kept), {}};
  EXPECT_EQ(bytes, before_.substr(0x4000, 0x8000));
}

TEST_P(FlashRun, ALostReadBackIsNoSuccess) {
  board.misbehave("short_read");
  EXPECT_CONTAINS(failure(), "200 of 400 bytes were read back");
}

TEST_P(FlashRun, CtrlCEndsTheToolAndSaysWhatIsLeft) {
  board.misbehave("hang");
  hooks.stop = [this] { return std::filesystem::exists(board.folder / "hangs"); };
  EXPECT_CONTAINS(failure(), "was ended; the flash may be PARTLY WRITTEN");
}

TEST_P(FlashRun, CtrlCBeforeTheStartChangesNothing) {
  hooks.stop = [] { return true; };
  EXPECT_CONTAINS(failure(), "interrupted; nothing on the board was changed");
  EXPECT_TRUE(board.calls().empty());
}

TEST_P(FlashRun, AToolThatHangsIsEndedEvenIfItIgnoresSignals) {
  board.misbehave("hang_hard");
  // From the moment that it hangs; before that it may be as slow as this machine.
  hooks.limits.at_most = std::chrono::milliseconds(1000);
  EXPECT_CONTAINS(failure(), "took too long and was ended");
}

TEST_P(FlashRun, AFailedStartSaysThatTheImageIsThere) {
  if (!openocd()) GTEST_SKIP() << "a reset line or a person starts it";
  WorkFolder folder;
  const FlashPlan planned = plan();
  write_and_verify(planned, image, folder, hooks);
  hooks.stop = [] { return true; };
  EXPECT_CONTAINS(
      host_tools_test::thrown_message<FlashError>([&] { start_application(planned, folder, hooks); }),
      "the image is written and verified");
}

}  // namespace kmax::flash::flash_run_test
