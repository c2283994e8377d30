#include "host_tools/simulation/scene_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "host_tools/base/numbers.hpp"

namespace kmax::simulation {

namespace {
class KeyList {
 public:
  template <typename Model, std::size_t count>
  void numbers(std::string_view table, const std::array<ModelField<Model>, count>& fields,
               std::string_view motor = "", bool with_default = true) {
    for (const ModelField<Model>& field : fields) {
      std::string allowed =
          fmt::format("{} .. {}", base::number_text(field.minimum), base::number_text(field.maximum));
      if (!field.note.empty()) allowed += fmt::format(" ({})", field.note);
      keys.push_back({table, field.name, SceneValue::number, motor, field.unit,
                      with_default ? base::number_text(Model{}.*field.member) : "", std::move(allowed),
                      field.meaning});
    }
  }
  void truth(std::string_view table, std::string_view name, bool initial, std::string_view meaning) {
    keys.push_back(
        {table, name, SceneValue::truth, "", "", initial ? "true" : "false", "true, false", meaning});
  }
  void word(std::string_view table, std::string_view name, std::span<const std::string_view> words,
            std::string_view initial, std::string_view meaning) {
    keys.push_back({table, name, SceneValue::word, "", "",
                    initial.empty() ? "" : fmt::format("\"{}\"", initial),
                    fmt::format("\"{}\"", fmt::join(words, "\", \"")), meaning});
  }
  void text(std::string_view name, std::string_view meaning) {
    keys.push_back({"", name, SceneValue::text, "", "", "", "a text", meaning});
  }

  std::vector<SceneKey> keys;
};

std::vector<SceneKey> make_keys() {
  KeyList list;
  list.text("name", "name of the scene; without it the name of the file");
  list.text("description", "one sentence");
  list.numbers("", scene_fields);
  list.keys.push_back({"", "seed", SceneValue::whole, "", "", "1", "a whole number, 0 .. 2^63 - 1",
                       "of the noise of all parts"});
  list.truth("", "identified", true,
             "a board starts with the values of the scene's motors, as after a calibration; false: with the "
             "factory's");
  list.numbers("device", device_fields);
  list.numbers("device", start_fields);
  list.numbers("structure", structure_fields);
  list.numbers("operator", operator_fields);
  list.truth("operator", "same_person", false,
             "of a further axis only: its hand is that of axis 0's person, and answers to the background "
             "forces of both axes, which stand at right angles");
  list.numbers("motion", motion_fields);
  list.word("encoder", "kind", encoder_kinds, encoder_kinds.front(),
            "kind of encoder; as5047p needs a motor");
  list.numbers("encoder", encoder_fields);
  list.truth("encoder", "reversed", false, "it counts downwards while the position grows; needs a motor");
  list.truth("encoder", "select_filtered", true,
             "the select of an AS5047P passes a filter (solder jumper J20 is open)");
  list.word("motor", "kind", motor_kinds, "", "kind of motor; required in this table");
  list.numbers("motor", brushed_dc_motor_fields, "dc");
  list.numbers("motor", synchronous_motor_fields, "pmsm");
  list.numbers("motor", both_inductances_fields, "pmsm", false);
  std::vector<std::string_view> defects;
  for (const DefectName& one : defect_names) defects.push_back(one.name);
  list.keys.push_back({"motor", "defects", SceneValue::words, "", "", "[]",
                       fmt::format("a list of \"{}\"", fmt::join(defects, "\", \"")),
                       "what is wrong with the axis from the beginning; needs a motor that is not ideal"});
  list.numbers("inverter", inverter_fields);
  list.numbers("current_sensor", current_sensor_fields);
  list.numbers("supply", supply_fields);
  list.truth("supply", "absorbs", SupplyConfig{}.absorbs, "the source takes current back, as a battery does");
  list.truth("supply", "part_ratings", SupplyConfig{}.part_ratings,
             "the board's parts break above their ratings; false: they bear everything");
  list.numbers("spikes", spikes_fields);
  const SpikesConfig spikes;
  list.truth("spikes", "at_samples", spikes.at_samples,
             "they begin within 4 us after a conversion; false: at an edge of the present duties");
  list.truth("spikes", "index", spikes.index, "on the lines of the indexes");
  list.truth("spikes", "emergency_stop", spikes.emergency_stop, "on the line of the emergency stop");
  list.truth("spikes", "fault_line", spikes.fault_line, "on the fault line of the gate drivers");
  list.truth("spikes", "encoder", spikes.encoder, "on A and B of the encoders");
  list.word("integrator", "kind", integrator_names, integrator_names.front(),
            "method; the others are there to be compared with \"exact\"");
  list.numbers("integrator", integrator_fields);
  list.numbers("measurement", measurement_fields);
  return std::move(list.keys);
}
}  // namespace

const SceneTable* scene_table_named(std::string_view name) {
  const auto* found = std::find_if(scene_tables.begin(), scene_tables.end(),
                                   [&](const SceneTable& table) { return table.name == name; });
  return found == scene_tables.end() ? nullptr : found;
}

std::string SceneKey::full() const {
  return table.empty() ? std::string(name) : fmt::format("{}.{}", table, name);
}

const std::vector<SceneKey>& scene_keys() {
  static const std::vector<SceneKey> keys = make_keys();
  return keys;
}

std::vector<std::string_view> key_names(std::string_view table, std::string_view motor) {
  std::vector<std::string_view> names;
  for (const SceneKey& key : scene_keys()) {
    if (key.table == table && (key.motor.empty() || key.motor == motor)) names.push_back(key.name);
  }
  return names;
}

const SceneKey* find_scene_key(std::string_view table, std::string_view name) {
  for (const SceneKey& key : scene_keys()) {
    if (key.table == table && key.name == name) return &key;
  }
  return nullptr;
}

std::string scene_keys_markdown() {
  std::string page =
      R"(# Scenes

Made by `kmax simulate --keys` from the tables that the reader of scenes goes by. A scene is a TOML file that
says what a simulated run consists of. It names its parts; a part that is not named is not there.

A number is in the unit of its row, `mass = 0.06`, or a text with a unit that converts to it, `mass = "60 g"`.
Every key may be given on the command line instead: `kmax simulate touch --set device.mass=60g`, which takes
parameters of the firmware too. A name that is both is the key of the scene; `parameters.device.mass` names
the parameter. Further axes have tables of their own, `[axis1.device]`, in the tables marked "per axis".

The supplied scenes are in `host_tools/simulation/scenes`.
)";
  for (const SceneTable& table : scene_tables) {
    page += table.name.empty()
                ? "\n## Before all tables\n\n"
                : fmt::format("\n## [{}]{}\n\n", table.name, table.of_axis ? ", per axis" : "");
    page += fmt::format("{}\n", table.meaning);
    bool first = true;
    for (const SceneKey& key : scene_keys()) {
      if (key.table != table.name) continue;
      if (first) page += "\n| key | unit | default | allowed | meaning |\n|---|---|---|---|---|\n";
      first = false;
      page += fmt::format("| `{}` | {} | {} | {} | {}{} |\n", key.name, key.unit, key.initial, key.allowed,
                          key.motor.empty() ? "" : fmt::format("kind \"{}\": ", key.motor), key.meaning);
    }
  }
  return page;
}

}  // namespace kmax::simulation
