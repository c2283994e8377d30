#include "host_tools/experiment/limited_touches.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>

#include "host_tools/experiment/resolution/resolution_experiment.hpp"
#include "tests/host_tools/experiment/asked_person.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::limited_touches_test {
namespace {
using host_tools_test::TemporaryFolder;
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
  LimitedTouches& begin(const std::vector<std::size_t>& further_axes = {}) {
    touches.emplace(device, limits, std::vector<std::string>{"wall.stiffness=1"},
                    TouchParty{prompter, journal.get(), tell, notice}, further_axes);
    return *touches;
  }
  void expect_restored() {
    touches.reset();
    EXPECT_EQ(values(), before);
    EXPECT_TRUE(notices.empty());
  }

  TouchLimits limits;
  AskedPerson asked;
  calibration::Prompter* prompter = &asked;
  std::unique_ptr<RunJournal> journal;
  std::vector<std::string> notices;
  Tell notice = [this](const std::string& text) { notices.push_back(text); };
  std::vector<double> before;
  std::optional<LimitedTouches> touches;
};

TEST_F(Limited, TheLimitsAreAtWorkAtOnceAndWhatWasBeforeComesBack) {
  EXPECT_EQ(begin().force_limit(), 2.0);
  EXPECT_EQ(values(), (std::vector<double>{2.0, 9.0, 1.0, 700.0, 800.0}))
      << "what is only going to be changed is not yet";
  touches->set({"wall.stiffness=900"});
  EXPECT_EQ(values()[3], 900.0);
  expect_restored();
}

TEST_F(Limited, AFurtherAxisIsLoweredToTheSame) {
  begin({1});
  EXPECT_EQ(values(), (std::vector<double>{2.0, 2.0, 1.0, 700.0, 800.0}));
  expect_restored();
}

TEST_F(Limited, TheAxisOfTheLimitsIsMeantByANameWithoutPrefix) {
  limits.axis = 1;
  begin().set({"wall.stiffness=900"});
  EXPECT_EQ(values(), (std::vector<double>{10.0, 2.0, 1.0, 700.0, 900.0}));
  expect_restored();
}

TEST_F(Limited, LimitsThatAreLowerAlreadyStay) {
  set({"link.timeout=0.25"});
  before = values();
  limits.force_limit = 50.0;
  EXPECT_EQ(begin({1}).force_limit(), 10.0);
  EXPECT_EQ(values(), before);
  expect_restored();
}

TEST_F(Limited, ALimitThatTheDeviceRefusesChangesNothing) {
  limits.force_limit = -1.0;
  EXPECT_CONTAINS(thrown_message<device::ValueError>([&] { begin({1}); }), "force.limit");
  expect_restored();
}

TEST_F(Limited, WhatIsRefusedLaterLeavesTheLimitsUntilTheEnd) {
  EXPECT_THROW(begin().set({"wall.stiffness=-1"}), device::ValueError);
  EXPECT_EQ(values()[0], 2.0);
  expect_restored();
}

TEST_F(Limited, WhatCannotBePutBackIsTold) {
  begin();
  cable().cut = true;
  touches.reset();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_CONTAINS(notices[0], "force.limit=10");
  EXPECT_CONTAINS(notices[0], "link.timeout=0");
  EXPECT_CONTAINS(notices[0], "wall.stiffness=700");
}

TEST_F(Limited, ThePersonIsAskedIfThereIsOne) {
  begin().ask("press");
  EXPECT_EQ(asked.requests, std::vector<std::string>{"press"});
  asked.answer = [] { throw std::logic_error("no"); };
  EXPECT_THROW(touches->ask("press"), std::logic_error);
  touches.reset();
  prompter = nullptr;
  begin().ask("press");
  EXPECT_EQ(asked.requests.size(), 2u);
  expect_restored();
}

TEST_F(Limited, ATouchIsKeptUnderItsKey) {
  const TemporaryFolder folder;
  journal =
      std::make_unique<RunJournal>(folder / "j", RunJournal::Json{{"settings", 1}}, RunJournal::Begin::anew);
  std::uint64_t made = 0;
  const auto touch = [&](const char* key) {
    const auto once = [&made] {
      ResolutionTouch one;
      one.lost_records = ++made;
      return one;
    };
    return begin().touch<ResolutionTouch>(key, "wall", once).lost_records;
  };
  EXPECT_EQ(touch("a"), 1u);
  EXPECT_EQ(touch("b"), 2u);
  EXPECT_EQ(touch("a"), 1u);
  EXPECT_EQ(journal->size(), 2u);
}

TEST_F(Limited, AnOscillationBeyondItsLimitEndsATouch) {
  begin().set({"wall.law=plain", "wall.stiffness=5500", "haptic.rate=500"});
  EXPECT_FALSE(touches->watch("wall", 0.5).aborted_at);
  ASSERT_FALSE(told.empty());
  EXPECT_CONTAINS(told.back(), "wall: ");
  touches.reset();
  limits.abort_amplitude = 0.8e-3;
  EXPECT_TRUE(begin().watch("wall", 3.0).aborted_at);
  expect_disarmed();
}

class LimitedWithoutAPerson : public Limited {
 protected:
  LimitedWithoutAPerson() : Limited(nobody()) {}
};

TEST_F(LimitedWithoutAPerson, NobodyIsWaitedForLongerThanThePatience) {
  limits.patience = 1.5;
  EXPECT_CONTAINS(thrown_message<NobodyTouched>([&] { begin().watch("wall", 3.0); }), "1.5 s");
  expect_disarmed();
  expect_restored();
}

TEST(WatchWithin, HasEveryLimit) {
  const TouchWatch watch = watch_within({1, 3.0, 0.02, 7.0, 1e-3}, "wall", 4.0);
  EXPECT_EQ(watch.axis, 1u);
  EXPECT_EQ(watch.name, "wall");
  EXPECT_EQ(watch.hold_time, 4.0);
  EXPECT_EQ(watch.contact_patience, 7.0);
  EXPECT_EQ(watch.abort_amplitude, 0.02);
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

}  // namespace
}  // namespace kmax::experiment::limited_touches_test
