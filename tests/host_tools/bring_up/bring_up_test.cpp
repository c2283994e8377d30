#include "host_tools/bring_up/bring_up.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/bring_up/person_at_the_bench.hpp"
#include "tests/host_tools/renamed_board.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/shared_beginning.hpp"

namespace kmax::bring_up::bring_up_test {

using simulation::CurrentSensor;
using simulation::Defect;
using simulation::TemperatureSensor;

/// A new board, on x86.
struct StartedBoard {
  explicit StartedBoard(const std::string& scene)
      : StartedBoard(selftest::TestedAxis::opened(scene, false)) {}
  explicit StartedBoard(const simulation::Scene& scene)
      : board(scene, 0),
        person(*board.device, board.drives(), [this](bool pressed) { press_stop(pressed); }) {
    board.link->before_tick = [this] { person.move_hand(); };
  }

  void press_stop(bool pressed) { board.link->hardware().power().press_emergency_stop(pressed); }

  selftest::TestedAxis board;
  PersonAtTheBench person;
};

TEST(BringUp, OfABoardThatIsNotKnownDoesNotBegin) {
  StartedBoard started("dc_coreless_a");
  host_tools_test::RenamedBoard renamed(started.board.device->link(), "moteus_r4");
  device::Device device(std::make_unique<host_tools_test::RenamedBoard>(renamed, "moteus_r4"));
  PersonAtTheBench person(device, started.board.drives(), [](bool) {});
  EXPECT_CONTAINS(host_tools_test::thrown_message<base::DeviceError>([&] { person.run(); }), "moteus_r4");
  EXPECT_TRUE(person.asked.empty());
  EXPECT_EQ(renamed.written, 0U);
}

TEST(BringUp, ABlankBoardComesToItsFirstWalls) {
  for (const char* scene : {"dc_coreless_a", "gimbal_b"}) {
    StartedBoard board(scene);
    EXPECT_TRUE(board.person.run()) << scene << "\n" << board.person.text();
    ASSERT_EQ(board.person.begun.size(), all_stages().size());
    EXPECT_EQ(board.person.kept, static_cast<int>(all_stages().size()));
    EXPECT_FALSE(board.person.report.next(0).has_value());
    EXPECT_TRUE(board.board.disarmed());
    // Within the limits that it states: those of the first wall, and the calibration's saved, the wall's not.
    EXPECT_LE(*board.person.report.number(0, Stage::wall, "wall of 0.50 N/mm", "largest_force"), 1.0);
    EXPECT_GT(*board.person.report.number(0, Stage::wall, "wall of 0.50 N/mm", "deepest"), 0.5e-3);
    EXPECT_EQ(board.board.device->read_number("motor.calibrated"), 1.0);
    EXPECT_EQ(board.board.device->read_number("force.limit"), 3.3F);
    EXPECT_EQ(board.board.device->read_number("store.state"), 2.0) << "saved";
    // Every number stands in the range that the report gives for it.
    for (const StageResult& result : board.person.results) {
      for (const selftest::CheckResult& check : result.checks) {
        for (const selftest::MeasuredValue& value : check.values) {
          EXPECT_GE(value.value, value.least) << check.name << " " << value.name;
          EXPECT_LE(value.value, value.most) << check.name << " " << value.name;
        }
      }
    }
    // Any stage can be run again, and says what it measures now.
    Settings again;
    again.only = Stage::load;
    EXPECT_TRUE(board.person.run(again));
    EXPECT_FALSE(board.person.report.next(0).has_value());
  }
}

TEST(BringUp, NoStageBeforeItsTurn) {
  StartedBoard board("dc_coreless_a");
  Settings settings;
  settings.only = Stage::load;
  EXPECT_THROW(board.person.run(settings), OutOfTurn);
  EXPECT_TRUE(board.person.asked.empty());
  EXPECT_TRUE(board.person.results.empty());
  settings.only = Stage::logic;
  EXPECT_TRUE(board.person.run(settings));
  settings.only = Stage::gate_drivers;
  EXPECT_TRUE(board.person.run(settings));
  // One that fails takes back what stood on it.
  board.press_stop(true);
  settings.only = Stage::logic;
  EXPECT_FALSE(board.person.run(settings));
  EXPECT_EQ(board.person.report.next(0), Stage::logic);
  EXPECT_EQ(board.person.report.result(0, Stage::gate_drivers), nullptr);
}

constexpr double usual_source_resistance = 0.05;  // ohm

/// A fault of the wiring, and where it must be found, with which words.
struct Planted {
  const char* name;
  const char* scene;
  Stage stage;
  const char* part;
  std::function<void(StartedBoard&)> plant;   ///< when that stage begins
  std::optional<Settings> settings{};         ///< of the whole run; none: the usual ones
  bool breaks_parts = false;                  ///< of the board, before anybody could look
  std::optional<double> source_resistance{};  ///< ohm; none: usual_source_resistance
};

Settings with(void (*change)(Settings&)) {
  Settings settings;
  change(settings);
  return settings;
}

std::function<void(StartedBoard&)> defect(Defect one) {
  return [one](StartedBoard& board) { board.board.plant(one); };
}

std::function<void(StartedBoard&)> supply_of(double volts) {
  return [volts](StartedBoard& board) {
    board.board.drives().supply().set_source(volts);
    board.board.drives().supply().set_voltage(volts);
    board.board.link->wait(std::chrono::milliseconds(50));
  };
}

/// Not yet identified, its encoder with an index a few millimetres beside the handle.
simulation::Scene with_index(const char* name) {
  simulation::Scene scene = selftest::TestedAxis::opened(name, false);
  simulation::EncoderConfig& encoder = scene.axes[0].encoder;
  encoder.index_position = encoder.reversed ? encoder.counts_per_turn - 300.0 : 300.0;
  scene.parameters.push_back({"encoder.index", std::string("once_per_turn"), "test"});
  return scene;
}

CurrentSensor& sensor(StartedBoard& board) {
  return board.board.drives().drive(0).current_sensor();
}

const std::vector<Planted>& planted() {
  using Channel = CurrentSensor::Channel;
  constexpr auto dc = "dc_coreless_a", pmsm = "gimbal_b";
  static const std::vector<Planted> all = {
      {"no motor supply", dc, Stage::logic, "supply", supply_of(0.0)},
      {"supply too low", dc, Stage::logic, "supply", supply_of(11.0)},
      {"supply too high", dc, Stage::logic, "supply", supply_of(27.0)},
      {"board for 24 V taken for one of 56 V", dc, Stage::logic, "voltage variant", supply_of(20.8),
       with([](Settings& s) { s.supply = 12.0; })},
      {"board for 56 V taken for one of 24 V", dc, Stage::logic, "voltage variant", supply_of(20.0),
       with([](Settings& s) { s.supply = 34.5; })},
      {"board for 24 V at 48 V", dc, Stage::logic, "supply (beyond the range)", supply_of(48.0), {}, true},
      {"no wire at GPIO5", dc, Stage::logic, "emergency stop", [](StartedBoard& b) { b.press_stop(true); }},
      {"button beside the wire", dc, Stage::logic, "emergency stop",
       [](StartedBoard& b) { b.person.button_works = false; }},
      {"bad cable of the link", dc, Stage::logic, "link",
       [](StartedBoard& b) {
         b.board.link->lose_every(40);
         b.person.at_progress = [&b](const std::string& text) {
           if (text == "supply and temperature") b.board.link->lose_every(0);
         };
       }},
      {"temperature sensor off", dc, Stage::logic, "temperature sensor",
       [](StartedBoard& b) { b.board.drives().temperature(0).set_wiring(TemperatureSensor::Wiring::open); }},
      {"motor connected too early", dc, Stage::gate_drivers, "motor terminals",
       [](StartedBoard& b) {
         b.board.drives().mend(0, Defect::phase_b_open);
         b.board.drives().mend(0, Defect::phase_c_open);
         b.board.plant(Defect::motor_blocked);
       }},
      {"gate driver reports a fault", dc, Stage::gate_drivers, "gate driver",
       [](StartedBoard& b) { b.board.link->hardware().power().set_gate_driver_fault(true); }},
      {"stop that ends nothing once the bridge is on", dc, Stage::gate_drivers, "emergency stop",
       [](StartedBoard& b) { b.person.button_works = false; }},
      {"amplifier stuck at its rail", dc, Stage::gate_drivers, "current sense",
       [](StartedBoard& b) { sensor(b).set_stuck(Channel::b, 3.3); }},
      {"phase A loose", pmsm, Stage::load, "phase A (open)", defect(Defect::phase_a_open)},
      {"phase B loose", pmsm, Stage::load, "phase B (open)", defect(Defect::phase_b_open)},
      {"phase C loose", pmsm, Stage::load, "phase C (open)", defect(Defect::phase_c_open)},
      {"weak supply", dc, Stage::load, "supply", nullptr, {}, false, 8.0},
      {"weak supply, small motor", pmsm, Stage::load, "supply", nullptr, {}, false, 8.0},
      {"brushed motor's lead loose", dc, Stage::load, "motor winding or cable (B to C open)",
       defect(Defect::phase_c_open)},
      {"shunt B turned around", dc, Stage::load, "current sensor B", defect(Defect::current_b_inverted)},
      {"shunt C turned around", pmsm, Stage::load, "current sensor C", defect(Defect::current_c_inverted)},
      {"sensor C dead", pmsm, Stage::load, "current sensor C",
       [](StartedBoard& b) { sensor(b).short_inputs(Channel::c, true); }},
      {"encoder unplugged", dc, Stage::motor, "encoder", defect(Defect::encoder_unplugged)},
      {"encoder's disc loose", pmsm, Stage::motor, "encoder", defect(Defect::encoder_stuck)},
      {"index loose", dc, Stage::motor, "encoder index", defect(Defect::index_loose)},
      {"index loose, synchronous motor", pmsm, Stage::motor, "encoder index", defect(Defect::index_loose)},
      {"handle blocked", dc, Stage::motor, "encoder", defect(Defect::motor_blocked)},
      {"no brake resistor at AUX", dc, Stage::motor, "brake resistor",
       [](StartedBoard& b) { b.board.device->apply(device::parse_assignments({"supply.brake_voltage=26"})); },
       with([](Settings& s) { s.brake = 0.0; })},
      {"brake resistor never used", dc, Stage::motor, "supply.brake_voltage", [](StartedBoard&) {},
       with([](Settings& s) { s.brake = 2.0; })},
      {"encoder slips", pmsm, Stage::calibration, "", defect(Defect::encoder_slipping)},
  };
  return all;
}

TEST(BringUp, AnIndexThatIsWiredIsPassedByHand) {
  for (const char* name : {"dc_coreless_a", "gimbal_b"}) {
    StartedBoard board(with_index(name));
    board.person.at_stage = [](const std::string& asked) {
      if (asked.starts_with("Stage calibration")) throw bench::Interrupted("enough");
    };
    EXPECT_THROW(board.person.run(), bench::Interrupted) << board.person.text();
    EXPECT_EQ(board.person.report.next(0), Stage::calibration);
    EXPECT_NE(board.person.text().find("encoder index: pass"), std::string::npos) << board.person.text();
  }
}

/// Each fault on its own copy of a board that came without one to the stage at which it is planted.
void find_each(const simulation::Scene& scene, const Settings& settings, std::vector<Planted> faults) {
  SharedBeginning::run([&](SharedBeginning& beginning) {
    StartedBoard board(scene);
    const auto before = board.board.settings();
    std::optional<Planted> there;
    board.person.at_stage = [&](const std::string& asked) {
      const auto at_this_stage = [&](const Planted& one) {
        return asked.starts_with(fmt::format("Stage {}:", text_of(one.stage).name));
      };
      for (const Planted& one : faults) {
        if (there || !at_this_stage(one) || !beginning.fork(one.name)) continue;
        there = one;
        if (one.plant) one.plant(board);
      }
      std::erase_if(faults, at_this_stage);
      if (!there && faults.empty()) throw bench::Interrupted("all have been planted");
    };
    bool passed = true;
    try {
      passed = board.person.run(settings);
    } catch (const bench::Interrupted&) {
      if (there) throw;
    }
    if (!there) {
      EXPECT_TRUE(passed) << board.person.text();
      EXPECT_TRUE(faults.empty()) << faults.front().name << " was not planted";
      return;
    }
    EXPECT_FALSE(passed) << board.person.text();
    EXPECT_EQ(board.person.report.next(0), there->stage) << board.person.text();
    EXPECT_TRUE(board.person.faulty_part() == there->part || *there->part == '\0')
        << board.person.faulty_part() << "\n"
        << board.person.text();
    board.board.link->lose_every(0);
    EXPECT_TRUE(board.board.disarmed());
    if (there->stage < Stage::calibration && std::string(there->name) != "no brake resistor at AUX") {
      EXPECT_EQ(board.board.settings(), before);
    }
    // It goes on there, and not before.
    EXPECT_EQ(board.person.begun.back(), text_of(there->stage).name);
  });
}

TEST(BringUp, EachPlantedFaultIsFoundAtItsStageAndHarmsNothing) {
  EXPECT_GE(planted().size(), 20U);
  std::map<std::string, std::vector<Planted>> usual;
  for (const Planted& one : planted()) {
    if (!one.settings && !one.breaks_parts && !one.source_resistance) {
      usual[one.scene].push_back(one);
      continue;
    }
    simulation::Scene scene = with_index(one.scene);
    scene.supply->part_ratings = !one.breaks_parts;
    scene.supply->resistance = one.source_resistance.value_or(usual_source_resistance);
    find_each(scene, one.settings.value_or(Settings{}), {one});
  }
  for (const auto& [name, faults] : usual) {
    simulation::Scene scene = with_index(name.c_str());
    scene.supply->part_ratings = true;
    scene.supply->resistance = usual_source_resistance;
    find_each(scene, {}, faults);
  }
}

TEST(BringUp, ExchangedLeadsAndLinesAreCuredByTheCalibration) {
  for (const auto& [scene, one] :
       {std::pair("dc_coreless_a", Defect::phases_swapped), std::pair("gimbal_b", Defect::phases_swapped),
        std::pair("gimbal_b", Defect::encoder_reversed)}) {
    SCOPED_TRACE(std::string(scene) + ", " + std::string(simulation::name_of(one)));
    StartedBoard board(scene);
    board.person.at_stage = [&board, defect = one](const std::string& asked) {
      if (asked.starts_with("Stage load")) board.board.plant(defect);
    };
    EXPECT_TRUE(board.person.run()) << board.person.text();
  }
}

// 10 uV/degC at 0.5 mohm are 0.02 A/degC, which is allowed; of 40 uV/degC the amplifier is bad.
TEST(BringUp, AmplifiersThatDriftAreFoundOnceTheBoardIsWarm) {
  for (const auto& [drift, warming, verdict] : {std::tuple(10e-6, 30.0, selftest::Verdict::pass),
                                                std::tuple(10e-6, 3.0, selftest::Verdict::not_judged),
                                                std::tuple(-40e-6, 10.0, selftest::Verdict::fail)}) {
    simulation::Scene scene = selftest::TestedAxis::opened("dc_coreless_a", false);
    scene.axes[0].current_sensor.drift_b = drift;
    StartedBoard board(scene);
    board.person.at_stage = [&, warm = 25.0 + warming](const std::string& asked) {
      if (!asked.starts_with("Stage calibration")) return;
      sensor(board).set_temperature(warm);
      board.board.drives().temperature(0).set_temperature(warm);
      board.board.link->wait(std::chrono::seconds(4));
    };
    EXPECT_EQ(board.person.run(), verdict != selftest::Verdict::fail) << board.person.text();
    const selftest::CheckResult& last = board.person.results.back().checks.back();
    EXPECT_EQ(last.name, "amplifier offsets") << board.person.text();
    EXPECT_EQ(last.verdict, verdict) << last.message;
    const auto measured =
        board.person.report.number(0, Stage::stiffer, "amplifier offsets", "offset_b_drift");
    EXPECT_EQ(measured.has_value(), verdict != selftest::Verdict::not_judged);
    if (measured) {
      EXPECT_NEAR(*measured * 0.5e-3 / drift, 1.0, 0.1);
    }
    // It is an offset that the firmware takes off: what is known from the cold board is the scene's.
    EXPECT_NEAR(*board.person.report.number(0, Stage::gate_drivers, "amplifier offsets", "offset_b"),
                0.006 / 80.0 / 0.5e-3, 0.02);
  }
}

TEST(BringUp, AmplifiersAreNotSaidToDriftLittleWhereEitherTemperatureIsNotKnown) {
  StartedBoard board("dc_coreless_a");
  device::Device& device = *board.board.device;
  auto& temperature = board.board.drives().temperature(0);
  Report report{BoardFacts{}};
  const auto check = [&] {
    board.board.link->wait(std::chrono::seconds(4));
    return check_offsets(device, 0, report);
  };
  report.add(0, {Stage::gate_drivers, "", {check_cold_offsets(device, 0)}});
  temperature.set_temperature(60.0);
  EXPECT_EQ(check().verdict, selftest::Verdict::pass);
  temperature.set_wiring(TemperatureSensor::Wiring::open);
  EXPECT_EQ(check().verdict, selftest::Verdict::not_judged) << "the sensor is broken";
  temperature.set_wiring(TemperatureSensor::Wiring::intact);
  // By an earlier kmax, which measured none.
  report.add(0, {Stage::gate_drivers, "", {}});
  const selftest::CheckResult found = check();
  EXPECT_EQ(found.verdict, selftest::Verdict::not_judged);
  EXPECT_NE(found.message.find("gate_drivers"), std::string::npos) << found.message;
}

TEST(BringUp, ThreeResistorsInAStarAreALoad) {
  simulation::Scene scene = selftest::TestedAxis::opened("gimbal_b", false);
  auto& motor = std::get<simulation::SynchronousMotorConfig>(*scene.axes[0].motor);
  motor.resistance = 4.7;
  motor.inductance_d = motor.inductance_q = 10e-6;
  motor.torque_constant = 1e-5;
  StartedBoard board(scene);
  EXPECT_FALSE(board.person.run()) << "they do not move";
  EXPECT_EQ(board.person.report.next(0), Stage::motor) << board.person.text();
}

TEST(BringUp, WhoEndsItLeavesTheDeviceInOrder) {
  StartedBoard board("dc_coreless_a");
  const auto before = board.board.settings();
  board.person.at_stage = [&](const std::string& asked) {
    if (asked.starts_with("Stage load")) throw bench::Interrupted("interrupted");
  };
  EXPECT_THROW(board.person.run(), bench::Interrupted);
  EXPECT_EQ(board.person.report.next(0), Stage::load);
  EXPECT_EQ(board.board.settings(), before);
  EXPECT_TRUE(board.board.disarmed());
}

}  // namespace kmax::bring_up::bring_up_test
