#pragma once
// Reads what a scene says about the parts of an axis beside the person: [device] and [structure]; [encoder],
// [motor], [inverter] and [current_sensor]; and what all axes share, [integrator] and [supply]. All throw
// SceneError with the place in the file.

#include <string>

#include "host_tools/simulation/scene.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::simulation {

// `table`: the one that holds the tables of the axis; `prefix`: "" or "axis1.".
void read_device_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis);
// Where the handle begins: what [device] says, and otherwise what is in the axis already.
void read_start(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                SceneAxis& axis);
// What the device and the other parts of the axis contradict each other in; when all have been read.
void check_device(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                  const SceneAxis& axis);
void read_integrator_table(const SceneTables& tables, const toml::table& root, Scene& scene);

// The motor is read before the encoder, which needs to know whether there is one.
void read_encoder_table(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis);
void read_motor_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                       SceneAxis& axis);
void read_supply_table(const SceneTables& tables, const toml::table& root, Scene& scene);

}  // namespace kmax::simulation
