// Arming and disarming through the whole firmware: when force may appear, and that it appears nowhere else.
#include <gtest/gtest.h>

#include "tests/board/bench.hpp"

namespace kmax::board::application_arming_test {
namespace {

class Arming : public BenchOfWalls {};

TEST_F(Arming, OutOfTheBoxWithNoSettingChangedItArmsAndDrives) {
  Bench fresh;
  fresh.device.stand_at(1000);
  fresh.device.stand_at(1000, 1);
  EXPECT_TRUE(fresh.arm());
  fresh.device.move(1000, -1);  // 0.8 m/s
  fresh.run_ms(55);
  EXPECT_GT(fresh.force(), 0.0f);
}

TEST_F(Arming, InsideTheWallIsRefusedWithTheReasonAndNeverComesLater) {
  bench.device.stand_at(-1);
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::handle_inside_wall);
  EXPECT_EQ(bench.state(), DriveState::switched_on);
  bench.device.stand_at(1000);
  bench.command(0x0F);
  bench.command(0x0F);
  bench.run_ms(20);
  EXPECT_EQ(bench.state(), DriveState::switched_on)
      << "a held word must not arm when the handle leaves the wall";
  bench.command(0x07);
  bench.command(0x0F);
  bench.run_ticks(2);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  EXPECT_EQ(bench.refusal(), Refusal::none);
}

TEST_F(Arming, OnTheSurfaceIsInsideOneCountOutsideIsNot) {
  bench.device.stand_at(0);
  EXPECT_FALSE(bench.arm());
  bench.device.stand_at(1);
  EXPECT_TRUE(bench.arm());
}

TEST_F(Arming, InterferenceAloneIsReasonEnoughToRefuseInside) {
  bench.set("wall.law", 0);
  bench.set("interference.mode", 1);
  bench.set("interference.force", 3);
  bench.device.stand_at(-5000);
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::handle_inside_wall);
}

TEST_F(Arming, WithoutAWallThereIsNothingToBeInsideOf) {
  bench.set("wall.law", 0);
  bench.device.stand_at(-5000);
  EXPECT_TRUE(bench.arm());
  bench.run_ms(10);
  EXPECT_EQ(bench.force(), 0.0f);
}

TEST_F(Arming, OneAxisInsideItsWallDoesNotHinderTheOther) {
  bench.device.stand_at(-100, 1);
  EXPECT_TRUE(bench.arm(0));
  EXPECT_FALSE(bench.arm(1));
  EXPECT_EQ(bench.refusal(1), Refusal::handle_inside_wall);
  EXPECT_EQ(bench.refusal(0), Refusal::none);
}

TEST_F(Arming, EncoderWithoutAValidCountIsRefused) {
  bench.device.valid[0] = false;
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::encoder_invalid);
  EXPECT_EQ(bench.state(), DriveState::switched_on) << "refused, not tripped";
  bench.device.valid[0] = true;
  bench.disarm();
  EXPECT_TRUE(bench.arm());
}

TEST_F(Arming, EncoderThatWasNeverValidIsRefusedEvenWithoutAWall) {
  Bench fresh;
  fresh.set_up_plain_wall();
  fresh.device.valid[0] = false;
  fresh.set("wall.law", 0);
  EXPECT_FALSE(fresh.arm());
  EXPECT_EQ(fresh.refusal(), Refusal::encoder_invalid);
}

TEST_F(Arming, ForceComesWithTheSoftStartAlsoWhenAWallIsMetDuringIt) {
  bench.set("force.ramp_time", 0.1);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);  // 1 N
  float last = 0.0f;
  int rising = 0;
  for (int i = 0; i < 2100; ++i) {
    bench.run_ticks(1);
    EXPECT_GE(bench.force(), last);
    EXPECT_LE(bench.force() - last, 1.0f / 2000.0f * 200.0f) << "no jump beyond what the ramp had reached";
    rising += bench.force() > last ? 1 : 0;
    last = bench.force();
  }
  EXPECT_GT(rising, 1000);
  EXPECT_NEAR(last, 1.0f, 1e-5f);
  // Arming again starts the ramp again.
  bench.device.stand_at(1000);
  bench.disarm();
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ticks(1);
  EXPECT_LT(bench.force(), 0.2f);
}

TEST_F(Arming, ForceIsZeroInEveryStateButOperationEnabled) {
  bench.device.stand_at(-1000);
  const auto expect_no_force = [&](DriveState state) {
    EXPECT_EQ(bench.state(), state);
    bench.device.recording = true;
    bench.device.forces[0].clear();
    bench.run_ms(5);
    for (const float force : bench.device.forces[0]) ASSERT_EQ(force, 0.0f) << int(state);
    bench.device.recording = false;
    EXPECT_FALSE(bench.device.last[0].enabled);
  };
  expect_no_force(DriveState::switch_on_disabled);
  bench.command(0x06);
  expect_no_force(DriveState::ready_to_switch_on);
  bench.command(0x07);
  expect_no_force(DriveState::switched_on);
  for (const unsigned leaving : {0x00u, 0x06u, 0x07u, 0x02u}) {
    bench.command(0x00);
    bench.device.stand_at(1000);
    ASSERT_TRUE(bench.arm());
    bench.device.stand_at(-1000);
    bench.run_ms(2);
    EXPECT_EQ(bench.force(), 1.0f);
    EXPECT_TRUE(bench.device.last[0].enabled);
    bench.command(static_cast<std::uint16_t>(leaving));
    expect_no_force(leaving == 0   ? DriveState::switch_on_disabled
                    : leaving == 6 ? DriveState::ready_to_switch_on
                    : leaving == 7 ? DriveState::switched_on
                                   : DriveState::quick_stop_active);
    if (leaving == 2) {
      bench.command(0x0F);
      expect_no_force(DriveState::quick_stop_active);
    }
  }
}

TEST_F(Arming, WallMovedOntoTheHandleAndArmedAtOnceIsRefused) {
  bench.command(0x06);
  // Both requests wait on the line together: write, then the controlword right behind it.
  bench.set("wall.position", 0.0015);
  bench.command(0x0F);
  bench.run_ticks(5);
  EXPECT_EQ(bench.state(), DriveState::switched_on);
  EXPECT_EQ(bench.refusal(), Refusal::handle_inside_wall);
  // And away from it again: armed by the new settings as well.
  bench.set("wall.position", 0.0005);
  bench.command(0x07);
  bench.command(0x0F);
  bench.run_ticks(2);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
}

TEST_F(Arming, MirroredWallRefusesAndPushesTheOtherWay) {
  bench.set("wall.side", -1);
  bench.device.stand_at(1000);
  EXPECT_FALSE(bench.arm());
  bench.device.stand_at(-1000);
  bench.disarm();
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(500);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(), -0.5f);
}

TEST_F(Arming, StatuswordTellsTheStateAndTheLimit) {
  const auto word = [&] { return static_cast<unsigned>(bench.get("drive.statusword")); };
  EXPECT_EQ(word() & 0x6F, 0x40u);
  EXPECT_EQ(word() & 0x0210, 0x0200u) << "remote, no voltage";
  bench.command(0x06);
  EXPECT_EQ(word() & 0x6F, 0x21u);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(word() & 0x6F, 0x27u);
  EXPECT_EQ(word() & 0x0810, 0x0010u);
  bench.device.stand_at(-10000);  // 10 N, limit 3.3 N
  bench.run_ms(2);
  EXPECT_EQ(bench.force(), 3.3f);
  EXPECT_EQ(word() & 0x0800, 0x0800u);
  EXPECT_EQ(static_cast<unsigned>(bench.get("measured.flags")), 1u | 2u | 16u);
  // Each bit alone: the slew limit is in the way, the force limit is not.
  bench.device.stand_at(-1000);
  bench.run_ms(2);
  bench.set("force.slew_limit", 0.1);
  bench.device.stand_at(-2000);
  bench.run_ms(2);
  EXPECT_EQ(static_cast<unsigned>(bench.get("measured.flags")), 1u | 4u | 16u);
  EXPECT_GT(bench.get("measured.limited_samples"), 30);
  EXPECT_GE(bench.get("measured.armed_samples"), bench.get("measured.limited_samples"));
}

TEST_F(Arming, TheSoftStartShowsInTheFlagsWhileItLasts) {
  const auto flags = [&] { return static_cast<unsigned>(bench.get("measured.flags")); };
  bench.set("force.ramp_time", 0.1);
  bench.device.stand_at(1000);
  EXPECT_EQ(flags(), 0u);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(flags(), 8u | 16u);
  bench.run_ms(100);
  EXPECT_EQ(flags(), 16u);
}

}  // namespace
}  // namespace kmax::board::application_arming_test
