#include "host_tools/simulated_board/simulated_board.hpp"

#include <fmt/format.h>

#include <filesystem>

template class kmax::board::NativeBoard<kmax::simulated_board::SimulatedDevice>;

namespace kmax::simulated_board {

simulation::Scene open_scene(const std::string& name_or_path,
                             std::span<const simulation::SceneSetting> settings) {
  if (std::filesystem::exists(name_or_path))
    return simulation::load_scene(name_or_path, check_parameter, settings);
  std::string names;
  for (const SuppliedScene& scene : supplied_scenes()) {
    if (scene.name == name_or_path)
      return simulation::parse_scene(scene.text, scene.name, check_parameter, settings);
    names += fmt::format("{}{}", names.empty() ? "" : ", ", scene.name);
  }
  throw simulation::SceneError(fmt::format(
      "{}: no such file, and no supplied scene of that name; supplied are {}", name_or_path, names));
}

simulation::Scene factory_scene() {
  simulation::Scene scene = open_scene("touch");
  scene.parameters.clear();
  return scene;
}

}  // namespace kmax::simulated_board
