#include "host_tools/experiment/wall_test/wall_test.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/experiment/device_experiment.hpp"

namespace kmax::experiment::wall_test_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

/// A touch at 0.1 m/s that holds 1 mm inside the wall; position and force swing at 50 Hz by as much, peak to
/// peak, until `end`.
RigTouch held(double position_swing, double force_swing, double end = 10.0) {
  RigTouch touch;
  touch.touched = true;
  touch.speed = 0.1;
  for (int n = -50; n < 1650; ++n) {
    const double time = n * 0.002;
    const double phase = time < end ? std::sin(2.0 * std::numbers::pi * 50.0 * time + 0.5) : 0.0;
    RigSample sample;
    sample.time = time;
    sample.outside_distance = time < 0.0 ? -0.1 * time : -std::min(0.1 * time, 1e-3);
    if (time > 0.1) sample.outside_distance += 0.5 * position_swing * phase;
    sample.force = time < 0.0 ? 0.0 : std::min(100.0 * time, 1.0);
    if (time > 0.1) sample.force += 0.5 * force_swing * phase;
    touch.samples.push_back(sample);
  }
  return touch;
}

WallTouch measured(const RigTouch& touch, TouchKind kind = TouchKind::slow) {
  return measure_wall_touch(kind, touch, {});
}

TEST(WallTouchVerdict, IsStableByBothWhereNothingSwings) {
  const WallTouch touch = measured(held(0.0, 0.0));
  EXPECT_TRUE(touch.counts());
  for (const StabilityCriterion criterion : stability_criteria) EXPECT_TRUE(touch.stable(criterion));
}

TEST(WallTouchVerdict, CanBeUnstableByForceAlone) {
  const WallTouch touch = measured(held(0.1e-3, 1.2));
  EXPECT_TRUE(touch.stable(StabilityCriterion::position));
  EXPECT_FALSE(touch.stable(StabilityCriterion::force));
  EXPECT_FALSE(touch.stable(StabilityCriterion::both));
  EXPECT_NEAR(touch.force_swing, 1.2, 0.05);
  EXPECT_TRUE(measured(held(0.1e-3, 0.95)).stable_by_force) << "1 N is the bound";
}

TEST(WallTouchVerdict, CanBeUnstableByPositionAlone) {
  const WallTouch touch = measured(held(0.2e-3, 0.5));
  EXPECT_FALSE(touch.stable(StabilityCriterion::position));
  EXPECT_TRUE(touch.stable(StabilityCriterion::force));
  EXPECT_FALSE(touch.stable(StabilityCriterion::both));
  EXPECT_NEAR(touch.position_swing, 0.2e-3, 0.01e-3);
  EXPECT_TRUE(measured(held(0.16e-3, 0.5)).stable_by_position) << "0.165 mm is the bound";
}

TEST(WallTouchVerdict, IsStableWhereTheSwingDiesOutBeforeTheEnd) {
  EXPECT_TRUE(measured(held(1e-3, 3.0, 2.7)).stable(StabilityCriterion::both));
  EXPECT_FALSE(measured(held(1e-3, 3.0, 2.9)).stable_by_position);
}

TEST(WallTouchVerdict, OfATouchThatWasEndedIsUnstableByBoth) {
  RigTouch touch = held(0.0, 0.0);
  touch.aborted_at = 0.4;
  std::erase_if(touch.samples, [](const RigSample& sample) { return sample.time > 0.4; });
  const WallTouch ended = measured(touch);
  EXPECT_TRUE(ended.counts());
  EXPECT_FALSE(ended.stable_by_position);
  EXPECT_FALSE(ended.stable_by_force);
  EXPECT_FALSE(ended.settling.has_value());
}

TEST(WallTouchVerdict, OfAHandleOutsideTheWallIsNoneUnlessItWasLetGo) {
  RigTouch touch = held(0.0, 0.0);
  for (RigSample& sample : touch.samples) {
    if (sample.time <= 1.6) continue;
    sample.outside_distance = 0.02 + 0.05 * (sample.time - 1.6);  // it flies on
    sample.force = 0.0;
  }
  EXPECT_FALSE(measured(touch).counts());
  const WallTouch let_go = measured(touch, TouchKind::let_go);
  EXPECT_TRUE(let_go.counts());
  EXPECT_TRUE(let_go.stable(StabilityCriterion::both));
  EXPECT_FALSE(let_go.settling.has_value());
  EXPECT_FALSE(measured(held(0.2e-3, 0.0), TouchKind::let_go).stable_by_position) << "it is still in it";
}

TEST(WallTouchVerdict, OfARecordingWithoutItsEndIsNone) {
  RigTouch touch = held(0.0, 0.0);
  std::erase_if(touch.samples, [](const RigSample& sample) { return sample.time > 2.7; });
  EXPECT_FALSE(measured(touch).counts());
  EXPECT_FALSE(measured(touch, TouchKind::let_go).counts());
}

TEST(WallTouchMeasure, HasDepthForceAndRateHardnessOfTheTouch) {
  RigTouch touch = held(0.0, 0.0);
  touch.side = 1.0;
  const WallTouch result = measured(touch);
  EXPECT_DOUBLE_EQ(result.deepest, 1e-3);
  EXPECT_DOUBLE_EQ(result.peak_force, 1.0);
  // At 500 Hz the rise over 4 ms has its first sample outside.
  const double hardness = 0.2 / 0.004 / 0.1;
  EXPECT_NEAR(result.rate_hardness.value(), hardness, 1e-6);
  EXPECT_EQ(result.contact_speed, 0.1);
  // On the other side of a handle the force has the other sign.
  touch.side = -1.0;
  for (RigSample& sample : touch.samples) sample.force = -sample.force;
  EXPECT_NEAR(measured(touch).rate_hardness.value(), hardness, 1e-6);
  touch.speed = 0.0;
  EXPECT_FALSE(measured(touch).rate_hardness.has_value());
}

TEST(WallTouchMeasure, SettlesWhenTheHandleNoLongerSwings) {
  // What swings within the last quarter of a second still counts.
  EXPECT_NEAR(measured(held(0.5e-3, 0.0, 1.0)).settling.value(), 1.25, 0.02);
  EXPECT_EQ(measured(held(0.0, 0.0)).settling.value(), 0.0);
  EXPECT_FALSE(measured(held(0.5e-3, 0.0)).settling.has_value());
  // A hand that yields slowly does not swing.
  RigTouch creeping = held(0.0, 0.0);
  for (RigSample& sample : creeping.samples)
    if (sample.time > 0.0) sample.outside_distance -= 1e-3 * sample.time;
  EXPECT_EQ(measured(creeping).settling.value(), 0.0);
}

TEST(WallTouchMeasure, SettlesAfterThePulse) {
  RigTouch touch = held(0.5e-3, 0.0, 2.0);
  touch.change_times = {1.5, 1.521, 1.542};
  const WallTouch pulse = measured(touch, TouchKind::pulse);
  EXPECT_NEAR(pulse.pulse_time.value(), 0.021, 1e-9);
  EXPECT_NEAR(pulse.settling.value(), 2.25 - 1.542, 0.02);
}

/// Stable by position up to one stiffness, by force up to another, at 1, 2, 3 N/mm.
std::vector<WallTouch> touches_up_to(double position, double force, TouchKind kind = TouchKind::slow) {
  std::vector<WallTouch> touches;
  for (const double stiffness : {1e3, 2e3, 3e3}) {
    for (std::size_t number = 1; number <= 3; ++number) {
      WallTouch touch;
      touch.kind = kind;
      touch.stiffness = stiffness;
      touch.number = number;
      touch.judged = true;
      // One of three is enough to be unstable.
      touch.stable_by_position = stiffness <= position || number != 2;
      touch.stable_by_force = stiffness <= force || number != 3;
      touch.contact_speed = 0.1 * static_cast<double>(number);
      touch.deepest = 1e-3 * static_cast<double>(number);
      touch.settling = 0.1;
      touches.push_back(touch);
    }
  }
  return touches;
}

WallTestSettings three_stiffnesses() {
  WallTestSettings settings;
  settings.stiffnesses = {1e3, 2e3, 3e3};
  return settings;
}

std::string limit_words(const std::vector<WallTouch>& touches, StabilityCriterion criterion,
                        std::optional<TouchKind> kind = TouchKind::slow) {
  return limit_text(stable_limit(wall_cells(touches, three_stiffnesses()), criterion, kind));
}

TEST(StableLimit, SaysWhereItLiesAndWhatIsNotKnown) {
  using enum StabilityCriterion;
  EXPECT_EQ(limit_words(touches_up_to(3e3, 2e3), position), "at least 3 N/mm: nothing was unstable");
  EXPECT_EQ(limit_words(touches_up_to(3e3, 2e3), force), "2 N/mm");
  EXPECT_EQ(limit_words(touches_up_to(3e3, 2e3), both), "2 N/mm");
  EXPECT_EQ(limit_words(touches_up_to(0.0, 2e3), both), "below 1 N/mm: unstable already there");
  std::vector<WallTouch> holed = touches_up_to(3e3, 3e3);
  for (WallTouch& touch : holed) touch.judged = touch.stiffness != 2e3;
  EXPECT_EQ(limit_words(holed, both), "at least 1 N/mm: no touch at 2 N/mm could be judged");
  EXPECT_EQ(limit_words({}, both), "unknown: no touch at 1 N/mm could be judged");
}

TEST(StableLimit, GoesNoFartherThanTheFirstThatIsUnstable) {
  std::vector<WallTouch> touches = touches_up_to(3e3, 3e3);
  touches[4].stable_by_force = false;  // at 2 N/mm
  EXPECT_EQ(limit_words(touches, StabilityCriterion::both), "1 N/mm");
}

TEST(StableLimit, OfAllKindsIsTheSmallest) {
  std::vector<WallTouch> touches = touches_up_to(2e3, 3e3);
  for (const TouchKind kind : {TouchKind::fast, TouchKind::pulse, TouchKind::let_go}) {
    const auto more = touches_up_to(kind == TouchKind::fast ? 1e3 : 3e3, 3e3, kind);
    touches.insert(touches.end(), more.begin(), more.end());
  }
  EXPECT_EQ(limit_words(touches, StabilityCriterion::both, {}), "1 N/mm");
  EXPECT_EQ(limit_words(touches, StabilityCriterion::both, TouchKind::pulse),
            "at least 3 N/mm: nothing was unstable");
}

TEST(WallCells, CountTheTouchesThatCount) {
  std::vector<WallTouch> touches = touches_up_to(1e3, 2e3);
  touches[0].judged = false;
  const std::vector<WallCell> cells = wall_cells(touches, three_stiffnesses());
  ASSERT_EQ(cells.size(), 12u);
  EXPECT_EQ(cells[0].touches, 2u);
  EXPECT_DOUBLE_EQ(cells[0].contact_speed, 0.25);
  EXPECT_DOUBLE_EQ(cells[0].deepest, 3e-3);
  EXPECT_EQ(cells[2].touches, 3u);
  EXPECT_EQ(cells[2].stable_by(StabilityCriterion::position), 2u);
  EXPECT_EQ(cells[2].stable_by(StabilityCriterion::force), 2u);
  EXPECT_EQ(cells[2].stable_by(StabilityCriterion::both), 1u);
  EXPECT_DOUBLE_EQ(cells[2].contact_speed, 0.2);
  EXPECT_EQ(cells[2].settling, std::optional(0.1));
  EXPECT_EQ(cells[3].kind, TouchKind::fast);
  EXPECT_EQ(cells[3].touches, 0u);
}

// --- On a board.

/// A board with the person who makes touches of one kind.
class WallTestOnABoard : public DeviceExperiment {
 protected:
  explicit WallTestOnABoard(TouchKind kind_made = TouchKind::slow)
      : DeviceExperiment(scene_of(kind_made, {})), kind(kind_made) {
    limits = wall_test_limits();
    prompter = nullptr;
    settings.repeats = 1;
    settings.stiffnesses = {1e3};
  }
  std::vector<WallTouch> run() {
    std::vector<WallTouch> all;
    with_rig([&](Rig& rig) {
      make_wall_touches(
          rig, kind, settings, [](std::size_t) {}, [&](WallTouch touch) { all.push_back(std::move(touch)); });
    });
    return all;
  }
  TouchKind kind;
  WallTestSettings settings;
};

TEST_F(WallTestOnABoard, OnlyTheStiffnessIsTheTests) {
  set({"wall.law=magnetic", "wall.magnetic_coefficient=0.7", "haptic.rate=1000", "wall.damping=2"});
  before = values();
  report = [&](const std::string& text) {
    if (text.find("holding") == std::string::npos) return;
    reported.push_back(text);
    EXPECT_NEAR(device.read_number("wall.magnetic_coefficient"), 0.7, 1e-6);
    EXPECT_EQ(device.read_number("wall.law"), 2.0);
    EXPECT_EQ(device.read_number("haptic.rate"), 1000.0);
    EXPECT_EQ(device.read_number("wall.damping"), 2.0);
    EXPECT_EQ(device.read_number("wall.stiffness"), 1000.0);
  };
  ASSERT_EQ(run().size(), 1u);
  EXPECT_FALSE(reported.empty());
  expect_disarmed_and_restored();
}

TEST_F(WallTestOnABoard, AnInterruptionLeavesItDisarmedWithItsParameters) {
  settings.stiffnesses = {4e3, 5e3};
  for (const int at : {1, 3, 6}) {
    int calls = 0;
    report = [&](const std::string&) {
      if (++calls == at) throw std::runtime_error("interrupted");
    };
    EXPECT_EQ(thrown_message<std::runtime_error>([&] { run(); }), "interrupted");
    expect_disarmed_and_restored();
  }
}

TEST_F(WallTestOnABoard, SomebodyIsAskedForEachTouch) {
  prompter = &person;
  person.answer = [&] { cable().sim.wait(std::chrono::seconds(2)); };
  settings.repeats = 2;
  run();
  ASSERT_EQ(person.requests.size(), 2u);
  EXPECT_CONTAINS(person.requests[0], "1 N/mm, slow: take the handle out of the wall");
  EXPECT_CONTAINS(person.requests[0], "about 0.05 m/s");
  EXPECT_CONTAINS(request_of(TouchKind::let_go, 2e3, settings), "after 1.5 s open the hand");
  EXPECT_CONTAINS(request_of(TouchKind::pulse, 2e3, settings), "after 1.5 s the device pushes");
}

TEST_F(WallTestOnABoard, SettingsOutOfRangeAreRefused) {
  const auto refusal = [&] { return thrown_message<std::invalid_argument>([&] { run(); }); };
  settings.stiffnesses = {};
  EXPECT_CONTAINS(refusal(), "no stiffness");
  settings.stiffnesses = {2e3, 1e3};
  EXPECT_CONTAINS(refusal(), "1000 N/m after 2000 N/m");
  settings.stiffnesses = {1e3};
  settings.hold_time = 1.0;
  EXPECT_CONTAINS(refusal(), "hold time = 1: allowed is 2 to 60");
  settings.hold_time = 3.0;
  settings.repeats = 0;
  EXPECT_CONTAINS(refusal(), "repeats = 0");
  EXPECT_TRUE(reported.empty());
}

TEST_F(WallTestOnABoard, TheSpeedIsTheOneIntended) {
  EXPECT_NEAR(run().at(0).contact_speed, 0.05, 0.015);
}

class FastTouch : public WallTestOnABoard {
 protected:
  FastTouch() : WallTestOnABoard(TouchKind::fast) {}
};
TEST_F(FastTouch, ReachesItsSpeed) {
  EXPECT_NEAR(run().at(0).contact_speed, 0.5, 0.15);
}

class PulsedTouch : public WallTestOnABoard {
 protected:
  PulsedTouch() : WallTestOnABoard(TouchKind::pulse) {}
};
TEST_F(PulsedTouch, IsPushedBothWaysFor20Milliseconds) {
  const WallTouch touch = run().at(0);
  EXPECT_NEAR(touch.pulse_time.value(), 0.02, 0.01);
  double before_it = 0.0, high = 0.0, low = 1e9;
  for (const RigSample& sample : touch.samples) {
    if (sample.time < 1.45) before_it = sample.force;
    if (sample.time < 1.5 || sample.time > 1.65) continue;
    high = std::max(high, sample.force);
    low = std::min(low, sample.force);
  }
  EXPECT_GT(high, before_it + 1.0);
  EXPECT_LT(low, before_it - 1.0);
  EXPECT_TRUE(touch.settling.has_value());
  expect_disarmed_and_restored();
  EXPECT_EQ(device.read_number("force.ceiling"), 0.0);
}

class LetGoTouch : public WallTestOnABoard {
 protected:
  LetGoTouch() : WallTestOnABoard(TouchKind::let_go) {}
};
TEST_F(LetGoTouch, LeavesTheWallByItself) {
  settings.repeats = 2;
  const std::vector<WallTouch> both = run();
  ASSERT_EQ(both.size(), 2u);
  for (const WallTouch& touch : both) {
    EXPECT_TRUE(touch.counts());
    EXPECT_NEAR(touch.contact_speed, 0.2, 0.06);
    double in_hand = 0.0, at_end = 0.0;
    for (const RigSample& sample : touch.samples) {
      if (sample.time < 1.4) in_hand = sample.outside_distance;
      if (sample.time < 2.9) at_end = sample.outside_distance;
    }
    EXPECT_LT(in_hand, -0.2e-3);
    EXPECT_GT(at_end, in_hand + 0.2e-3);
  }
}

// --- What is said of it.

WallTestResult result_of(std::vector<WallTouch> touches) {
  WallTestResult result;
  result.settings = three_stiffnesses();
  result.law = "plain";
  result.haptic_rate = 500.0;
  result.touches = std::move(touches);
  result.cells = wall_cells(result.touches, result.settings);
  return result;
}

TEST(WallTestReport, FitsIntoATerminalOf80Columns) {
  const WallTestResult result = result_of(touches_up_to(1e3, 0.0));
  for (const report::Table& table : {limit_table(result), verdict_table(result), measure_table(result)}) {
    const std::string text = report::terminal_text(table, 80);
    for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
      EXPECT_LE(end - begin, 80u) << text.substr(begin, end - begin);
  }
  EXPECT_CONTAINS(report::terminal_text(verdict_table(result), 80), "1 of 3");
}

TEST(WallTestReport, PageHasCriteriaLimitsPictureAndOrigin) {
  const TemporaryFolder folder;
  WallTestResult result = result_of(touches_up_to(3e3, 2e3));
  result.touches[0].samples = held(0.0, 0.0).samples;
  const auto files = write_wall_test(result, {"2026-01-02", "kmax 9", "sim", {"haptic.rate=500"}, 7},
                                     folder / "new", ".svg");
  ASSERT_EQ(files.size(), 8u);
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  const std::string page = folder.read("new/wall_test.md");
  for (const char* part :
       {"0.165 mm peak to peak in every quarter", "more than 1 N", "| slow | at least 3 N/mm", "2 N/mm |",
        "wall_test.svg", "2026-01-02", "haptic.rate=500", "Paper 1: "})
    EXPECT_CONTAINS(page, part);
  const plot::CsvTable trace = plot::read_csv(folder / "new/wall_test_slow.csv");
  EXPECT_EQ(trace.column("time_s").size(), result.touches[0].samples.size());
  EXPECT_EQ(trace.column("stiffness_n_per_m").front(), 1000.0);
  EXPECT_CONTAINS(folder.read("new/wall_test_touches.csv"), "3000,slow,3,1,0,");
}

TEST(WallTestReport, SaysOfAWallThatGrowsWhatStableDoesNot) {
  WallTestResult result = result_of(touches_up_to(3e3, 2e3));
  const auto words = [&] { return fmt::format("{}", fmt::join(wall_test_words(result), " ")); };
  EXPECT_EQ(words().find("grows"), std::string::npos);
  result.grows = true;
  EXPECT_CONTAINS(words(), "not that it comes to its stiffness");
}

}  // namespace kmax::experiment::wall_test_test
