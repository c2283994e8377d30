// How the force goes when whoever commands an axis is lost: link.loss, through the whole firmware.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "tests/board/bench.hpp"
#include "tests/board/scripted_power.hpp"

namespace kmax::board::link_loss_test {
namespace {

using firmware::Fault;
using firmware::LinkLoss;

/// A motor whose current is what it should be.
class FollowingMotor : public ScriptedPower {
 public:
  firmware::AxisInput sample(std::size_t axis) {
    const float current = last[axis].motor.current_reference + excess;
    samples[axis].current_b = current, samples[axis].current_c = -current;
    return ScriptedPower::sample(axis);
  }
  float excess = 0.0f;  ///< A
};

struct Lost {
  /// An axis that is pressed a millimetre into a wall of 1 N/mm, and whose commander falls silent.
  void lose_commander(LinkLoss loss, double ramp_time = 0.1) {
    bench.set_up_plain_wall();
    bench.preset("device.hand_force", 0);  // scripted handles jump
    bench.preset("force.ramp_time", ramp_time);
    bench.preset("link.timeout", 0.3);
    bench.preset("link.loss", static_cast<double>(loss));
    bench.device.stand_at(1000);
    bench.run_ms(5);
    ASSERT_TRUE(bench.arm());
    bench.device.stand_at(-1000);
    bench.run_ms(200);
    ASSERT_FLOAT_EQ(bench.force(), 1.0f);
    for (int tick = 0; tick < 4000 && bench.state() == DriveState::operation_enabled; ++tick) {
      before = bench.force();
      bench.run_ticks(1);
    }
  }
  const firmware::Axis::Output& output() const { return bench.device.last[0]; }
  bool brakes() const {
    const auto& motor = output().motor;
    return output().enabled && output().force == 0.0f && motor.duty_a == 0.5f && motor.duty_b == 0.5f &&
           motor.duty_c == 0.5f;
  }
  void expect_fault() {
    EXPECT_EQ(bench.state(), DriveState::fault);
    EXPECT_FALSE(output().enabled);
    EXPECT_EQ(output().force, 0.0f);
    EXPECT_EQ(bench.get("drive.error_code"), firmware::error_code_of(Fault::link_silent));
  }

  BenchWith<FollowingMotor> bench;
  float before = 0.0f;
};

class LinkLost : public testing::Test, public Lost {};

TEST_F(LinkLost, LimpTakesTheForceAtOnce) {
  lose_commander(LinkLoss::limp);
  bench.run_ticks(1);
  expect_fault();
}

TEST_F(LinkLost, RampTakesItEvenlyWithinTheRampTime) {
  lose_commander(LinkLoss::ramp);
  ASSERT_EQ(bench.state(), DriveState::fault_reaction_active);
  EXPECT_GT(bench.force(), 0.98f);
  float last = before;
  int steps = 0;
  for (int tick = 1; tick < 2000; ++tick) {
    bench.run_ticks(1);
    EXPECT_LE(bench.force(), last) << tick;
    EXPECT_LT(last - bench.force(), 0.01f) << tick;
    EXPECT_NEAR(bench.force(), 1.0f - static_cast<float>(tick) / 2000.0f, 0.01f) << tick;
    steps += bench.force() < last ? 1 : 0;
    last = bench.force();
  }
  EXPECT_GT(steps, 300);
  bench.run_ticks(10);
  expect_fault();
}

TEST_F(LinkLost, WhatTheHandDoesMeanwhileIsAnsweredByLessAndLess) {
  lose_commander(LinkLoss::ramp);
  bench.run_ms(50);
  bench.device.stand_at(-2000);
  bench.run_ticks(10);
  EXPECT_NEAR(bench.force(), 1.0f, 0.05f) << "half of twice as much";
  bench.device.stand_at(1000);
  bench.run_ticks(10);
  EXPECT_EQ(bench.force(), 0.0f) << "out of the wall";
}

TEST_F(LinkLost, WithoutARampTimeRampIsAtOnce) {
  lose_commander(LinkLoss::ramp, 0.0);
  bench.run_ticks(1);
  expect_fault();
}

TEST_F(LinkLost, DampShortsTheMotorUntilTheHandleStands) {
  lose_commander(LinkLoss::damp);
  bench.run_ticks(1);
  bench.device.move(-1000, 1);  // 20 mm/s
  for (int ms = 0; ms < 500; ++ms) {
    bench.run_ms(1);
    ASSERT_TRUE(brakes()) << ms;
    ASSERT_EQ(bench.state(), DriveState::fault_reaction_active) << ms;
  }
  bench.device.stand_at(9000);
  bench.run_ms(30);
  EXPECT_TRUE(brakes()) << "it may only be turning round";
  bench.run_ms(40);
  expect_fault();
}

TEST_F(LinkLost, DampEndsAfterTwoSecondsWhateverMoves) {
  lose_commander(LinkLoss::damp);
  bench.device.move(-1000, 1);
  int ms = 0;
  for (; ms < 3000 && bench.state() == DriveState::fault_reaction_active; ++ms) {
    bench.run_ms(1);
  }
  EXPECT_NEAR(ms, 2000, 5);
  bench.run_ticks(1);
  expect_fault();
}

TEST_F(LinkLost, AnythingElseThatIsWrongEndsItWithinATick) {
  const std::pair<const char*, std::function<void(Lost&)>> events[] = {
      {"encoder", [](Lost& on) { on.bench.device.valid[0] = false; }},
      {"supply", [](Lost& on) { on.bench.device.samples[0].supply_voltage = 60.0f; }},
      {"over-current", [](Lost& on) { on.bench.device.excess = 100.0f; }}};
  for (const LinkLoss loss : {LinkLoss::ramp, LinkLoss::damp}) {
    for (const auto& [name, happens] : events) {
      Lost one;
      one.lose_commander(loss);
      one.bench.run_ms(10);
      ASSERT_TRUE(one.output().enabled) << name;
      happens(one);
      one.bench.run_ticks(1);
      EXPECT_FALSE(one.output().enabled) << name;
      EXPECT_EQ(one.output().force, 0.0f) << name;
      one.bench.run_ticks(10);
      EXPECT_EQ(one.bench.state(), DriveState::fault) << name;
    }
  }
}

TEST_F(LinkLost, AWordThatDisarmsEndsItAndOneThatDoesNotChangesNothing) {
  for (const unsigned word : {0x00U, 0x02U, 0x06U, 0x07U, 0x80U}) {
    Lost one;
    one.lose_commander(LinkLoss::damp);
    one.bench.run_ticks(1);
    EXPECT_EQ(one.bench.command(0x0F), 0);
    ASSERT_TRUE(one.brakes()) << "it is too late to come back";
    one.bench.command(static_cast<std::uint16_t>(word));
    one.bench.run_ticks(10);
    EXPECT_FALSE(one.output().enabled) << word;
    EXPECT_NE(one.bench.state(), DriveState::fault_reaction_active) << word;
    EXPECT_NE(one.bench.state(), DriveState::operation_enabled) << word;
  }
}

TEST_F(LinkLost, UntilTheForceIsGoneTheAxisCountsAsArmed) {
  lose_commander(LinkLoss::ramp, 0.19);
  EXPECT_EQ(bench.set("force.limit", 100), 4);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::only_tightens));
  EXPECT_EQ(bench.set("encoder.direction", -1), 4);
  EXPECT_EQ(bench.set("link.loss", 0), 4);
  EXPECT_NE(bench.set("store.command", 1), 0);
  bench.run_ms(1100);
  expect_fault();
  EXPECT_EQ(bench.set("link.loss", 0), 0);
  bench.device.stand_at(1000);
  bench.clear_fault();
  EXPECT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(1100);
}

TEST_F(LinkLost, ModeExcitationGoesLimp) {
  bench.preset("link.timeout", 0.3);
  bench.preset("link.loss", static_cast<double>(LinkLoss::damp));
  bench.preset("drive.mode", 1);
  bench.run_ms(5);
  ASSERT_TRUE(bench.arm());
  bench.run_ms(310);
  expect_fault();
}

}  // namespace
}  // namespace kmax::board::link_loss_test
