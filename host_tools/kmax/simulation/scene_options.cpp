#include "host_tools/kmax/simulation/scene_options.hpp"

#include <fmt/format.h>

#include <vector>

#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::cli {

std::string supplied_scene_names() {
  std::vector<std::string_view> names;
  for (const auto& one : simulated_board::supplied_scenes()) names.push_back(one.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

void add_scene_argument(CLI::App& command, std::string& scene, bool required) {
  command.add_option("scene", scene, "TOML file, or a supplied scene: " + supplied_scene_names())
      ->option_text("SCENE")
      ->required(required);
}

std::string unarmed_text(std::string_view given, firmware::Refusal refusal) {
  // The firmware's own advice is for a device that somebody holds.
  if (refusal == firmware::Refusal::commutation_unknown)
    return fmt::format(
        "its board does not know the motor yet. 'kmax simulate {0} --set identified=true' starts as after a "
        "calibration; to calibrate it, run 'kmax serve --scene {0} --serial /tmp/kmax' and 'kmax calibrate "
        "--device serial:/tmp/kmax'",
        given);
  return std::string(firmware::to_string(refusal));
}

}  // namespace kmax::cli
