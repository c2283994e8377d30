#include "host_tools/flash/flash_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "firmware/parameters/parameter_store.hpp"
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
  FlashTarget target() const {
    FlashTarget made;
    made.memory = &stm32f405_memory;
    made.program = find_program(std::string(facts_of(GetParam()).program))->string();
    made.serial_port = "/dev/ttyUSB0";
    return made;
  }
  FlashPlan plan() const { return plan_flash(GetParam(), image, target()); }
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
  FlashImage image =
      FlashImage::load(board.folder.write("image.elf", made_elf(made_image())), stm32f405_memory);
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
    EXPECT_EQ(after.substr(piece.address - stm32f405_memory.flash_begin(), piece.bytes.size()),
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

/// What the firmware would find in the board's parameter sectors.
class SectorsOf {
 public:
  static constexpr std::size_t sector_count = 2, words_per_sector = 4096;
  explicit SectorsOf(std::string& flash) : flash_(flash) {}
  std::uint32_t read(std::size_t sector, std::size_t word) const {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;)
      value = value << 8 | static_cast<std::uint8_t>(flash_[at(sector, word) + i]);
    return value;
  }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) flash_[at(sector, word) + i] = static_cast<char>(value >> (8 * i));
    return true;
  }
  bool erase(std::size_t sector) {
    std::fill_n(flash_.begin() + static_cast<std::ptrdiff_t>(at(sector, 0)), 4 * words_per_sector, '\xFF');
    return true;
  }

 private:
  static std::size_t at(std::size_t sector, std::size_t word) { return 0x4000 + 4 * (sector * 4096 + word); }
  std::string& flash_;
};

TEST_P(FlashRun, AFactoryResetForgetsParametersAndCodeAndNothingElse) {
  std::string locked = before_;
  SectorsOf sectors(locked);
  for (const std::size_t sector : {0, 1}) sectors.erase(sector);
  firmware::ParameterStore<SectorsOf> store(sectors);
  firmware::ParameterValues values;
  values.set_real<"wall.stiffness">(500);
  store.begin(firmware::persistent_part(values), 4711);
  while (store.step() == firmware::SaveProgress::busy) {
  }
  ASSERT_EQ(store.survey().lock_code, 4711u);
  board.folder.write("flash", locked);

  WorkFolder folder;
  const FlashPlan planned = plan_factory_reset(GetParam(), target());
  erase_parameters(planned, folder, hooks);
  start_application(planned, folder, hooks);
  std::string after = board.flash();
  EXPECT_EQ(after.substr(0x4000, 0x8000), std::string(0x8000, '\xFF'));
  EXPECT_EQ(after.substr(0, 0x4000), before_.substr(0, 0x4000));
  EXPECT_EQ(after.substr(0xC000), before_.substr(0xC000));
  SectorsOf found(after);
  firmware::ParameterStore<SectorsOf> fresh(found);
  EXPECT_EQ(fresh.survey().lock_code, 0u);
  EXPECT_FALSE(fresh.load(values).found);
}

TEST_P(FlashRun, AFactoryResetThatLeavesSomethingSaysSo) {
  const auto reset = [this] {
    WorkFolder folder;
    return host_tools_test::thrown_message<FlashError>(
        [&] { erase_parameters(plan_factory_reset(GetParam(), target()), folder, hooks); });
  };
  board.misbehave("no_erase");
  EXPECT_CONTAINS(reset(), "the tool ended well, but at 0x08004");
  EXPECT_CONTAINS(reset(), "PARTLY ERASED, and the device still locked: try again");
  hooks.stop = [] { return true; };
  EXPECT_CONTAINS(reset(), "to erase the stored parameters");
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
