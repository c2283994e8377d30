#pragma once
// Puts settings into the tables of a scene before they are read, as if the file said so. For the readers of
// scenes only: it needs toml++.

#include <toml++/toml.h>

#include <span>
#include <string_view>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

// Throws SceneError for an axis or a part that the scene does not have. What is wrong with a name or a value
// is the reader's to say: it finds what was put here without a place in the file.
void put_settings(toml::table& root, std::span<const SceneSetting> settings, std::string_view source);

}  // namespace kmax::simulation
