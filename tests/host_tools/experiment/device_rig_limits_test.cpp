#include "host_tools/experiment/device_rig.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::device_rig_limits_test {

using host_tools_test::thrown_message;

class Limited : public TouchedBoard {
 protected:
  explicit Limited(const simulation::Scene& scene = simulated_board::factory_scene()) : TouchedBoard(scene) {
    set({"axis0.force.limit=10", "axis1.force.limit=9", "link.timeout=0", "wall.stiffness=700",
         "axis1.wall.stiffness=800"});
    limits.force_limit = 2.0;
    before = values();
  }
  std::vector<double> values() {
    std::vector<double> all;
    for (const char* name : {"axis0.force.limit", "axis1.force.limit", "link.timeout", "axis0.wall.stiffness",
                             "axis1.wall.stiffness"})
      all.push_back(device.read_number(name));
    return all;
  }
  DeviceRig& begin(RigAxes axes = RigAxes::wall) {
    rig.emplace(device, limits, TouchParty{nullptr, nullptr, report, notice}, axes);
    return *rig;
  }
  bool aborts(double hold_time) {
    TouchPlan plan;
    plan.name = "wall";
    plan.hold_time = hold_time;
    return rig->touch<Held>(plan, [](const RigTouch& touch) { return Held{touch.aborted_at.has_value()}; })
        .aborted;
  }
  struct Held {
    bool aborted;
    bool counts() const { return true; }
  };
  void expect_restored() {
    rig.reset();
    EXPECT_EQ(values(), before);
    EXPECT_TRUE(notices.empty());
  }

  TouchLimits limits;
  std::vector<std::string> notices;
  ReportText notice = [this](const std::string& text) { notices.push_back(text); };
  std::vector<double> before;
  std::optional<DeviceRig> rig;
};

TEST_F(Limited, TheLimitsAreAtWorkAtOnceAndWhatWasBeforeComesBack) {
  EXPECT_EQ(begin().force_limit(), 2.0);
  EXPECT_EQ(values(), (std::vector<double>{2.0, 9.0, 1.0, 700.0, 800.0}))
      << "what is only going to be changed is not yet";
  rig->set({900.0});
  EXPECT_EQ(values()[3], 900.0);
  expect_restored();
}

TEST_F(Limited, AFurtherAxisIsLoweredToTheSame) {
  begin(RigAxes::wall_along);
  EXPECT_EQ(values(), (std::vector<double>{2.0, 2.0, 1.0, 700.0, 800.0}));
  expect_restored();
}

TEST_F(Limited, TheAxisOfTheLimitsIsMeantByANameWithoutPrefix) {
  limits.axis = 1;
  begin().set({900.0});
  EXPECT_EQ(values(), (std::vector<double>{10.0, 2.0, 1.0, 700.0, 900.0}));
  expect_restored();
}

TEST_F(Limited, LimitsThatAreLowerAlreadyStay) {
  set({"link.timeout=0.25"});
  before = values();
  limits.force_limit = 50.0;
  EXPECT_EQ(begin(RigAxes::wall_along).force_limit(), 10.0);
  EXPECT_EQ(values(), before);
  expect_restored();
}

TEST_F(Limited, AWallOfEveryLawIsSetWithAllThatItHas) {
  begin(RigAxes::wall_along);
  for (const firmware::NamedValue& law : firmware::names::wall_law) {
    SCOPED_TRACE(law.name);
    // What the wall before has left.
    set({"position.rounding=nearest", "interference.mode=none", "interference.force=0",
         "interference.background_force=0", "interference.onset_time=1", "axis1.wall.law=plain",
         "axis1.position.resolution=0.001", "axis1.interference.mode=perpendicular",
         "axis1.haptic.rate=20000"});
    RigWall wall;
    wall.law = static_cast<control::WallKind>(law.value);
    wall.resolution = 0.4e-3;
    wall.rounding = control::Rounding::floor;
    wall.interference = control::InterferenceMode::parallel;
    wall.force = 1.5;
    wall.background_force = 0.5;
    rig->set(wall);
    const auto value = [&](const char* name) { return device.read_number(name); };
    EXPECT_EQ(value("wall.law"), law.value);
    EXPECT_EQ(value("position.resolution"), 0.4e-3F);
    EXPECT_EQ(value("position.rounding"), static_cast<double>(control::Rounding::floor));
    EXPECT_EQ(value("interference.mode"), static_cast<double>(control::InterferenceMode::parallel));
    EXPECT_EQ(value("interference.force"), 1.5);
    EXPECT_EQ(value("interference.background_force"), 0.5);
    EXPECT_EQ(value("interference.onset_time"), 0.0);
    EXPECT_EQ(value("axis1.wall.law"), static_cast<double>(control::WallKind::none));
    EXPECT_EQ(value("axis1.position.resolution"), 0.0);
    EXPECT_EQ(value("axis1.interference.mode"), static_cast<double>(control::InterferenceMode::none));
    EXPECT_EQ(value("axis1.haptic.rate"), wall.haptic_rate);
  }
  expect_restored();
}

TEST_F(Limited, ALimitThatTheDeviceRefusesChangesNothing) {
  limits.force_limit = -1.0;
  EXPECT_CONTAINS(thrown_message<base::ValueError>([&] { begin(RigAxes::wall_along); }), "force.limit");
  expect_restored();
}

TEST_F(Limited, WhatIsRefusedLaterLeavesTheLimitsUntilTheEnd) {
  EXPECT_THROW(begin().set({-1.0}), base::ValueError);
  EXPECT_EQ(values()[0], 2.0);
  expect_restored();
}

TEST_F(Limited, WhatCannotBePutBackIsTold) {
  begin();
  cable().cut = true;
  rig.reset();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_CONTAINS(notices[0], "force.limit=10");
  EXPECT_CONTAINS(notices[0], "link.timeout=0");
  EXPECT_CONTAINS(notices[0], "wall.stiffness=700");
}

TEST_F(Limited, AnOscillationBeyondItsLimitEndsATouch) {
  begin().set({5500.0});
  EXPECT_FALSE(aborts(0.5));
  ASSERT_FALSE(reported.empty());
  EXPECT_CONTAINS(reported.back(), "wall: ");
  limits.abort_amplitude = 0.8e-3;
  rig.reset();
  begin().set({5500.0});
  EXPECT_TRUE(aborts(3.0));
  expect_disarmed();
}

class LimitedWithoutAPerson : public Limited {
 protected:
  LimitedWithoutAPerson() : Limited(nobody()) {}
};

TEST_F(LimitedWithoutAPerson, NobodyIsWaitedForLongerThanThePatience) {
  limits.patience = 1.5;
  EXPECT_CONTAINS(thrown_message<NobodyTouched>([&] {
                    begin();
                    aborts(3.0);
                  }),
                  "1.5 s");
  expect_disarmed();
  expect_restored();
}

TEST_F(Limited, SettingsForAJournalAreTheDevicesTheExperimentsAndTheLimits) {
  limits.axis = 1;
  const RunJournal::Json all = touch_settings("jitter", device, limits, {{"window_s", 0.5}, {"touches", 3}});
  const RunJournal::Json circumstances = device_circumstances(device, 1);
  std::vector<std::string> expected{"experiment"}, found;
  for (const auto& [name, value] : circumstances.items()) {
    expected.push_back(name);
    EXPECT_EQ(all.at(name), value) << name;
  }
  for (const char* name : {"window_s", "touches", "force_limit_n", "abort_amplitude_m"})
    expected.push_back(name);
  for (const auto& [name, value] : all.items()) found.push_back(name);
  EXPECT_EQ(found, expected);
  EXPECT_EQ(all["experiment"], "jitter");
  EXPECT_EQ(all["axis"], 1);
  EXPECT_EQ(all["window_s"], 0.5);
  EXPECT_EQ(all["force_limit_n"], 2.0);
  EXPECT_EQ(all["abort_amplitude_m"], 0.01);
}

}  // namespace kmax::experiment::device_rig_limits_test
