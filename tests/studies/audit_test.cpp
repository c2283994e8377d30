#include "tests/studies/audit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::studies::audit_test {

using experiment::few_people;
using experiment::found_stiffness;
using experiment::paragraphs_of;
using experiment::quick_run;
using Row = std::vector<std::string>;

PeopleMean only(double stiffness) {
  return {stiffness, {}, 0.0, {}};
}

TEST(AuditedLaws, AreLawsOfOursAndSoAreThoseThatAreReadDifferently) {
  std::set<std::string, std::less<>> ours;
  for (const Baseline& law : law_baselines()) ours.insert(law.name);
  std::set<std::string_view> audited;
  for (const AuditedLaw& law : audited_laws) {
    EXPECT_TRUE(ours.contains(law.ours)) << law.ours;
    EXPECT_TRUE(audited.insert(law.ours).second) << law.ours;
  }
  std::set<std::string> names;
  for (const LawReading& one : law_readings()) {
    EXPECT_TRUE(audited.contains(one.law)) << one.law;
    EXPECT_TRUE(names.insert(one.law + one.what).second) << one.what;
  }
}

std::vector<experiment::TouchSample> touch_of(const WallChange& wall, double stiffness) {
  TouchSetup setup;
  setup.wall.wall.kind = control::WallKind::plain;
  setup.wall.wall.stiffness = static_cast<float>(stiffness);
  wall(setup);
  std::vector<experiment::TouchSample> samples;
  experiment::simulate_touch(setup, &samples);
  return samples;
}

// What is varied is our own law: with nothing changed it is that to the last bit.
TEST(LawReadings, WithNothingChangedThePassivityControllerIsOurs) {
  for (const bool spring : {false, true}) {
    const auto ours = touch_of(passivity_controlled(15.0, spring), 7000.0),
               read = touch_of(passivity_read({.keeps_spring = spring}), 7000.0);
    ASSERT_EQ(ours.size(), read.size());
    for (std::size_t n = 0; n < ours.size(); ++n) ASSERT_EQ(ours[n].position, read[n].position) << n;
  }
}

TEST(LawReadings, WithNothingChangedTheWallGrowsLikeTheFirmwares) {
  const auto ours = touch_of(growing(2000.0, 0.2, 0.0), 8000.0), read = touch_of(growth_read({}), 8000.0);
  ASSERT_EQ(ours.size(), read.size());
  // Its velocity is one sample older, and its surface is a count's edge.
  EXPECT_NEAR(ours.back().position, read.back().position, 60e-6);
  EXPECT_GT(read.back().force, 0.5);
}

TEST(LawReadings, AWallThatNeverPullsDoesNot) {
  const auto least = [](bool pulls) {
    double force = 0.0;
    for (const auto& sample : touch_of(passivity_read({.keeps_spring = true, .pulls = pulls}), 12000.0))
      force = std::min(force, sample.force);
    return force;
  };
  EXPECT_LT(least(true), -0.1);
  // The count's edge and the loop's surface differ by rounding.
  EXPECT_GT(least(false), -1e-3);
}

// The two readings that the page rests on, on few people.
TEST(LawReadings, NotPullingAndNotComingToItsStiffnessMakeTheDifference) {
  const SubjectSet set = few_people(2);
  const auto found = sweep(set,
                           {plain_wall().wall, passivity_controlled(15.0, false),
                            passivity_read({.pulls = false}), growing(2000.0, 0.2, 0.0), growth_read({})},
                           quick_run());
  EXPECT_GT(found[1].mean, found[2].mean + 500.0);
  EXPECT_GT(found[2].mean, found[0].mean + 500.0);
  EXPECT_GT(found[4].mean, 1.1 * found[3].mean);
  EXPECT_GT(found[3].mean, 2.0 * found[0].mean);
}

TEST(CompareWithAudit, HasEveryLawAndItsNoiseAndEveryReading) {
  StiffnessRun run = quick_run();
  run.steps.last = 1500.0;
  std::vector<BaselineResult> results;
  for (const Baseline& law : law_baselines())
    results.push_back({law, only(3000.0), only(1.0), only(2000.0), only(2000.0), {}, {}});
  const AuditComparison comparison = compare_with_audit(few_people(1), results, results, run);
  ASSERT_EQ(comparison.rows.size(), audited_laws.size());
  for (const AuditRow& row : comparison.rows) {
    EXPECT_EQ(row.moves.mean, 3000.0);
    EXPECT_EQ(row.feels.mean, 2000.0);
    EXPECT_LE(row.least, row.most);
    EXPECT_GT(row.least, 0.0) << "so soft a wall is stable from wherever it is touched";
  }
  EXPECT_EQ(comparison.readings.size(), law_readings().size());
  for (const report::Table& table : audit_section(comparison).tables)
    EXPECT_NO_THROW(report::require_rectangular(table));
}

TEST(AuditSection, SaysWhatExplainsADifferenceAndWhatDoesNot) {
  AuditComparison comparison;
  const auto row = [&](std::size_t law, double ours, double least, double most) {
    comparison.rows.push_back({audited_laws[law], only(ours), only(3570.0), only(3500.0), least, most});
  };
  row(0, 3580.0, 3550.0, 3600.0);     // 3.57
  row(5, 8050.0, 8000.0, 8100.0);     // 6.21
  row(7, 19560.0, 19000.0, 20000.0);  // 10.97
  row(4, 9830.0, 9600.0, 10120.0);    // 10.20, a step of the search beyond the range
  row(9, 9000.0, 8900.0, 9100.0);     // 9.38, and nothing was read differently
  const auto read = [&](std::size_t law, const char* what, double found) {
    comparison.readings.push_back(
        {{std::string(audited_laws[law].ours), what, {}}, only(found), only(3650.0)});
  };
  read(5, "turned round", 8000.0);
  read(5, "never pulls", 6000.0);
  read(7, "keeps", 13000.0);
  const report::Section section = audit_section(comparison);
  const report::Table& laws = section.tables[0];
  EXPECT_EQ(laws.rows[0], (Row{"plain", "3.57", "3.58", "+0.01", "3.57", "3.57", "+0.00", "3.48", "3.50",
                               "+0.02", "within the noise: 3.55 to 3.60 when touches begin elsewhere"}));
  EXPECT_EQ(laws.rows[1].back(), "read differently: never pulls, 6.00 N/mm");
  EXPECT_EQ(laws.rows[2].back(), "not explained; readings tried: 1, the nearest: keeps, 13.00 N/mm");
  EXPECT_CONTAINS(laws.rows[3].back(), "within the noise");
  EXPECT_CONTAINS(laws.rows[4].back(), "not explained: 8.90 to 9.10");
  EXPECT_EQ(section.tables[1].rows[1], (Row{"passivity controller, alpha <= 15 N s/m", "never pulls", "6.00",
                                            "-0.21", "3.65", "+0.00"}));
  EXPECT_CONTAINS(paragraphs_of(section), "Of 5 laws 2 come out within the noise");
  EXPECT_CONTAINS(paragraphs_of(section), "Of the others 1 can be had within 4 %");
  EXPECT_CONTAINS(paragraphs_of(section), "and 2 cannot");
  read(5, "the wall never pulls", 7130.0);
  EXPECT_CONTAINS(paragraphs_of(audit_section(comparison)),
                  "50 % of +1.84 N/mm (passivity controller, alpha <= 15 N s/m)");
}

// --- Raw data ---------------------------------------------------------------------------------------------

TEST(RawData, HasARowForEachPersonAndWallAndAFileForEachStudy) {
  SubjectSet set = few_people(2);
  RawData raw;
  StudyInput input{{set}, quick_run(), {}};
  std::vector<MaxStiffness> people{found_stiffness(3000.0), found_stiffness(40000.0)};
  people[0].ending_speed = 0.1;
  people[1].beyond_last = true;
  input.keep("baselines", set, "plain", "position", mean_of(people));  // nobody hears of it
  input.raw = &raw;
  input.keep("baselines", set, "plain", "position", mean_of(people));
  input.keep("baselines", set, "field, of 2 N", "force", mean_of(people));
  input.keep("rates", set, "plain", "force", mean_of({people.data(), 1}));
  ASSERT_EQ(raw.tables().size(), 2U);
  EXPECT_EQ(raw.tables()[0].rows.size(), 4U);
  EXPECT_EQ(raw.tables()[0].rows[1],
            (Row{"few", "3.3", "plain", "position", "2", "40000", "yes", "0", "0", "0"}));
  const host_tools_test::TemporaryFolder folder;
  raw.write(folder / "");
  EXPECT_EQ(folder.read("raw_baselines.csv"), report::csv(raw.tables()[0]));
  EXPECT_CONTAINS(folder.read("raw_rates.csv"), "few,3.3,plain,force,1,3000,no,0.1,0,0");
  EXPECT_CONTAINS(host_tools_test::thrown_message<std::runtime_error>([&] { raw.write(folder / "none"); }),
                  "raw_baselines.csv");
}

TEST(RawData, StudiesKeepTheirPeople) {
  RawData raw;
  StudyInput input{{few_people(2)}, quick_run(), {}};
  input.raw = &raw;
  input.run.steps.last = 1000.0;
  run_studies({"largest"}, input);
  ASSERT_EQ(raw.tables().size(), 1U);
  EXPECT_EQ(raw.tables()[0].caption, "largest");
  EXPECT_EQ(raw.tables()[0].rows.size(), 2 * experiment::stiffness_conditions().size());
}

}  // namespace kmax::studies::audit_test
