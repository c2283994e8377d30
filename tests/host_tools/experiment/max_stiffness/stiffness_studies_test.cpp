#include "host_tools/experiment/max_stiffness/stiffness_studies.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/quick_study.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::stiffness_studies_test {
namespace {

TEST(StiffnessStudies, AnUnknownNameIsRefusedWithThoseThereAre) {
  const auto message = [](std::string_view name) {
    return host_tools_test::thrown_message<std::invalid_argument>(
        [&] { run_stiffness_study(name, {few_people(1)}, quick_run()); });
  };
  for (const char* name : {"", "cause", "Causes", "all"}) {
    for (const StudyName& study : stiffness_studies) EXPECT_CONTAINS(message(name), study.name);
  }
  EXPECT_TRUE(message("cause").starts_with("cause: there is no such study"));
}

TEST(StiffnessStudies, NobodyToStudyIsRefused) {
  for (const StudyName& study : stiffness_studies)
    EXPECT_THROW(run_stiffness_study(study.name, {}, quick_run()), std::invalid_argument) << study.name;
}

TEST(StiffnessStudies, HeldWallsHaveASectionForEachSet) {
  SubjectSet clipped = few_people(1), unclipped = few_people(1);
  unclipped.device.force_limit = 0.0;
  const auto sections = run_stiffness_study("figures", {clipped, unclipped}, quick_run());
  ASSERT_EQ(sections.size(), 2U);
  EXPECT_CONTAINS(sections[0].heading, "clipped at 3.3 N");
  EXPECT_CONTAINS(sections[1].heading, "not clipped");
  for (const report::Section& section : sections)
    EXPECT_NO_THROW(report::require_rectangular(section.tables.at(0)));
}

TEST(StiffnessStudies, CausesOfAllSetsStandInOneTable) {
  SubjectSet clipped = few_people(1), unclipped = few_people(1);
  unclipped.device.force_limit = 0.0;
  StiffnessRun run = quick_run();
  run.steps.last = 300.0;  // no wall that is stable so far up ends elsewhere
  const auto sections = run_stiffness_study("causes", {clipped, unclipped}, run);
  ASSERT_EQ(sections.size(), 1U);
  const report::Table& table = sections[0].tables.at(0);
  EXPECT_EQ(table.columns.size(), 4U);
  EXPECT_EQ(table.rows.size(), cause_conditions(1.0).size());
  EXPECT_EQ(table.rows[0][2], ">0.30");
}

}  // namespace
}  // namespace kmax::experiment::stiffness_studies_test
