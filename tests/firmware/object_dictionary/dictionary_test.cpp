#include "firmware/object_dictionary/dictionary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "firmware/object_dictionary/dictionary_checks.hpp"

namespace kmax::firmware::dictionary_test {
namespace {

const Entry& named(std::string_view name) {
  const std::size_t found = find_entry(name);
  if (found == entry_count) throw std::runtime_error("no entry " + std::string(name));
  return entry_at(found);
}

// The vocabulary of the design: names are a contract with everyone who writes a script or a scene.
struct Word {
  std::string_view name, unit;
  std::vector<std::string_view> choices = {};  // all of them must be there unless the firmware lacks the part
};
const std::vector<Word> vocabulary = {
    {"wall.law", "", {"none", "plain", "magnetic", "adaptive"}},
    {"wall.position", "m"},
    {"wall.side", "", {"+1", "-1"}},
    {"wall.stiffness", "N/m"},
    {"wall.damping", "N s/m"},
    {"wall.magnetic_coefficient", "N"},
    {"wall.magnetic_length", "m"},
    {"wall.adaptive_gain", "N"},
    {"wall.adaptive_offset", "N"},
    {"wall.adaptive_velocity_max", "m/s"},
    {"wall.adaptive_relation", "", {"linear", "square", "square_root"}},
    {"wall.adaptive_force_min", "N"},
    {"wall.adaptive_force_max", "N"},
    {"wall.adaptive_velocity", "", {"approach", "speed"}},
    {"wall.adaptive_mode", "", {"instant", "latched", "peak_hold"}},
    {"wall.adaptive_hold_time", "s"},
    {"wall.stiffness_ceiling", "N/m"},
    {"wall.damping_ceiling", "N s/m"},
    {"wall.damping_window", "samples"},
    {"wall.touch_stiffness", "N/m"},
    {"wall.growth_time", "s"},
    {"wall.calm_velocity", "m/s"},
    {"interference.mode", "", {"none", "perpendicular", "parallel"}},
    {"interference.force", "N"},
    {"interference.background_force", "N"},
    {"interference.onset_time", "s"},
    {"position.resolution", "m"},
    {"position.rounding", "", {"nearest", "floor", "hysteresis"}},
    {"velocity.estimator", "", {"difference", "low_pass", "foaw", "tracking", "edge_period"}},
    {"velocity.window", "samples"},
    {"velocity.bandwidth", "Hz"},
    {"haptic.rate", "Hz"},
    {"force.limit", "N"},
    {"force.slew_limit", "N/s"},
    {"force.ramp_time", "s"},
    {"force.ceiling", "N"},
    {"guard.mode", "", {"off", "warn", "refuse"}},
    {"guard.damping", "N s/m"},
    {"guard.friction", "N"},
    {"guard.operator_force", "N"},
    {"guard.operator_speed", "m/s"},
    {"guard.delay", "s"},
    {"device.transmission", "m/rad"},
    {"device.mass", "kg"},
    {"motor.kind", "", {"dc", "pmsm"}},
    {"motor.resistance", "ohm"},
    {"motor.inductance", "H"},
    {"motor.torque_constant", "N m/A"},
    {"motor.pole_pairs", ""},
    {"current.limit", "A"},
    {"current.bandwidth", "rad/s"},
    {"encoder.kind", "", {"quadrature", "as5047p"}},
    {"encoder.counts_per_turn", "counts"},
    {"encoder.direction", "", {"+1", "-1"}},
    {"encoder.offset", "counts"},
    {"supply.voltage_min", "V"},
    {"supply.voltage_max", "V"},
    {"supply.brake_voltage", "V"},
    {"motor.electrical_offset", "rad"},
    {"encoder.index", "", {"none", "once_per_turn"}},
    {"motor.inductance_q", "H"},
    {"motor.calibrated", "", {"no", "yes"}},
    {"encoder.start", "", {"anywhere", "at_rest"}},
    {"device.hand_force", "N"},
    {"temperature.derating", "degC"},
    {"temperature.motor_limit", "degC"},
    {"temperature.ambient", "degC"},
    {"temperature.winding_capacity", "J/K"},
    {"temperature.winding_resistance", "K/W"},
    {"temperature.case_capacity", "J/K"},
    {"temperature.case_resistance", "K/W"},
    {"compensation.dead_time", "s"},
    {"compensation.dead_time_current", "A"},
    {"compensation.limit", "N"},
    {"compensation.friction", "N"},
    {"compensation.friction_velocity", "m/s"},
    {"compensation.cogging_periods", ""},
    {"compensation.cogging_cosine_1", "N"},
    {"compensation.cogging_sine_1", "N"},
    {"compensation.cogging_cosine_2", "N"},
    {"compensation.cogging_sine_2", "N"},
    {"compensation.gravity_constant", "N"},
    {"compensation.gravity_cosine", "N"},
    {"compensation.gravity_sine", "N"},
    {"instability.action", "", {"off", "warn", "soften", "trip"}},
    {"instability.force", "N"},
    {"instability.amplitude", "m"},
    {"temperature.limit", "degC"},
    {"velocity.limit", "m/s"},
    {"drive.declared_absent", "", {"no", "yes"}},
    {"link.timeout", "s"},
    {"link.loss", "", {"limp", "ramp", "damp"}},
    {"node.id", ""},
    {"can.bit_rate", "bit/s"},
    {"modbus.unit", ""},
    {"modbus.baud_rate", "baud"},
};

TEST(Dictionary, HasEveryNameOfTheVocabularyWithItsUnitAndChoices) {
  for (const Word& word : vocabulary) {
    ASSERT_LT(find_entry(word.name), entry_count) << word.name;
    const Entry& entry = named(word.name);
    EXPECT_EQ(entry.unit, word.unit) << word.name;
    EXPECT_EQ(entry.access, Access::read_write) << word.name;
    EXPECT_TRUE(entry.persistent) << word.name;
    EXPECT_FALSE(entry.help.empty()) << word.name;
    if (entry.unit != "bit/s" && entry.unit != "baud") {
      EXPECT_EQ(entry.values.empty(), word.choices.empty()) << word.name;
    }
    for (const std::string_view choice : word.choices) {
      EXPECT_TRUE(std::any_of(entry.values.begin(), entry.values.end(),
                              [&](const NamedValue& v) { return v.name == choice; }))
          << word.name << " = " << choice;
    }
  }
}

// Hosts send the number, people read the name: where the name is a number it is that one, else the choices
// are counted in their order.
TEST(Dictionary, NumbersOfChoicesAreTheirNamesOrTheirOrder) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    int place = 0;
    for (const NamedValue& choice : entry_at(i).values) {
      char* end = nullptr;
      const std::string name(choice.name);
      const long number = std::strtol(name.c_str(), &end, 10);
      EXPECT_EQ(choice.value, *end == '\0' ? number : place) << entry_at(i).name << " = " << name;
      ++place;
    }
  }
}

// A setting that is kept and is not in the vocabulary would be an undocumented name. CANopen's own settings
// are named by CiA 301.
TEST(Dictionary, HasNoPersistentNameOutsideTheVocabulary) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    if (!entry_at(i).persistent || entry_at(i).access == Access::communication) continue;
    EXPECT_TRUE(std::any_of(vocabulary.begin(), vocabulary.end(), [&](const Word& w) {
      return w.name == entry_at(i).name;
    })) << entry_at(i).name;
  }
}

TEST(Dictionary, ChoicesHaveDistinctNamesAndNumbers) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    std::set<std::string_view> names;
    std::set<std::int32_t> numbers;
    for (const NamedValue& v : entry_at(i).values) {
      EXPECT_TRUE(names.insert(v.name).second) << entry_at(i).name;
      EXPECT_TRUE(numbers.insert(v.value).second) << entry_at(i).name;
      EXPECT_LE(entry_at(i).minimum, v.value);
      EXPECT_GE(entry_at(i).maximum, v.value);
    }
  }
}

// Addresses are in scripts and in the field: appending may not move them.
TEST(Dictionary, ModbusAddressesArePinned) {
  struct Pin {
    std::string_view name;
    int axis0, axis1;
  };
  constexpr Pin pins[] = {
      {"wall.law", 0x0000, 0x0400},
      {"wall.position", 0x0001, 0x0401},
      {"wall.side", 0x0003, 0x0403},
      {"wall.stiffness", 0x0004, 0x0404},
      {"wall.adaptive_relation", 0x0012, 0x0412},
      {"wall.adaptive_hold_time", 0x0019, 0x0419},
      {"interference.mode", 0x0040, 0x0440},
      {"position.resolution", 0x0060, 0x0460},
      {"velocity.limit", 0x0074, 0x0474},
      {"haptic.rate", 0x0080, 0x0480},
      {"force.limit", 0x0090, 0x0490},
      {"force.ramp_time", 0x0094, 0x0494},
      {"guard.mode", 0x00B0, 0x04B0},
      {"guard.operator_speed", 0x00B7, 0x04B7},
      {"guard.delay", 0x00B9, 0x04B9},
      {"guard.verdict", 0x0100, 0x0500},
      {"instability.action", 0x0150, 0x0550},
      {"instability.amplitude", 0x0153, 0x0553},
      {"instability.alarms", 0x0110, 0x0510},
      {"instability.softening", 0x0118, 0x0518},
      {"guard.bound", 0x0105, 0x0505},
      {"encoder.counts_per_turn", 0x0111, 0x0511},
      {"encoder.offset", 0x0114, 0x0514},
      {"drive.controlword", 0x0200, 0x0600},
      {"drive.mode", 0x0208, 0x0608},
      {"profile.operation_mode", 0x0280, 0x0680},
      {"profile.target_torque", 0x0281, 0x0681},
      {"profile.max_torque", 0x0282, 0x0682},
      {"profile.polarity", 0x0283, 0x0683},
      {"profile.quick_stop_option", 0x0284, 0x0684},
      {"profile.fault_option", 0x0288, 0x0688},
      {"profile.target_force", 0x0289, 0x0689},
      {"profile.operation_mode_display", 0x00C0, 0x04C0},
      {"profile.velocity", 0x00C1, 0x04C1},
      {"profile.torque", 0x00C7, 0x04C7},
      {"profile.device_type", 0x00CB, 0x04CB},
      {"telemetry.current", 0x00E0, 0x04E0},
      {"canopen.sync_cob_id", 0x2800, 0x2800},
      {"rpdo1.cob_id", 0x2900, 0x2900},
      {"rpdo1.mapped_count", 0x2910, 0x2910},
      {"tpdo4.mapped_8", 0x2BDF, 0x2BDF},
      {"tpdo5.mapped_8", 0x2C1F, 0x2C1F},
      {"canopen.sync_period", 0x2807, 0x2807},
      {"canopen.sync_counter_overflow", 0x2809, 0x2809},
      {"sdo_server_2.response_cob_id", 0x2842, 0x2842},
      {"profile.digital_inputs", 0x00CD, 0x04CD},
      {"drive.statusword", 0x0000, 0x0400},
      {"drive.error_code", 0x0001, 0x0401},
      {"drive.refusal", 0x0002, 0x0402},
      {"measured.tick", 0x0020, 0x0420},
      {"measured.position", 0x0022, 0x0422},
      {"measured.force", 0x0026, 0x0426},
      {"measured.armed_samples", 0x0037, 0x0437},
      {"supply.voltage_min", 0x2000, 0x2000},
      {"link.timeout", 0x2010, 0x2010},
      {"modbus.unit", 0x2030, 0x2030},
      {"modbus.baud_rate", 0x2031, 0x2031},
      {"trace.axis", 0x2040, 0x2040},
      {"trace.interval", 0x2041, 0x2041},
      {"transaction.control", 0x2100, 0x2100},
      {"info.vendor_id", 0x2000, 0x2000},
      {"info.uptime", 0x200F, 0x200F},
      {"info.reset_cause", 0x2013, 0x2013},
      {"info.crash_program_counter", 0x2018, 0x2018},
      {"store.command", 0x2110, 0x2110},
      {"store.state", 0x20C0, 0x20C0},
      {"store.sequence", 0x20C1, 0x20C1},
      {"store.write_errors", 0x20C8, 0x20C8},
      {"counters.queue_overflows", 0x2050, 0x2050},
      {"refusal.reason", 0x2080, 0x2080},
      {"trace.next", 0x20A0, 0x20A0},
  };
  for (const Pin& pin : pins) {
    const std::size_t entry = find_entry(pin.name);
    ASSERT_LT(entry, entry_count) << pin.name;
    EXPECT_EQ(modbus_address(entry, 0), pin.axis0) << pin.name;
    EXPECT_EQ(modbus_address(entry, 1), pin.axis1) << pin.name;
  }
}

// CiA 402-2's object dictionary: index, type and access, each a VAR.
TEST(Dictionary, Cia402ObjectsStandAtTheStandardsIndexWithItsTypeAndAccess) {
  struct Object {
    std::string_view name;
    int index;
    Type type;
    bool written;
  };
  constexpr Object objects[] = {
      {"drive.error_code", 0x603F, Type::unsigned16, false},
      {"drive.controlword", 0x6040, Type::unsigned16, true},
      {"drive.statusword", 0x6041, Type::unsigned16, false},
      {"profile.abort_connection_option", 0x6007, Type::integer16, true},
      {"profile.quick_stop_option", 0x605A, Type::integer16, true},
      {"profile.shutdown_option", 0x605B, Type::integer16, true},
      {"profile.disable_option", 0x605C, Type::integer16, true},
      {"profile.halt_option", 0x605D, Type::integer16, true},
      {"profile.fault_option", 0x605E, Type::integer16, true},
      {"profile.operation_mode", 0x6060, Type::integer8, true},
      {"profile.operation_mode_display", 0x6061, Type::integer8, false},
      {"measured.count", 0x6064, Type::integer32, false},
      {"profile.velocity", 0x606C, Type::integer32, false},
      {"profile.target_torque", 0x6071, Type::integer16, true},
      {"profile.max_torque", 0x6072, Type::unsigned16, true},
      {"profile.rated_current", 0x6075, Type::unsigned32, false},
      {"profile.rated_torque", 0x6076, Type::unsigned32, false},
      {"profile.torque", 0x6077, Type::integer16, false},
      {"profile.current", 0x6078, Type::integer16, false},
      {"profile.polarity", 0x607E, Type::unsigned8, true},
      {"profile.supported_modes", 0x6502, Type::unsigned32, false},
      {"profile.device_type", 0x67FF, Type::unsigned32, false},
      {"profile.digital_inputs", 0x60FD, Type::unsigned32, false},
  };
  std::set<int> listed;
  for (const Object& object : objects) {
    const Entry& entry = named(object.name);
    EXPECT_EQ(entry.index(), object.index) << object.name;
    EXPECT_EQ(entry.object_subindex(), 0) << object.name;
    EXPECT_EQ(entry.type, object.type) << object.name;
    EXPECT_EQ(entry.access, object.written ? Access::read_write : Access::read_only) << object.name;
    EXPECT_FALSE(entry.persistent) << object.name;
    EXPECT_EQ(entry.scope(), Scope::axis) << object.name;
    listed.insert(object.index);
  }
  for (std::size_t i = 0; i < entry_count; ++i) {
    if (entry_at(i).index() >= 0x6000) {
      EXPECT_TRUE(listed.contains(entry_at(i).index())) << entry_at(i).name;
    }
  }
}

// They are kept, any link may read them and only CANopen writes them: no register of theirs can be written.
TEST(Dictionary, CommunicationSettingsAreKeptReadAndNeverWrittenThroughModbus) {
  int count = 0;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    if (entry.access != Access::communication) continue;
    ++count;
    EXPECT_TRUE(entry.persistent) << entry.name;
    EXPECT_EQ(entry.scope(), Scope::device) << entry.name;
    EXPECT_GE(entry.index(), 0x1000) << entry.name;
    EXPECT_LT(entry.index(), 0x1C00) << entry.name;
    EXPECT_GE(modbus_address(i, 0), 0x2800) << entry.name;
    EXPECT_LT(modbus_address(i, 0), 0x2D00) << entry.name;
  }
  // SYNC, emergency, heartbeat, error behaviour; 4 nodes watched; 4 RPDOs of 2 + 9, 4 TPDOs of 4 + 9.
  EXPECT_EQ(count, 7 + 4 + 2 + 4 * 11 + 5 * 13);
}

TEST(Dictionary, NoTwoObjectsShareAnIndexOnEitherAxis) {
  std::set<std::pair<int, int>> places;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const int index = entry_at(entry).index() + static_cast<int>(axis) * axis_index_offset;
    EXPECT_TRUE(places.insert({index, entry_at(entry).object_subindex()}).second) << entry_at(entry).name;
  }
}

TEST(Dictionary, NoTwoValuesShareARegisterAndAxesDoNotRunIntoEachOther) {
  std::map<std::pair<bool, int>, std::string> owner;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    for (int word = 0; word < register_count(e.type); ++word) {
      const std::pair<bool, int> place{e.access == Access::read_write, modbus_address(entry, axis) + word};
      const auto [at, is_new] = owner.insert({place, std::string(e.name)});
      EXPECT_TRUE(is_new) << e.name << " and " << at->second << " at " << place.second;
      EXPECT_FALSE(place.second >= 0x4000 && place.second < 0x5000) << e.name << " is in the trace window";
      if (e.scope() == Scope::axis) {
        EXPECT_EQ(place.second / 0x400, static_cast<int>(axis)) << e.name;
      } else {
        EXPECT_GE(place.second, 0x2000) << e.name;
      }
    }
  }
}

TEST(Dictionary, HasRoomForSevenAxes) {
  static_assert(dictionary_checks::places_hold<3>);
  static_assert(dictionary_checks::places_hold<6>);
  static_assert(dictionary_checks::places_hold<most_axes>);
  static_assert(!dictionary_checks::places_hold<most_axes + 1>,
                "axis 7 would begin where the device's objects do");
}

TEST(Dictionary, SlotsAndOwnersAreInverse) {
  std::set<std::size_t> seen;
  for (std::size_t entry = 0; entry < entry_count; ++entry) {
    const std::size_t axes = entry_at(entry).scope() == Scope::axis ? axis_count : 1;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const std::size_t slot = slot_of(entry, axis);
      EXPECT_TRUE(seen.insert(slot).second);
      EXPECT_EQ(owner_of(slot).entry, entry);
      EXPECT_EQ(owner_of(slot).axis, axis);
    }
  }
  EXPECT_EQ(seen.size(), slot_count);
  EXPECT_EQ(*seen.rbegin(), slot_count - 1);
}

TEST(Dictionary, FindsEveryNameAndNoOther) {
  for (std::size_t i = 0; i < entry_count; ++i) EXPECT_EQ(find_entry(entry_at(i).name), i);
  for (const std::string_view wrong :
       {"", "wall", "wall.", "wall.stiffnes", "wall.stiffness ", "Wall.stiffness"})
    EXPECT_EQ(find_entry(wrong), entry_count) << wrong;
}

// What would make the force jump or the scale change under the hand must not be writable while armed; what an
// experiment turns up while the hand holds the handle must be.
TEST(Dictionary, ChangesWhileArmedAreAllowedWhereTheyMustBe) {
  for (const std::string_view name : {"wall.law",
                                      "wall.position",
                                      "wall.side",
                                      "interference.mode",
                                      "position.resolution",
                                      "position.rounding",
                                      "velocity.estimator",
                                      "velocity.window",
                                      "velocity.bandwidth",
                                      "haptic.rate",
                                      "device.transmission",
                                      "encoder.counts_per_turn",
                                      "encoder.direction",
                                      "encoder.offset",
                                      "encoder.kind",
                                      "motor.kind",
                                      "guard.mode",
                                      "link.timeout",
                                      "force.ceiling",
                                      "wall.stiffness_ceiling",
                                      "wall.damping_ceiling"})
    EXPECT_EQ(named(name).change, Change::disarmed_only) << name;
  for (const std::string_view name :
       {"wall.stiffness", "wall.damping", "wall.magnetic_coefficient", "force.limit", "velocity.limit"})
    EXPECT_EQ(named(name).change, Change::only_lower) << name;
  for (const std::string_view name : {"trace.interval", "transaction.control", "drive.controlword"})
    EXPECT_EQ(named(name).change, Change::any_time) << name;
}

std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> cells;
  for (std::size_t at = 1; at < row.size(); at = row.find('|', at) + 1) {
    const std::string cell = row.substr(at, row.find('|', at) - at);
    const std::size_t first = cell.find_first_not_of(" `"), last = cell.find_last_not_of(" `");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
    if (row.find('|', at) == std::string::npos) break;
  }
  return cells;
}

// What users and their programs go by: a number that changes here changes there too, and is noticed.
TEST(Dictionary, HasTheNumbersOfItsReference) {
  constexpr std::array types{"unsigned8", "integer8", "unsigned16", "unsigned32",
                             "integer32", "float32",  "integer16"};
  std::ifstream page("../docs/parameters.md");
  std::size_t rows = 0;
  for (std::string row; std::getline(page, row);) {
    if (!row.starts_with("| `")) continue;
    ++rows;
    const auto cells = cells_of(row);
    ASSERT_GE(cells.size(), 8U) << row;
    const std::size_t entry = find_entry(cells[0]);
    const Entry& e = named(cells[0]);
    std::array<char, 32> place{};
    std::snprintf(place.data(), place.size(), "0x%04X:%u 0x%04X", unsigned{e.index()},
                  unsigned{e.object_subindex()}, unsigned{modbus_address(entry, 0)});
    EXPECT_EQ(cells[5] + " " + cells[6], place.data()) << row;
    EXPECT_EQ(cells[1], e.unit) << row;
    EXPECT_EQ(cells[4], types[static_cast<std::size_t>(e.type)]) << row;
    EXPECT_EQ(cells[2] == "read only", e.access == Access::read_only) << row;
    if (e.access == Access::read_only) continue;
    if (e.values.empty()) {
      EXPECT_EQ(std::strtod(cells[2].c_str(), nullptr), e.minimum) << row;
      const std::size_t to = cells[2].find(" .. ");
      EXPECT_EQ(to == std::string::npos ? e.minimum : std::strtod(cells[2].c_str() + to + 4, nullptr),
                e.maximum)
          << row;
      EXPECT_EQ(std::strtod(cells[3].c_str(), nullptr), e.default_value) << row;
      continue;
    }
    std::string names;
    for (const NamedValue& value : e.values) {
      names += (names.empty() ? "" : ", ") + std::string(value.name);
      EXPECT_EQ(value.name == cells[3], value.value == e.default_value) << row;
    }
    EXPECT_EQ(cells[2], names) << row;
  }
  EXPECT_EQ(rows, entry_count);
}

}  // namespace
}  // namespace kmax::firmware::dictionary_test
