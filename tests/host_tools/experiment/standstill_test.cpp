
#include <gtest/gtest.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"
#include "host_tools/experiment/touch_journal.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::standstill_test {

using firmware::Fault;
using host_tools_test::thrown_message;

class StandstillTest : public TouchedBoard {
 protected:
  StandstillTest() { simulation_wait(2000); }
  void simulation_wait(int milliseconds) { cable().sim.wait(std::chrono::milliseconds(milliseconds)); }
  bool cut_off(const std::exception& error) {
    return bench::Standstill(device, {0, 1}, report).cut_off(error, "a wall");
  }
  Fault fault(std::size_t axis) { return device::fault_of(device::Drive(device, axis).status()); }

  const base::DeviceError any_error{"the axis lost its force"};
  const device::LinkError no_answer{"no answer"};
  const base::StoodStill stopped{"this program was stopped"};
};

TEST_F(StandstillTest, ASilenceThatTrippedIsClearedAndTold) {
  device::Drive(device, 0).arm();
  simulation_wait(1500);
  ASSERT_EQ(fault(0), Fault::link_silent);
  EXPECT_TRUE(cut_off(any_error));
  EXPECT_EQ(fault(0), Fault::none);
  EXPECT_EQ(device::Drive(device, 0).status().state(), firmware::DriveState::switch_on_disabled);
  ASSERT_EQ(reported.size(), 1u);
  EXPECT_CONTAINS(reported[0], "a wall: this touch is thrown away and made again");
  EXPECT_CONTAINS(reported[0], "heard nothing for 1");
  EXPECT_EQ(reported[0].find('\n'), std::string::npos);
}

TEST_F(StandstillTest, WithoutAFaultItIsTheErrorThatTells) {
  EXPECT_FALSE(cut_off(any_error));
  EXPECT_TRUE(reported.empty());
  EXPECT_TRUE(cut_off(no_answer));
  EXPECT_TRUE(cut_off(stopped));
  ASSERT_EQ(reported.size(), 2u);
  EXPECT_CONTAINS(reported[0], "no answer");
  EXPECT_CONTAINS(reported[1], "this program was stopped");
}

TEST_F(StandstillTest, AnAxisThatIsStillArmedIsDisarmed) {
  device::Drive(device, 0).arm();
  EXPECT_TRUE(cut_off(no_answer));
  expect_disarmed();
}

TEST_F(StandstillTest, AnyOtherFaultOfOneOfTheAxesIsLeftAlone) {
  device::Drive(device, 0).arm();
  simulation_wait(1500);
  ASSERT_EQ(fault(0), Fault::link_silent);
  set({"axis1.wall.law=none"});
  device::Drive(device, 1).arm();
  simulation().device().connect_encoder(1, false);
  simulation_wait(100);
  ASSERT_EQ(fault(1), Fault::encoder);
  for (const std::exception* error :
       {static_cast<const std::exception*>(&any_error), static_cast<const std::exception*>(&no_answer),
        static_cast<const std::exception*>(&stopped)})
    EXPECT_FALSE(cut_off(*error));
  EXPECT_EQ(fault(0), Fault::link_silent);
  EXPECT_EQ(fault(1), Fault::encoder);
  EXPECT_TRUE(reported.empty());
}

TEST_F(StandstillTest, WhoStoppedAnAxisMeantIt) {
  device::Drive(device, 0).arm();
  device::Drive(device, 0).stop();
  EXPECT_FALSE(cut_off(no_answer));
  EXPECT_EQ(device::Drive(device, 0).status().state(), firmware::DriveState::quick_stop_active);
}

TEST_F(StandstillTest, ADeviceThatCannotBeReachedOrWasStartedAnewIsNotReady) {
  bench::Standstill standstill(device, {0}, report);
  standstill.begin();
  cable().cut = true;
  EXPECT_FALSE(standstill.cut_off(no_answer, "a wall"));
  cable().cut = false;
  EXPECT_TRUE(standstill.cut_off(no_answer, "a wall"));
  // It has forgotten the lowered limits.
  device = device::Device(std::make_unique<CutLink>(simulated_board::factory_scene()));
  EXPECT_FALSE(standstill.cut_off(no_answer, "a wall"));
  EXPECT_EQ(reported.size(), 1u);
}

TEST_F(StandstillTest, NobodyNeedsToBeTold) {
  EXPECT_TRUE(bench::Standstill(device, {0}, {}).cut_off(no_answer, "a wall"));
}

/// Whole experiments, disturbed: contact and max-stiffness. Those of the other experiments are theirs.
class DisturbedTouches : public StalledBoard {
 protected:
  DisturbedTouches() {
    contact.hold_time = 2.0;
    cable().sim.wait(std::chrono::milliseconds(2000));
    set({"force.limit=10", "link.timeout=5"});
  }

  template <typename Run>
  auto with_rig(const Run& run) {
    DeviceRig rig(device, touch_limits, {nullptr, nullptr, report, notice});
    return run(rig);
  }
  /// Three touches of a wall that holds still.
  std::vector<ContactResult> run_contacts() {
    return with_rig([&](Rig& rig) {
      std::vector<ContactResult> results;
      for (int trial = 0; trial < 3; ++trial) {
        results.push_back(run_contact(rig, contact_conditions()[2], contact));
        limits.push_back(device.read_number("force.limit"));
      }
      return results;
    });
  }
  void expect_left_in_order() {
    expect_disarmed();
    EXPECT_EQ(device.read_number("force.limit"), 10.0);
    EXPECT_EQ(device.read_number("link.timeout"), 5.0);
    EXPECT_EQ(device.read_number("trace.interval"), 0.0);
  }

  ContactSettings contact;
  TouchLimits touch_limits = contact_limits();
  std::vector<std::string> notices;
  std::vector<double> limits;
  const ReportText notice = [this](const std::string& text) { notices.push_back(text); };
};

constexpr Stall::Of every_stall[] = {Stall::Of::program, Stall::Of::link, Stall::Of::device};

TEST_F(DisturbedTouches, OneOfThemIsMadeAgainAndMeasuresTheSame) {
  const auto undisturbed = run_contacts();
  EXPECT_TRUE(notices.empty());
  for (const Stall::Of of : every_stall) {
    for (const int at_request : {1, 5, 40, 80}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(of) << " at request " << at_request);
      stall = {of, at_request, [](int touch) { return touch == 2; }};
      touches = 0;
      notices.clear();
      limits.clear();
      const auto disturbed = run_contacts();
      EXPECT_EQ(touches, 4);
      ASSERT_EQ(notices.size(), 1u);
      EXPECT_CONTAINS(notices[0], "thrown away");
      ASSERT_EQ(limits.size(), 3u);
      EXPECT_NEAR(limits[0], 3.3, 1e-6) << "lowered before the touch that is disturbed";
      EXPECT_NEAR(limits[1], 3.3, 1e-6) << "and after its repetition";
      ASSERT_EQ(disturbed.size(), 3u);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(disturbed[i].measure.verdict, undisturbed[i].measure.verdict);
        EXPECT_NEAR(disturbed[i].measure.peak_to_peak, undisturbed[i].measure.peak_to_peak, 0.15e-3);
        EXPECT_EQ(disturbed[i].lost_records, 0u);
        EXPECT_EQ(disturbed[i].aborted_at, std::nullopt);
      }
      expect_left_in_order();
    }
  }
}

TEST_F(DisturbedTouches, WhatNeverEndsIsToldAfterTheThirdRepetition) {
  stall = {Stall::Of::program, 40, [](int) { return true; }};
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { run_contacts(); }),
                  "axis 0 lost its force during the touch: the host was silent for longer than link.timeout");
  EXPECT_EQ(touches, 1 + most_standstills);
  EXPECT_EQ(notices.size(), static_cast<std::size_t>(most_standstills));
  expect_left_in_order();
  touches = 0;
  ASSERT_TRUE(device::Drive(device, 0).clear());
  stall.of = Stall::Of::link;
  EXPECT_CONTAINS(thrown_message<device::LinkError>([&] { run_contacts(); }), "no answer");
  EXPECT_EQ(touches, 1 + most_standstills);
  expect_left_in_order();
}

TEST_F(DisturbedTouches, ThreeStandstillsAreAllowedToEachTouch) {
  stall = {Stall::Of::program, 40, [](int touch) { return touch % 4 != 0; }};
  EXPECT_EQ(run_contacts().size(), 3u);
  EXPECT_EQ(touches, 12);
  EXPECT_EQ(notices.size(), 9u);
  expect_left_in_order();
}

TEST_F(DisturbedTouches, NoOtherErrorIsRepeated) {
  report = [&](const std::string& text) {
    if (touches == 2 && text.find("holding") != std::string::npos)
      simulation().device().connect_encoder(0, false);
  };
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { run_contacts(); }), "encoder");
  EXPECT_EQ(touches, 2);
  EXPECT_TRUE(notices.empty());
  expect_left_in_order();
}

TEST_F(DisturbedTouches, NeitherIsWhatTheUserOrAnotherProgramStops) {
  struct Interrupted {};
  report = [&](const std::string& text) {
    if (touches == 2 && text.find("holding") != std::string::npos) throw Interrupted();
  };
  EXPECT_THROW(run_contacts(), Interrupted);
  EXPECT_EQ(touches, 2);
  report = [&](const std::string& text) {
    if (touches == 4 && text.find("holding") != std::string::npos) device::Drive(device, 0).stop();
  };
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { run_contacts(); }), "Quick stop");
  EXPECT_EQ(touches, 4);
  EXPECT_TRUE(notices.empty());
}

// Ctrl-C during a standstill is seen before there is force again.
TEST_F(DisturbedTouches, NothingIsArmedAgainAfterAnInterruption) {
  struct Interrupted {};
  bool interrupted = false;
  stall = {Stall::Of::program, 40, [&](int) { return interrupted = true; }};
  report = [&](const std::string&) {
    if (interrupted) throw Interrupted();
  };
  EXPECT_THROW(run_contacts(), Interrupted);
  EXPECT_EQ(touches, 1);
  expect_disarmed();
}

TEST_F(DisturbedTouches, AnOscillationIsAVerdictAndNotRepeated) {
  touch_limits.abort_amplitude = 0.5e-3;  // any touch bounces by more
  stall = {Stall::Of::program, 1000, [](int) { return true; }};
  const auto results = run_contacts();
  EXPECT_EQ(touches, 3);
  for (const ContactResult& result : results) EXPECT_TRUE(result.aborted_at);
  EXPECT_TRUE(notices.empty());
}

TEST_F(DisturbedTouches, TheSearchForTheLargestStiffnessEndsWhereItWould) {
  DeviceStiffnessSettings settings;
  settings.touch = contact;
  settings.steps.first = 3000;
  settings.steps.step = 500;
  StiffnessCondition plain;
  plain.name = "plain";
  const auto search = [&] {
    return with_rig([&](Rig& rig) { return find_max_stiffness(rig, plain, settings); });
  };
  const DeviceStiffnessResult undisturbed = search();
  for (const Stall::Of of : every_stall) {
    stall = {of, 40, [](int touch) { return touch == 2; }};
    touches = 0;
    notices.clear();
    const DeviceStiffnessResult disturbed = search();
    EXPECT_EQ(notices.size(), 1u);
    EXPECT_EQ(disturbed.found.stiffness, undisturbed.found.stiffness);
    EXPECT_EQ(disturbed.touches.size(), undisturbed.touches.size());
    EXPECT_EQ(static_cast<std::size_t>(touches), undisturbed.touches.size() + 1);
  }
}

}  // namespace kmax::experiment::standstill_test
