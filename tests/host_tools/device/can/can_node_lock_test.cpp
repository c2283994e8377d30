#include "host_tools/device/can/can_node_lock.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <thread>

#include "host_tools/device/can/unix_can_hub.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::can_node_lock_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using namespace std::chrono_literals;

/// A name that no other test run has.
std::string own_bus() {
  return "can_test_" + std::to_string(getpid());
}

TEST(CanNodeLock, ASecondProgramWaitsAndThenGivesUpNamingNodeAndHolder) {
  const CanNodeLock first(own_bus(), 5, {});
  std::vector<std::string> notices;
  const auto message = thrown_message<LinkError>(
      [&] { CanNodeLock(own_bus(), 5, [&](const std::string& text) { notices.push_back(text); }); });
  EXPECT_CONTAINS(message, "node 5 on " + own_bus());
  EXPECT_CONTAINS(message, "in use by another program (process " + std::to_string(getpid()));
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_CONTAINS(notices[0], "waiting");
}

TEST(CanNodeLock, OtherNodesAndBusesAreFree) {
  const CanNodeLock first(own_bus(), 5, {});
  EXPECT_TRUE(CanNodeLock::try_to_take(own_bus(), 6));
  EXPECT_TRUE(CanNodeLock::try_to_take(own_bus(), 55));
  EXPECT_TRUE(CanNodeLock::try_to_take(own_bus() + "x", 5));
  EXPECT_FALSE(CanNodeLock::try_to_take(own_bus(), 5));
}

TEST(CanNodeLock, ABusIsTheSameByEveryPath) {
  const TemporaryFolder folder;
  const UnixCanHub hub((folder / "bus").string());
  std::filesystem::create_symlink(folder / "bus", folder / "link");
  const CanNodeLock first(hub.path(), 5, {});
  EXPECT_FALSE(CanNodeLock::try_to_take((folder / "link").string(), 5));
  EXPECT_FALSE(CanNodeLock::try_to_take((folder.path() / "." / "bus").string(), 5));
  EXPECT_TRUE(CanNodeLock::try_to_take((folder / "link").string(), 6));
}

TEST(CanNodeLock, TheSecondGetsTheNodeWhenTheFirstIsDone) {
  std::optional<CanNodeLock> first;
  first.emplace(own_bus(), std::uint8_t{5}, Notice{});
  EXPECT_NO_THROW(CanNodeLock(own_bus(), 5, [&](const std::string&) { first.reset(); }));
}

TEST(CanNodeLock, WhoWaitsLendsIt) {
  CanNodeLock first(own_bus(), 5, {});
  std::atomic<bool> had_it = false;
  std::thread other([&] {
    const CanNodeLock second(own_bus(), 5, {});
    had_it = true;
  });
  while (!had_it) first.yield(20ms);
  other.join();
  EXPECT_FALSE(CanNodeLock::try_to_take(own_bus(), 5)) << "and takes it back";
}

TEST(CanNodeLock, WhoDoesNotGiveItBackIsTold) {
  CanNodeLock first(own_bus(), 5, {});
  std::unique_ptr<CanNodeLock> second;
  std::thread other([&] {
    while (!second) second = CanNodeLock::try_to_take(own_bus(), 5);
  });
  // As often as it takes until the other one had a moment to take it.
  std::string message;
  while (message.empty()) {
    try {
      first.yield(20ms);
    } catch (const LinkError& error) {
      message = error.what();
    }
  }
  other.join();
  EXPECT_CONTAINS(message, "did not give it back");
}

TEST(CanNodeLock, DisappearsWithAProcessThatIsKilled) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const std::string bus = own_bus();
  const pid_t child = fork();
  if (child == 0) {
    const CanNodeLock held(bus, 5, {});
    if (write(ready[1], "x", 1) != 1) _exit(1);
    for (;;) pause();
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_FALSE(CanNodeLock::try_to_take(bus, 5));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(CanNodeLock::try_to_take(bus, 5));
  close(ready[0]);
  close(ready[1]);
}

}  // namespace kmax::device::can_node_lock_test
