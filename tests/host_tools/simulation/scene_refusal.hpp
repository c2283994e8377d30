#pragma once

#include <string>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

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
