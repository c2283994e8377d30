#pragma once

#include <filesystem>
#include <string>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

// Where the scenes lie that the program brings along.
inline std::filesystem::path scene_folder() {
  const std::filesystem::path here = std::filesystem::path(__FILE__).parent_path();
  return (here / "../../../host_tools/simulation/scenes").lexically_normal();
}

// One of them, by its name.
inline Scene scene_file(const std::string& name) {
  return load_scene((scene_folder() / (name + ".toml")).string());
}

// The message of the SceneError that the text of a scene "bad.toml" provokes, or "accepted".
inline std::string refusal(const std::string& text, const ParameterCheck& check = {}) {
  try {
    parse_scene(text, "bad.toml", check);
    return "accepted";
  } catch (const SceneError& error) {
    return error.what();
  }
}

}  // namespace kmax::simulation
