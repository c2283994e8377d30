#include "host_tools/experiment/touch_journal.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::touch_journal_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

struct Counted {
  int number = 0;
  bool good = true;
  bool counts() const { return good; }
};
void to_json(RunJournal::Json& json, const Counted& touch) {
  json = {{"number", touch.number}};
}
void from_json(const RunJournal::Json& json, Counted& touch) {
  touch.number = json.at("number").get<int>();
}

class Asked final : public bench::Prompter {
 public:
  void ask(const std::string&) override {}
};

class TouchJournal : public testing::Test {
 protected:
  Counted touch(const std::string& key, bench::Prompter* prompter = nullptr) {
    return journaled_touch<Counted>({prompter, journal.get(), report}, key, "wall", once);
  }
  void reopen(RunJournal::Begin begin) {
    journal.reset();
    journal = std::make_unique<RunJournal>(folder / "j", RunJournal::Json{{"settings", 1}}, begin);
  }
  TouchJournal() { reopen(RunJournal::Begin::fresh); }

  const TemporaryFolder folder;
  std::unique_ptr<RunJournal> journal;
  std::vector<std::string> reported;
  const ReportText report = [this](const std::string& text) { reported.push_back(text); };
  int made = 0;
  std::function<Counted()> once = [this] { return Counted{++made, true}; };
  Asked person;
};

TEST_F(TouchJournal, ATouchIsMadeOnceAndKnownAfterwards) {
  EXPECT_EQ(touch("a").number, 1);
  EXPECT_EQ(touch("b").number, 2);
  reopen(RunJournal::Begin::resume);
  EXPECT_EQ(touch("a").number, 1);
  EXPECT_EQ(touch("b").number, 2);
  EXPECT_EQ(made, 2);
}

TEST_F(TouchJournal, ATouchThatDoesNotCountIsMadeAgainAndNotKept) {
  once = [this] { return Counted{++made, made == 2}; };
  EXPECT_EQ(touch("a").number, 2);
  EXPECT_EQ(reported.size(), 1u);
  once = [this] { return Counted{++made, false}; };
  EXPECT_EQ(touch("b").number, 5);
  EXPECT_EQ(journal->size(), 1u);
  once = [this] { return Counted{++made, true}; };
  reopen(RunJournal::Begin::resume);
  EXPECT_EQ(touch("b").number, 6);
}

TEST_F(TouchJournal, NobodyIsAskedThreeTimesAndWithoutAPrompterOnce) {
  once = [this]() -> Counted {
    ++made;
    throw NobodyTouched("nobody");
  };
  EXPECT_THROW(touch("a"), NobodyTouched);
  EXPECT_EQ(made, 1);
  EXPECT_THROW(touch("a", &person), NobodyTouched);
  EXPECT_EQ(made, 4);
  once = [this] {
    if (++made < 7) throw NobodyTouched("nobody");
    return Counted{made, true};
  };
  EXPECT_EQ(touch("a", &person).number, 7);
}

TEST_F(TouchJournal, AnyOtherErrorIsTheCallersAndNothingIsKept) {
  once = []() -> Counted { throw base::DeviceError("fault"); };
  EXPECT_THROW(touch("a", &person), base::DeviceError);
  EXPECT_EQ(journal->size(), 0u);
}

TEST_F(TouchJournal, SomethingElseUnderItsKeyIsRefused) {
  journal->add("a", "nonsense");
  const auto what = thrown_message<JournalError>([&] { touch("a"); });
  EXPECT_CONTAINS(what, "'a' is not what this experiment writes");
  EXPECT_EQ(made, 0);
}

TEST_F(TouchJournal, WithoutAJournalEveryTouchIsMade) {
  journal.reset();
  touch("a");
  EXPECT_EQ(touch("a").number, 2);
}

}  // namespace kmax::experiment::touch_journal_test
