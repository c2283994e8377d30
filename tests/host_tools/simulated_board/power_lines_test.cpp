#include "host_tools/simulated_board/simulated_power.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::power_lines_test {

using firmware::Fault;
using firmware::Refusal;
using simulation::Defect;

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

}  // namespace kmax::simulated_board::power_lines_test
