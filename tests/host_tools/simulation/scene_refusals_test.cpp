// Every number, word and truth of every table of a scene, with every kind of wrong value: refused with
// file:line:column, the key, its value and what is allowed. A value at either end of its range is a scene
// like any other: it is refused with a place, or it runs.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/simulation/quadrature_encoder.hpp"
#include "host_tools/simulation/scene_drives.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::scene_refusals_test {

// One key of one table: where it is written, and what it may be.
struct Key {
  std::string table;   // "" at the top
  std::string needed;  // what else the table must hold, on one line each
  std::string name;
  double minimum = 0.0, maximum = 0.0;
  bool whole = false;
  std::string full() const { return table.empty() ? name : table + "." + name; }
};

constexpr double infinity = std::numeric_limits<double>::infinity();

template <typename Model, std::size_t count>
void add_keys(std::vector<Key>& keys, const std::string& table,
              const std::array<ModelField<Model>, count>& fields, const std::string& needed = "") {
  for (const auto& field : fields)
    keys.push_back({table, needed, std::string(field.name), field.minimum, field.maximum});
}

void add_axis_keys(std::vector<Key>& keys, const std::string& prefix) {
  add_keys(keys, prefix + "device", device_fields);
  keys.push_back({prefix + "device", "", "start_position", -10.0, 10.0});
  keys.push_back({prefix + "device", "", "start_velocity", -100.0, 100.0});
  add_keys(keys, prefix + "structure", structure_fields);
  add_keys(keys, prefix + "operator", operator_fields);
  add_keys(keys, prefix + "motion", motion_fields);
  add_keys(keys, prefix + "encoder", encoder_fields);
  add_keys(keys, prefix + "motor", brushed_dc_motor_fields, "kind = \"dc\"\n");
  add_keys(keys, prefix + "motor", synchronous_motor_fields, "kind = \"pmsm\"\n");
  keys.push_back({prefix + "motor", "kind = \"pmsm\"\n", "inductance", 1e-7, 1.0});
  add_keys(keys, prefix + "inverter", inverter_fields);
  add_keys(keys, prefix + "current_sensor", current_sensor_fields);
}

std::vector<Key> every_number() {
  std::vector<Key> keys{{"", "", "duration", 1e-3, 1e5}, {"", "", "seed", 0.0, infinity, true}};
  keys.push_back({"measurement", "", "window", 1e-3, 1e5});
  keys.push_back({"measurement", "", "threshold", 1e-9, 1.0});
  add_keys(keys, "supply", supply_fields);
  keys.push_back({"integrator", "kind = \"rk4\"\n", "substeps", 1.0, 1e6});
  keys.push_back({"integrator", "kind = \"adaptive\"\n", "tolerance", 1e-14, 1e-2});
  add_axis_keys(keys, "");
  add_axis_keys(keys, "axis1.");
  return keys;
}

struct Written {
  std::string text;
  std::string place;  // line:column of the value
};

// A scene with this line in this table, and the tables that the table needs.
Written scene_with(const Key& key, const std::string& name, const std::string& value) {
  const std::string axis = key.table.rfind("axis1.", 0) == 0 ? "axis1." : "";
  const std::string own = key.table.substr(axis.size());
  std::string text;
  int line = 1;
  const auto say = [&](const std::string& words) {
    text += words;
    for (const char c : words) line += c == '\n' ? 1 : 0;
  };
  Written written;
  const auto say_key = [&] {
    say(key.needed);
    written.place = std::to_string(line) + ":" + std::to_string(name.size() + 4);
    say(name + " = " + value + "\n");
  };
  if (key.table.empty()) say_key();
  if (key.table != "device") say("[device]\n");
  if (!axis.empty() && own != "device") say("[axis1.device]\n");
  if (own == "motion") say("[" + axis + "operator]\n");
  if (own == "inverter" || own == "current_sensor") say("[" + axis + "motor]\nkind = \"dc\"\n");
  if (!key.table.empty()) {
    say("[" + key.table + "]\n");
    say_key();
  }
  written.text = text;
  return written;
}

void expect_refused(const Key& key, const std::string& value) {
  const Written scene = scene_with(key, key.name, value);
  const std::string message = refusal(scene.text);
  EXPECT_EQ(message.rfind("bad.toml:" + scene.place + ": " + key.full() + " = ", 0), 0u)
      << scene.text << "-> " << message;
  EXPECT_NE(message.find("allowed is a"), std::string::npos) << message;
}

TEST(SceneRefusals, NoNumberIsNotOneOrBeyondItsRange) {
  const std::vector<Key> keys = every_number();
  EXPECT_GT(keys.size(), 90u);
  for (const Key& key : keys) {
    for (const char* value : {"nan", "-nan", "inf", "-inf", "\"one\"", "\"1 parsec\"", "\"\"", "true",
                              "[1.0]", "{a = 1.0}", "1979-05-27", "07:32:00", "-1e308", "1.5e308"})
      expect_refused(key, value);
    if (key.whole) {
      for (const char* value : {"-1", "1.0", "\"1\"", "-9223372036854775808"}) expect_refused(key, value);
      continue;
    }
    expect_refused(key, fmt::format("{:.17e}", std::nextafter(key.minimum, -infinity)));
    expect_refused(key, fmt::format("{:.17e}", std::nextafter(key.maximum, infinity)));
    expect_refused(key, "9223372036854775807");
    expect_refused(key, "-9223372036854775808");
  }
}

TEST(SceneRefusals, AMistypedKeyIsToldWhatItMayHaveMeant) {
  std::vector<Key> keys = every_number();
  for (const char* axis : {"", "axis1."}) {
    for (const char* table : {"device", "structure", "operator", "encoder", "measurement", "supply"}) {
      if (*axis != '\0' && (std::string(table) == "measurement" || std::string(table) == "supply")) continue;
      keys.push_back({"", "", std::string(axis) + table});
    }
  }
  for (const Key& key : keys) {
    for (const int way : {0, 1, 2}) {
      std::string wrong = key.name;
      const std::size_t middle = wrong.size() / 2;
      if (way == 0) wrong.erase(middle, 1);                       // a letter left out
      if (way == 1) wrong.insert(middle, 1, 'x');                 // one too many
      if (way == 2) std::swap(wrong[middle - 1], wrong[middle]);  // two swapped
      if (wrong == key.name || wrong.rfind("axis1.", 0) == 0 || wrong.find('.') != std::string::npos)
        continue;
      const Written scene = scene_with(key, wrong, "1.0");
      const std::string message = refusal(scene.text);
      EXPECT_NE(message.find(": unknown key; allowed here: "), std::string::npos) << scene.text << message;
      const std::size_t meant = message.find("did you mean ");
      ASSERT_NE(meant, std::string::npos) << scene.text << message;
      EXPECT_NE(message.find(key.name, meant), std::string::npos) << message;
    }
  }
}

TEST(SceneRefusals, WordsAndTruths) {
  struct Word {
    const char *before, *name, *place;
  };
  const auto expect_refused = [](const std::vector<Word>& words, std::initializer_list<const char*> values,
                                 const std::string& allowed) {
    for (const auto& [before, name, place] : words) {
      for (const std::string value : values) {
        const std::string key = name, text = before + key.substr(key.rfind('.') + 1) + " = " + value + "\n";
        const std::string message = refusal(*before == '\0' ? text + "[device]\n" : text);
        EXPECT_TRUE(message.starts_with("bad.toml:" + std::string(place) + ": " + key + " = ")) << message;
        EXPECT_NE(message.find(": allowed is " + allowed), std::string::npos) << message;
      }
    }
  };
  expect_refused({{"[device]\n[integrator]\n", "integrator.kind", "3:8"},
                  {"[device]\n[encoder]\n", "encoder.kind", "3:8"},
                  {"[device]\n[motor]\n", "motor.kind", "3:8"}},
                 {"1", "true", "\"\"", "\"exakt\"", "nan", "[\"exact\"]", "\"Exact\""}, "\"");
  expect_refused(
      {{"", "identified", "1:14"},
       {"[device]\n[encoder]\n", "encoder.reversed", "3:12"},
       {"[device]\n[supply]\n", "supply.absorbs", "3:11"},
       {"[device]\n[operator]\n[axis1.device]\n[axis1.operator]\n", "axis1.operator.same_person", "5:15"}},
      {"1", "0.0", "\"true\"", "nan", "[true]"}, "true or false");
  expect_refused({{"", "name", "1:8"}, {"", "description", "1:15"}}, {"1", "nan", "true", "[\"a\"]"},
                 "a text in quotes");
}

TEST(SceneRefusals, ATableMustBeOne) {
  for (const char* table : {"device", "structure", "operator", "motion", "encoder", "motor", "inverter",
                            "current_sensor", "supply", "integrator", "measurement", "parameters", "axis1"}) {
    for (const char* value : {"1", "nan", "\"on\"", "true", "[]"}) {
      const std::string device = std::string(table) == "device" ? "" : "[device]\n";
      const std::string message = refusal(std::string(table) + " = " + value + "\n" + device);
      EXPECT_EQ(message.rfind(fmt::format("bad.toml:1:{}: {} = ", std::string(table).size() + 4, table), 0),
                0u)
          << message;
    }
    EXPECT_EQ(refusal(std::string("[[") + table + "]]\n").rfind("bad.toml:1:", 0), 0u) << table;
  }
}

// What a text makes the reader say, word for word.
TEST(SceneRefusals, NamePlaceKeyValueAndWhatIsAllowed) {
  const std::string defects =
      "\"phase_a_open\", \"phase_b_open\", \"phase_c_open\", \"phases_swapped\", \"encoder_unplugged\", "
      "\"encoder_stuck\", \"encoder_reversed\", \"encoder_slipping\", \"supply_low\", \"motor_blocked\", "
      "\"current_b_inverted\", \"current_c_inverted\", \"gate_driver_missing\", \"index_loose\"";
  const std::string motion = "[device]\n[operator]\n[motion]\nstart_position = -0.05\n";
  const std::string persons = "[device]\n[operator]\n[axis1.device]\n[axis1.operator]\nsame_person = true\n";
  for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
           {"[device]\nmass = -1\n", "2:8: device.mass = -1: allowed is a number from 0.0001 to 100 kg"},
           {"[device]\nmass = \"heavy\"\n",
            "2:8: device.mass = 'heavy' is not a number; allowed is a number from 0.0001 to 100 kg"},
           {"[device]\n\n  mas = 1.0\n",
            "3:3: device.mas = 1.0: unknown key; allowed here: mass, damping, friction, force_limit, delay, "
            "start_position, start_velocity; did you mean mass?"},
           {"[device]\n[operator]\ngrip = 1\n",
            "3:1: operator.grip = 1: unknown key; allowed here: grip_stiffness, grip_damping, hand_mass, "
            "arm_stiffness, arm_damping, activation_gain, activation_time, activation_limit, push_lag"},
           {"[device]\n[axis1.device]\n[axis1.encodr]\n",
            "3:8: axis1.encodr = {table}: unknown key; allowed here: device, structure, operator, motion, "
            "encoder, motor, inverter, current_sensor; did you mean encoder?"},
           {"seed = -1\n[device]\n", "1:8: seed = -1: allowed is a whole number from 0 to 2^63 - 1"},
           {"device = 3\n", "1:10: device = 3: allowed is a table, [device]"},
           {"[device]\n[parameters]\na.b = [1, 2]\n",
            "3:7: parameters.a.b = [array]: allowed is a number, a text or true/false"},
           {"[axis1.device]\n", "1:1: [device] is missing: every axis needs a device"},
           {motion + "wall_side = -1\nwall_position = 0.0\n[parameters]\nwall.position = -0.01\n",
            "6:17: motion.wall_position = 0: the parameter wall.position is -0.01 (bad.toml:8:17); allowed "
            "is the same value, or none here"},
           {"[device]\n[axis1.device]\n[axis1.operator]\nsame_person = true\n",
            "4:15: axis1.operator.same_person = true: nobody holds axis 0; allowed is that with an "
            "[operator]"},
           {persons + "[motor]\nkind = \"dc\"\n",
            "5:15: axis1.operator.same_person = true: allowed is that where neither axis has a motor of kind "
            "\"dc\" or \"pmsm\""},
           {"[device]\n[integrator]\nkind = \"rk5\"\n",
            "3:8: integrator.kind = 'rk5': allowed is \"exact\", \"semi_implicit_euler\", \"rk4\" or "
            "\"adaptive\"; did you mean rk4?"},
           {"[device]\n[motor]\nresistance = 1\n",
            "2:1: motor.kind is missing; allowed is \"ideal\", \"dc\" or \"pmsm\""},
           {"[device]\n[motor]\nkind = \"stepper\"\n",
            "3:8: motor.kind = 'stepper': allowed is \"ideal\", \"dc\" or \"pmsm\""},
           {"[device]\n[motor]\nkind = \"dc\"\npole_pairs = 7\n",
            "4:1: motor.pole_pairs = 7: unknown key; allowed here: kind, resistance, inductance, "
            "torque_constant, defects"},
           {"[device]\n[axis1.device]\n[axis1.motor]\nkind = \"pmsm\"\npole_pairs = 6.5\n",
            "3:1: axis1.motor.pole_pairs = 6.5: allowed is a whole number"},
           {"[device]\n[motor]\nkind = \"pmsm\"\ninductance = 1e-3\ninductance_q = 1e-3\n",
            "4:14: motor.inductance = 0.001: motor.inductance_q is given too; allowed is inductance, or "
            "inductance_d and inductance_q"},
           {"[device]\n[motor]\nkind = \"dc\"\ndefects = [\"smoke\"]\n",
            "4:12: motor.defects = 'smoke': allowed is a list of " + defects},
           {"[device]\n[motor]\nkind = \"dc\"\ndefects = 3\n",
            "4:11: motor.defects = 3: allowed is a list of " + defects},
           {"[device]\n[inverter]\n",
            "2:1: [inverter] without a [motor] of kind \"dc\" or \"pmsm\": there is no current; add the "
            "motor, or remove the table"},
           {"[device]\n[axis1.device]\n[axis1.current_sensor]\n",
            "3:1: [axis1.current_sensor] without a [axis1.motor] of kind \"dc\" or \"pmsm\": there is no "
            "current; add the motor, or remove the table"},
           {"[device]\n[encoder]\nkind = \"hall\"\n",
            "3:8: encoder.kind = 'hall': allowed is \"quadrature\" or \"as5047p\""},
           {"[device]\n[encoder]\nindex_position = 4000\n[motor]\nkind = \"dc\"\n",
            "2:1: encoder.index_position = 4000: allowed is a whole number below counts_per_turn = 4000"},
           // Parts that contradict each other.
           {"[device]\ndelay = 1e-3\n[motor]\nkind = \"dc\"\n",
            "2:9: device.delay = 0.001: with this [motor] the circuit makes the delay; allowed is 0 there, "
            "or a delay with [motor] kind = \"ideal\""},
           {"[device]\n[axis1.device]\ndelay = 1e-3\n[axis1.motor]\nkind = \"pmsm\"\n",
            "3:9: axis1.device.delay = 0.001: with this [axis1.motor] the circuit makes the delay; allowed "
            "is 0 there, or a delay with [axis1.motor] kind = \"ideal\""},
           {"[device]\n[integrator]\nsubsteps = 10\n",
            "3:12: integrator.substeps = 10: integrator.kind is \"exact\", which has none; allowed is that "
            "with kind = \"semi_implicit_euler\" or \"rk4\""},
           {"[device]\n[integrator]\nkind = \"adaptive\"\nsubsteps = 10\n",
            "4:12: integrator.substeps = 10: integrator.kind is \"adaptive\", which has none; allowed is "
            "that with kind = \"semi_implicit_euler\" or \"rk4\""},
           {"[device]\n[integrator]\nkind = \"rk4\"\ntolerance = 1e-9\n",
            "4:13: integrator.tolerance = 1e-09: integrator.kind is \"rk4\", which has none; allowed is that "
            "with kind = \"adaptive\""},
           {"[device]\n[motor]\nkind = \"ideal\"\nresistance = 1\n",
            "4:1: motor.resistance = 1: unknown key; allowed here: kind"},
           {"[device]\n[motor]\nkind = \"ideal\"\ndefects = [\"phase_b_open\"]\n",
            "4:11: motor.defects = [array]: an ideal motor has nothing that could break; allowed is "
            "motor.kind = \"dc\" or \"pmsm\", or no defects"},
           {"[device]\n[motor]\nkind = \"ideal\"\n[inverter]\n",
            "4:1: [inverter] without a [motor] of kind \"dc\" or \"pmsm\": there is no current; add the "
            "motor, or remove the table"},
           {"[device]\n[encoder]\nreversed = true\n",
            "3:12: encoder.reversed = true: how it is mounted belongs to a motor's encoder; allowed is that "
            "with [motor] kind = \"dc\" or \"pmsm\""},
           {"[device]\n[encoder]\nkind = \"as5047p\"\n",
            "3:8: encoder.kind = 'as5047p': this chip belongs to a motor's encoder; allowed is that with "
            "[motor] kind = \"dc\" or \"pmsm\""},
           {"[device]\n[encoder]\nindex_position = 3\n[motor]\nkind = \"ideal\"\n",
            "3:18: encoder.index_position = 3: an index belongs to a motor's encoder; allowed is that with "
            "[motor] kind = \"dc\" or \"pmsm\""},
           {"[device]\n[encoder]\ncounts_per_turn = 16.5\nedge_noise = 0.1\n",
            "2:1: encoder.counts_per_turn = 16.5: allowed is a whole number"},
       }) {
    EXPECT_EQ(refusal(text), "bad.toml:" + message);
  }
}

// Each with a place.
TEST(SceneRefusals, RefusesEveryKindOfNonsense) {
  const std::string person = "[device]\n[operator]\n[motion]\n", parameters = "[device]\n[parameters]\n";
  for (const auto& [text, part] : std::vector<std::pair<std::string, std::string>>{
           {"", "bad.toml:"},
           {"[device]\n[motion]\n", "bad.toml:"},
           {person + "wall_side = 0.5\n", "bad.toml:"},
           {person + "start_position = -1.0\n", "bad.toml:"},
           {person + "hold_time = 0.5\n", "bad.toml:"},
           {"duration = 2.0\n" + person, "bad.toml:"},
           {"[device]\n[axis1]\n", "bad.toml:"},
           {"[device]\n[axis2.device]\n", "bad.toml:"},
           {"[device]\n[axis0.device]\n", "bad.toml:"},
           {"[device]\n[encoder]\ncounts_per_turn = 1e9\ntransmission = 1e-6\n", "bad.toml:"},
           {"[device]\n[motor]\nkind = \"pmsm\"\nresistance = 100\ninductance = 1e-6\n", "bad.toml:"},
           {"[device]\n[axis1.device]\n[axis1.supply]\n", "bad.toml:"},
           {"[device]\n[motor]\nkind = \"dc\"\n[inverter]\ndead_time = 1e-6\n", "bad.toml:"},
           {"[device]\n[motor]\nkind = \"dc\"\n[encoder]\ncounts_per_turn = 16.5\n", "bad.toml:"},
           {"[device]\n[operator]\nsame_person = true\n",
            "bad.toml:3:1: operator.same_person = true: unknown key"},
           // Syntax errors.
           {"[device]\nmass = \n", "bad.toml:2:"},
           {"[device]\nmass = 1\nmass = 2\n", "bad.toml:3:"},
           // Axis 0 by its name is the same parameter.
           {parameters + "a.b = 1\n\"a.b\" = 2\n", "given twice"},
           {parameters + "axis0.wall.position = 0.01\nwall.position = 0.02\n", "bad.toml:4:"},
           {parameters + "axis0.wall.position = 0.01\nwall.position = 0.02\n",
            "given twice (also at bad.toml:3:"},
           {parameters + "axis0.wall.position = 0.01\nwall.position = 0.02\n", "as axis0.wall.position"},
           {parameters + "wall.position = 0.02\naxis0.wall.position = 0.02\n", "given twice"},
       }) {
    EXPECT_NE(refusal(text).find(part), std::string::npos) << text << " -> " << refusal(text);
  }
  // The second axis has a wall of its own.
  EXPECT_EQ(refusal(parameters + "axis1.wall.position = 0.01\nwall.position = 0.02\n"), "accepted");
  EXPECT_EQ(refusal(parameters + "axis1.wall.position = 0.01\naxis0.wall.position = 0.02\n"), "accepted");
  EXPECT_EQ(refusal("[device]\n[encoder]\ncounts_per_turn = 16.5\n"), "accepted") << "an ideal encoder may";
}

std::optional<Scene> accepted(const std::string& text) {
  try {
    return parse_scene(text, "extreme.toml");
  } catch (const SceneError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("extreme.toml:", 0), 0u) << error.what();
    return std::nullopt;
  }
}

void expect_finite(const CoupledHandle& handle, const std::string& text) {
  for (const double value :
       {handle.position(), handle.velocity(), handle.tip_position(), handle.tip_velocity(),
        handle.hand_position(), handle.hand_velocity(), handle.intended_position()})
    ASSERT_TRUE(std::isfinite(value)) << text;
}

void run_ideal(const Scene& scene, std::size_t axis, const std::string& text) {
  CoupledHandle handle = scene.make_handle(axis);
  AxisEncoder encoder(scene.axes[axis].encoder, handle.position(), scene.seed_of(axis));
  if (scene.axes[axis].motion) handle.begin_motion();
  for (const double duration : {50e-6, 2e-3}) {
    for (int n = 0; n < 10; ++n) {
      handle.advance(n % 2 == 0 ? 3.0 : -3.0, 1.0, duration);
      encoder.sample(handle.position());
      expect_finite(handle, text);
    }
  }
}

void run_driven(const Scene& scene, const std::string& text) {
  SceneDrives drives(scene);
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis)
    drives.set_bridge(axis, {{{{true, 0.5}, {true, 0.6}, {true, 0.4}}}});
  for (int n = 0; n < 20; ++n) drives.advance(25e-6);
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    if (!drives.has(axis)) continue;
    expect_finite(drives.drive(axis).handle(), text);
    for (const double current : drives.drive(axis).currents()) ASSERT_TRUE(std::isfinite(current)) << text;
  }
}

// What a value on the bound itself may be refused for is anything but its range.
TEST(SceneRefusals, BothEndsOfEveryRangeRunOrAreRefused) {
  int ran = 0;
  for (const Key& key : every_number()) {
    if (key.whole) continue;
    for (const double end : {key.minimum, key.maximum}) {
      const std::string text = scene_with(key, key.name, fmt::format("{:.17e}", end)).text;
      EXPECT_EQ(refusal(text).find("allowed is a number from"), std::string::npos) << text << refusal(text);
      const std::optional<Scene> scene = accepted(text);
      if (!scene) continue;
      ++ran;
      for (std::size_t axis = 0; axis < scene->axes.size(); ++axis) {
        if (!scene->axes[axis].motor) run_ideal(*scene, axis, text);
      }
      try {
        run_driven(*scene, text);
      } catch (const std::invalid_argument& error) {
        // 1 um of travel per radian, or 1000 N m/A: the shaft would turn faster than anything.
        EXPECT_NE(std::string(error.what()).find("allowed are"), std::string::npos) << error.what();
        EXPECT_TRUE(key.name == "transmission" || key.name == "torque_constant") << key.name;
      } catch (const PartBroken& broken) {
        EXPECT_EQ(key.name, "voltage") << broken.what();
      }
    }
  }
  EXPECT_GT(ran, 130);
}

// The corners of the mechanical parts together: stiffest on lightest, softest on heaviest.
TEST(SceneRefusals, StiffOnLightAndSoftOnHeavy) {
  for (const bool stiff : {false, true}) {
    for (const char* integrator : {"exact", "semi_implicit_euler", "rk4"}) {
      std::string text = fmt::format("[integrator]\nkind = \"{}\"\n", integrator);
      if (stiff) {
        text +=
            "[device]\nmass = 1e-3\ndelay = 1.7e-3\n[structure]\nstiffness = 1e5\nhandle_mass = 1e-3\n"
            "[operator]\ngrip_stiffness = 1e4\nhand_mass = 1e-2\n";
      } else {
        text +=
            "[device]\nmass = 100\n[structure]\nstiffness = 1\ndamping = 0\nhandle_mass = 100\n[operator]\n"
            "grip_stiffness = 1\ngrip_damping = 0\nhand_mass = 100\narm_stiffness = 1\narm_damping = 0\n";
      }
      const std::optional<Scene> scene = accepted(text);
      ASSERT_TRUE(scene) << text;
      if (stiff && std::string(integrator) != "exact") continue;  // what a fixed step cannot do
      run_ideal(*scene, 0, text);
    }
  }
}

}  // namespace kmax::simulation::scene_refusals_test
