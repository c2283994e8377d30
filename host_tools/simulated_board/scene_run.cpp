#include "host_tools/simulated_board/scene_run.hpp"

#include <chrono>

#include "firmware/haptic_configuration.hpp"

namespace kmax::simulated_board {

namespace {
constexpr std::size_t controlword_entry = firmware::entry_of<"drive.controlword">();

/// Lets the settings arrive, then walks to "operation enabled".
void arm(SimulatedBoard& simulation) {
  simulation.board().advance(firmware::tick_rate_hz / 10);
  for (const std::uint32_t word : {0x06u, 0x07u, 0x0Fu}) {
    simulation.board().application().preset(controlword_entry, 0, word);
    simulation.board().advance(1);
  }
}

std::optional<simulation::ContactMeasure> judge(const simulation::Scene& scene, const RunResult& result) {
  if (!scene.axes[0].motion || result.judged_to > scene.duration || result.samples.empty())
    return std::nullopt;
  std::vector<simulation::ContactSample> positions;
  for (const RunSample& sample : result.samples) positions.push_back({sample.time, sample.true_position});
  simulation::ContactCriterion criterion;
  criterion.window_begin = result.judged_from;
  criterion.window_end = result.judged_to;
  criterion.threshold = scene.measurement.threshold;
  criterion.wall_position = scene.axes[0].motion->wall_position;
  criterion.wall_side = scene.axes[0].motion->wall_side;
  return simulation::measure_contact(positions, criterion);
}
}  // namespace

RunResult run_scene(const simulation::Scene& scene) {
  const auto real_begin = std::chrono::steady_clock::now();
  SimulatedBoard simulation(scene);
  firmware::Application& application = simulation.board().application();
  // Nobody talks to this board; its link supervision would take the force away.
  application.preset(firmware::entry_of<"link.timeout">(), 0, 0);
  RunResult result;
  arm(simulation);
  if (application.state(0) != firmware::DriveState::operation_enabled) {
    result.end_state = application.state(0);
    result.refusal = application.refusal(0);
    return result;
  }
  const double length = firmware::count_length(application.values(), 0);
  const auto ticks = static_cast<std::uint64_t>(scene.duration * firmware::tick_rate_hz + 0.5);
  const simulation::CoupledHandle& handle = simulation.device().handle(0);
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    const double true_position = handle.position(), true_velocity = handle.velocity();
    const double hand = handle.hand_position(), intended = handle.intended_position();
    simulation.board().advance(1);
    const auto& haptic = application.ISR_report(0).haptic;
    if (!haptic.new_sample) continue;
    result.samples.push_back({static_cast<double>(tick) / firmware::tick_rate_hz, true_position,
                              true_velocity, hand, intended, static_cast<double>(haptic.position) * length,
                              static_cast<double>(haptic.velocity), static_cast<double>(haptic.force),
                              handle.applied_force(), static_cast<double>(haptic.magnetic_coefficient)});
  }
  const auto& report = application.ISR_report(0);
  result.end_state = application.state(0);
  result.fault = application.fault(0);
  result.limited_share =
      report.armed_samples == 0 ? 0.0 : static_cast<double>(report.limited_samples) / report.armed_samples;
  result.clipped_share = handle.clipped_share();
  if (handle.has_operator() && handle.motion().hold_end()) {
    result.judged_to = *handle.motion().hold_end();
    result.judged_from = result.judged_to - scene.measurement.window;
    result.contact = judge(scene, result);
  }
  result.simulated_s = static_cast<double>(simulation.board().now_us()) * 1e-6;
  result.real_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - real_begin).count();
  return result;
}

}  // namespace kmax::simulated_board
