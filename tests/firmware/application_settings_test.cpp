// Parameters through the whole firmware: when they take effect, and what they do to position and force.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/board/bench.hpp"

namespace kmax::board::application_settings_test {
namespace {

class Settings : public BenchOfWalls {
 protected:
  // The single-register write of a value of two words, and the tick at which its request is executed.
  void send_write(std::string_view name, double number, std::size_t axis = 0) {
    using namespace firmware;
    bench.board().receive(
        modbus::adu(1, modbus::multiple_request(address_of(name, axis), words_for(name, number))));
  }
};

TEST_F(Settings, StiffnessWhileArmedTakesEffectInTheTickAfterTheRequestIsExecuted) {
  ASSERT_EQ(bench.set("wall.stiffness_ceiling", 2000), 0);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(), 1.0f);
  send_write("wall.stiffness", 2000);
  for (int ticks = 0; bench.application().values().real<"wall.stiffness">() != 2000.0f; ++ticks) {
    EXPECT_EQ(bench.force(), 1.0f);
    bench.run_ticks(1);
    ASSERT_LT(ticks, 1000) << "the write has not been taken";
  }
  bench.run_ticks(1);
  EXPECT_EQ(bench.force(), 2.0f);
}

TEST_F(Settings, WhatMustNotChangeWhileArmedIsRefusedInWordsAndChangesNothing) {
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(bench.set("wall.position", 0.5), 4);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::while_armed));
  EXPECT_EQ(bench.get("refusal.register"), firmware::address_of("wall.position"));
  EXPECT_EQ(bench.get("wall.position"), 0.0);
  EXPECT_EQ(bench.set("wall.position", 0.5, 1), 4) << "of the other axis neither";
  bench.disarm();
  EXPECT_EQ(bench.set("wall.position", 0.5), 0);
  EXPECT_EQ(bench.get("refusal.reason"), 0);
}

TEST_F(Settings, ExceptionsSayWhatKindOfErrorItWas) {
  EXPECT_EQ(bench.set("wall.stiffness", -1), 3);
  EXPECT_EQ(bench.write(firmware::address_of("wall.stiffness"), {0}), 2);
  EXPECT_EQ(bench.write(0x003F, {0}), 2);
  EXPECT_EQ(bench.write(0x4000, {0}), 2);
  EXPECT_EQ(bench.set("transaction.control", 2), 4);
  EXPECT_EQ(bench.set("transaction.control", 1), 0);
  EXPECT_EQ(bench.set("transaction.control", 1), 6);
  EXPECT_EQ(bench.set("transaction.control", 3), 3);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::out_of_range));
}

TEST_F(Settings, TransactionMakesOneStepOfSeveralValues) {
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.set("transaction.control", 1);
  bench.set("wall.stiffness", 500);
  bench.set("force.limit", 0.25);
  EXPECT_EQ(bench.force(), 1.0f);
  bench.device.recording = true;
  bench.set("transaction.control", 2);
  bench.run_ticks(2);
  for (const float force : bench.device.forces[0]) EXPECT_TRUE(force == 1.0f || force == 0.25f) << force;
  EXPECT_EQ(bench.force(), 0.25f);
}

TEST_F(Settings, DisarmedTransactionIsNotAppliedByArmingInBetween) {
  bench.set("transaction.control", 1);
  bench.set("wall.position", 0.5);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(bench.set("transaction.control", 2), 4);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::while_armed));
  EXPECT_EQ(bench.get("wall.position"), 0.0);
}

TEST_F(Settings, TwoChangesBeforeATickLastWinsAndTheRestartIsNotLost) {
  bench.set("position.resolution", 0.0001);
  EXPECT_NEAR(bench.get("measured.resolution"), 0.0001, 1e-9);
  // preset() acts at once: restarting, then not restarting, with no tick in between.
  bench.preset("encoder.offset", 400);
  bench.preset("wall.stiffness", 3000);
  bench.preset("wall.stiffness", 4000);
  bench.run_ticks(1);
  EXPECT_EQ(bench.get("measured.count"), 600);
  EXPECT_EQ(bench.get("measured.velocity"), 0.0) << "restarted: the jump of the origin is no motion";
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(300);  // position -100
  bench.run_ms(1);
  EXPECT_NEAR(bench.force(), 0.4f, 1e-6f);
}

TEST_F(Settings, ScaleAndOriginChangesAreNeverTakenForMotion) {
  for (const auto& [name, number] : {std::pair{"encoder.offset", -123456.0},
                                     {"encoder.direction", -1.0},
                                     {"device.transmission", 0.05},
                                     {"encoder.counts_per_turn", 8192.0},
                                     {"position.resolution", 0.001},
                                     {"haptic.rate", 500.0}}) {
    send_write(name, number);
    for (int i = 0; i < 400; ++i) {
      bench.run_ticks(1);
      bench.application().serial().ISR_byte(0, true,
                                            static_cast<std::uint32_t>(bench.board().now_us()));  // noise
    }
    bench.run_ms(5);
    EXPECT_EQ(bench.get("measured.velocity"), 0.0) << name;
  }
}

TEST_F(Settings, DirectionAndOffsetGiveTheDocumentedPosition) {
  bench.set("encoder.offset", 250);
  EXPECT_EQ(bench.get("measured.count"), 750);
  bench.set("encoder.direction", -1);
  EXPECT_EQ(bench.get("measured.count"), -750);
  EXPECT_NEAR(bench.get("measured.position"), -750e-6, 1e-9);
  EXPECT_NEAR(bench.get("measured.distance"), -750e-6, 1e-9);
  bench.device.stand_at(-50);
  EXPECT_EQ(bench.get("measured.count"), 300);
  // Counts that fall are motion towards +.
  bench.device.move(-50, -10);
  bench.run_ms(5);
  EXPECT_NEAR(bench.get("measured.velocity"), 10 * 1e-6 * 20000, 1e-3);
}

TEST_F(Settings, CounterWrapsAreNoMotion) {
  constexpr std::int64_t edges[] = {std::int64_t{1} << 31, std::int64_t{1} << 32, -(std::int64_t{1} << 31), 0,
                                    -(std::int64_t{1} << 32)};
  for (const std::int64_t edge : edges) {
    Bench b;
    b.set_up_plain_wall();
    b.preset("wall.law", 0);
    b.preset("velocity.limit", 1.0);
    b.device.stand_at(edge - 1000);
    b.run_ticks(20);
    ASSERT_TRUE(b.arm());
    const double before = b.get("measured.count");
    b.device.move(edge - 1000, 10);  // 0.2 m/s
    b.run_ticks(200);
    b.device.stand_at(edge + 1000);
    b.run_ms(5);
    EXPECT_EQ(b.state(), DriveState::operation_enabled) << edge;
    const double moved = b.get("measured.count") - before;  // low 32 bits
    EXPECT_TRUE(moved == 2000 || moved == 2000 - 4294967296.0) << edge << " " << moved;
  }
}

// 10^9 counts per turn: little more than two turns from the counter's origin the count does not fit 32 bits.
// 10^9 counts per turn: little more than two turns from the counter's origin the count does not fit 32 bits,
// and at 100 Hz a host can arm before the second sample.
TEST_F(Settings, HandleFarFromTheOriginIsOnItsRightSideFromTheFirstSample) {
  Bench b;
  b.set_up_plain_wall();
  b.preset("encoder.counts_per_turn", 1e9);
  b.preset("haptic.rate", 100, 0);
  b.preset("haptic.rate", 100, 1);
  b.preset("modbus.baud_rate", 921600);
  std::int64_t count = 0;
  for (int i = 0; i < 60; ++i) {  // three turns, in steps below half the counter's range
    count += 50'000'000;
    b.device.stand_at(count);
    b.run_ticks(200);
  }
  b.run_ms(500);
  b.command(0x06);
  // Turned round, the handle is three turns inside.
  b.set("encoder.direction", -1);
  b.command(0x0F);
  b.run_ticks(1);
  EXPECT_EQ(b.state(), DriveState::switched_on);
  EXPECT_EQ(b.refusal(), Refusal::handle_inside_wall);
  b.run_ms(25);
  EXPECT_EQ(b.get("measured.velocity"), 0.0) << "a new origin is no motion";
}

TEST_F(Settings, OriginMovedByMoreThan31BitsIsNoMotion) {
  Bench b;
  b.set_up_plain_wall();
  b.preset("haptic.rate", 100, 0);
  b.preset("haptic.rate", 100, 1);
  b.device.stand_at(std::numeric_limits<std::int32_t>::min());
  b.run_ms(50);
  b.set("encoder.offset", std::numeric_limits<std::int32_t>::max());
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(b.get("measured.velocity"), 0.0);
    EXPECT_EQ(b.get("measured.count"), 1.0) << "-2^32 + 1, low 32 bits";
    EXPECT_NEAR(b.get("measured.position"), -4294.967295, 1e-3);
  }
  b.set("encoder.direction", -1);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(b.get("measured.velocity"), 0.0);
    EXPECT_NEAR(b.get("measured.position"), 4294.967295, 1e-3);
  }
}

TEST_F(Settings, LowRateHoldsTheForceForTheWholeSample) {
  bench.set("haptic.rate", 500);
  ASSERT_TRUE(bench.arm());
  bench.device.move(0, -1);
  bench.device.recording = true;
  bench.run_ticks(40 * 50);
  const auto& forces = bench.device.forces[0];
  std::vector<std::size_t> changes;
  for (std::size_t i = 1; i < forces.size(); ++i) {
    if (forces[i] != forces[i - 1]) changes.push_back(i);
  }
  ASSERT_GT(changes.size(), 40u);
  for (std::size_t i = 1; i < changes.size(); ++i) EXPECT_EQ(changes[i] - changes[i - 1], 40u);
  EXPECT_NEAR(forces[changes[5]] - forces[changes[4]], 40e-6f * 1000, 1e-6f);
}

TEST_F(Settings, DisarmingBetweenTwoSamplesRemovesTheForceAtOnce) {
  bench.set("haptic.rate", 100);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(15);
  EXPECT_EQ(bench.force(), 1.0f);
  while (bench.device.tick % 200 != 20) bench.run_ticks(1);
  bench.board().receive(firmware::modbus::adu(1, {6, 2, 0, 0, 6}));
  while (bench.state() == DriveState::operation_enabled) bench.run_ticks(1);
  bench.run_ticks(1);
  EXPECT_EQ(bench.force(), 0.0f);
}

TEST_F(Settings, ParallelInterferenceActsOnTheOtherAxis) {
  bench.set("wall.law", 0, 1);
  bench.set("interference.mode", 2);
  bench.set("interference.force", 0.75);
  bench.set("interference.background_force", 0.5);
  ASSERT_TRUE(bench.arm(0));
  bench.device.stand_at(-1000);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(0), 1.5f) << "spring and background force along the normal";
  EXPECT_EQ(bench.force(1), 0.0f) << "the other axis is not armed";
  bench.command(0x06, 1), bench.command(0x0F, 1);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(1), 0.75f);
  bench.set("force.limit", 0.5, 1);
  bench.run_ms(1);
  EXPECT_EQ(bench.force(1), 0.5f) << "within the other axis' own limit";
  bench.disarm(0);
  bench.run_ticks(2);
  EXPECT_EQ(bench.force(1), 0.0f) << "who makes it is gone";
}

TEST_F(Settings, UnitAndBaudRateChangeAfterTheReply) {
  EXPECT_EQ(bench.set("modbus.unit", 17), 0);  // answered as unit 1
  EXPECT_TRUE(bench.request({3, 0, 0, 0, 1}, 1).empty());
  EXPECT_FALSE(bench.request({3, 0, 0, 0, 1}, 17).empty());
  const Bytes reply = bench.request({16, 0x20, 0x31, 0, 2, 4, 0, 0, 0x25, 0x80}, 17);  // 9600
  EXPECT_EQ(reply, (Bytes{16, 0x20, 0x31, 0, 2}));
  bench.run_ticks(1);
  EXPECT_EQ(bench.application().serial().settings().baud_rate, 9600u);
  const auto start = bench.board().now_us();
  EXPECT_FALSE(bench.request({3, 0, 0, 0, 1}, 17).empty());
  EXPECT_GT(bench.board().now_us() - start, 15u * 1146u) << "at the new rate";
}

TEST_F(Settings, PresetIsRefusedLikeAHostsWrite) {
  auto& application = bench.application();
  const auto preset = [&](std::string_view name, std::uint32_t raw) {
    return application.preset(firmware::entry_named(name), 0, raw).refusal;
  };
  EXPECT_EQ(preset("wall.law", 9), Refusal::not_a_choice);
  EXPECT_EQ(preset("wall.stiffness", 0x7FC00000), Refusal::not_finite);
  EXPECT_EQ(preset("wall.law", 0x10002), Refusal::not_a_choice) << "not cut to 16 bits";
  EXPECT_EQ(preset("wall.side", 0xFFFFFFFF), Refusal::none);
  EXPECT_EQ(preset("drive.statusword", 2), Refusal::read_only);
  EXPECT_EQ(preset("measured.count", 0), Refusal::read_only);
  EXPECT_EQ(application.values().whole<"wall.law">(), 1) << "a reading's address is another value's register";
}

}  // namespace
}  // namespace kmax::board::application_settings_test
