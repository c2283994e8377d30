#pragma once
// Reads what a scene says about the electrical parts: [encoder], [motor], [inverter], [current_sensor] of one
// axis, and [supply]. All throw SceneError with the place in the file.

#include <string>

#include "host_tools/simulation/scene.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::simulation {

// `table`: the one that holds the tables of the axis; `prefix`: "" or "axis1.".
// The motor is read before the encoder, which needs to know whether there is one.
void read_encoder_table(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis);
void read_motor_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                       SceneAxis& axis);
void read_supply_table(const SceneTables& tables, const toml::table& root, Scene& scene);

}  // namespace kmax::simulation
