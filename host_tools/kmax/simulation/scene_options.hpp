#pragma once
// What the commands that simulate a scene have in common.

#include <CLI/App.hpp>

#include <string>
#include <string_view>

#include "firmware/parameters/refusal.hpp"

namespace kmax::cli {

/// The names of the supplied scenes: "touch, two_axes".
std::string supplied_scene_names();

/// The argument SCENE.
void add_scene_argument(CLI::App& command, std::string& scene, bool required);

/// Why an axis of the scene, given on the command line as `given`, could not be armed, and what to do.
std::string unarmed_text(std::string_view given, firmware::Refusal refusal);

}  // namespace kmax::cli
