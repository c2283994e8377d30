#include "host_tools/simulated_board/simulated_power_hardware.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::simulated_power_hardware_test {

using board::OffsetProgress;
using simulation::Defect;

/// The hardware of a scene under the board's own drives, without an application.
struct Plant {
  explicit Plant(simulation::Scene scene) : world(scene) {}
  explicit Plant(const char* name) : Plant(open_scene(name)) {}

  template <firmware::FixedName name>
  void set(double value, std::size_t axis = 0) {
    constexpr std::size_t entry = firmware::entry_of<name>();
    values.set_raw(firmware::slot_of(entry, axis),
                   firmware::raw_from_number(firmware::entry_at(entry).type, value));
    drives.apply(values);
  }
  firmware::AxisInput tick(double duration = 0.0) {
    if (duration > 0.0) world.advance(duration);
    return drives.ISR_measure(0, *this);
  }
  /// A motor without friction that a voltage turns, read all the while.
  firmware::AxisInput turn_for(double seconds) {
    world.set_bridge(0, {{{{true, 0.5}, {true, 0.53}, {true, 0.47}}}});
    firmware::AxisInput input{};
    for (int n = 0; n < std::lround(seconds / 50e-6); ++n) input = tick(50e-6);
    return input;
  }
  void blocked_current(double b_minus_c) {
    world.plant(0, Defect::motor_blocked);
    world.set_bridge(0, {{{{false, 0.0}, {true, 0.5 + b_minus_c / 2}, {true, 0.5 - b_minus_c / 2}}}});
    world.advance(0.01);
  }
  void calibrate() {
    EXPECT_EQ(drives.hardware().configure_gate_driver(0, drives.gain()), board::GateDriverAnswer::accepted);
    drives.restart_offset_calibration();
    for (int n = 0; n < 1024; ++n) {
      EXPECT_EQ(drives.offset_progress(), OffsetProgress::running);
      tick();
    }
    EXPECT_EQ(drives.offset_progress(), OffsetProgress::accepted);
  }
  std::int64_t true_count() const {
    const double turns = world.drive(0).disc_angle() / 6.283185307179586;
    return static_cast<std::int64_t>(std::floor(turns * world.drive(0).encoder().config().counts_per_turn));
  }
  /// Of the stage: nothing is wrong.
  firmware::Fault condition() const { return firmware::Fault::none; }

  simulation::SceneDrives world;
  board::Drives<SimulatedPowerHardware> drives{11.0f, world};
  firmware::ParameterValues values;
};

simulation::Scene turning(const char* name, double start = 0.0) {
  simulation::Scene scene = open_scene(name);
  scene.axes[0].start.position = start;
  // A brushed motor turns under any voltage.
  scene.axes[0].motor = simulation::BrushedDcMotorConfig{};
  return scene;
}

TEST(SimulatedPowerHardware, OffsetsAreMeasuredAndCurrentsReadInSteps) {
  Plant plant("dc_coreless_a");
  plant.set<"current.limit">(3.0);
  plant.calibrate();
  plant.blocked_current(0.2);
  const double current = plant.world.drive(0).currents()[simulation::terminal_b];
  ASSERT_GT(current, 1.5);
  double sum_b = 0, sum_c = 0;
  for (int n = 0; n < 1000; ++n) {
    const auto measured = plant.tick().motor;
    EXPECT_TRUE(measured.present);
    // A code is 20.1 mA at a gain of 80; 10 mA of noise, at most five times that.
    EXPECT_NEAR(static_cast<double>(measured.current_b), current, 0.075);
    EXPECT_NEAR(static_cast<double>(measured.current_c), -current, 0.075);
    sum_b += static_cast<double>(measured.current_b);
    sum_c += static_cast<double>(measured.current_c);
  }
  EXPECT_NEAR(sum_b / 1000, current, 0.006);
  EXPECT_NEAR(sum_c / 1000, -current, 0.006);
}

TEST(SimulatedPowerHardware, OffsetsAreRefusedWhileACurrentChanges) {
  Plant plant("dc_coreless_a");
  ASSERT_EQ(plant.drives.hardware().configure_gate_driver(0, plant.drives.gain()),
            board::GateDriverAnswer::accepted);
  plant.drives.restart_offset_calibration();
  plant.world.plant(0, Defect::motor_blocked);
  for (int n = 0; n < 1024; ++n) {
    plant.world.set_bridge(0, {{{{false, 0.0}, {true, n % 200 < 100 ? 0.6 : 0.4}, {true, 0.5}}}});
    plant.tick(50e-6);
  }
  EXPECT_EQ(plant.drives.offset_progress(), OffsetProgress::refused);
}

TEST(SimulatedPowerHardware, ASaturatedSupplyIsSeen) {
  Plant plant("dc_coreless_a");
  EXPECT_EQ(plant.tick().condition, firmware::Fault::none);
  plant.world.supply().set_source(100.0);
  plant.world.supply().set_voltage(100.0);
  EXPECT_EQ(plant.tick().condition, firmware::Fault::over_voltage);
}

TEST(SimulatedPowerHardware, SupplyIsReadThroughTheDivider) {
  Plant plant("dc_coreless_a");
  for (const double volts : {8.0, 23.7, 30.0}) {
    plant.world.supply().set_voltage(volts);
    const float read = plant.tick().motor.supply_voltage;
    EXPECT_NEAR(static_cast<double>(read), volts, 0.5 * 3.3 / 4096 * 11 + 1e-4);
    EXPECT_EQ(read, plant.drives.readings().supply_voltage);
  }
}

TEST(SimulatedPowerHardware, GateDriversNeedTheirSupply) {
  Plant plant("dc_coreless_a");
  SimulatedPowerHardware& hardware = plant.drives.hardware();
  EXPECT_FALSE(hardware.fault_line_low());
  plant.world.supply().set_voltage(5.0);
  EXPECT_TRUE(hardware.fault_line_low());
  EXPECT_EQ(hardware.configure_gate_driver(0, drivers::CurrentSenseGain::x80),
            board::GateDriverAnswer::silent);
  plant.world.supply().set_voltage(24.0);
  hardware.set_gate_driver_fault(true);
  EXPECT_TRUE(hardware.fault_line_low());
}

TEST(SimulatedPowerHardware, TemperaturesAreThoseOfTheSensors) {
  Plant plant("dc_coreless_a");
  for (const double celsius : {-10.0, 25.0, 90.0}) {
    plant.world.temperature(0).set_temperature(celsius);
    EXPECT_NEAR(static_cast<double>(plant.drives.readings().power_stage_temperature[0]), celsius, 0.1);
  }
  plant.world.temperature(1).set_wiring(simulation::TemperatureSensor::Wiring::open);
  EXPECT_TRUE(std::isnan(plant.drives.readings().power_stage_temperature[1]));
}

TEST(SimulatedPowerHardware, CountsTheLines) {
  Plant plant(turning("dc_coreless_a", 0.01));
  const auto input = plant.turn_for(0.05);
  EXPECT_TRUE(input.count_valid);
  EXPECT_EQ(input.count, static_cast<std::uint32_t>(plant.true_count()));
  EXPECT_GT(plant.true_count(), 700);
}

TEST(SimulatedPowerHardware, TheSerialChipBeginsWithinATurn) {
  for (const double start : {0.0, 0.9, -0.02}) {
    Plant plant(turning("gimbal_a", start));
    plant.set<"encoder.kind">(1);
    const std::int64_t first = plant.true_count();
    const auto input = plant.tick();
    EXPECT_TRUE(input.count_valid);
    EXPECT_LT(input.count, 16384u);
    EXPECT_EQ((static_cast<std::int64_t>(input.count) - first) % 16384, 0);
    const auto later = plant.turn_for(0.05);
    EXPECT_EQ(later.count - input.count, static_cast<std::uint32_t>(plant.true_count() - first));
    EXPECT_NE(later.count, input.count);
  }
}

TEST(SimulatedPowerHardware, OnlyTheInterfaceThatIsNamedIsRead) {
  Plant lines(turning("dc_coreless_a"));
  lines.set<"encoder.kind">(1);
  EXPECT_FALSE(lines.turn_for(0.02).count_valid) << "no chip answers";
  Plant chip(turning("gimbal_a"));
  const auto input = chip.turn_for(0.02);
  EXPECT_TRUE(input.count_valid);
  EXPECT_EQ(input.count, 0u) << "nothing on the lines";
}

TEST(SimulatedPowerHardware, AnUnpluggedCableLooksLikeRestUnlessAnIndexIsWatched) {
  Plant blind(turning("dc_coreless_a"));
  const auto before = blind.turn_for(0.02);
  blind.world.plant(0, Defect::encoder_unplugged);
  const auto after = blind.turn_for(0.02);
  EXPECT_TRUE(after.count_valid);
  EXPECT_EQ(after.count, before.count);

  Plant watched(turning("dc_coreless_a", -0.001));
  watched.set<"encoder.index">(1);
  EXPECT_TRUE(watched.turn_for(0.05).count_valid);
  watched.world.plant(0, Defect::encoder_unplugged);
  EXPECT_FALSE(watched.turn_for(3 * 50e-6).count_valid);

  Plant serial(turning("gimbal_a"));
  serial.set<"encoder.kind">(1);
  EXPECT_TRUE(serial.turn_for(0.02).count_valid);
  serial.world.plant(0, Defect::encoder_unplugged);
  EXPECT_FALSE(serial.turn_for(50e-6).count_valid);
}

TEST(SimulatedPowerHardware, TheAmplifiersSettleWithinWhatTheBoardAllowsTheDuties) {
  for (const auto gain : {drivers::CurrentSenseGain::x10, drivers::CurrentSenseGain::x20,
                          drivers::CurrentSenseGain::x40, drivers::CurrentSenseGain::x80}) {
    constexpr const board::BoardDescription& board = board::odrive_v3::description;
    const simulation::CurrentSensor sensor({.gain = static_cast<double>(drivers::gain_factor(gain))});
    const double duty =
        0.5 + 0.5 * static_cast<double>(board.modulation_limit[static_cast<std::size_t>(gain)]);
    EXPECT_LE(duty, board.largest_duty());
    const double left = sensor.left_after(0.5 * (1.0 - duty) / board.pwm_hz() - board.dead_time());
    EXPECT_LT(left, 0.0135) << drivers::gain_factor(gain);
    EXPECT_GT(left, 0.008) << "or more voltage could be used";
  }
}

TEST(SimulatedPowerHardware, TheCodesAtZeroCurrentAreTheOffsetsWhateverFlows) {
  Plant plant("dc_coreless_a");
  plant.set<"current.limit">(3.0);
  plant.calibrate();
  plant.blocked_current(0.2);
  const auto codes = plant.drives.hardware().zero_current(0);
  EXPECT_NEAR(codes.phase_b, 2048 + 0.006 * 4096 / 3.3, 2.5);
  EXPECT_NEAR(codes.phase_c, 2048 - 0.004 * 4096 / 3.3, 2.5);
}

}  // namespace kmax::simulated_board::simulated_power_hardware_test
