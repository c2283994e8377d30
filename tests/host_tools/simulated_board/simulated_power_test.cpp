#include "host_tools/simulated_board/simulated_power.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::simulated_power_test {

using firmware::Fault;
using firmware::Refusal;
using simulation::Defect;

// The whole loop of each supplied motor, told the truth: the force that the wall asks for arrives, within the
// steps of the converter, and so fast as current.bandwidth says. Also at other places of the turn, where a
// wrong electrical angle would show, and to the other side.
TEST(SimulatedPower, TheForceOfTheWallArrivesThroughEveryMotor) {
  struct Case {
    const char* name;
    double start = 0.0, side = 1.0;
  };
  for (const auto& [name, start, side] :
       {Case{"dc_coreless_a"}, Case{"dc_coreless_b"}, Case{"gimbal_a"}, Case{"gimbal_b"}, Case{"drone"},
        Case{"dc_coreless_a", 0.0, -1.0}, Case{"gimbal_a", 0.0011}, Case{"gimbal_a", 0.0047, -1.0},
        Case{"gimbal_b", 0.03}}) {
    SCOPED_TRACE(testing::Message() << name << " at " << start << " side " << side);
    simulation::Scene scene = identified(name);
    scene.axes[0].start.position = start;
    MotorBench bench(scene);
    bench.drives().plant(0, Defect::motor_blocked);
    bench.prepare_wall(side);
    ASSERT_TRUE(bench.arm()) << firmware::to_string(bench.application().refusal(0));
    bench.run(0.01);
    EXPECT_NEAR(bench.current_force(), 0.0, 0.12);
    for (const double force : {2.0, 0.5, 3.0}) {
      bench.set_wall_force(force);
      bench.run(0.01);
      double sum = 0.0, squares = 0.0;
      constexpr int ticks = 4000;
      for (int n = 0; n < ticks; ++n) {
        bench.tick();
        const double made = side * bench.current_force();
        sum += made;
        squares += made * made;
      }
      const double mean = sum / ticks;
      EXPECT_NEAR(static_cast<double>(bench.report().haptic.force), side * force, 1e-3);
      EXPECT_NEAR(mean, force, 0.015);
      EXPECT_LT(squares / ticks - mean * mean, 0.05 * 0.05) << "ripple";
    }
    EXPECT_TRUE(bench.armed());
  }
}

TEST(SimulatedPower, AStepOfTheForceRisesWithTheBandwidth) {
  for (const char* name : calibration_scenes) {
    MotorBench bench(identified(name));
    bench.drives().plant(0, Defect::motor_blocked);
    bench.set<"current.bandwidth">(2000.0);
    // Without it the drone motor's current crosses the dead time's band slowly: 17 ticks.
    bench.set<"compensation.dead_time">(125e-9);
    bench.prepare_wall();
    ASSERT_TRUE(bench.arm()) << name;
    bench.run(0.01);
    const double begin = bench.current_force();
    bench.set_wall_force(3.0);
    bench.tick();  // the tick that still knows the old settings
    int ticks = 0;
    while (bench.current_force() < begin + 0.632 * (3.0 - begin) && ticks < 1000) bench.tick(), ++ticks;
    // 1 / bandwidth is 10 ticks; sampling, the half tick of the PWM and the mean of the last half tick are
    // two.
    EXPECT_NEAR(ticks, 11, 3) << name;
  }
}

TEST(SimulatedPower, TheSameSceneGivesTheSameBits) {
  const auto record = [](std::uint64_t seed) {
    simulation::Scene scene = identified("gimbal_b");
    scene.seed = seed;
    MotorBench bench(scene);
    bench.prepare_wall();
    EXPECT_TRUE(bench.arm());
    bench.set_wall_force(1.0);
    std::vector<double> forces;
    for (int n = 0; n < 2000; ++n) {
      bench.tick();
      forces.push_back(bench.drive().force());
    }
    return forces;
  };
  const auto first = record(14);
  EXPECT_EQ(first, record(14));
  EXPECT_NE(first, record(15)) << "the noise has another seed";
}

TEST(SimulatedPower, IsReadyWhenTheOffsetsAreMeasured) {
  MotorBench bench(identified("gimbal_a"));
  bench.run(0.07);
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.application().refusal(0), Refusal::power_stage_not_ready);
  bench.set<"wall.law">(0);
  bench.run(0.01);
  EXPECT_TRUE(bench.arm());
}

simulation::Scene both_axes(std::size_t missing) {
  simulation::Scene scene = open_scene("motor_axes");
  scene.axes[missing].defects.push_back(Defect::gate_driver_missing);
  return scene;
}

// Its converter's pins float, so its offsets would never be accepted; the other axis renders all the same.
TEST(SimulatedPower, AnAxisWhoseGateDriverNeverAnswersIsAbsentAndTheOtherRenders) {
  for (const std::size_t missing : {0U, 1U}) {
    const std::size_t there = 1 - missing;
    MotorBench bench(both_axes(missing));
    bench.set<"wall.law">(0, missing);
    bench.run(0.4);
    EXPECT_FALSE(bench.arm(there));
    EXPECT_EQ(bench.application().refusal(there), Refusal::power_stage_not_ready) << "it is still tried";
    bench.run(0.3);
    EXPECT_FALSE(bench.arm(missing));
    EXPECT_EQ(bench.application().refusal(missing), Refusal::axis_absent);
    if (there == 1) bench.set<"motor.calibrated">(1, there);
    ASSERT_TRUE(bench.arm(there)) << firmware::to_string(bench.application().refusal(there));
    bench.run(1.0);
    EXPECT_TRUE(bench.armed(there));
    EXPECT_GT(bench.report(there).haptic.force, 0.3f) << "the wall";
    EXPECT_EQ(bench.application().fault(missing), Fault::none);
    bench.application().refresh_readings();
    EXPECT_EQ(bench.application().values().whole<"drive.presence">(missing), 1);
    EXPECT_EQ(bench.application().values().whole<"drive.presence">(there), 0);
  }
}

TEST(SimulatedPower, AGateDriverThatFallsSilentLaterIsAFaultOfTheBoard) {
  MotorBench bench(open_scene("motor_axes"));
  bench.run(0.3);
  bench.drives().plant(1, Defect::gate_driver_missing);
  bench.power().set_gate_driver_fault(true);
  bench.power().set_gate_driver_fault(false);
  bench.run(2.0);
  for (const std::size_t axis : {0U, 1U}) {
    EXPECT_FALSE(bench.arm(axis));
    EXPECT_EQ(bench.application().refusal(axis), Refusal::power_stage_not_ready);
  }
}

/// A hand turns the motor of an axis with up to so many m/s at the handle, or holds it.
void turn(MotorBench& bench, double speed, std::size_t axis = 0) {
  bench.drive(axis).hold(speed == 0.0);
  bench.drive(axis).push(20.0 * speed, speed == 0.0 ? 0.0 : 20.0);
}

// DRV8301: it does not start while a phase is above 8.5 V, which a motor that is turned makes.
TEST(SimulatedPower, AGateDriverThatIsResetWhileItsMotorIsTurnedFastStartsWhenItStands) {
  struct Turned {
    double speed, limit;
    bool starts;
  };
  for (const auto& [speed, limit, starts] : {Turned{1.0, 8.5, true}, {1.6, 8.5, false}, {1.6, 0.0, true}}) {
    simulation::Scene scene = identified("gimbal_b");
    scene.axes[0].inverter.start_limit = limit;
    MotorBench bench(scene);
    bench.set<"wall.law">(0);
    bench.run(0.3);
    ASSERT_TRUE(bench.arm());
    bench.disarm();
    turn(bench, speed);
    bench.run(0.1);
    bench.power().set_gate_driver_fault(true);
    bench.run(0.01);
    bench.power().set_gate_driver_fault(false);
    bench.run(0.6);
    bench.clear();
    EXPECT_EQ(bench.arm(), starts) << speed;
    EXPECT_EQ(bench.application().refusal(0), starts ? Refusal::none : Refusal::power_stage_not_ready);
    bench.disarm();
    turn(bench, 0.0);
    bench.run(0.6);
    EXPECT_TRUE(bench.arm()) << firmware::to_string(bench.application().refusal(0));
  }
}

TEST(SimulatedPower, AnAxisThatIsTurnedWhileTheBoardStartsIsNotTakenForAbsent) {
  simulation::Scene scene = open_scene("motor_axes");
  for (simulation::SceneAxis& axis : scene.axes) {
    axis.motion.reset();
    axis.person.reset();
    axis.inverter.start_limit = 1.0;
  }
  MotorBench bench(scene);
  bench.set<"wall.law">(0, 1);
  turn(bench, 2.0, 1);
  bench.run(2.0);
  EXPECT_FALSE(bench.arm(0)) << "the drivers share a line";
  turn(bench, 0.0, 1);
  bench.run(0.6);
  bench.application().refresh_readings();
  EXPECT_EQ(bench.application().values().whole<"drive.presence">(1), 0);
  bench.set<"wall.law">(0, 0);
  EXPECT_TRUE(bench.arm(0)) << firmware::to_string(bench.application().refusal(0));
}

TEST(SimulatedPower, AnAxisIsDeclaredAbsentAndTakenBackWhileNothingIsArmed) {
  MotorBench bench(open_scene("motor_axes"));
  bench.set<"wall.law">(0, 0);
  bench.run(0.3);
  ASSERT_TRUE(bench.arm(0)) << firmware::to_string(bench.application().refusal(0));
  EXPECT_EQ(bench.set<"drive.declared_absent">(1, 0), Refusal::while_armed);
  bench.disarm(0);
  ASSERT_EQ(bench.set<"drive.declared_absent">(1, 0), Refusal::none);
  bench.run(0.3);
  EXPECT_FALSE(bench.arm(0));
  EXPECT_EQ(bench.application().refusal(0), Refusal::axis_absent);
  ASSERT_EQ(bench.set<"drive.declared_absent">(0, 0), Refusal::none);
  bench.run(200e-6);
  EXPECT_FALSE(bench.arm(0));
  EXPECT_EQ(bench.application().refusal(0), Refusal::power_stage_not_ready) << "its driver is written again";
  bench.run(0.3);
  EXPECT_TRUE(bench.arm(0)) << firmware::to_string(bench.application().refusal(0));
}

TEST(SimulatedPower, AnotherGainIsTakenThroughTheWholeSequence) {
  MotorBench bench(identified("drone"));
  bench.set<"wall.law">(0);
  bench.run(0.1);
  EXPECT_EQ(bench.power().gain(), drivers::CurrentSenseGain::x80);
  bench.set<"current.limit">(60.0);
  bench.run(0.01);
  EXPECT_EQ(bench.power().gain(), drivers::CurrentSenseGain::x20);
  EXPECT_FALSE(bench.arm());
  bench.run(0.1);
  EXPECT_EQ(bench.drive().current_sensor().gain(), 20.0);
  EXPECT_TRUE(bench.arm());
}

// Armed, with a force of 2 N.
struct PoweredBench {
  PoweredBench() : bench(identified("gimbal_a")) {
    bench.drives().plant(0, Defect::motor_blocked);
    bench.prepare_wall();
    EXPECT_TRUE(bench.arm());
    bench.set_wall_force(2.0);
    bench.run(0.02);
    EXPECT_NEAR(bench.current_force(), 2.0, 0.1);
  }
  bool legs_off() {
    const auto& legs = bench.drives().bridge(0).legs;
    return std::none_of(legs.begin(), legs.end(), [](const auto& leg) { return leg.enabled; });
  }
  void expect_trip(Fault fault) {
    bench.run(0.005);
    EXPECT_FALSE(bench.armed());
    EXPECT_EQ(bench.application().fault(0), fault);
    EXPECT_TRUE(legs_off());
    EXPECT_NEAR(bench.current_force(), 0.0, 1e-6);
  }
  void expect_recovery() {
    bench.run(0.3);
    bench.clear();
    bench.set_wall_force(0.0);
    EXPECT_TRUE(bench.arm()) << firmware::to_string(bench.application().refusal(0));
  }

  MotorBench bench;
};

TEST(PowerLines, SupplyLoss) {
  PoweredBench power;
  MotorBench& bench = power.bench;
  bench.drives().supply().disconnect();
  bench.run(0.5);
  EXPECT_EQ(bench.application().fault(0), Fault::under_voltage);
  EXPECT_TRUE(power.legs_off());
  // Empty, the gate drivers have no supply either.
  bench.drives().supply().set_voltage(3.0);
  bench.run(0.01);
  bench.clear();
  EXPECT_FALSE(bench.arm());
  bench.drives().supply().connect();
  power.expect_recovery();
}

TEST(PowerLines, EachFaultTakesTheForceAwayAndNoneIsClearedBeforeItsCause) {
  struct Case {
    const char* name;
    Fault fault;
    void (*cause)(MotorBench&);
    void (*mend)(MotorBench&);  // if it can be
    bool remains = false;       // until then
  };
  for (const Case& one : {
           Case{"emergency stop", Fault::emergency_stop,
                [](MotorBench& bench) { bench.power().press_emergency_stop(true); },
                [](MotorBench& bench) { bench.power().press_emergency_stop(false); }, true},
           Case{"gate driver", Fault::gate_driver,
                [](MotorBench& bench) { bench.power().set_gate_driver_fault(true); },
                [](MotorBench& bench) { bench.power().set_gate_driver_fault(false); }, true},
           Case{"hot power stage", Fault::over_temperature,
                [](MotorBench& bench) { bench.drives().temperature(0).set_temperature(110.0); },
                [](MotorBench& bench) { bench.drives().temperature(0).set_temperature(40.0); }, true},
           Case{"supply too low", Fault::under_voltage,
                [](MotorBench& bench) { bench.drives().plant(0, Defect::supply_low); },
                [](MotorBench& bench) { bench.drives().mend(0, Defect::supply_low); }},
           Case{"supply too high", Fault::over_voltage,
                [](MotorBench& bench) {
                  bench.drives().supply().set_source(27.0);
                  bench.drives().supply().set_voltage(27.0);
                },
                nullptr},
           Case{"a serial encoder that falls silent", Fault::encoder,
                [](MotorBench& bench) { bench.drives().plant(0, Defect::encoder_unplugged); },
                [](MotorBench& bench) { bench.drives().mend(0, Defect::encoder_unplugged); }},
           Case{"a bridge that falls without a cause", Fault::power_stage,
                [](MotorBench& bench) { bench.power().break_bridge(0); }, [](MotorBench&) {}},
       }) {
    SCOPED_TRACE(one.name);
    PoweredBench power;
    MotorBench& bench = power.bench;
    one.cause(bench);
    if (one.fault == Fault::emergency_stop) {
      bench.tick();
      EXPECT_TRUE(power.legs_off()) << "without waiting for the tick";
    }
    power.expect_trip(one.fault);
    if (one.remains) {
      bench.run(0.5);
      bench.clear();
      EXPECT_FALSE(bench.arm());
      EXPECT_EQ(bench.application().fault(0), one.fault) << "a cause that remains cannot be cleared";
    }
    if (one.mend == nullptr) continue;
    one.mend(bench);
    power.expect_recovery();
  }
}

TEST(PowerLines, AnOpenPhase) {
  PoweredBench power;
  MotorBench& bench = power.bench;
  bench.drives().plant(0, Defect::phase_b_open);
  bench.run(0.1);
  EXPECT_FALSE(bench.armed());
  EXPECT_EQ(bench.application().fault(0), Fault::phase_open);
}

TEST(SimulatedPower, AMotorThatBrakesIsTakenByTheBrakeResistor) {
  simulation::Scene scene = identified("dc_coreless_a");
  scene.axes[0].start.velocity = 0.0;
  const auto highest = [&](double brake_voltage) {
    MotorBench bench(scene);
    bench.set<"supply.brake_voltage">(brake_voltage);
    bench.prepare_wall();
    EXPECT_TRUE(bench.arm());
    double most = 0.0;
    bench.drives().supply().set_voltage(25.4);
    for (int n = 0; n < 2000; ++n) {
      bench.tick();
      if (n > 1000) most = std::max(most, bench.drives().supply().voltage());
    }
    return std::pair{most, bench.drives().supply().brake_energy()};
  };
  EXPECT_GT(highest(0.0).first, 25.2) << "no resistor is fitted";
  EXPECT_LT(highest(25.0).first, 25.1);
  EXPECT_GT(highest(25.0).second, 0.01);
}

/// A heavy handle without friction that nobody holds.
MotorBench heavy_handle(bool for_24_v) {
  simulation::Scene scene = identified("dc_coreless_a");
  scene.axes[0].device.mass = 0.5;
  scene.axes[0].device.friction = 0.0;
  scene.axes[0].device.damping = 0.0;
  scene.axes[0].person.reset();
  scene.axes[0].motion.reset();
  scene.supply->voltage = for_24_v ? 24.0 : 56.0;
  scene.supply->divider_ratio = for_24_v ? 11.0 : 19.0;
  return MotorBench(scene);
}

/// The motor speeds it up and brakes it: its energy goes into the supply, which takes nothing back.
TEST(PartRatings, AMotorThatBrakesTripsAtTheBoardsCeilingBeforeAPartBreaks) {
  for (const bool for_24_v : {true, false}) {
    MotorBench bench = heavy_handle(for_24_v);
    const auto variant = *bench.drives().variant();
    const auto ceiling = static_cast<double>(board::odrive_v3::supply_ceiling(variant));
    EXPECT_EQ(bench.set<"supply.voltage_max">(ceiling + 0.1), firmware::Refusal::supply_above_ceiling);
    ASSERT_EQ(bench.set<"supply.voltage_max">(ceiling), firmware::Refusal::none);
    bench.set<"drive.mode">(2);
    bench.set<"velocity.limit">(10.0);
    bench.set<"force.ramp_time">(0.0);
    bench.set<"device.hand_force">(0.0);
    bench.run(0.1);
    ASSERT_TRUE(bench.arm());
    bench.set<"profile.target_force">(1.5);
    bench.run(0.6);
    ASSERT_TRUE(bench.armed());
    bench.set<"profile.target_force">(-1.5);
    double highest = 0.0;
    for (int n = 0; n < 8000; ++n) {
      bench.tick();
      highest = std::max(highest, bench.drives().supply().voltage());
    }
    EXPECT_EQ(bench.application().fault(0), Fault::over_voltage);
    EXPECT_GT(highest, ceiling - 0.05) << "a converter's step is 0.015 V";
    EXPECT_LT(highest, ceiling + 0.5)
        << "the weakest part bears " << board::odrive_v3::part_ratings(variant).weakest();
  }
}

TEST(PartRatings, ASupplyAboveThemEndsTheRunWithThePartsName) {
  for (const auto& [for_24_v, volts, part] :
       {std::tuple{true, 28.9, "capacitors of the 24 V board"}, {false, 60.1, "MOSFETs of the 56 V board"}}) {
    MotorBench bench = heavy_handle(for_24_v);
    bench.drives().supply().set_voltage(volts - 0.3);
    bench.tick();
    bench.drives().supply().set_voltage(volts);
    try {
      bench.tick();
      ADD_FAILURE() << volts;
    } catch (const simulation::PartBroken& broken) {
      EXPECT_NE(std::string(broken.what()).find(part), std::string::npos) << broken.what();
    }
  }
  simulation::Scene scene = identified("dc_coreless_a");
  scene.supply->part_ratings = false;
  MotorBench bench(scene);
  bench.drives().supply().set_voltage(90.0);
  bench.tick();
}

// A save may stop the processor for half a second, and nobody would switch the resistor off.
TEST(SimulatedPower, TheBrakeResistorIsOffWhileASaveIsUnderWay) {
  MotorBench bench(identified("dc_coreless_a"));
  bench.set<"supply.brake_voltage">(25.0);
  bench.prepare_wall();
  ASSERT_TRUE(bench.arm());
  const auto brakes_for = [&bench] {
    bench.drives().supply().set_voltage(25.4);
    const double before = bench.drives().supply().brake_energy();
    bench.tick();
    bench.tick();
    return bench.drives().supply().brake_energy() > before;
  };
  EXPECT_TRUE(brakes_for());
  bench.disarm();
  EXPECT_TRUE(brakes_for()) << "a moment after driving";
  const std::uint16_t command = firmware::modbus_address(firmware::entry_of<"store.command">(), 0);
  bench.board().receive(firmware::modbus::adu(
      1, {6, static_cast<std::uint8_t>(command >> 8), static_cast<std::uint8_t>(command), 0, 1}));
  for (int n = 0; n < 400 && !bench.application().store_busy(); ++n) bench.tick();
  ASSERT_TRUE(bench.application().store_busy());
  EXPECT_FALSE(brakes_for());
}

/// A blocked motor at a gain of 80 whose wall asks for `force`, N.
struct SenseBench : MotorBench {
  explicit SenseBench(const simulation::CurrentSensorConfig& sensor, double force = 2.0,
                      double resistance = 2.3, const char* name = "dc_coreless_a")
      : MotorBench(scene_of(sensor, resistance, name)) {
    drives().plant(0, Defect::motor_blocked);
    set<"current.limit">(5.0);
    set<"force.limit">(20.0);
    prepare_wall(force < 0.0 ? -1.0 : 1.0);
    EXPECT_EQ(power().gain(), drivers::CurrentSenseGain::x80);
    EXPECT_TRUE(arm()) << firmware::to_string(application().refusal(0));
    set_wall_force(std::abs(force));
    run(0.05);
  }
  void heat(double from, double to, double rate) {
    constexpr double step = 0.01;
    const int steps = static_cast<int>(std::lround((to - from) / (rate * step)));
    for (int n = 1; n <= steps; ++n) {
      drive().current_sensor().set_temperature(from + n * rate * step);
      run(step);
    }
  }
  double current() { return drive().currents()[simulation::terminal_b]; }
  /// A, what the firmware measures, less what makes the force; the mean of 0.1 s.
  double error() {
    const double newton_per_ampere =
        static_cast<double>(application().values().real<"motor.torque_constant">(0)) /
        drive().encoder().config().transmission;
    double sum = 0.0;
    for (int n = 0; n < 2000; ++n) {
      tick();
      sum += static_cast<double>(report().motor.current) - current_force() / newton_per_ampere;
    }
    return sum / 2000;
  }

 private:
  static simulation::Scene scene_of(const simulation::CurrentSensorConfig& sensor, double resistance,
                                    const char* name) {
    simulation::Scene scene = identified(name);
    scene.axes[0].current_sensor = sensor;
    if (auto* brushed = std::get_if<simulation::BrushedDcMotorConfig>(&*scene.axes[0].motor))
      brushed->resistance = resistance;
    return scene;
  }
};

// The DRV8301's amplifiers may be off by 4 mV at their inputs.
TEST(CurrentAmplifiers, AreAcceptedWithinTheirDataSheetAtEveryGain) {
  struct Case {
    double limit, gain;
  };
  for (const auto& [limit, gain] : {Case{5.0, 80.0}, Case{30.0, 40.0}, Case{60.0, 20.0}, Case{120.0, 10.0}}) {
    for (const double millivolt : {3.9, -3.9, 6.0}) {
      SCOPED_TRACE(testing::Message() << millivolt << " mV, gain " << gain);
      simulation::Scene scene = identified("dc_coreless_a");
      scene.axes[0].current_sensor.offset_c = millivolt * 1e-3 * gain;
      MotorBench bench(scene);
      bench.set<"current.limit">(limit);
      bench.set<"wall.law">(0);
      bench.run(0.2);
      EXPECT_EQ(bench.drive().current_sensor().gain(), gain);
      EXPECT_EQ(bench.arm(), std::abs(millivolt) < 4.0);
    }
  }
}

TEST(CurrentAmplifiers, ABoardThatWarmsUpKeepsItsForceAndDoesNotTrip) {
  for (const double c_against_b : {1.0, -1.0}) {
    SenseBench bench({.drift_b = 10e-6, .drift_c = c_against_b * 10e-6});
    bench.heat(25.0, 65.0, 2.0);
    ASSERT_TRUE(bench.armed()) << firmware::text_of(bench.application().fault(0)).name;
    EXPECT_NEAR(bench.error(), 0.0, 0.02) << "a code; the drift alone is 0.8 A";
    EXPECT_NEAR(bench.current_force(), 2.0, 0.06);
  }
  SenseBench synchronous({}, 2.0, 0.0, "gimbal_a");
  synchronous.heat(25.0, 65.0, 2.0);
  ASSERT_TRUE(synchronous.armed());
  EXPECT_NEAR(synchronous.error(), 0.0, 0.02);
}

// All at once, and at the largest current.
TEST(CurrentAmplifiers, TheWorstBoardDoesNotTrip) {
  for (const double sign : {1.0, -1.0}) {
    SenseBench bench({.noise = 5e-6,
                      .offset_b = 0.25,
                      .offset_c = -0.25,
                      .drift_b = 15e-6,
                      .drift_c = 15e-6,
                      .driven_b = sign * 0.1e-3,
                      .driven_c = sign * 0.1e-3,
                      .gain_error_b = 0.03,
                      .gain_error_c = -0.03},
                     sign * 11.5);
    EXPECT_NEAR(bench.current(), sign * 4.9, 0.25);
    bench.heat(25.0, 85.0, 3.0);
    EXPECT_TRUE(bench.armed()) << firmware::text_of(bench.application().fault(0)).name;
    EXPECT_NEAR(bench.error(), 0.0, 0.05);
  }
}

// 0.1 mV are 0.2 A at once when driving begins, and 0.8 N of a small gimbal motor.
TEST(CurrentAmplifiers, TheZeroThatDrivingMovesIsFoundInMilliseconds) {
  for (const double sign : {1.0, -1.0}) {
    SenseBench bench({.driven_b = sign * 0.1e-3, .driven_c = -sign * 0.1e-3});
    EXPECT_NEAR(bench.error(), 0.0, 0.01) << "the mean from 50 to 150 ms behind arming";
    bench.set_wall_force(0.0);
    bench.disarm(0);
    bench.run(0.05);
    ASSERT_TRUE(bench.arm());
    bench.run(0.05);
    EXPECT_NEAR(bench.error(), 0.0, 0.01);
  }
}

// 0.6 mV, 60 codes, are no zero that driving moves, even where the sum's watch takes 17 ms for its verdict.
TEST(CurrentAmplifiers, ASensorThatFailsWhenDrivingBeginsIsNotTakenForAZeroThatMoves) {
  simulation::Scene scene = identified("dc_coreless_a");
  for (const double driven : {0.6e-3, -0.6e-3}) {
    scene.axes[0].current_sensor.driven_c = driven;
    MotorBench bench(scene);
    bench.set<"current.limit">(5.0);
    bench.set<"current.bandwidth">(300.0);
    bench.set<"wall.law">(0);
    bench.run(0.2);
    ASSERT_EQ(bench.drive().current_sensor().gain(), 80.0);
    ASSERT_TRUE(bench.arm());
    bench.run(0.1);
    EXPECT_FALSE(bench.armed());
    EXPECT_EQ(bench.application().fault(0), Fault::current_sum);
  }
}

TEST(CurrentAmplifiers, AnOffsetThatLeavesItsWindowTakesTheForceAway) {
  SenseBench bench({.offset_b = 0.3, .drift_b = 20e-6});
  bench.heat(25.0, 35.0, 5.0);
  EXPECT_TRUE(bench.armed()) << "3.95 mV";
  bench.heat(35.0, 60.0, 5.0);
  EXPECT_FALSE(bench.armed()) << "4.45 mV";
  EXPECT_EQ(bench.application().fault(0), Fault::current_sense);
  bench.clear();
  EXPECT_FALSE(bench.arm()) << "it stays where it is";
  bench.drive().current_sensor().set_temperature(25.0);
  bench.run(0.5);
  bench.clear();
  bench.set_wall_force(0.0);
  EXPECT_TRUE(bench.arm());
}

// 24 V and 4.5 ohm: what the bridge can give is not enough for 5 A.
TEST(CurrentAmplifiers, TheCurrentIsTrueAtTheLargestDuty) {
  for (const double sign : {1.0, -1.0}) {
    SenseBench bench({}, sign * 11.0, 4.5);
    ASSERT_TRUE(bench.armed()) << firmware::text_of(bench.application().fault(0)).name;
    EXPECT_GT(sign * bench.current(), 3.8);
    EXPECT_LT(sign * bench.current(), 4.5) << "by the supply";
    bench.run(1.0);  // until the zero has gone as far as it goes, which settles no better
    EXPECT_NEAR(bench.error() / bench.current(), 0.0, 0.013);
  }
}

}  // namespace kmax::simulated_board::simulated_power_test
