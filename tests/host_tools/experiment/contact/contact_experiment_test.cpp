#include "host_tools/experiment/contact/contact_experiment.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "host_tools/plot/csv_table.hpp"
#include "host_tools/plot/figure.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::contact_experiment_test {

using host_tools_test::thrown_message;
using simulation::ContactVerdict;

class Contact : public TouchedBoard {
 protected:
  Contact() { settings.hold_time = 1.0; }

  ContactResult run(std::size_t condition) {
    const ReportText nobody = [](const std::string&) {};
    rig.reset();
    rig.emplace(device, limits, TouchParty{nullptr, nullptr, report, nobody});
    return run_contact(*rig, contact_conditions()[condition], settings);
  }

  ContactSettings settings;
  TouchLimits limits = contact_limits();
  std::optional<DeviceRig> rig;  ///< as it was left
};

TEST(ContactConditions, AreThePapersWallsWithTheAdaptiveOneInEachMode) {
  const auto conditions = contact_conditions();
  ASSERT_EQ(conditions.size(), paper::contact_verdicts.size() + 2);
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const auto& verdict = paper::contact_verdicts[std::min<std::size_t>(i, 3)];
    EXPECT_EQ(conditions[i].figure, verdict.figure);
    EXPECT_EQ(conditions[i].paper_words, verdict.words);
    EXPECT_EQ(conditions[i].paper_stable, verdict.stable);
  }
  EXPECT_EQ(conditions[1].name, "F_MC = 1 N");
  EXPECT_EQ(conditions[1].assignments,
            (std::vector<std::string>{"wall.law=magnetic", "wall.magnetic_coefficient=1"}));
  EXPECT_EQ(conditions[4].name, "adaptive, latched");
  EXPECT_EQ(conditions[4].assignments,
            (std::vector<std::string>{"wall.law=adaptive", "wall.adaptive_mode=latched"}));
}

// A coarse position that somebody left set makes any wall vibrate (paper 2).
TEST_F(Contact, PositionsAreThoseOfTheEncoder) {
  device.apply(device::parse_assignments({"position.resolution=0.0004"}));
  run(2);
  EXPECT_EQ(device.read_number("position.resolution"), 0.0);
}

TEST_F(Contact, ATrialHasTheTouchAtTimeZeroAndLosesNothing) {
  const ContactResult result = run(1);
  expect_disarmed();
  EXPECT_EQ(result.condition.name, "F_MC = 1 N");
  EXPECT_EQ(result.lost_records, 0u);
  EXPECT_EQ(result.judged_from, 0.0);
  EXPECT_EQ(result.judged_to, 1.0);
  EXPECT_NE(result.measure.verdict, ContactVerdict::no_contact);
  ASSERT_FALSE(result.samples.empty());
  EXPECT_LT(result.samples.front().time, 0.0);
  EXPECT_GT(result.samples.back().time, 1.0);
  for (const auto& sample : result.samples) {
    ASSERT_TRUE(sample.time >= 0 || sample.outside_distance > 0.0) << sample.time;
    ASSERT_TRUE(sample.time != 0 || sample.outside_distance <= 0.0);
    ASSERT_EQ(result.position(sample), sample.outside_distance) << "of a surface at 0";
  }
  EXPECT_EQ(std::count_if(result.samples.begin(), result.samples.end(), [](auto& s) { return s.time == 0; }),
            1);
  ASSERT_FALSE(reported.empty());
  EXPECT_CONTAINS(reported.front(), "F_MC = 1 N: waiting for the touch");
  EXPECT_CONTAINS(reported.back(), "of 1.0 s");
  EXPECT_EQ(device.read_number("wall.magnetic_coefficient"), 1);
  EXPECT_EQ(device.read_number("trace.interval"), 0);
}

// The person presses for 3 s, and the trial is over after 1.3 s: arming must wait until the hand is back.
TEST_F(Contact, AnotherTrialOnTheSameDeviceWaitsForTheHandle) {
  run(0);
  EXPECT_LT(device.read_number("measured.distance"), 0);
  const ContactResult second = run(2);
  EXPECT_EQ(second.lost_records, 0u);
  EXPECT_NE(second.measure.verdict, ContactVerdict::no_contact);
  expect_disarmed();
}

// Between the last look at the statusword and the end of the trial.
TEST_F(Contact, AFaultJustBeforeTheEndIsReportedToo) {
  std::size_t trials = 0;
  report = [&](const std::string& text) { trials += text.ends_with("out of the wall") ? 0 : 1; };
  run(0);
  const std::size_t last = trials;
  std::size_t calls = 0;
  report = [&](const std::string& text) {
    if (!text.ends_with("out of the wall") && ++calls == last)
      simulation().device().connect_encoder(0, false);
  };
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { run(0); }), "lost its force");
}

TEST_F(Contact, ATraceThatStopsEndsTheTrialDisarmed) {
  report = [&](const std::string&) { device.write(device::Parameter::of<"trace.interval">(), 0, true); };
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { run(0); }), "trace has stopped");
  expect_disarmed();
}

TEST_F(Contact, ValuesThatAreNotAllowedAreRefusedBeforeArming) {
  settings.stiffness = -1;
  EXPECT_CONTAINS(thrown_message<base::ValueError>([&] { run(0); }), "wall.stiffness");
  settings.stiffness = 5500;
  settings.haptic_rate = 333;
  EXPECT_CONTAINS(thrown_message<base::ValueError>([&] { run(0); }), "haptic.rate");
  EXPECT_TRUE(reported.empty());
  expect_disarmed();
}

TEST(ContactConditions, AreWhatTheirRigSets) {
  for (const ContactCondition& condition : contact_conditions()) {
    const auto set = wall_assignments(condition.wall, 1, RigAxes::wall);
    EXPECT_NO_THROW(device::parse_assignments(set, 1)) << condition.name;
    for (const std::string& one : condition.assignments)
      EXPECT_TRUE(std::find(set.begin(), set.end(), one) != set.end()) << one;
  }
}

ContactResult trial(ContactVerdict verdict, double peak_to_peak, std::uint64_t lost = 0) {
  ContactResult result;
  result.measure.verdict = verdict;
  result.measure.peak_to_peak = peak_to_peak;
  result.lost_records = lost;
  return result;
}

TEST(WorstOf, AnUnstableTrialOutweighsTheLargestSlipOfAStableOne) {
  const ContactResult worst =
      worst_of({trial(ContactVerdict::stable, 5e-3, 1), trial(ContactVerdict::unstable, 2e-4, 2),
                trial(ContactVerdict::no_contact, 9e-3, 4)});
  EXPECT_EQ(worst.measure.verdict, ContactVerdict::unstable);
  EXPECT_EQ(worst.measure.peak_to_peak, 2e-4);
  EXPECT_EQ(worst.trials, 3u);
  EXPECT_EQ(worst.unstable_trials, 1u);
  EXPECT_EQ(worst.lost_records, 7u);
}

RC_GTEST_PROP(WorstOfProperty, OrderDoesNotMatterAndNothingIsWorse, ()) {
  const auto numbers = *rc::gen::nonEmpty<std::vector<std::pair<int, bool>>>(
      rc::gen::container<std::vector<std::pair<int, bool>>>(
          rc::gen::pair(rc::gen::inRange(0, 10), rc::gen::arbitrary<bool>())));
  std::vector<ContactResult> trials;
  for (const auto& [size, unstable] : numbers)
    trials.push_back(trial(unstable ? ContactVerdict::unstable : ContactVerdict::stable, size * 1e-4));
  const ContactResult worst = worst_of(trials);
  std::reverse(trials.begin(), trials.end());
  const ContactResult reversed = worst_of(trials);
  RC_ASSERT(worst.measure.verdict == reversed.measure.verdict);
  RC_ASSERT(worst.measure.peak_to_peak == reversed.measure.peak_to_peak);
  RC_ASSERT((worst.unstable_trials > 0) == (worst.measure.verdict == ContactVerdict::unstable));
  for (const ContactResult& one : trials)
    RC_ASSERT(one.measure.verdict != worst.measure.verdict ||
              one.measure.peak_to_peak <= worst.measure.peak_to_peak);
}

TEST(ContactResult, NoContactNeverAgreesWithThePaper) {
  ContactResult result = trial(ContactVerdict::no_contact, 0);
  result.condition.paper_stable = false;
  EXPECT_EQ(result.agrees_with_paper(), TestedClaim(false));
  result.measure.verdict = ContactVerdict::unstable;
  EXPECT_EQ(result.agrees_with_paper(), TestedClaim(true));
  result.condition.paper_stable = true;
  EXPECT_EQ(result.agrees_with_paper(), TestedClaim(false));
}

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

ContactResult result_of(const std::string& name) {
  ContactResult result;
  result.condition = {name, "9", {}, "stable", true, {}};
  result.measure.verdict = simulation::ContactVerdict::stable;
  result.measure.peak_to_peak = 0.1234e-3;
  result.contact_speed = 0.19;
  result.judged_to = 1.0;
  result.trials = 3;
  for (int i = 0; i < 100; ++i)
    result.samples.push_back({i * 0.01 - 0.1, 1e-3 - i * 2e-5, 0.5 * i, 0.0, 0.0, 1.0});
  return result;
}

TEST(ContactReport, TableHasALineForEachConditionUnderItsHeadings) {
  const std::string table = report::terminal_text(contact_table({result_of("first"), result_of("second")}));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 4);
  for (const char* text : {"first", "second", "0.19 m/s", "0.123 mm", "0 of 3", "Fig. 9", "yes"})
    EXPECT_CONTAINS(table, text);
  const auto column = table.find("verdict");
  EXPECT_EQ(table.substr(table.find("first") + column, 6), "stable") << table;
  const std::string empty = report::terminal_text(contact_table({}));
  EXPECT_EQ(std::count(empty.begin(), empty.end(), '\n'), 2);
}

// A run-up can be too short for the speed that is intended.
TEST_F(Contact, TheSpeedAtContactIsTheHandles) {
  EXPECT_NEAR(run(0).contact_speed, 0.2, 0.06) << "the arm swings: it is not quite what is intended";
  const auto intended = simulated_board::factory_scene().axes[0].motion;
  const auto words = contact_words(settings, 1, "foaw", intended);
  EXPECT_CONTAINS(words.back(), "intends 0.2 m/s after a run-up of 20 mm");
  EXPECT_EQ(contact_words(settings, 1, "foaw").size() + 1, words.size());
}

TEST(ContactReport, SaysWhichVerdictsTheFitImplies) {
  const TemporaryFolder folder;
  std::vector<ContactResult> results;
  std::vector<std::filesystem::path> pictures;
  for (const ContactCondition& condition : contact_conditions()) {
    results.push_back(result_of(condition.name));
    results.back().condition = condition;
    pictures.emplace_back("a.svg");
  }
  for (const auto& picture : pictures) folder.write(picture.string(), "");
  const auto rows_with = [&](const char* text, report::Origin origin) {
    std::vector<std::filesystem::path> here;
    for (const auto& picture : pictures) here.push_back(folder / picture.string());
    write_contact_page(results, {}, here, folder / "", origin, {"2026-01-02", "kmax 9", "sim", {}, {}});
    const std::string page = folder.read("contact.md");
    std::size_t count = 0;
    for (std::size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(rows_with("| implied by the fit |", report::Origin::predicted), 2u);
  EXPECT_EQ(rows_with("| a test |", report::Origin::predicted), 4u);
  EXPECT_EQ(rows_with("Made on 2026-01-02 with kmax 9, on sim.", report::Origin::predicted), 1u);
  EXPECT_EQ(rows_with("implied by the fit", report::Origin::measured), 0u);
  for (ContactResult& result : results) result.papers_wall = false;
  EXPECT_EQ(rows_with("| implied by the fit |", report::Origin::predicted), 0u);
}

TEST(ContactReport, PictureAndTableShareASafeName) {
  const TemporaryFolder folder;
  const ContactResult result = result_of("F_MC = 2 N, ../x");
  const auto files = write_contact(result, folder / "new/folder", ".svg");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0], folder / "new/folder/contact_f_mc_2_n_x.svg");
  EXPECT_EQ(files[1], folder / "new/folder/contact_f_mc_2_n_x.csv");
  const plot::CsvTable csv = plot::read_csv(files[1]);
  ASSERT_EQ(csv.column("time_s").size(), result.samples.size());
  for (std::size_t i = 0; i < result.samples.size(); ++i) {
    ASSERT_EQ(csv.column("position_m")[i], result.position(result.samples[i]));
    ASSERT_EQ(csv.column("force_n")[i], result.samples[i].force);
  }
  EXPECT_CONTAINS(folder.read("new/folder/contact_f_mc_2_n_x.svg"), "0.12 mm peak to peak");
}

TEST(ContactReport, WhatCannotBeWrittenIsAnError) {
  const TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_CONTAINS(
      thrown_message<std::runtime_error>([&] { write_contact(result_of("a"), folder / "file", ".svg"); }),
      "file");
  std::filesystem::create_directories(folder / "out/contact_a.csv");
  EXPECT_CONTAINS(
      thrown_message<std::runtime_error>([&] { write_contact(result_of("a"), folder / "out", ".svg"); }),
      "contact_a.csv: cannot be written");
  EXPECT_CONTAINS(
      thrown_message<plot::FigureError>([&] { write_contact(result_of("b"), folder / "out", ".gif"); }),
      "must end in");
}

}  // namespace kmax::experiment::contact_experiment_test
