#include "host_tools/serve/pseudo_terminal.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <memory>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::serve::pseudo_terminal_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using Bytes = std::vector<std::uint8_t>;

std::size_t open_descriptors() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

Bytes read_some(int descriptor) {
  Bytes buffer(8192);
  const ssize_t got = read(descriptor, buffer.data(), buffer.size());
  buffer.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return buffer;
}

TEST(PseudoTerminal, CarriesEveryByteUnchangedBothWays) {
  const TemporaryFolder folder;
  PseudoTerminal line(folder / "line");
  const int other = open((folder / "line").c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(other, 0);
  Bytes all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
  line.write(all);
  EXPECT_EQ(read_some(other), all);
  ASSERT_EQ(write(other, all.data(), all.size()), 256);
  EXPECT_EQ(line.read(1'000'000), all);
  EXPECT_EQ(line.read(0), Bytes{}) << "no echo";
  close(other);
}

TEST(PseudoTerminal, OutlivesTheProgramsThatOpenIt) {
  const TemporaryFolder folder;
  PseudoTerminal line(folder / "line");
  for (std::uint8_t i = 0; i < 3; ++i) {
    const int other = open((folder / "line").c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(other, 0);
    ASSERT_EQ(write(other, &i, 1), 1);
    EXPECT_EQ(line.read(1'000'000), Bytes{i});
    close(other);
    EXPECT_EQ(line.read(1000), Bytes{});
  }
}

TEST(PseudoTerminal, WritingWhatNobodyReadsNeverWaits) {
  const TemporaryFolder folder;
  PseudoTerminal line(folder / "line");
  const Bytes much(1000, 0x55);
  for (int i = 0; i < 1000; ++i) line.write(much);
}

TEST(PseudoTerminal, TheNameGoesWithTheLine) {
  const TemporaryFolder folder;
  {
    const PseudoTerminal line(folder / "line");
    EXPECT_EQ(std::filesystem::read_symlink(folder / "line"), line.device());
  }
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(PseudoTerminal, StaleNamesAreReplaced) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink("/no/such/thing", folder / "line");
  const PseudoTerminal first(folder / "line");
  EXPECT_EQ(std::filesystem::read_symlink(folder / "line"), first.device());
}

TEST(PseudoTerminal, LeavesANameAloneThatAnotherHasTaken) {
  const TemporaryFolder folder;
  auto first = std::make_unique<PseudoTerminal>(folder / "line");
  std::filesystem::remove(folder / "line");
  const PseudoTerminal second(folder / "line");
  EXPECT_NE(first->device(), second.device());
  first.reset();
  EXPECT_EQ(std::filesystem::read_symlink(folder / "line"), second.device());
}

TEST(PseudoTerminal, AnythingElseOfThatNameIsLeftAlone) {
  const TemporaryFolder folder;
  folder.write("file", "precious");
  folder.write("target", "precious");
  std::filesystem::create_directory(folder / "folder");
  std::filesystem::create_symlink(folder / "target", folder / "link");
  std::filesystem::create_symlink("/dev/null", folder / "device");
  for (const char* name : {"file", "folder", "link", "device"})
    EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { PseudoTerminal line(folder / name); }),
                    "something else has this name");
  EXPECT_EQ(folder.read("file"), "precious");
  EXPECT_EQ(folder.read("link"), "precious");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "folder"));
  EXPECT_EQ(std::filesystem::read_symlink(folder / "device"), "/dev/null");
}

TEST(PseudoTerminal, AMissingFolderIsSaidAndNothingStaysOpen) {
  const TemporaryFolder folder;
  const std::size_t before = open_descriptors();
  for (int i = 0; i < 5; ++i)
    EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { PseudoTerminal line(folder / "no/line"); }),
                    "cannot be made: No such file");
  EXPECT_EQ(open_descriptors(), before);
}

TEST(PseudoTerminal, DoesNotTakeTheNameOfOneThatIsServed) {
  const TemporaryFolder folder;
  {
    const PseudoTerminal first(folder / "line");
    const auto target = std::filesystem::read_symlink(folder / "line");
    EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { PseudoTerminal(folder / "line"); }),
                    "another program serves a serial link here");
    EXPECT_EQ(std::filesystem::read_symlink(folder / "line"), target);
  }
  // Left behind by one that was killed, whose terminal somebody else has meanwhile.
  const int others = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_EQ(unlockpt(others), 0);
  std::filesystem::create_symlink(ptsname(others), folder / "line");
  const PseudoTerminal second(folder / "line");
  EXPECT_EQ(std::filesystem::read_symlink(folder / "line"), second.device());
  close(others);
}

}  // namespace kmax::serve::pseudo_terminal_test
