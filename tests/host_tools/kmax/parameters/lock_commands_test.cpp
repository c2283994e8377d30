// kmax lock and unlock on a simulated device that outlives the commands; codes from files, a pipe and a
// terminal.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "host_tools/device/lock.hpp"
#include "tests/host_tools/kmax/wired_command_line.hpp"

namespace kmax::cli::lock_commands_test {
namespace {

/// In the place of standard input for a while.
class Input {
 public:
  explicit Input(int descriptor) : before_(dup(STDIN_FILENO)) {
    if (before_ < 0 || dup2(descriptor, STDIN_FILENO) < 0) throw std::runtime_error("no standard input");
  }
  ~Input() {
    dup2(before_, STDIN_FILENO);
    close(before_);
  }
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

 private:
  int before_;
};

class LockCommands : public WiredCommandLine {
 protected:
  std::vector<std::string> with(std::vector<std::string> arguments, const std::string& code) {
    arguments.insert(arguments.end(), {"--code-file", folder.write("code", code + "\n").string()});
    return arguments;
  }
  int lock(const std::string& code) { return kmax(with({"lock"}, code)); }
  int unlock(const std::string& code) { return kmax(with({"unlock"}, code)); }
  std::string state() {
    EXPECT_EQ(kmax({"get", "lock.state", "--json"}), base::done);
    return document()["lock.state"]["value"];
  }
  /// What a pipe holds when the command begins.
  int piped(std::vector<std::string> arguments, const std::string& text) {
    int ends[2] = {-1, -1};
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    EXPECT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(ends[1]);
    const Input input(ends[0]);
    close(ends[0]);
    return kmax(std::move(arguments));
  }
};

TEST_F(LockCommands, LockSetsACodeAndUnlockOpensWithIt) {
  ASSERT_EQ(lock("4711"), base::done) << said;
  EXPECT_EQ(output, "the code is kept and the device locked; 'kmax unlock' opens it\n");
  EXPECT_EQ(state(), "locked");
  expect_error(
      {"set", "wall.stiffness=500"}, base::failed,
      "the device refused: the device is locked; 'kmax unlock' opens it, with the code that its owner has "
      "set; nothing was changed");
  expect_error({"save"}, base::failed, "the device is locked");
  expect_error({"defaults"}, base::failed, "the device is locked");
  ASSERT_EQ(lock("9999"), base::done);
  EXPECT_EQ(output, "it is locked already\n");
  ASSERT_EQ(unlock("4711"), base::done) << said;
  EXPECT_EQ(output, "open until the next start or 'kmax lock'\n");
  EXPECT_EQ(kmax({"set", "wall.stiffness=500"}), base::done);
  ASSERT_EQ(unlock("1"), base::done) << "nothing is asked";
  ASSERT_EQ(kmax({"lock"}), base::done) << said;
  EXPECT_EQ(output, "locked, with the code that was set before\n");
  EXPECT_EQ(state(), "locked");
}

TEST_F(LockCommands, ALockedDeviceIsUsedAndWatched) {
  ASSERT_EQ(kmax({"set", "link.timeout=0", "wall.law=none"}), base::done);
  ASSERT_EQ(lock("4711"), base::done) << said;
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  EXPECT_EQ(kmax({"stop"}), base::done) << said;
  EXPECT_EQ(kmax({"disarm"}), base::done) << said;
  EXPECT_EQ(kmax({"clear"}), base::done) << said;
  EXPECT_EQ(kmax({"record", in("trace.csv"), "--for", "0.1"}), base::done) << said;
  EXPECT_EQ(kmax({"dump", in("all.toml")}), base::done) << said;
  EXPECT_EQ(folder.read("all.toml").find("lock"), std::string::npos);
  EXPECT_EQ(state(), "locked");
}

TEST_F(LockCommands, WrongCodesAreRefusedWithTheTimeToWait) {
  ASSERT_EQ(lock("4711"), base::done);
  EXPECT_EQ(unlock("4712"), base::failed);
  EXPECT_CONTAINS(
      said,
      "the device was not opened: the device refused: the code is wrong; 1 wrong code was given, the next "
      "one is taken in 1 s");
  device->wait(std::chrono::milliseconds(1100));
  EXPECT_EQ(kmax(with({"unlock", "--json"}, "4713")), base::failed);
  EXPECT_CONTAINS(document()["error"].get<std::string>(),
                  "2 wrong codes were given, the next one is taken in 2 s");
}

TEST_F(LockCommands, WhileItWaitsTheRightCodeIsRefusedToo) {
  ASSERT_EQ(lock("4711"), base::done);
  ASSERT_EQ(unlock("4712"), base::failed);
  ASSERT_EQ(unlock("4711"), base::failed);
  EXPECT_CONTAINS(said, "after a wrong code no code is taken for a while, not even the right one");
  EXPECT_CONTAINS(said, "; 1 wrong code was given, the next one is taken in 1 s");
  ASSERT_EQ(kmax({"info"}), base::done);
  EXPECT_CONTAINS(output, "write lock           locked; 1 wrong code was given\n");
  device->wait(std::chrono::seconds(1));
  ASSERT_EQ(kmax(with({"unlock", "--json"}, "4711")), base::done) << said;
  EXPECT_EQ(document(), (Json{{"state", "open"}, {"wrong_codes", 0}, {"wait_s", 0}}));
  EXPECT_CONTAINS(said, "since it was opened last: 1 wrong code\n");
  ASSERT_EQ(kmax({"info", "--json"}), base::done);
  EXPECT_EQ(document()["lock"]["state"], "open");
}

TEST_F(LockCommands, TheCodeIsChangedAndRemovedWhileOpen) {
  ASSERT_EQ(kmax({"lock", "--remove"}), base::done);
  EXPECT_EQ(output, "no code is set; the device is open\n");
  ASSERT_EQ(lock("4711"), base::done);
  for (const char* change : {"--change", "--remove"})
    expect_error(with({"lock", change}, "5000"), base::failed, "the device is locked: 'kmax unlock' first");
  ASSERT_EQ(unlock("4711"), base::done);
  ASSERT_EQ(kmax(with({"lock", "--change"}, "5000")), base::done) << said;
  EXPECT_EQ(state(), "locked");
  EXPECT_EQ(unlock("4711"), base::failed);
  device->wait(std::chrono::seconds(1));
  ASSERT_EQ(unlock("5000"), base::done) << said;
  ASSERT_EQ(kmax({"lock", "--remove"}), base::done) << said;
  EXPECT_EQ(output, "no code is set any more; the device is open\n");
  EXPECT_EQ(state(), "no_code");
  expect_error({"lock", "--remove", "--change"}, base::wrong_usage, "excludes");
}

TEST_F(LockCommands, OnlyDisarmed) {
  ASSERT_EQ(kmax({"set", "link.timeout=0", "wall.law=none"}), base::done);
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  expect_error(
      with({"lock"}, "4711"), base::failed,
      "the code was not set: the device refused: it cannot change while an axis is armed; disarm first");
  ASSERT_EQ(kmax({"disarm"}), base::done);
  ASSERT_EQ(lock("4711"), base::done);
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  expect_error(with({"unlock"}, "4711"), base::failed, "disarm first");
}

// Nor does a message show what was given.
TEST_F(LockCommands, WhatIsNoCodeIsRefusedWithoutBeingShown) {
  for (const char* text : {"", "999", "0", "04711", "4294967296", "47 11", "4711x", "-4711", "4711\n4712",
                           "0x1267", "99999999999999999999999"}) {
    ASSERT_EQ(lock(text), base::wrong_usage) << text;
    EXPECT_CONTAINS(said, "a code is a whole number from 1000 to 4294967295, in digits");
    const std::string shown = text;
    if (shown.size() > 3) {
      EXPECT_EQ(said.find(shown), std::string::npos) << said;
    }
  }
  ASSERT_EQ(lock("4294967295"), base::done) << said;
  EXPECT_EQ(unlock("0"), base::wrong_usage);
  EXPECT_CONTAINS(said, "from 1 to 4294967295");
  EXPECT_EQ(kmax({"unlock", "--code-file", in("none")}), base::wrong_usage);
  EXPECT_CONTAINS(said, "name the file that holds the code");
  EXPECT_EQ(kmax({"unlock", "4294967295"}), base::wrong_usage) << "no argument takes it";
  for (const char* name : {"lock.code=5000", "lock.key=5000"})
    expect_error({"set", name}, base::wrong_usage, "use 'kmax lock' or 'kmax unlock'");
}

TEST_F(LockCommands, ACodeComesThroughAPipe) {
  ASSERT_EQ(piped({"lock"}, "4711\n"), base::done) << said;
  EXPECT_EQ(said, "") << "nobody is asked";
  ASSERT_EQ(piped({"unlock"}, "4711"), base::done) << said;
  EXPECT_EQ(piped({"lock", "--change"}, ""), base::wrong_usage);
  EXPECT_CONTAINS(said, "standard input ended before a code came");
}

/// Somebody at a terminal, who types when nothing is shown any more.
class Typist {
 public:
  explicit Typist(std::string text) {
    if (openpty(&own_, &theirs_, nullptr, nullptr, nullptr) != 0) throw std::runtime_error("no terminal");
    typing_ = std::thread([this, typed = std::move(text)] {
      while (echo()) std::this_thread::yield();
      EXPECT_EQ(write(own_, typed.data(), typed.size()), static_cast<ssize_t>(typed.size()));
    });
  }
  ~Typist() {
    typing_.join();
    close(theirs_);
    close(own_);
  }
  Typist(const Typist&) = delete;
  Typist& operator=(const Typist&) = delete;
  int terminal() const { return theirs_; }
  bool echo() const {
    termios now{};
    return tcgetattr(theirs_, &now) != 0 || (now.c_lflag & ECHO) != 0;
  }
  /// What the terminal has shown.
  std::string shown() const {
    char text[256];
    pollfd readable{own_, POLLIN, 0};
    if (poll(&readable, 1, 0) <= 0) return {};
    const ssize_t got = read(own_, text, sizeof text);
    return got > 0 ? std::string(text, static_cast<std::size_t>(got)) : std::string();
  }

 private:
  int own_ = -1, theirs_ = -1;
  std::thread typing_;
};

TEST_F(LockCommands, ATerminalDoesNotShowWhatIsTyped) {
  Typist typist("4711\n4711\n");
  const Input input(typist.terminal());
  ASSERT_EQ(kmax({"lock"}), base::done) << said;
  EXPECT_CONTAINS(said, "kmax: new code of the write lock: \nkmax: the same once more: \n");
  EXPECT_EQ(typist.shown().find("4711"), std::string::npos);
  EXPECT_TRUE(typist.echo());
}

TEST_F(LockCommands, ASlipInTheSecondOneSetsNothing) {
  Typist typist("4711\n4712\n");
  const Input input(typist.terminal());
  EXPECT_EQ(kmax({"lock"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "the two codes are not the same; nothing was changed");
  EXPECT_EQ(state(), "no_code");
}

TEST_F(LockCommands, UnlockAsksOnceAndOthersCanTalkToTheDeviceMeanwhile) {
  ASSERT_EQ(lock("4711"), base::done);
  const int before = connections;
  Typist typist("4711\n");
  const Input input(typist.terminal());
  ASSERT_EQ(kmax({"unlock"}), base::done) << said;
  EXPECT_CONTAINS(said, "kmax: code of the write lock: \n");
  EXPECT_EQ(connections, before + 2) << "none is open while somebody types";
}

TEST_F(LockCommands, ALostAnswerIsSettledByTheDevicesState) {
  const auto lose = [this](Loss what) {
    loss = what;
    first_lost_write = last_lost_write = 1;
  };
  lose(Loss::reply);
  ASSERT_EQ(lock("4711"), base::done) << said;
  ASSERT_EQ(unlock("4711"), base::done) << said;
  ASSERT_EQ(kmax({"lock"}), base::done) << said;
  lose(Loss::request);
  EXPECT_EQ(unlock("4711"), base::failed);
  EXPECT_CONTAINS(said, "no answer; the device was not opened; try again");
  first_lost_write = last_lost_write = 0;
  ASSERT_EQ(unlock("4711"), base::done);
  lose(Loss::request);
  EXPECT_EQ(kmax(with({"lock", "--change"}, "5000")), base::failed);
  EXPECT_CONTAINS(said, "no answer; the code was not set; try again");
}

TEST_F(LockCommands, HelpSaysWhatItDoesNotProtectFrom) {
  EXPECT_EQ(kmax({"lock", "--help"}), base::done);
  EXPECT_CONTAINS(words(), "the links have no authentication");
  EXPECT_EQ(kmax({"unlock", "--help"}), base::done);
  EXPECT_CONTAINS(words(), "kmax flash --factory-reset");
}

}  // namespace
}  // namespace kmax::cli::lock_commands_test
