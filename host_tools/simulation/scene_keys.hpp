#pragma once
// Every table and every key that a scene file may have. The reader accepts these and no others, and
// docs/scenes.md and `kmax simulate --keys` show them.

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/simulation/model_field.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

struct SceneTable {
  std::string_view name;  // "" for the keys that stand before all tables
  bool of_axis;           // a further axis has it too, as [axis1.NAME]
  bool part;              // without the table the part is not there; else it has its defaults
  std::string_view meaning;
};

inline constexpr std::array scene_tables{
    SceneTable{"", false, false, "Of the whole scene; before all tables."},
    SceneTable{"device", true, true, "The mechanical side of an axis, seen at the handle. Required."},
    SceneTable{"structure", true, true, "The handle behind a compliant structure."},
    SceneTable{"operator", true, true, "The hand and arm of the person who holds the handle."},
    SceneTable{"motion", true, true,
               "What that person does: approach, press, let go. Needs `[operator]`; without it the person "
               "stays at the start."},
    SceneTable{"encoder", true, false, "The encoder on the motor shaft, and the transmission to the handle."},
    SceneTable{"motor", true, true,
               "The motor. Without it, or with `kind = \"ideal\"`, a force source with the device's limit."},
    SceneTable{"inverter", true, false, "The power stage; needs a motor that is not ideal."},
    SceneTable{"current_sensor", true, false,
               "Shunts and amplifiers of the legs B and C; needs a motor that is not ideal."},
    SceneTable{"supply", false, false, "The supply of the board; of use with a motor that is not ideal."},
    SceneTable{"spikes", false, true, "Interference on the lines of a virtual board."},
    SceneTable{"integrator", false, false,
               "How the mechanical parts are integrated. Circuits are always solved exactly."},
    SceneTable{"measurement", false, false, "How the held contact is judged."},
    SceneTable{"parameters", false, false,
               "Parameters of the firmware by their names (docs/parameters.md), `wall.stiffness = 5500` or "
               "`\"wall.stiffness\" = 5500`; those of a further axis as `axis1.wall.stiffness`."},
};

const SceneTable* scene_table_named(std::string_view name);

enum class SceneValue { number, whole, truth, word, text, words };

struct SceneKey {
  std::string_view table;
  std::string_view name;
  SceneValue type;
  std::string_view motor;  // "dc" or "pmsm": of this kind of motor only
  std::string_view unit;
  std::string initial;  // as in the file; empty: none
  std::string allowed;
  std::string_view meaning;

  // "device.mass"; without a table the name.
  std::string full() const;
};

// In the order of scene_tables.
const std::vector<SceneKey>& scene_keys();

// The names of one table's keys; of [motor] those of one kind.
std::vector<std::string_view> key_names(std::string_view table, std::string_view motor = "");

// The key of this table; of [motor] the first kind's that has it.
const SceneKey* find_scene_key(std::string_view table, std::string_view name);

// docs/scenes.md.
std::string scene_keys_markdown();

// Tables that belong to no model struct of their own.
inline constexpr std::array measurement_fields{
    ModelField<Measurement>{"window", &Measurement::window, 1e-3, 1e5, "s",
                            "end of the hold phase that is judged"},
    ModelField<Measurement>{"threshold", &Measurement::threshold, 1e-9, 1.0, "m",
                            "peak to peak above which the contact is unstable"},
};
inline constexpr std::array scene_fields{
    ModelField<Scene>{"duration", &Scene::duration, 1e-3, 1e5, "s", "from the start of the motion"}};
inline constexpr std::array start_fields{
    ModelField<HandleStart>{"start_position", &HandleStart::position, -10.0, 10.0, "m",
                            "where the handle begins; without it motion.start_position"},
    ModelField<HandleStart>{"start_velocity", &HandleStart::velocity, -100.0, 100.0, "m/s",
                            "with what velocity it begins"},
};
struct BothInductances {
  double inductance = 0.0;
};
inline constexpr std::array both_inductances_fields{
    ModelField<BothInductances>{"inductance", &BothInductances::inductance, 1e-7, 1.0, "H",
                                "for inductance_d and inductance_q"},
};
inline constexpr std::array<std::string_view, 3> motor_kinds{"ideal", "dc", "pmsm"};
inline constexpr std::array<std::string_view, 2> encoder_kinds{"quadrature", "as5047p"};

}  // namespace kmax::simulation
