#include "host_tools/simulated_board/file_flash.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "firmware/parameters/parameter_record.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulated_board::file_flash_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

static_assert(firmware::FlashSectors<FileFlash> && firmware::FlashSectors<MemoryFlash>);

class FileFlashTest : public testing::Test {
 protected:
  std::string path() const { return (folder / "store").string(); }
  TemporaryFolder folder;
};

TEST_F(FileFlashTest, AFileThatIsMissingOrEmptyBecomesAnErasedMemory) {
  for (const bool there : {false, true}) {
    std::filesystem::remove(path());
    if (there) folder.write("store", "");
    const FileFlash flash(path());
    for (const std::size_t word : {0u, 1u, 4095u})
      EXPECT_EQ(flash.read(0, word) & flash.read(1, word), 0xFFFF'FFFFu);
    EXPECT_EQ(std::filesystem::file_size(path()), FileFlash::file_size);
  }
}

TEST_F(FileFlashTest, ProgrammingOnlyClearsBitsAndIsInTheFileAtOnce) {
  FileFlash flash(path());
  EXPECT_TRUE(flash.program(1, 5, 0xF0F0'1234u));
  EXPECT_TRUE(flash.program(1, 5, 0xFF00'FFFFu));
  EXPECT_EQ(flash.read(1, 5), 0xF000'1234u);
  const std::string bytes = folder.read("store");
  EXPECT_EQ(bytes.substr(16384 + 20, 4), std::string("\x34\x12\x00\xF0", 4));
}

TEST_F(FileFlashTest, ErasingIsOfOneSectorAndWhatWasWrittenIsReadAgain) {
  {
    FileFlash flash(path());
    flash.program(0, 4095, 1);
    flash.program(1, 16, firmware::record::magic);
    flash.program(1, 0, 2);
    EXPECT_TRUE(flash.erase(0));
  }
  const FileFlash again(path());
  EXPECT_EQ(again.read(0, 4095), 0xFFFF'FFFFu);
  EXPECT_EQ(again.read(1, 0), 2u);
}

TEST_F(FileFlashTest, WhatIsNoStoreIsRefusedAndLeftAlone) {
  folder.write("store", "precious");
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { FileFlash flash(path()); }), "is 8 bytes long");
  EXPECT_EQ(folder.read("store"), "precious");
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { FileFlash flash(folder.path().string()); }),
                  "cannot be opened");
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { FileFlash flash("/dev/null"); }),
                  "must be a file");
  EXPECT_CONTAINS(
      thrown_message<std::runtime_error>([&] { FileFlash flash((folder / "no/store").string()); }),
      "No such file");
}

TEST_F(FileFlashTest, AFileOfTheSameLengthThatIsSomethingElseIsRefusedAndLeftAlone) {
  const auto refusal = [&](const std::string& bytes) {
    folder.write("store", bytes);
    const std::string message = thrown_message<std::runtime_error>([&] { FileFlash flash(path()); });
    EXPECT_EQ(folder.read("store"), bytes);
    return message;
  };
  EXPECT_CONTAINS(refusal(std::string(FileFlash::file_size, '\0')), "holds no record of one");
  EXPECT_CONTAINS(refusal(std::string(FileFlash::file_size - 1, '\xFF') + 'x'), "holds no record of one");
  // The mark of a record where none can begin.
  std::string misplaced(FileFlash::file_size, '\xFF');
  misplaced.replace(4, 4, "2PMK");
  EXPECT_CONTAINS(refusal(misplaced), "holds no record of one");
  folder.write("store", std::string(FileFlash::file_size, '\xFF'));
  EXPECT_NO_THROW(FileFlash flash(path()));
}

TEST_F(FileFlashTest, OneProcessAtATime) {
  const FileFlash first(path());
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { FileFlash second(path()); }), "another process");
}

// The order at the start: defaults for the hardware, then what is kept, then the scene's own parameters.
TEST_F(FileFlashTest, KeptParametersReplaceDefaultsAndTheScenesOwnReplaceThem) {
  simulation::Scene scene = factory_scene();
  {
    FileFlash flash(path());
    SimulatedBoard simulation(scene, firmware::AnyFlashSectors::of(flash));
    auto& application = simulation.board().application();
    const auto set = [&](std::size_t entry, double number) {
      const auto raw = firmware::raw_from_number(firmware::entry_at(entry).type, number);
      ASSERT_EQ(application.preset(entry, 0, raw).refusal, firmware::Refusal::none);
    };
    set(firmware::entry_of<"wall.stiffness">(), 111);
    set(firmware::entry_of<"wall.damping">(), 2);
    set(firmware::entry_of<"encoder.counts_per_turn">(), 1234);
    firmware::ParameterStore<FileFlash> store(flash);
    store.begin(application.values());
    while (store.step() == firmware::SaveProgress::busy) {
    }
  }
  scene.parameters.push_back({"wall.stiffness", 222.0, ""});
  FileFlash flash(path());
  SimulatedBoard simulation(scene, firmware::AnyFlashSectors::of(flash));
  const auto& values = simulation.board().application().values();
  EXPECT_EQ(values.real<"wall.stiffness">(), 222.0f);
  EXPECT_EQ(values.real<"wall.damping">(), 2.0f);
  EXPECT_EQ(values.whole<"encoder.counts_per_turn">(), 1234);
}

}  // namespace kmax::simulated_board::file_flash_test
