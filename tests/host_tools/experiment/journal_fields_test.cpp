#include "host_tools/experiment/journal_fields.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::journal_fields_test {
namespace {
using host_tools_test::thrown_message;

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
    RunJournal journal(folder / "j", {{"settings", 1}}, RunJournal::Begin::anew);
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
}  // namespace kmax::experiment::journal_fields_test
