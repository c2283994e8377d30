#include "host_tools/simulated_board/simulated_power_hardware.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::simulated_power_hardware_test {
namespace {

using board::odrive_v3::OffsetProgress;

class PowerHardware : public testing::Test {
 protected:
  PowerHardware() { hardware.set_range(4.5f); }

  void configure() {
    ASSERT_TRUE(hardware.configure_gate_driver(0));
    hardware.restart_offset_calibration();
    for (int n = 0; n < 1024; ++n) {
      EXPECT_EQ(hardware.offset_progress(), OffsetProgress::running);
      static_cast<void>(hardware.measured(0));
    }
    ASSERT_EQ(hardware.offset_progress(), OffsetProgress::accepted);
  }
  void drive_current(double b_minus_c) {
    drives.plant(0, simulation::Defect::motor_blocked);
    drives.set_bridge(0, {{{{false, 0.0}, {true, 0.5 + b_minus_c / 2}, {true, 0.5 - b_minus_c / 2}}}});
    drives.advance(0.01);
  }

  simulation::Scene scene = open_scene("dc_coreless_a");
  simulation::SceneDrives drives{scene};
  SimulatedPowerHardware hardware{drives};
};

TEST_F(PowerHardware, OffsetsAreMeasuredAndCurrentsReadInSteps) {
  configure();
  drive_current(0.2);
  const double current = drives.drive(0).currents()[simulation::terminal_b];
  ASSERT_GT(current, 1.5);
  double sum_b = 0, sum_c = 0;
  for (int n = 0; n < 1000; ++n) {
    const auto measured = hardware.measured(0);
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

TEST_F(PowerHardware, TheGainFollowsTheRangeWhenItIsConfigured) {
  configure();
  EXPECT_EQ(hardware.gain(), drivers::CurrentSenseGain::x80);
  EXPECT_EQ(drives.drive(0).current_sensor().gain(), 80.0);
  hardware.set_range(60.0f);
  EXPECT_TRUE(hardware.gain_has_changed());
  EXPECT_EQ(drives.drive(0).current_sensor().gain(), 80.0);
  ASSERT_TRUE(hardware.configure_gate_driver(0));
  EXPECT_FALSE(hardware.gain_has_changed());
  EXPECT_EQ(drives.drive(0).current_sensor().gain(), 40.0);
}

TEST_F(PowerHardware, OffsetsAreRefusedWhileACurrentChanges) {
  ASSERT_TRUE(hardware.configure_gate_driver(0));
  hardware.restart_offset_calibration();
  drives.plant(0, simulation::Defect::motor_blocked);
  for (int n = 0; n < 1024; ++n) {
    drives.set_bridge(0, {{{{false, 0.0}, {true, n % 200 < 100 ? 0.6 : 0.4}, {true, 0.5}}}});
    drives.advance(50e-6);
    static_cast<void>(hardware.measured(0));
  }
  EXPECT_EQ(hardware.offset_progress(), OffsetProgress::refused);
}

TEST_F(PowerHardware, SaturationOfCurrentAndSupplyIsSeen) {
  configure();
  EXPECT_FALSE(hardware.currents_saturated(0));
  // 24 V into 2.3 ohm are 10 A: within the range; a supply of 100 V is not.
  drives.supply().set_source(100.0);
  drives.supply().set_voltage(100.0);
  drive_current(0.9);
  static_cast<void>(hardware.measured(0));
  EXPECT_TRUE(hardware.currents_saturated(0));
  EXPECT_TRUE(hardware.supply_saturated());
}

TEST_F(PowerHardware, SupplyIsReadThroughTheDivider) {
  for (const double volts : {8.0, 23.7, 30.0}) {
    drives.supply().set_voltage(volts);
    const auto measured = hardware.measured(0);
    EXPECT_NEAR(static_cast<double>(measured.supply_voltage), volts, 0.5 * 3.3 / 4096 * 11 + 1e-4);
    EXPECT_EQ(measured.supply_voltage, hardware.supply_voltage());
    const float codes = measured.supply_voltage / drivers::SupplyDivider({.ratio = 11.0f}).volts_per_code();
    EXPECT_NEAR(static_cast<double>(codes), std::round(static_cast<double>(codes)), 1e-3);
  }
}

TEST_F(PowerHardware, GateDriversNeedTheirSupply) {
  EXPECT_FALSE(hardware.fault_line_low());
  drives.supply().set_voltage(5.0);
  EXPECT_TRUE(hardware.fault_line_low());
  EXPECT_FALSE(hardware.configure_gate_driver(0));
  drives.supply().set_voltage(24.0);
  hardware.set_gate_driver_fault(true);
  EXPECT_TRUE(hardware.fault_line_low());
}

TEST_F(PowerHardware, TemperaturesAreThoseOfTheSensors) {
  for (const double celsius : {-10.0, 25.0, 90.0}) {
    drives.temperature(0).set_temperature(celsius);
    EXPECT_NEAR(static_cast<double>(hardware.temperature(0)), celsius, 0.1);
  }
  drives.temperature(1).set_wiring(simulation::TemperatureSensor::Wiring::open);
  EXPECT_TRUE(std::isnan(hardware.temperature(1)));
  EXPECT_NEAR(static_cast<double>(hardware.temperature(0)), 90.0, 0.1);
}

}  // namespace
}  // namespace kmax::simulated_board::simulated_power_hardware_test
