// What the application does for the motor: temperatures, commutation, excitation, the record of a trip.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/board/bench.hpp"
#include "tests/board/scripted_power.hpp"

namespace kmax::board::application_motor_test {
namespace {

using firmware::Fault;

int code_of(Fault fault) {
  return firmware::text_of(fault).error_code;
}

class MotorOfABoard : public testing::Test {
 protected:
  void SetUp() override {
    bench.set_up_plain_wall();
    bench.preset("device.hand_force", 0);  // scripted handles jump
    bench.device.stand_at(1000);
    bench.run_ticks(20);
  }
  void carry(float amperes) {
    bench.device.samples[0].current_b = amperes, bench.device.samples[0].current_c = -amperes;
  }
  void make_synchronous() {
    bench.preset("motor.kind", 1);
    bench.run_ticks(3);
  }

  BenchWith<ScriptedPower> bench;
};

TEST_F(MotorOfABoard, TheWindingGetsWarmByItsCurrentAndTripsAboveItsLimit) {
  bench.preset("temperature.winding_capacity", 0.01);
  bench.preset("temperature.winding_resistance", 100);
  bench.preset("temperature.motor_limit", 60);
  bench.preset("wall.law", 0);
  bench.run_ms(20);
  EXPECT_NEAR(bench.get("measured.winding_temperature"), 25.0, 0.1);
  ASSERT_TRUE(bench.arm());
  carry(3.0f);
  double last_limit = 5.0;
  int steps_down = 0;
  for (int ms = 0; ms < 100 && bench.state() == DriveState::operation_enabled; ++ms) {
    bench.run_ms(1);
    const double limit = bench.get("measured.current_limit");
    EXPECT_LE(limit, last_limit);
    steps_down += limit < last_limit ? 1 : 0;
    last_limit = limit;
  }
  ASSERT_EQ(bench.state(), DriveState::fault);
  EXPECT_GE(steps_down, 1) << "the current limit falls before the trip";
  EXPECT_EQ(bench.get("drive.error_code"), code_of(Fault::motor_too_hot));
  EXPECT_GT(bench.get("drive.fault_value"), 60.0);
  EXPECT_EQ(bench.get("drive.fault_bound"), 60.0);
  EXPECT_GT(bench.get("trip.winding_temperature"), 60.0);
  EXPECT_EQ(bench.get("trip.temperature"), 30.0);
  EXPECT_EQ(bench.get("trip.supply"), 24.0);
  EXPECT_NEAR(bench.get("trip.current"), 3.0, 1e-6);
  // Still hot: it cannot be cleared, and is said to be why it is not armed.
  carry(0.0f);
  bench.clear_fault();
  EXPECT_EQ(bench.refusal(), Refusal::fault_present);
  bench.run_ms(10'000);
  bench.clear_fault();
  EXPECT_EQ(bench.state(), DriveState::switch_on_disabled);
  EXPECT_TRUE(bench.arm());
}

TEST_F(MotorOfABoard, AHotPowerStageHasLessCurrentThenNone) {
  bench.device.board.power_stage_temperature[0] = 90.0f;
  bench.run_ms(20);
  EXPECT_EQ(bench.get("measured.current_limit"), 2.5);
  EXPECT_EQ(bench.get("measured.current_limit", 1), 5.0) << "the other axis has its own";
  bench.preset("force.limit", 1000);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-30'000);
  carry(2.5f);  // as the loop would make it
  bench.run_ticks(5);
  EXPECT_EQ(bench.get("measured.current_reference"), 2.5);
  EXPECT_EQ(static_cast<int>(bench.get("measured.flags")) & 32, 32) << "less force than asked for";
  EXPECT_EQ(static_cast<int>(bench.get("drive.statusword")) & firmware::statusword::internal_limit_active,
            firmware::statusword::internal_limit_active);
}

TEST_F(MotorOfABoard, ASynchronousMotorIsNotArmedBeforeItsAngleIsKnown) {
  make_synchronous();
  EXPECT_EQ(bench.get("measured.commutation_known"), 0);
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::commutation_unknown);
  bench.disarm();
  bench.set("motor.commutation_known", 1);
  EXPECT_EQ(bench.get("measured.commutation_known"), 1);
  EXPECT_TRUE(bench.arm());
}

TEST_F(MotorOfABoard, WhatMakesTheAngleKnown) {
  make_synchronous();
  const auto known = [&] {
    bench.run_ms(1);
    return bench.get("measured.commutation_known") == 1;
  };
  const auto lasting = [&](const char* name) {
    bench.set(name, 1);
    EXPECT_FALSE(known()) << name << ": counts that last are worth nothing before the motor is identified";
    bench.set("motor.calibrated", 1);
    EXPECT_TRUE(known()) << name;
    bench.set(name, 0);
    EXPECT_FALSE(known()) << name;
    bench.set("motor.calibrated", 0);
  };
  ASSERT_FALSE(known());
  lasting("encoder.kind");
  lasting("encoder.start");
  bench.device.referenced[0] = true;
  EXPECT_FALSE(known());
  bench.set("motor.calibrated", 1);
  EXPECT_TRUE(known()) << "the index has been passed";
  bench.device.referenced[0] = false;
  EXPECT_FALSE(known());
  bench.set("motor.kind", 0);
  EXPECT_TRUE(known()) << "a brushed motor commutates itself";
}

TEST_F(MotorOfABoard, WhatWasFoundIsForgottenWithWhatItWasFoundWith) {
  make_synchronous();
  for (const auto& [name, value] : {std::pair("encoder.direction", -1.0),
                                    {"encoder.counts_per_turn", 4096.0},
                                    {"encoder.offset", 7.0},
                                    {"encoder.index", 1.0},
                                    {"motor.pole_pairs", 11.0},
                                    {"motor.electrical_offset", 1.0}}) {
    bench.set("motor.commutation_known", 1);
    ASSERT_EQ(bench.get("measured.commutation_known"), 1) << name;
    bench.set(name, value);
    EXPECT_EQ(bench.get("motor.commutation_known"), 0) << name;
    EXPECT_EQ(bench.get("measured.commutation_known"), 0) << name;
  }
  bench.set("motor.commutation_known", 1);
  bench.set("wall.stiffness", 2000);
  EXPECT_EQ(bench.get("motor.commutation_known"), 1) << "has nothing to do with it";
  ++bench.device.reference_generation[0];
  bench.run_ms(1);
  EXPECT_EQ(bench.get("motor.commutation_known"), 0) << "the counts were referred again";
  bench.set("motor.commutation_known", 1);
  bench.set("store.command", 2);
  EXPECT_EQ(bench.get("motor.commutation_known"), 0) << "the defaults are another motor's";
}

TEST_F(MotorOfABoard, CountsThatWereLostTakeTheAngleWithThem) {
  make_synchronous();
  bench.set("motor.commutation_known", 1);
  ASSERT_TRUE(bench.arm());
  bench.device.valid[0] = false;
  bench.run_ms(1);
  bench.device.valid[0] = true;
  ASSERT_EQ(bench.get("drive.error_code"), code_of(Fault::encoder));
  bench.clear_fault();
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::commutation_unknown);
}

TEST_F(MotorOfABoard, CompensationStaysBelowTheFrictionThatIsKnown) {
  EXPECT_NE(bench.set("compensation.limit", 0.1), 0) << "no friction is known";
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<double>(Refusal::compensation_beyond_friction));
  EXPECT_EQ(bench.set("guard.friction", 0.15), 0);
  EXPECT_EQ(bench.set("compensation.limit", 0.1), 0);
  EXPECT_NE(bench.set("guard.friction", 0.1), 0) << "not below it any more";
  EXPECT_NE(bench.set("compensation.limit", 0.15), 0);
}

TEST_F(MotorOfABoard, ThePlaceOfTheRotorIsNotKeptOverAStart) {
  EXPECT_FALSE(firmware::entry_at(firmware::entry_of<"motor.commutation_known">()).persistent);
  EXPECT_FALSE(firmware::entry_at(firmware::entry_of<"drive.mode">()).persistent);
}

TEST_F(MotorOfABoard, ExcitationNeedsNoWallAndNoAngle) {
  make_synchronous();
  bench.device.stand_at(-1000);  // inside
  bench.set("drive.mode", 1);
  bench.set("excitation.travel", 0.0005);
  bench.run_ms(1);
  ASSERT_TRUE(bench.arm());
  bench.run_ms(5);
  EXPECT_EQ(bench.force(), 0.0f) << "no wall in this mode";
  EXPECT_NE(bench.set("drive.mode", 0), 0) << "not while armed";
  EXPECT_EQ(bench.get("measured.excitation_finished"), 1) << "kind off";

  bench.device.stand_at(-1501);
  bench.run_ticks(2);
  EXPECT_EQ(bench.state(), DriveState::fault);
  EXPECT_EQ(bench.get("drive.error_code"), code_of(Fault::excitation_travel));
  EXPECT_NEAR(bench.get("drive.fault_value"), -0.000501, 1e-9);
  EXPECT_NEAR(bench.get("drive.fault_bound"), 0.0005, 1e-9);
  EXPECT_NEAR(bench.get("trip.position"), -0.001501, 1e-9);
}

TEST_F(MotorOfABoard, ATripKeepsTheNumbersOfItsTick) {
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(1);
  carry(-9.0f);
  bench.device.samples[0].supply_voltage = 21.5f;
  bench.run_ticks(2);
  ASSERT_EQ(bench.state(), DriveState::fault);
  ASSERT_EQ(bench.get("drive.error_code"), code_of(Fault::over_current));
  const double tick = bench.get("trip.tick");
  carry(0.0f);
  bench.device.samples[0].supply_voltage = 24.0f;
  bench.device.stand_at(5000);
  bench.run_ms(30);
  EXPECT_EQ(bench.get("trip.tick"), tick);
  EXPECT_LT(tick, bench.get("measured.tick"));
  EXPECT_NEAR(bench.get("trip.position"), -0.001, 1e-9);
  EXPECT_EQ(bench.get("trip.supply"), 21.5);
  EXPECT_EQ(bench.get("trip.current"), -9.0);
  EXPECT_EQ(bench.get("trip.force"), 1.0);
  bench.clear_fault();
  EXPECT_EQ(bench.get("trip.tick"), 0) << "belongs to the present fault only";
}

TEST_F(MotorOfABoard, AFaultOfTheMainLoopHasItsNumbersToo) {
  ASSERT_TRUE(bench.arm());
  bench.device.board.power_stage_temperature[0] = 101.0f;
  bench.run_ms(2);
  ASSERT_EQ(bench.get("drive.error_code"), code_of(Fault::over_temperature));
  EXPECT_EQ(bench.get("trip.temperature"), 101.0);
  EXPECT_NEAR(bench.get("trip.position"), 0.001, 1e-9);
  EXPECT_GT(bench.get("trip.tick"), 0);
}

TEST_F(MotorOfABoard, ABrokenTemperatureSensorKeepsTheAxisDisarmed) {
  bench.device.board.power_stage_temperature[0] = std::numeric_limits<float>::quiet_NaN();
  bench.run_ms(1);
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::too_hot);
}

TEST_F(MotorOfABoard, ACaptureIsCommandedAndReadThroughTheRegisters) {
  EXPECT_NE(bench.set("capture.command", 1), 0) << "no channel is chosen";
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<double>(Refusal::capture_without_channels));
  bench.set("capture.channel_1", 4);   // count
  bench.set("capture.channel_2", 18);  // distance
  bench.set("capture.samples", 10);
  bench.device.move(1000, 7);
  ASSERT_EQ(bench.set("capture.command", 1), 0);
  bench.run_ms(2);
  ASSERT_EQ(bench.get("capture.state"), 3);
  EXPECT_EQ(bench.get("capture.taken"), 10);
  EXPECT_EQ(bench.get("capture.channels"), 2);
  const Words words = bench.read(4, firmware::capture_window, 40);
  ASSERT_EQ(words.size(), 40u);
  for (std::size_t sample = 1; sample < 10; ++sample) {
    const auto count = [&](std::size_t s) { return words[4 * s] << 16 | words[4 * s + 1]; };
    EXPECT_EQ(count(sample) - count(sample - 1), 7) << sample;
  }
  EXPECT_TRUE(bench.read(4, 0xAFFF, 2).empty()) << "past its end";
  EXPECT_NE(bench.set("capture.command", 2), 0) << "no such command";
}

}  // namespace
}  // namespace kmax::board::application_motor_test
