#include "host_tools/flash/program.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::flash::program_test {

using Words = std::vector<std::string>;
using std::chrono::milliseconds;

class Program : public testing::Test {
 protected:
  ProgramResult shell(
      const std::string& text, const std::function<bool()>& stop = [] { return false; },
      const ProgramLimits& limits = {}) {
    return run_program(Words{"/bin/sh", "-c", text, "name"}, folder.path(), folder / "log", stop, limits);
  }
  std::string log() const { return folder.read("log"); }
  host_tools_test::TemporaryFolder folder;
};

TEST_F(Program, ExitCodesAndSignalsAreTold) {
  EXPECT_TRUE(shell("exit 0").succeeded());
  const ProgramResult failed = shell("exit 7");
  EXPECT_EQ(failed.end, ProgramEnd::exited);
  EXPECT_EQ(failed.code, 7);
  EXPECT_FALSE(failed.succeeded());
  const ProgramResult killed = shell("kill -SEGV $$");
  EXPECT_EQ(killed.end, ProgramEnd::killed_by_signal);
  EXPECT_EQ(killed.code, SIGSEGV);
}

TEST_F(Program, BothOutputsGoToTheLogBehindTheCommandLine) {
  shell("echo one; echo two >&2");
  shell("echo three");
  EXPECT_CONTAINS(log(), "$ /bin/sh -c 'echo one; echo two >&2' name\none\ntwo\n");
  EXPECT_CONTAINS(log(), "three\n");
}

TEST_F(Program, LongOutputIsComplete) {
  EXPECT_TRUE(
      shell("i=0; while [ $i -lt 20000 ]; do echo 0123456789; i=$((i+1)); done; echo END").succeeded());
  EXPECT_GT(log().size(), 220'000u);
  EXPECT_TRUE(log().ends_with("END\n"));
}

TEST_F(Program, RunsInTheFolderWithoutInputAndWithoutAShell) {
  EXPECT_TRUE(shell("read line && exit 1; pwd > where").succeeded());
  EXPECT_EQ(folder.read("where"), folder.path().string() + "\n");
  run_program(Words{"/bin/echo", "$HOME; exit 1", "a b"}, folder.path(), folder / "log",
              [] { return false; });
  EXPECT_CONTAINS(log(), "\n$HOME; exit 1 a b\n");
}

TEST_F(Program, OneThatCannotBeStartedIsNamed) {
  EXPECT_CONTAINS(host_tools_test::thrown_message<ProgramError>([&] {
                    run_program(Words{"/no/such/program"}, folder.path(), folder / "log",
                                [] { return false; });
                  }),
                  "/no/such/program cannot be started: No such file");
}

TEST_F(Program, AnInterruptionEndsItInOrder) {
  const auto stop = [this] { return std::filesystem::exists(folder / "ready"); };
  const ProgramResult result =
      shell("trap 'echo tidied; exit 0' INT; touch ready; while :; do sleep 0.01; done", stop);
  EXPECT_EQ(result.end, ProgramEnd::interrupted);
  EXPECT_FALSE(result.succeeded()) << "although it says that all is well";
  EXPECT_CONTAINS(log(), "tidied");
}

TEST_F(Program, OneThatIgnoresSignalsIsKilled) {
  const auto stop = [this] { return std::filesystem::exists(folder / "ready"); };
  const ProgramResult result = shell("trap '' INT TERM; touch ready; while :; do sleep 0.01; done", stop,
                                     {.at_most = milliseconds(600'000), .grace = milliseconds(20)});
  EXPECT_EQ(result.end, ProgramEnd::interrupted);
  EXPECT_EQ(result.code, SIGKILL);
}

TEST_F(Program, WhatItStartedIsGoneToo) {
  const auto stop = [this] { return std::filesystem::exists(folder / "ready"); };
  shell("sh -c 'trap \"\" INT TERM; echo $$ > child; touch ready; while :; do sleep 0.01; done'", stop,
        {.at_most = milliseconds(600'000), .grace = milliseconds(20)});
  const pid_t child = std::stoi(folder.read("child"));
  // Without its parent it is the init process' to collect; until then it counts as there.
  for (int i = 0; i < 500 && kill(child, 0) == 0; ++i) {
    const std::string state = "/proc/" + std::to_string(child) + "/stat";
    std::ifstream file(state);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.find(") Z ") != std::string::npos) return;
    usleep(10'000);
  }
  EXPECT_NE(kill(child, 0), 0);
}

TEST_F(Program, OneThatTakesTooLongIsEnded) {
  const ProgramResult result =
      shell("sleep 600", [] { return false; }, {.at_most = milliseconds(50), .grace = milliseconds(20)});
  EXPECT_EQ(result.end, ProgramEnd::timed_out);
  EXPECT_FALSE(result.succeeded());
}

TEST_F(Program, OneThatLeavesItsOutputToAnotherDoesNotHold) {
  EXPECT_TRUE(shell("sleep 600 & echo $! > child; exit 0").succeeded());
  kill(std::stoi(folder.read("child")), SIGKILL);
}

TEST_F(Program, IsFoundOnPathOnlyIfItCanBeRun) {
  const std::string old = getenv("PATH");
  for (const char* name : {"a", "b", "c"}) std::filesystem::create_directory(folder / name);
  folder.write("a/tool", "");
  std::filesystem::create_directory(folder / "b" / "tool");
  std::filesystem::permissions(folder.write("c/tool", ""), std::filesystem::perms::owner_all);
  setenv("PATH",
         ((folder / "a").string() + "::" + (folder / "b").string() + ":" + (folder / "c").string()).c_str(),
         1);
  EXPECT_EQ(find_program("tool"), folder / "c" / "tool");
  EXPECT_EQ(find_program("other"), std::nullopt);
  setenv("PATH", "", 1);
  EXPECT_EQ(find_program("tool"), std::nullopt);
  setenv("PATH", old.c_str(), 1);
}

TEST(CommandText, IsWhatAShellUnderstands) {
  EXPECT_EQ(command_text(Words{"openocd", "-c", "reset halt", "-f", "a/b.cfg"}),
            "openocd -c 'reset halt' -f a/b.cfg");
  EXPECT_EQ(command_text(Words{"a", "", "it's", "$x"}), "a '' 'it'\\''s' '$x'");
}

}  // namespace kmax::flash::program_test
