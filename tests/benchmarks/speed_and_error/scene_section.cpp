#include <fmt/format.h>

#include <cmath>

#include "host_tools/simulated_board/scene_run.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

using simulated_board::RunTicks;

struct SceneTime {
  double seconds = 0.0, simulated = 0.0;  // s, of processor time and of the scene
  std::uint64_t ticks = 0;                // of the firmware, since arming
  double ratio() const { return simulated / seconds; }
};

SceneTime time_of(const simulation::Scene& scene, RunTicks ticks, int repetitions) {
  SceneTime time;
  time.seconds = best_processor_time(repetitions, [&] {
    const simulated_board::RunResult run = simulated_board::run_scene(scene, ticks);
    time.simulated = run.simulated_s;
    time.ticks = run.firmware_ticks;
  });
  return time;
}

// Three digits, as far as they mean something.
std::string rounded(double ratio) {
  return fmt::format("{:.0f}", ratio < 1000.0 ? ratio : 10.0 * std::round(ratio / 10.0));
}

// The handle alone, moved as often as the firmware has ticks: no run can be faster.
double handle_alone(const simulation::Scene& scene, int repetitions) {
  const simulated_board::RunResult run = simulated_board::run_scene(scene);
  const auto pieces =
      static_cast<std::uint32_t>(20000.0 * (run.samples[0][1].time - run.samples[0][0].time) + 0.5);
  const double seconds = best_processor_time(repetitions, [&] {
    simulation::CoupledHandle handle = scene.make_handle(0);
    if (handle.has_operator()) handle.begin_motion();
    for (const simulated_board::RunSample& sample : run.samples[0])
      handle.advance(sample.force, sample.force > 0.0 ? sample.magnetic_coefficient : 0.0, 50e-6, pieces);
    keep(handle.position());
  });
  return scene.duration / seconds;
}

}  // namespace

report::Section scene_section() {
  report::Section section{"Scenes through the firmware", {}, {}, {}};
  section.paragraphs.emplace_back(
      "Compared: a run of 'kmax simulate' in which the firmware runs all of its 20,000 ticks a second, with "
      "the one that it does: of a scene without motor or encoder defects only the ticks that do more than "
      "hold the force between two haptic samples. The handle moves through every tick in both, in pieces of "
      "50 us.");
  section.paragraphs.emplace_back(
      "The results are equal bit for bit (tests/host_tools/simulated_board/scene_run_test.cpp), so there is "
      "no error to weigh against the speed. The ratio is what 'kmax simulate' prints, from building the "
      "board to the last sample, but of processor time; a field changes the hand's stiffness in every piece, "
      "which then takes most of the time.");
  report::Table table{"Simulated seconds per second:",
                      {"scene", "haptic rate (Hz)", "every tick", "as run", "factor",
                       "ticks run of each 1000", "handle alone, about"},
                      {}};
  for (const char* name : {"touch", "free_handle", "compliant_structure", "paper2_fig_1", "two_axes",
                           "paper1_fig_10", "paper1_fig_12", "noisy_encoder", "motor_axes"}) {
    const simulation::Scene scene = simulated_board::open_scene(name);
    const SceneTime every = time_of(scene, RunTicks::every, 3), needed = time_of(scene, RunTicks::needed, 60);
    const simulated_board::RunResult run = simulated_board::run_scene(scene);
    const double rate = 1.0 / (run.samples[0][1].time - run.samples[0][0].time);
    const bool alone = scene.axes.size() == 1 && !scene.axes[0].motor;
    table.rows.push_back(
        {name, fmt::format("{:.0f}", rate), rounded(every.ratio()), rounded(needed.ratio()),
         fmt::format("{:.1f}", needed.ratio() / every.ratio()),
         fmt::format("{:.0f}", 1e3 * static_cast<double>(needed.ticks) / static_cast<double>(every.ticks)),
         alone ? rounded(handle_alone(scene, 9)) : std::string("-")});
  }
  section.tables.push_back(std::move(table));
  return section;
}

}  // namespace kmax::benchmark
