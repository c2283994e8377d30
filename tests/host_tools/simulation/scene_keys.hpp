#pragma once
// Every number that a scene file may hold, with the table it stands in and its range; and a scene with one of
// them in it.

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

// One key of one table: where it is written, and what it may be.
struct Key {
  std::string table;   // "" at the top
  std::string needed;  // what else the table must hold, on one line each
  std::string name;
  double minimum = 0.0, maximum = 0.0;
  bool whole = false;
  std::string full() const { return table.empty() ? name : table + "." + name; }
};

inline constexpr double infinity = std::numeric_limits<double>::infinity();

template <typename Model, std::size_t count>
void add_keys(std::vector<Key>& keys, const std::string& table,
              const std::array<ModelField<Model>, count>& fields, const std::string& needed = "") {
  for (const auto& field : fields)
    keys.push_back({table, needed, std::string(field.name), field.minimum, field.maximum});
}

inline void add_axis_keys(std::vector<Key>& keys, const std::string& prefix) {
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

inline std::vector<Key> every_number() {
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
inline Written scene_with(const Key& key, const std::string& name, const std::string& value) {
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

}  // namespace kmax::simulation
