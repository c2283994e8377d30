#include <kmax/errors.hpp>
#include <kmax/scene.hpp>

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/device/drive.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/libkmax/translated.hpp"
#include "host_tools/simulated_board/scene_run.hpp"

namespace kmax {

namespace {
void replace(simulation::Scene& scene, const std::string& name, const std::string& value) {
  if (const auto wrong = simulated_board::check_parameter(name, value)) throw ValueError(*wrong);
  std::erase_if(scene.parameters, [&](const simulation::SceneParameter& one) { return one.name == name; });
  scene.parameters.push_back({name, value, "parameters"});
}

SceneSample sample_of(const simulated_board::RunSample& sample) {
  return {.time = sample.time,
          .true_position = sample.true_position,
          .true_velocity = sample.true_velocity,
          .hand_position = sample.hand_position,
          .position = sample.position,
          .velocity = sample.velocity,
          .force = sample.force,
          .applied_force = sample.applied_force};
}
}  // namespace

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& one : simulated_board::supplied_scenes()) names.emplace_back(one.name);
  return names;
}

SceneResult run_scene(const std::string& name,
                      const std::vector<std::pair<std::string, std::string>>& parameters) {
  return library::translated([&] {
    simulation::Scene scene = simulated_board::open_scene(name);
    for (const auto& [parameter, value] : parameters) replace(scene, parameter, value);
    const simulated_board::RunResult run = simulated_board::run_scene(scene);
    if (run.samples.at(0).empty())
      throw RefusedError(fmt::format("{}: axis {} could not be armed: {}", scene.name, run.axis,
                                     firmware::to_string(run.refusal)));
    SceneResult result{.name = scene.name,
                       .state = std::string(device::name_of(run.end_state)),
                       .fault = std::string(firmware::text_of(run.fault).name)};
    for (const auto& axis : run.samples) {
      auto& samples = result.axes.emplace_back();
      std::ranges::transform(axis, std::back_inserter(samples), sample_of);
    }
    if (run.contact) {
      result.contact = experiment::to_string(run.contact->verdict);
      result.peak_to_peak = run.contact->peak_to_peak;
      result.deepest = run.contact->deepest;
    }
    return result;
  });
}

}  // namespace kmax
