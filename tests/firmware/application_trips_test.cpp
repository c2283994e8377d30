// What removes the force by itself: over-speed, encoder, silent host; and that it never returns by itself.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/board/bench.hpp"

namespace kmax::board::application_trips_test {
namespace {

using firmware::Fault;

int code_of(Fault fault) {
  return firmware::text_of(fault).error_code;
}

class Trips : public BenchOfWalls {
 protected:
  // Runs to the tick at which the fault is there; the force must be zero from then on, and was not before.
  void expect_no_force_for_ms(double ms) {
    bench.device.recording = true;
    bench.device.forces[0].clear();
    bench.run_ms(ms);
    for (const float force : bench.device.forces[0]) ASSERT_EQ(force, 0.0f);
    bench.device.recording = false;
  }

  // Whatever the host says short of clearing and arming again, no force.
  void expect_force_stays_away() {
    bench.device.stand_at(-1000);
    bench.device.recording = true;
    bench.device.forces[0].clear();
    for (const unsigned word : {0x0Fu, 0x07u, 0x0Fu, 0x06u, 0x0Fu, 0x00u, 0x0Fu, 0x8Fu, 0x0Fu, 0x06u, 0x07u})
      bench.command(static_cast<std::uint16_t>(word));
    // 0x8F above was a reset edge: cleared, but only shutdown and switch on have followed.
    bench.run_ms(5);
    for (const float force : bench.device.forces[0]) ASSERT_EQ(force, 0.0f);
    bench.device.recording = false;
    bench.device.stand_at(1000);
    bench.run_ms(20);
    bench.command(0x0F);
    bench.run_ticks(2);
    EXPECT_EQ(bench.state(), DriveState::operation_enabled);
    bench.device.stand_at(-1000);
    bench.run_ms(2);
    EXPECT_EQ(bench.force(), 1.0f);
  }
};

TEST_F(Trips, OverSpeedRemovesTheForceInTheTickThatFindsIt) {
  bench.preset("velocity.estimator", 0);
  bench.preset("velocity.limit", 1.0);
  bench.preset("interference.background_force", 2.0);
  bench.preset("interference.mode", 1);  // a force everywhere
  ASSERT_TRUE(bench.arm());
  bench.run_ms(1);
  EXPECT_EQ(bench.force(), 2.0f);
  // 1 um per count and tick is 0.02 m/s: 50 counts per tick are just allowed, 51 are not.
  bench.device.move(1000, 50);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(), 2.0f);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  const std::int64_t here = 1000 + 50 * 40;
  bench.device.move(here + 2, 51);
  bench.run_ticks(1);
  EXPECT_EQ(bench.force(), 0.0f) << "in this very tick";
  EXPECT_FALSE(bench.device.last[0].enabled);
  bench.run_ticks(1);
  EXPECT_EQ(bench.state(), DriveState::fault);
  EXPECT_EQ(bench.get("drive.error_code"), code_of(Fault::over_speed));
  EXPECT_GT(std::abs(bench.get("drive.fault_value")), 1.0);
  EXPECT_EQ(bench.get("drive.fault_bound"), 1.0);
  EXPECT_EQ(bench.get("drive.error_code", 1), 0) << "the other axis has no fault";
  bench.device.stand_at(1000);
  bench.run_ms(1);
  bench.set("interference.mode", 0);
  bench.set("velocity.limit", 0);  // the scripted handle jumps
  expect_force_stays_away();
}

TEST_F(Trips, OverSpeedCountsInBothDirectionsAndZeroTurnsItOff) {
  bench.preset("velocity.estimator", 0);
  bench.preset("velocity.limit", 1.0);
  ASSERT_TRUE(bench.arm());
  bench.device.move(1000, -51);
  bench.run_ticks(3);
  EXPECT_EQ(bench.state(), DriveState::fault);
  Bench off;
  off.set_up_plain_wall();
  off.preset("velocity.estimator", 0);
  off.device.stand_at(1000);
  ASSERT_TRUE(off.arm());
  off.device.move(1000, 100'000);
  off.run_ms(5);
  EXPECT_EQ(off.state(), DriveState::operation_enabled);
}

TEST_F(Trips, OverSpeedWhileDisarmedIsNoFault) {
  bench.preset("velocity.limit", 1.0);
  bench.device.move(1000, 500);
  bench.run_ms(5);
  EXPECT_EQ(bench.state(), DriveState::switch_on_disabled);
  EXPECT_EQ(bench.get("drive.error_code"), 0);
}

TEST_F(Trips, EncoderWithoutACountTripsInThatTick) {
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(1);
  EXPECT_EQ(bench.force(), 1.0f);
  bench.device.valid[0] = false;
  bench.run_ticks(1);
  EXPECT_EQ(bench.force(), 0.0f);
  bench.run_ticks(1);
  EXPECT_EQ(bench.state(), DriveState::fault);
  EXPECT_EQ(bench.get("drive.error_code"), code_of(Fault::encoder));
  // The cause is still there: not cleared, and the host is told why.
  bench.clear_fault();
  EXPECT_EQ(bench.state(), DriveState::fault);
  EXPECT_EQ(bench.refusal(), Refusal::fault_present);
  bench.device.valid[0] = true;
  expect_no_force_for_ms(5);
  EXPECT_EQ(bench.state(), DriveState::fault) << "a valid count alone changes nothing";
  bench.command(0x00);
  expect_force_stays_away();
}

TEST_F(Trips, OneInvalidCountIsEnough) {
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(1);
  bench.device.valid[0] = false;
  bench.run_ticks(1);
  bench.device.valid[0] = true;
  expect_no_force_for_ms(10);
  EXPECT_EQ(bench.state(), DriveState::fault);
}

TEST_F(Trips, EncoderOfOneAxisLeavesTheOtherRunning) {
  ASSERT_TRUE(bench.arm(0));
  ASSERT_TRUE(bench.arm(1));
  bench.device.stand_at(-1000, 1);
  bench.device.valid[0] = false;
  bench.run_ms(5);
  EXPECT_EQ(bench.state(0), DriveState::fault);
  EXPECT_EQ(bench.state(1), DriveState::operation_enabled);
  EXPECT_EQ(bench.force(1), 1.0f);
}

class SilentHost : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Timeouts, SilentHost, testing::Values(0.01, 0.1, 1.0, 3.5));

TEST_P(SilentHost, RemovesTheForceWithinTheTimeOutAndOneMillisecond) {
  Bench bench;
  bench.set_up_plain_wall();
  bench.preset("link.timeout", GetParam());
  bench.device.stand_at(1000);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  // The last request's own end is the start of the silence.
  bench.board().receive(firmware::modbus::adu(1, {3, 0, 0, 0, 1}));
  const std::uint64_t heard_us = bench.board().now_us() + 8 * 96;
  std::uint64_t last_force_us = 0;
  while (bench.board().now_us() < heard_us + static_cast<std::uint64_t>(GetParam() * 1e6) + 5000) {
    bench.run_ticks(1);
    if (bench.force() != 0.0f) last_force_us = bench.board().now_us();
  }
  const double held = static_cast<double>(last_force_us - heard_us) * 1e-6;
  EXPECT_GE(held, GetParam() - 0.0001);
  EXPECT_LE(held, GetParam() + 0.001);
  EXPECT_EQ(bench.state(), DriveState::fault);
  EXPECT_EQ(bench.get("drive.error_code"), code_of(Fault::link_silent));
  EXPECT_NEAR(bench.get("drive.fault_value"), GetParam(), 0.001);
  EXPECT_FLOAT_EQ(static_cast<float>(bench.get("drive.fault_bound")), static_cast<float>(GetParam()));
  // Talking again does not bring the force back.
  bench.run_ms(50);
  EXPECT_EQ(bench.force(), 0.0f);
  bench.clear_fault();
  bench.device.stand_at(1000);
  EXPECT_TRUE(bench.arm());
}

TEST_F(Trips, TalkingHostKeepsTheForceAndFramesForOthersDoNotCount) {
  bench.preset("link.timeout", 0.05);
  ASSERT_TRUE(bench.arm());
  for (int i = 0; i < 20; ++i) {
    bench.run_ms(40);
    bench.get("measured.force");
  }
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  for (int i = 0; i < 4; ++i) {
    bench.board().receive(firmware::modbus::adu(9, {3, 0, 0, 0, 1}));  // another unit
    Bytes broken = firmware::modbus::adu(1, {3, 0, 0, 0, 1});
    broken[3] ^= 1;
    bench.run_ms(10);
    bench.board().receive(broken);
    bench.run_ms(10);
  }
  EXPECT_EQ(bench.state(), DriveState::fault);
}

TEST_F(Trips, TimeOutZeroNeverTrips) {
  ASSERT_TRUE(bench.arm());
  bench.run_ms(70'000);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
}

TEST_F(Trips, SilenceWhileDisarmedIsNoFault) {
  bench.preset("link.timeout", 0.01);
  bench.get("info.uptime");
  bench.run_ms(500);
  EXPECT_EQ(bench.state(), DriveState::switch_on_disabled);
  EXPECT_TRUE(bench.arm());
}

// At a low rate a sample is 10 ms apart, and the main loop must not see the old fault in the next arming.
TEST_F(Trips, ClearedAndArmedAgainWithinOneHapticSampleDoesNotTripAgain) {
  bench.preset("haptic.rate", 100, 0);
  bench.preset("haptic.rate", 100, 1);
  bench.preset("modbus.baud_rate", 921600);
  ASSERT_TRUE(bench.arm());
  while (bench.device.tick % 200 != 20) bench.run_ticks(1);
  bench.device.valid[0] = false;
  bench.run_ticks(2);
  ASSERT_EQ(bench.state(), DriveState::fault);
  bench.device.valid[0] = true;
  bench.run_ticks(2);
  // Broadcasts need no reply: four commands in less than a sample. The one that arms must not be one.
  const auto start = bench.device.tick;
  for (const unsigned word : {0x00u, 0x80u, 0x06u, 0x0Fu}) {
    bench.board().receive(
        firmware::modbus::adu(word == 0x0Fu ? 1 : 0, {6, 0x02, 0x00, 0, static_cast<std::uint8_t>(word)}));
    bench.run_ms(2.0);
  }
  ASSERT_LT(bench.device.tick - start, 170u);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  bench.run_ms(30);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled) << "no fault has happened since";
}

TEST_F(Trips, ReadingsTellTheTruthSoonAfterDisarmingAtALowRate) {
  bench.preset("haptic.rate", 100, 0);
  bench.preset("haptic.rate", 100, 1);
  bench.preset("modbus.baud_rate", 921600);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(25);
  ASSERT_EQ(bench.force(), 1.0f);
  while (bench.device.tick % 200 != 20) bench.run_ticks(1);
  bench.disarm();
  EXPECT_EQ(bench.force(), 0.0f);
  EXPECT_EQ(bench.get("measured.force"), 0.0) << "the force that is really asked for";
}

TEST_F(Trips, ATripThatMeetsTheHostsDisarmIsStillReported) {
  ASSERT_TRUE(bench.arm());
  // The controlword is executed at a poll; trip in the tick right before it.
  bench.board().receive(firmware::modbus::adu(1, {6, 0x02, 0x00, 0, 0x00}));
  int ticks = 0;
  {
    Bench twin;  // learns at which tick the command is executed
    twin.set_up_plain_wall();
    twin.device.stand_at(1000);
    twin.run_ticks(20);
    ASSERT_TRUE(twin.arm());
    twin.board().receive(firmware::modbus::adu(1, {6, 0x02, 0x00, 0, 0x00}));
    while (twin.state() == DriveState::operation_enabled) twin.run_ticks(1), ++ticks;
  }
  bench.run_ticks(static_cast<std::uint64_t>(ticks - 1));
  ASSERT_EQ(bench.state(), DriveState::operation_enabled);
  bench.device.valid[0] = false;
  bench.run_ticks(1);
  EXPECT_EQ(bench.state(), DriveState::fault);
  bench.run_ms(5);  // the reply to the command
  EXPECT_EQ(bench.get("drive.error_code"), code_of(Fault::encoder));
}

}  // namespace
}  // namespace kmax::board::application_trips_test
