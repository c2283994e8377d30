#include "host_tools/selftest/selftest.hpp"

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"

namespace kmax::selftest::selftest_test {

using simulation::Defect;

bool is_dc(const std::string& scene) {
  return scene.starts_with("dc_");
}

/// Runs it and checks what must hold in every case.
Report run_and_check(TestedAxis& tested, const std::string& what) {
  tested.link->wait(std::chrono::milliseconds(100));
  const auto before = tested.settings();
  const Report report = tested.run();
  EXPECT_EQ(tested.settings(), before) << what;
  EXPECT_TRUE(tested.disarmed()) << what;
  EXPECT_LE(tested.link->largest_displacement(), 1e-3) << what;
  EXPECT_EQ(report.checks.size(), 9U);
  EXPECT_FALSE(conclusion(report).empty());
  return report;
}

/// What some check has measured under this name.
double value_of(const Report& report, const std::string& name) {
  for (const CheckResult& check : report.checks)
    for (const MeasuredValue& value : check.values)
      if (value.name == name) return value.value;
  ADD_FAILURE() << "no check has measured " << name;
  return std::numeric_limits<double>::quiet_NaN();
}

void expect_part(const std::string& scene, Defect defect, const std::string& part) {
  const std::string what = scene + ", " + std::string(simulation::name_of(defect));
  TestedAxis tested(scene);
  tested.plant(defect);
  // The capacitors of a board that draws nothing would keep the voltage for ever.
  if (defect == Defect::supply_low) tested.drives().supply().set_voltage(12.0);
  const Report report = run_and_check(tested, what);
  EXPECT_EQ(faulty_part(report), part) << what << "\n" << text_of(report);
}

TEST(SelfTest, HealthyAxesPassCalibratedOrNot) {
  for (const char* scene : host_tools_test::motor_scenes) {
    for (const bool identified : {true, false}) {
      TestedAxis tested(scene, identified);
      const Report report = run_and_check(tested, scene);
      EXPECT_EQ(faulty_part(report), "") << scene << " identified " << identified << "\n" << text_of(report);
      for (const CheckResult& check : report.checks)
        EXPECT_EQ(check.verdict, Verdict::pass) << scene << ": " << check.name << ": " << check.message;
      // It has moved, and has told by how much: the encoder's resolution and a moment between ticks.
      EXPECT_GT(report.largest_displacement, 0.0);
      EXPECT_NEAR(report.largest_displacement, tested.link->largest_displacement(), 0.12e-3) << scene;
      EXPECT_EQ(conclusion(report), "No fault was found.");
    }
  }
}

TEST(SelfTest, BothAxesOfABoardWithTwoMotors) {
  for (const std::size_t axis : {0U, 1U}) {
    TestedAxis tested("motor_axes", true, axis);
    const Report report = run_and_check(tested, "motor_axes");
    EXPECT_EQ(faulty_part(report), "") << axis << "\n" << text_of(report);
  }
}

TEST(SelfTest, AnOpenPhaseIsNamed) {
  for (const char* scene : host_tools_test::motor_scenes) {
    const char* circuit = "motor winding or cable (B to C open)";
    // A DC motor has no lead at A.
    if (!is_dc(scene)) expect_part(scene, Defect::phase_a_open, "phase A (open)");
    expect_part(scene, Defect::phase_b_open, is_dc(scene) ? circuit : "phase B (open)");
    expect_part(scene, Defect::phase_c_open, is_dc(scene) ? circuit : "phase C (open)");
  }
}

TEST(SelfTest, AnInvertedCurrentSensorIsNamed) {
  for (const char* scene : host_tools_test::motor_scenes) {
    expect_part(scene, Defect::current_b_inverted, "current sensor B");
    expect_part(scene, Defect::current_c_inverted, "current sensor C");
  }
}

TEST(SelfTest, ADeadCurrentSensorIsNamed) {
  for (const char* scene : host_tools_test::motor_scenes) {
    for (const bool of_b : {true, false}) {
      TestedAxis tested(scene);
      using Channel = simulation::CurrentSensor::Channel;
      tested.drives().drive(0).current_sensor().short_inputs(of_b ? Channel::b : Channel::c, true);
      const Report report = run_and_check(tested, scene);
      EXPECT_EQ(faulty_part(report), of_b ? "current sensor B" : "current sensor C") << scene << "\n"
                                                                                     << text_of(report);
    }
  }
}

TEST(SelfTest, ADeadEncoderIsToldFromABlockedHandle) {
  for (const char* scene : host_tools_test::motor_scenes) {
    expect_part(scene, Defect::encoder_stuck, "encoder");
    expect_part(scene, Defect::encoder_unplugged, "encoder");
    expect_part(scene, Defect::motor_blocked, "handle (blocked or held)");
  }
}

TEST(SelfTest, ASlippingEncoderIsNamed) {
  for (const char* scene : host_tools_test::motor_scenes)
    expect_part(scene, Defect::encoder_slipping, "encoder (slips or wrong scale)");
}

TEST(SelfTest, AWrongDirectionIsNamed) {
  for (const char* scene : host_tools_test::motor_scenes) {
    const char* either = "direction of the encoder or the motor leads";
    expect_part(scene, Defect::encoder_reversed, is_dc(scene) ? either : "direction of the encoder");
    expect_part(scene, Defect::phases_swapped,
                is_dc(scene) ? either : "order of the phases or motor.electrical_offset");
  }
}

TEST(SelfTest, ASupplyOutsideItsLimitsIsNamed) {
  for (const char* scene : host_tools_test::motor_scenes) {
    expect_part(scene, Defect::supply_low, "supply");
    for (const double voltage : {0.0, 12.0, 27.0}) {
      TestedAxis tested(scene);
      tested.drives().supply().set_source(voltage);
      tested.drives().supply().set_voltage(voltage);
      const Report report = run_and_check(tested, scene);
      EXPECT_EQ(faulty_part(report), "supply") << scene << " " << voltage << "\n" << text_of(report);
      // What stands behind it is not blamed too.
      for (const CheckResult& check : report.checks)
        EXPECT_TRUE(check.name == "supply" || check.verdict != Verdict::fail)
            << check.name << ": " << check.message;
    }
  }
}

TEST(SelfTest, AnOpenEmergencyStopIsNamed) {
  TestedAxis tested("gimbal_b");
  tested.link->hardware().power().press_emergency_stop(true);
  const Report report = run_and_check(tested, "emergency stop");
  EXPECT_EQ(faulty_part(report), "emergency stop") << text_of(report);
  EXPECT_EQ(report.checks.at(7).verdict, Verdict::not_judged);
  EXPECT_EQ(tested.link->largest_displacement(), 0.0);
}

TEST(SelfTest, AGateDriverThatReportsAFaultIsNamed) {
  TestedAxis tested("dc_coreless_a");
  tested.link->hardware().power().set_gate_driver_fault(true);
  const Report report = run_and_check(tested, "gate driver");
  EXPECT_EQ(faulty_part(report), "gate driver") << text_of(report);
}

TEST(SelfTest, ABrokenTemperatureSensorIsNamed) {
  using Wiring = simulation::TemperatureSensor::Wiring;
  for (const Wiring wiring : {Wiring::open, Wiring::shorted}) {
    TestedAxis tested("dc_coreless_a");
    tested.drives().temperature(0).set_wiring(wiring);
    const Report report = run_and_check(tested, "temperature sensor");
    EXPECT_EQ(faulty_part(report), "temperature sensor") << text_of(report);
  }
}

TEST(SelfTest, AHotPowerStageIsNamed) {
  TestedAxis tested("dc_coreless_a");
  tested.drives().temperature(0).set_temperature(115.0);
  const Report report = run_and_check(tested, "hot");
  EXPECT_EQ(faulty_part(report), "power stage (too hot)") << text_of(report);
}

TEST(SelfTest, AnAxisWithItsForceOnIsLeftAlone) {
  TestedAxis tested("dc_coreless_a");
  device::Drive drive(*tested.device, 0);
  drive.arm();
  EXPECT_THROW(tested.run(), base::DeviceError);
  EXPECT_TRUE(drive.status().armed());
  drive.disarm();
}

TEST(SelfTest, LostMessagesAreTheLinksFault) {
  TestedAxis tested("dc_coreless_a");
  Probe probe(*tested.device, 0, [](const std::string&) {});
  tested.link->lose_every(20);
  Evidence evidence;
  evidence.link = probe.try_link(50);
  tested.link->lose_every(0);
  EXPECT_GE(evidence.link.lost, 2);
  EXPECT_EQ(check_link(evidence).verdict, Verdict::fail);
  EXPECT_EQ(check_link(evidence).part, "link");
}

TEST(SelfTest, ATripInTheMidstOfASwingIsReportedAndLeavesNothingBehind) {
  // The emergency stop is pressed while the motor swings.
  TestedAxis tested("gimbal_b");
  const auto before = tested.settings();
  int pulses = 0;
  SelfTestSettings settings;
  const Report report = run_selftest(*tested.device, settings, [&](const std::string& text) {
    if (text.starts_with("a pulse") && ++pulses == 9) {
      tested.link->before_tick = [&tested] {
        if (std::abs(tested.link->hardware().handle(0).velocity()) < 0.01) return;
        tested.link->hardware().power().press_emergency_stop(true);
      };
    }
  });
  tested.link->before_tick = {};
  EXPECT_EQ(faulty_part(report), "emergency stop") << text_of(report);
  EXPECT_TRUE(tested.disarmed());
  EXPECT_EQ(tested.settings(), before);
}

// A swing at part of the current takes 3 % of this supply, and the motor held at current.limit more than it
// has.
TEST(SelfTestSupply, IsJudgedByWhatItGivesAtTheCurrentLimit) {
  for (const double resistance : {3.0, 5.0}) {
    simulation::Scene scene = TestedAxis::opened("dc_coreless_a", true);
    scene.supply->resistance = resistance;
    const Report report = TestedAxis(scene, 0).run();
    EXPECT_EQ(faulty_part(report), resistance > 4.0 ? "supply" : "") << text_of(report);
    EXPECT_NE(text_of(report).find("with the motor held at current.limit"), std::string::npos);
    EXPECT_NEAR(value_of(report, "source_resistance") / resistance, 1.0, 0.1);
  }
}

}  // namespace kmax::selftest::selftest_test
