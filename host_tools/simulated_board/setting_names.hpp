#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulated_board {

/// What `--set NAME=VALUE` of a simulated run names: a key of the scene ("device.mass", "seed",
/// "axis1.operator.hand_mass") or a parameter of the firmware ("wall.stiffness"). A name that is both is the
/// scene's; "parameters.device.mass" is the firmware's.
struct NamedSetting {
  std::string name;  ///< as simulation::SceneSetting has it
  std::string_view unit;
  bool number = false;  ///< not a word, a text or a truth
};

/// ValueError for a name that is neither, with what may have been meant.
NamedSetting resolve_setting(std::string_view name);

/// "NAME=VALUE" each. ValueError for a name that is unknown or given twice, and for a text without "=".
/// Values are judged when the scene is read.
std::vector<simulation::SceneSetting> parse_settings(const std::vector<std::string>& texts);

/// The two sides of "NAME=VALUE", without spaces around them. ValueError without "=".
simulation::SceneSetting split_setting(const std::string& text);

}  // namespace kmax::simulated_board
