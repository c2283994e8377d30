#include <gtest/gtest.h>

#include <set>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies::baselines_test {

using experiment::few_people;
using experiment::paragraphs_of;
using experiment::quick_run;
using experiment::two_people;
using Row = std::vector<std::string>;

// What each of the people can have by the one that gives it less is less than the smaller of the two means.
TEST(Sweeps, ByBothIsTheMeanOfEachPersonsSmallerOne) {
  const std::array<MaxStiffness, 2> moves{experiment::found_stiffness(2000.0),
                                          experiment::found_stiffness(6000.0)},
      feels{experiment::found_stiffness(5000.0), experiment::found_stiffness(4000.0)};
  EXPECT_EQ(smaller_of_each(studies::mean_of(moves), studies::mean_of(feels)).mean, 3000.0);
}

PeopleMean mean_of(double mean) {
  return {mean, {}, 0.0};
}

TEST(Baselines, DampingAllowsMoreThanThePlainWallAndCostsNoField) {
  std::vector<Baseline> laws{
      plain_wall(), field_of_two(), {"damped", damped(8.0, control::VelocityEstimatorKind::difference)}};
  const auto results = run_baselines(few_people(3), laws, quick_run());
  ASSERT_EQ(results.size(), 3U);
  const BaselineResult &plain = results[0], &field = results[1], &damper = results[2];
  EXPECT_GT(damper.moves.mean, 1.5 * plain.moves.mean);
  EXPECT_EQ(damper.price.field_at_rest, 0.0);
  EXPECT_EQ(damper.price.work, 0.0);
  EXPECT_LT(damper.price.depth, plain.price.depth);
  EXPECT_EQ(field.price.field_at_rest, 2.0);
  // F_MC x_0 from infinity, a twentieth less from 20 mm, and less still where a sample is the first inside.
  EXPECT_GT(field.price.work, 1.0e-3);
  EXPECT_LT(field.price.work, 1.9e-3);
  EXPECT_EQ(plain.law.paper->stiffness, 3580.0);
  for (const BaselineResult& result : results) {
    EXPECT_LE(result.phases.mean, result.moves.mean + 100.0);
    double sum = 0.0;
    for (std::size_t n = 0; n < 3; ++n)
      sum += std::min(result.moves.people[n].stiffness, result.feels.people[n].stiffness);
    EXPECT_DOUBLE_EQ(result.both.mean, sum / 3.0);
    for (std::size_t n = 0; n < 3; ++n) {
      // A smaller swing that counts ends the search no later.
      EXPECT_LE(result.notices.people[n].stiffness, result.feels.people[n].stiffness);
    }
    EXPECT_GT(result.price.peak_force, 2.0);
    EXPECT_LE(result.price.peak_force, 3.3 + 1e-6);
  }
  // Friction and push are the same; what a damper takes is put in by the hand.
  EXPECT_GT(damper.price.touch_work, plain.price.touch_work);
}

TEST(Baselines, AreAllDifferentWalls) {
  for (const auto& laws : {law_baselines(), relation_baselines()}) {
    std::set<std::string> names;
    for (const Baseline& law : laws) EXPECT_TRUE(names.insert(law.name).second) << law.name;
  }
  TouchSetup square;
  for (const Baseline& law : relation_baselines())
    if (law.name == "square, latched, 0.8 to 2 N") law.wall(square);
  EXPECT_EQ(square.wall.wall.adaptive.relation, control::AdaptiveRelation::square);
  EXPECT_EQ(square.wall.wall.adaptive.mode, control::AdaptiveMode::latched);
  EXPECT_EQ(square.wall.wall.adaptive.offset, 0.8F);
}

using LoopOutput = control::HapticLoop<float>::Output;

TEST(PassivityController, TakesBackWhatTheWallHasGivenAndNoMore) {
  constexpr double count = 1e-4, period = 0.01;
  PassivityController controller(count, period, 1e6, 0.0);
  EXPECT_EQ(controller.added(5, {}), 0.0);
  LoopOutput pushes;
  pushes.force = 1.0F;
  EXPECT_EQ(controller.added(-10, {}), 0.0) << "nothing was given on the way in";
  EXPECT_EQ(controller.added(-12, pushes), 0.0) << "the wall took 0.2 mJ";
  pushes.force = 3.0F;
  // Given: 3 N over 0.2 mm, of which 0.2 mJ were taken before; back over the next interval at this speed.
  const double added = controller.added(-10, pushes);
  EXPECT_NEAR(added * 2.0 * count, -0.4e-3, 1e-9);
  EXPECT_EQ(controller.added(-10, pushes), 0.0) << "at rest there is nothing to damp";
  EXPECT_EQ(controller.added(3, pushes), 0.0) << "free space";
  EXPECT_EQ(controller.added(-1, {}), 0.0) << "and forgets";
  PassivityController weak(count, period, 0.5, 0.0);
  weak.added(-10, {});
  // 0.5 N s/m at 2 counts in 10 ms.
  EXPECT_NEAR(weak.added(-8, pushes), -0.5 * 2.0 * count / period, 1e-9);
}

TEST(PassivityController, AgainstTheSpringsEnergyBeginsEarlier) {
  constexpr double count = 1e-4, period = 0.01;
  PassivityController controller(count, period, 1e6, 1000.0);
  EXPECT_EQ(controller.added(0, {}), 0.0);
  LoopOutput spring;
  // 1 mm deep such a spring holds 0.5 mJ; the wall took none on the way in.
  EXPECT_NEAR(controller.added(-10, spring) * -10 * count, -0.5e-3, 1e-9);
  spring.force = 1.0F;
  spring.magnetic_force = 1.0F;
  // A field is a spring of its own.
  PassivityController same(count, period, 1e6, 1000.0);
  EXPECT_NEAR(same.added(-10, spring) * -10 * count, -0.5e-3, 1e-9);
}

TEST(PassivityController, BeginsEachTouchWithoutAMemory) {
  TouchSetup setup;
  passivity_controlled(15.0, true)(setup);
  setup.wall.wall.kind = control::WallKind::plain;
  setup.wall.wall.stiffness = 6000.0F;
  std::vector<experiment::TouchSample> one, two, without;
  experiment::simulate_touch(setup, &one);
  experiment::simulate_touch(setup, &two);
  setup.added_force = nullptr;
  experiment::simulate_touch(setup, &without);
  ASSERT_EQ(one.size(), two.size());
  bool differs = false;
  for (std::size_t n = 0; n < one.size(); ++n) {
    ASSERT_EQ(one[n].position, two[n].position);
    differs = differs || one[n].position != without[n].position;
  }
  EXPECT_TRUE(differs);
}

std::vector<BaselineResult> made_up(const std::vector<Baseline>& laws, const WallPrice& price) {
  std::vector<BaselineResult> results;
  for (const Baseline& law : laws)
    results.push_back(
        {law, mean_of(4000.0), mean_of(3900.0), mean_of(4000.0), mean_of(3800.0), mean_of(3000.0), price});
  return results;
}

TEST(BaselineSection, TheFrontAndTheRatingsFollowTheNumbers) {
  std::vector<BaselineResult> results = made_up(law_baselines(), {1.0, 1e-3, 1e-3});
  results[0].price = {0.0, 0.0, 2e-3};
  results[1].price = {2.0, 1.5e-3, 1e-3, 0.0, 3.25, 4.5e-3};
  results[1].moves.ends = {0, 1};
  for (BaselineResult& result : results) {
    if (result.law.name != "damping 8 N s/m, difference") continue;
    result.moves.mean = 9600.0;
    result.price = {0.0, 0.0, 0.5e-3};
  }
  const report::Section section = baseline_section(two_people(), results);
  EXPECT_EQ(section.tables[0].rows[1],
            (Row{"field of 2 N", ">4.00 ± 0.00", "3.90 ± 0.00", "4.00 ± 0.00", "3.80 ± 0.00", "2.00", "1.50",
                 "4.50", "3.25", "1.00", "0.00", "2.58"}));
  const std::string said = paragraphs_of(section);
  EXPECT_CONTAINS(said, "Damping of 8 N s/m without any field allows 9.60 N/mm, the paper's 2 N field 4.00");
  EXPECT_CONTAINS(said, "hard: damping 8 N s/m, difference.");
  EXPECT_CONTAINS(said, "fall as the field at rest rises: yes; as the work rises: yes");
  EXPECT_CONTAINS(said, "field of 2 N, moves: 1 of 2");
  results[1].price.field_at_rest = 0.5;
  EXPECT_CONTAINS(paragraphs_of(baseline_section(two_people(), results)), "field at rest rises: no");
}

TEST(NoticedSection, SaysWhatIsLeftByWhatPeopleNotice) {
  std::vector<BaselineResult> results = made_up(law_baselines(), {});
  results[6].notices = mean_of(7500.0);
  SubjectSet set = two_people();
  set.device.force_limit = 3.0;
  NoticedWalls finer{{"plain", mean_of(4000.0)}, {results[6].law.name, mean_of(20000.0)}};
  const report::Section section = noticed_section(set, results, finer);
  EXPECT_EQ(section.tables[0].rows[0], (Row{"plain", "4.00", "4.00", "3.00", "4.00"}));
  EXPECT_EQ(section.tables[0].rows[1].back(), "-");
  const std::string said = paragraphs_of(section);
  EXPECT_CONTAINS(said, "0.21 N is that of 3 N");
  EXPECT_CONTAINS(said, "counts of 55 um swings by 0.21 N from 3.82 N/mm on");
  EXPECT_CONTAINS(said,
                  "7.50 the most of these walls, " + results[6].law.name + ": 2.5 times the plain wall");
  EXPECT_CONTAINS(said, "at 38.18 N/mm, " + results[6].law.name + " holds 20.00, 5.0 times the plain wall");
  EXPECT_NO_THROW(report::require_rectangular(section.tables[0]));
  finer[1].second.ends.beyond_last = 1;
  EXPECT_CONTAINS(paragraphs_of(noticed_section(set, results, finer)),
                  "holds more than 20.00, more than 5.0 times the plain wall");
  set.device.force_limit = 0.0;
  EXPECT_NEAR(noticed_force(set), 0.07 * 3.3, 1e-12);
  results[0].notices = mean_of(0.0);
  EXPECT_CONTAINS(paragraphs_of(noticed_section(set, results, finer)), "where the plain wall holds none");
}

TEST(Baselines, AFinerEncoderFlickersLater) {
  const SubjectSet people = few_people(1);
  const NoticedWalls finer = run_noticed_with_finer_encoder(people, quick_run());
  const auto coarse = run_baselines(people, {plain_wall()}, quick_run());
  EXPECT_GE(finer.front().second.mean, coarse.front().notices.mean);
  EXPECT_GT(finer.back().second.mean, finer.front().second.mean);
}

TEST(PriceFront, HasEveryWallOnceInEachPanel) {
  std::vector<BaselineResult> results = made_up(law_baselines(), {1.0, 1e-3, 2e-3, 3000.0, 3.2, 4e-3});
  results[0].feels.mean = 3500.0;
  results[0].both.mean = 3000.0;
  const plot::Figure figure = price_front(two_people(), results);
  const std::array<double, 5> prices{2.0, 3.0, 1.0, 3.2, 4.0};
  ASSERT_EQ(figure.panels.size(), prices.size());
  for (std::size_t panel = 0; panel < prices.size(); ++panel) {
    std::size_t walls = 0;
    for (const plot::Series& series : figure.panels[panel].series) {
      walls += series.x.size();
      EXPECT_EQ(series.label.empty(), panel > 0);
      for (const double price : series.y) EXPECT_DOUBLE_EQ(price, prices[panel]);
    }
    EXPECT_EQ(walls, results.size());
    EXPECT_EQ(figure.panels[panel].series.size(), 9U) << "a curve a family";
    EXPECT_DOUBLE_EQ(figure.panels[panel].series[0].x[0], 3.0) << "what holds by both criteria";
  }
}

TEST(RelationSection, SaysWhatIsBetterThanThePapersChoice) {
  std::vector<BaselineResult> results = made_up(relation_baselines(), {0.8, 1e-3, 1e-3});
  EXPECT_CONTAINS(paragraphs_of(relation_section(two_people(), results)), "at no higher cost: none of these");
  for (BaselineResult& result : results)
    if (result.law.name == "square root, latched, 0.8 to 2 N") result.moves.mean = 6000.0;
  const report::Section section = relation_section(two_people(), results);
  EXPECT_CONTAINS(paragraphs_of(section), "at no higher cost: square root, latched, 0.8 to 2 N");
  EXPECT_NO_THROW(report::require_rectangular(section.tables[0]));
}

// --- Stiffness against damping ----------------------------------------------------------------------------

TEST(DampingMap, FindsTheMostThatIsStableByBothCriteria) {
  StiffnessRun run = quick_run();
  const std::vector<LoopSetting> all = loop_settings();
  const auto maps = run_damping_map(few_people(1), {all[0], all[5]}, run);
  ASSERT_EQ(maps.size(), 2U);
  EXPECT_EQ(maps[1].setting.name, "0.5 ms of delay");
  EXPECT_LT(maps[1].laws[0].moves.mean, maps[0].laws[0].moves.mean);
  // The more damping by differences the more a count is felt.
  EXPECT_LT(maps[0].damped[0].back().feels.mean, maps[0].damped[0].back().moves.mean);
  const report::Section section = damping_section(few_people(1), maps);
  ASSERT_EQ(section.tables.size(), 3U);
  EXPECT_EQ(section.tables[0].rows.size(), all_estimators.size());
  EXPECT_EQ(section.tables[2].rows.size(), 2U);
  for (const report::Table& table : section.tables) EXPECT_NO_THROW(report::require_rectangular(table));
}

TEST(DampingSection, NamesTheBestDampingOfEachEstimator) {
  DampingMap map{loop_settings().front(), {}, {}};
  map.laws[1] = {mean_of(8400.0), mean_of(8000.0), mean_of(7900.0)};
  map.damped[2][2] = {mean_of(9000.0), mean_of(8600.0), mean_of(8500.0)};
  map.damped[2][3] = {mean_of(12000.0), mean_of(3000.0), mean_of(3000.0)};
  const report::Section section = damping_section(two_people(), {map});
  EXPECT_EQ(section.tables[2].rows[0][2], "7.9");
  EXPECT_EQ(section.tables[2].rows[0][6], "8.5 (B 8)");
  EXPECT_CONTAINS(paragraphs_of(section), "than the field of 2 N in 1 of 1 rows");
  const host_tools_test::TemporaryFolder folder;
  draw_damping_map(map, folder / "map.svg");
  EXPECT_CONTAINS(folder.read("map.svg"), "foaw_end_fit");
}

// --- Walls that grow stiff --------------------------------------------------------------------------------

TEST(GrowingWalls, HoldMoreThanThePlainWallAlsoWithDelay) {
  const auto walls = run_growing_walls(few_people(1), quick_run());
  const auto seeming = run_seeming_walls(few_people(1), quick_run());
  EXPECT_EQ(walls[6].wall, "grows from 2 N/mm in 0.4 s, damping 6 N s/m");
  ASSERT_EQ(walls[6].situations.size(), growing_situations().size());
  for (const std::size_t n : {0, 2})
    EXPECT_GT(walls[6].situations[n].both.mean, 2.0 * walls.front().situations[n].both.mean) << n;
  const report::Section section = growing_section(few_people(1), walls, seeming);
  EXPECT_NO_THROW(report::require_rectangular(section.tables[0]));
  EXPECT_NO_THROW(report::require_rectangular(section.tables[1]));
  EXPECT_TRUE(section.tables[0].rows[0][1].ends_with(" (1.0)"));
  // What notices each count hardly oscillates, however high it is set, and is far from there.
  EXPECT_GT(seeming[1].stable.mean, 1.3 * seeming[0].stable.mean);
  EXPECT_LT(seeming[1].rendered, 0.7 * seeming[1].stable.mean);
  EXPECT_LT(seeming[1].rendered, 1.1 * walls[3].situations[0].both.mean);
}

TEST(GrowingWalls, APulsePushesIntoTheWallAndOut) {
  TouchSetup setup;
  pulse(setup);
  const experiment::AddedForce added = setup.added_force(setup);
  control::HapticLoop<float>::Output outside, inside;
  inside.inside = true;
  for (int n = 0; n < 1000; ++n) EXPECT_EQ(added(0, outside), 0.0) << "it counts from the contact";
  double in = 0.0, out = 0.0;
  for (int n = 0; n < 1500; ++n) {
    const double force = added(0, n % 2 == 0 ? inside : outside);
    (force < 0.0 ? in : out) += force / 500.0;
  }
  EXPECT_NEAR(in, -1.5 * 0.02, 1.5 / 500.0);
  EXPECT_NEAR(out, 1.5 * 0.02, 1.5 / 500.0);
}

TEST(DrawnDevices, AreTheSameForTheSameSeedAndWithinTheirBounds) {
  const SubjectSet set = few_people(2);
  const auto devices = draw_devices(set, 100, 5), again = draw_devices(set, 100, 5),
             other = draw_devices(set, 1, 6);
  EXPECT_NE(devices[0].device.mass, other[0].device.mass);
  std::size_t bent = 0;
  for (std::size_t n = 0; n < devices.size(); ++n) {
    EXPECT_EQ(devices[n].device.friction, again[n].device.friction);
    EXPECT_GE(devices[n].mass(), 0.02 * (1.0 - 1e-12));
    EXPECT_LE(devices[n].mass(), 0.2);
    EXPECT_GE(devices[n].device.force_limit, 3.3);
    EXPECT_LE(devices[n].device.delay, 0.5e-3);
    EXPECT_LT(devices[n].person, 2U);
    bent += devices[n].device.structure ? 1 : 0;
  }
  EXPECT_EQ(bent, 50U);
}

TEST(DrawnSection, CountsWhatIsTripledByBothCriteria) {
  const auto result = [](double moves, double feels, double depth) {
    return DrawnResult{{}, 2000.0, 1000.0, moves, feels, 1e-3, depth};
  };
  const report::Section section =
      drawn_section({result(6000.0, 3000.0, 0.9e-3), result(60000.0, 2900.0, 1.1e-3), {}});
  EXPECT_CONTAINS(paragraphs_of(section),
                  "at least three times the plain wall: 1 of 3 (of all such devices 6 to 79 %");
  EXPECT_CONTAINS(paragraphs_of(section), "softer than the plain wall: 1; smallest ratio 0.00, median 2.90");
  EXPECT_CONTAINS(paragraphs_of(section), "largest stiffness: 1 of 3.");
  EXPECT_EQ(section.tables[0].rows[1][3], "2.95");
}

}  // namespace kmax::studies::baselines_test
