#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

// Where the scenes lie that the program brings along, from wherever in the repository a test runs: a path
// that is compiled in would differ from clone to clone, and the compiler cache would hold none of it for
// another one.
inline std::filesystem::path scene_folder() {
  std::filesystem::path folder = std::filesystem::current_path();
  while (!std::filesystem::exists(folder / "host_tools/simulation/scenes")) {
    if (folder == folder.root_path())
      throw std::runtime_error("the scenes are not found: run this in the repository");
    folder = folder.parent_path();
  }
  return folder / "host_tools/simulation/scenes";
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
