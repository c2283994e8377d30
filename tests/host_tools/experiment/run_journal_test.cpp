#include "host_tools/experiment/run_journal.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <limits>

#include "host_tools/experiment/job_pool.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::run_journal_test {
namespace {
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using Json = RunJournal::Json;
using Begin = RunJournal::Begin;

class Journal : public testing::Test {
 protected:
  std::filesystem::path file() const { return folder / "run.jsonl"; }
  std::string text() const { return folder.read("run.jsonl"); }
  void write(const std::string& text) const { folder.write("run.jsonl", text); }
  std::string refusal(const Json& given, Begin begin = Begin::resume) const {
    return thrown_message<JournalError>([&] { const RunJournal journal(file(), given, begin); });
  }
  /// A journal of two jobs.
  std::string two_jobs() const {
    RunJournal journal(file(), settings, Begin::fresh);
    journal.add("first", {{"stiffness", 3580.1}});
    journal.add("second", 8.41);
    return text();
  }

  const TemporaryFolder folder;
  const Json settings = {{"trials", 3}, {"rate", 500.0}, {"clip", "on"}};
};

TEST_F(Journal, AResumedRunFindsWhatIsDone) {
  two_jobs();
  RunJournal journal(file(), settings, Begin::resume);
  EXPECT_EQ(journal.resumed(), 2u);
  ASSERT_NE(journal.find("first"), nullptr);
  EXPECT_EQ(journal.find("first")->at("stiffness"), 3580.1);
  EXPECT_EQ(*journal.find("second"), 8.41);
  EXPECT_EQ(journal.find("third"), nullptr);
  journal.add("third", nullptr);
  EXPECT_EQ(journal.size(), 3u);
  EXPECT_EQ(journal.resumed(), 2u);
}

TEST_F(Journal, ResumingWithoutAFileBeginsOne) {
  { const RunJournal journal(file(), settings, Begin::resume); }
  const RunJournal again(file(), settings, Begin::resume);
  EXPECT_EQ(again.resumed(), 0u);
}

TEST_F(Journal, AnewKeepsWhatWasThereAside) {
  const std::string before = two_jobs();
  const RunJournal journal(file(), settings, Begin::fresh);
  EXPECT_EQ(journal.size(), 0u);
  EXPECT_EQ(folder.read("run.jsonl.previous"), before);
}

TEST_F(Journal, AJobIsInTheFileWhenAddReturns) {
  RunJournal journal(file(), settings, Begin::fresh);
  journal.add("one", 1);
  EXPECT_TRUE(text().ends_with("{\"key\":\"one\",\"value\":1}\n")) << text();
  EXPECT_THROW(journal.add("one", 2), std::logic_error);
  EXPECT_EQ(*journal.find("one"), 1);
}

// Wherever the program ends while it writes, the jobs before are done and the next run writes whole lines.
TEST_F(Journal, ATornLastLineIsIgnoredWhereverItIsTorn) {
  const std::string whole = two_jobs();
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    const std::string torn = whole.substr(0, length);
    write(torn);
    const auto lines = std::count(torn.begin(), torn.end(), '\n');
    {
      RunJournal journal(file(), settings, Begin::resume);
      ASSERT_EQ(journal.resumed(), lines == 0 ? 0u : static_cast<std::size_t>(lines - 1)) << length;
      journal.add("new", length);
    }
    const RunJournal journal(file(), settings, Begin::resume);
    ASSERT_EQ(*journal.find("new"), length);
    ASSERT_EQ(journal.find("first") != nullptr, lines >= 2) << length;
  }
}

// What a file system leaves of a line when the machine loses its power.
TEST_F(Journal, ALastLineOfNothingIsIgnoredAndOneBeforeIsNot) {
  const std::string whole = two_jobs();
  const std::string lost(30, '\0');
  write(whole + lost + '\n');
  {
    const RunJournal journal(file(), settings, Begin::resume);
    EXPECT_EQ(journal.resumed(), 2u);
  }
  EXPECT_EQ(text(), whole);
  write(whole + lost + "\n{\"key\":\"third\",\"value\":1}\n");
  EXPECT_CONTAINS(refusal(settings), "line 4");
  write(whole + lost);
  const RunJournal journal(file(), settings, Begin::resume);
  EXPECT_EQ(journal.resumed(), 2u);
}

TEST_F(Journal, OtherSettingsAreRefusedWithTheirNames) {
  const std::string before = two_jobs();
  Json other = settings;
  other["trials"] = 5;
  EXPECT_CONTAINS(refusal(other), "trials was 3 and is 5 now");
  other = settings;
  other["seed"] = 1;
  EXPECT_CONTAINS(refusal(other), "seed was not a setting and is 1 now");
  EXPECT_CONTAINS(refusal({{"trials", 3}, {"rate", 500.0}}), "clip was \"on\" and is no setting now");
  EXPECT_CONTAINS(refusal(other), file().string());
  EXPECT_EQ(text(), before);
  // Another order is the same settings.
  const RunJournal journal(file(), {{"clip", "on"}, {"rate", 500.0}, {"trials", 3}}, Begin::resume);
  EXPECT_EQ(journal.resumed(), 2u);
}

TEST_F(Journal, WhatIsNoJournalIsRefusedAndLeftAlone) {
  for (const std::string& bad : std::vector<std::string>{
           "not a journal\n", "{}\n", "[]\n", "3\n", "\n", "{\"journal\":1}\n", "time_s,position_m\n0,0\n",
           "{\"journal\":1,\"settings\":3}\n", "{\"journal\":2,\"settings\":{}}\n"}) {
    write(bad);
    EXPECT_NE(refusal(settings), "") << bad;
    EXPECT_EQ(text(), bad);
  }
  const std::string whole = two_jobs();
  const std::string head = whole.substr(0, whole.find('\n') + 1);
  for (const std::string& bad :
       std::vector<std::string>{"{\"key\":3,\"value\":1}", "{\"key\":\"a\"}", "[1]", "x"}) {
    write(head + bad + "\n{\"key\":\"b\",\"value\":1}\n");
    EXPECT_CONTAINS(refusal(settings), "line 2");
  }
}

TEST_F(Journal, AJournalInUseIsRefusedToOthers) {
  const RunJournal journal(file(), settings, Begin::fresh);
  const std::string before = text();
  for (const Begin begin : {Begin::fresh, Begin::resume})
    EXPECT_CONTAINS(refusal(settings, begin), "another program is writing this journal");
  const pid_t child = fork();
  if (child == 0) {
    bool refused = false;
    try {
      const RunJournal second(file(), settings, Begin::resume);
    } catch (const JournalError&) {
      refused = true;
    }
    _exit(refused ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(text(), before);
}

TEST_F(Journal, AProgramThatIsKilledLeavesItsJobsAndNoLock) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    RunJournal journal(file(), settings, Begin::fresh);
    for (int i = 0; i < 5; ++i) journal.add(std::to_string(i), i);
    [[maybe_unused]] const ssize_t reported = ::write(ready[1], "x", 1);
    for (;;) pause();
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_CONTAINS(refusal(settings), "another program");
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const RunJournal journal(file(), settings, Begin::resume);
  EXPECT_EQ(journal.resumed(), 5u);
  close(ready[0]);
  close(ready[1]);
}

// A full disk, as a limit on the file's length shows it.
TEST_F(Journal, ALineThatCannotBeWrittenLeavesTheFileAsItWas) {
  const std::string whole = two_jobs();
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{whole.size() + 10, whole.size() + 10};
    int code = 1;
    try {
      RunJournal journal(file(), settings, Begin::resume);
      setrlimit(RLIMIT_FSIZE, &limit);
      journal.add("long enough to be torn by the limit", 1);
    } catch (const JournalError&) {
      code = 0;
    }
    _exit(code);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(text(), whole);
}

TEST_F(Journal, PlacesThatCannotBeWrittenAreNamed) {
  const auto message = [&](const std::filesystem::path& path) {
    return thrown_message<JournalError>([&] { const RunJournal journal(path, settings, Begin::fresh); });
  };
  EXPECT_CONTAINS(message(folder / "none/run.jsonl"), "none/run.jsonl");
  EXPECT_CONTAINS(message(folder.path()), folder.path().string());
}

TEST_F(Journal, ThreadsAddSideBySide) {
  {
    RunJournal journal(file(), settings, Begin::fresh);
    run_jobs(300, 8, [&](std::size_t index) { journal.add(std::to_string(index), index); });
  }
  const RunJournal journal(file(), settings, Begin::resume);
  ASSERT_EQ(journal.resumed(), 300u);
  for (std::size_t i = 0; i < 300; ++i) ASSERT_EQ(*journal.find(std::to_string(i)), i);
}

RC_GTEST_PROP(JournalProperty, KeysAndNumbersComeBackToTheLastBit, (const std::string& key)) {
  const TemporaryFolder folder;
  const double number = *rc::gen::map(rc::gen::arbitrary<std::int64_t>(),
                                      [](std::int64_t n) { return static_cast<double>(n) / 3.0 * 1e-12; });
  // Arbitrary bytes are no UTF-8 and would come back as another key.
  std::string ascii = key;
  for (char& c : ascii) c = static_cast<char>(c & 0x7F);
  { RunJournal(folder / "j", Json::object(), Begin::fresh).add(ascii, number); }
  const RunJournal journal(folder / "j", Json::object(), Begin::resume);
  RC_ASSERT(journal.find(ascii) != nullptr);
  RC_ASSERT(journal.find(ascii)->get<double>() == number);
}

TEST_F(Journal, BytesThatAreNoUtf8AreReplaced) {
  RunJournal journal(file(), settings, Begin::fresh);
  EXPECT_NO_THROW(journal.add("bad \xFF", "\xC3"));
  EXPECT_NO_THROW(RunJournal(folder / "other", {{"path", "\xFF"}}, Begin::fresh));
  journal.add("nan", std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(journal.find("nan")->is_null());
}

struct Kept {
  struct {
    double amplitude = 0.0;
  } measure;
  bool aborted = false;
  std::uint64_t lost = 0;
  int unkept = 0;
};

constexpr auto fields = [](auto& kept, const auto& field) {
  field("z_m", kept.measure.amplitude);
  field("aborted", kept.aborted);
  field("lost", kept.lost);
};

RunJournal::Json written(const Kept& kept) {
  RunJournal::Json json;
  write_fields(json, kept, fields);
  return json;
}

const Kept some{{0.1}, true, std::numeric_limits<std::uint64_t>::max(), 7};

TEST(JournalFields, AreWrittenInTheirOrder) {
  EXPECT_EQ(written(some).dump(), R"({"z_m":0.1,"aborted":true,"lost":18446744073709551615})");
}

TEST(JournalFields, ComeBackThroughTheFile) {
  const host_tools_test::TemporaryFolder folder;
  {
    RunJournal journal(folder / "j", {{"settings", 1}}, RunJournal::Begin::fresh);
    journal.add("one", written(some));
  }
  const RunJournal journal(folder / "j", {{"settings", 1}}, RunJournal::Begin::resume);
  Kept back;
  read_fields(*journal.find("one"), back, fields);
  EXPECT_EQ(back.measure.amplitude, some.measure.amplitude);
  EXPECT_EQ(back.aborted, some.aborted);
  EXPECT_EQ(back.lost, some.lost);
  EXPECT_EQ(back.unkept, 0);
}

TEST(JournalFields, AreAddedToWhatIsThere) {
  RunJournal::Json json = {{"verdict", "stable"}, {"aborted", 3}};
  write_fields(json, some, fields);
  EXPECT_EQ(json.dump(), R"({"verdict":"stable","aborted":true,"z_m":0.1,"lost":18446744073709551615})");
  Kept back;
  read_fields(json, back, fields);
  EXPECT_TRUE(back.aborted) << "another name is passed over";
}

TEST(JournalFields, OneThatIsMissingOrOfAnotherKindIsRefused) {
  Kept kept;
  const auto refusal = [&kept](const RunJournal::Json& json) {
    return thrown_message<RunJournal::Json::exception>([&] { read_fields(json, kept, fields); });
  };
  RunJournal::Json json = written(some);
  json.erase("lost");
  EXPECT_CONTAINS(refusal(json), "lost");
  json = written(some);
  json["aborted"] = "yes";
  EXPECT_CONTAINS(refusal(json), "boolean");
  Kept infinite = some;
  infinite.measure.amplitude = std::numeric_limits<double>::infinity();
  EXPECT_CONTAINS(refusal(RunJournal::Json::parse(written(infinite).dump())), "null");
  EXPECT_NE(refusal(RunJournal::Json(3)), "");
  EXPECT_NE(refusal(RunJournal::Json()), "");
}

}  // namespace

}  // namespace kmax::experiment::run_journal_test
