#include "host_tools/simulated_board/scene_run.hpp"

#include <array>
#include <chrono>

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::simulated_board {

namespace {
constexpr std::size_t controlword_entry = firmware::entry_of<"drive.controlword">();

/// One tick, and those behind it that only hold: at most `most` in all.
std::uint64_t advance(SimulatedBoard& simulation, RunTicks ticks, std::uint64_t most) {
  simulation.board().advance(1);
  return 1 + (ticks == RunTicks::every ? 0 : simulation.board().advance_held(most - 1));
}

/// Lets the settings arrive, then walks all axes of the scene to "operation enabled" together.
void arm(SimulatedBoard& simulation, std::size_t axes, RunTicks ticks) {
  constexpr std::uint64_t settling = firmware::tick_rate_hz / 10;
  for (std::uint64_t tick = 0; tick < settling;) tick += advance(simulation, ticks, settling - tick);
  for (const std::uint32_t word : {0x06u, 0x07u, 0x0Fu}) {
    for (std::size_t axis = 0; axis < axes; ++axis)
      simulation.board().application().preset(controlword_entry, axis, word);
    simulation.board().advance(1);
  }
}

/// The true handle, before the tick that samples it.
RunSample seen(const simulation::CoupledHandle& handle, double time) {
  RunSample sample{};
  sample.time = time;
  sample.true_position = handle.position();
  sample.tip_position = handle.tip_position();
  sample.true_velocity = handle.velocity();
  sample.hand_position = handle.hand_position();
  sample.intended_position = handle.intended_position();
  return sample;
}

void add_report(RunSample& sample, const control::HapticLoop<float>::Output& haptic, double count_length) {
  sample.position = static_cast<double>(haptic.position) * count_length;
  sample.velocity = static_cast<double>(haptic.velocity);
  sample.force = static_cast<double>(haptic.force);
  sample.magnetic_coefficient = static_cast<double>(haptic.magnetic_coefficient);
}

/// The axis that the run's end is about.
std::size_t axis_to_report(const firmware::Application& application, std::size_t axes) {
  for (std::size_t axis = 0; axis < axes; ++axis) {
    if (application.state(axis) != firmware::DriveState::operation_enabled) return axis;
  }
  return 0;
}

std::optional<simulation::ContactMeasure> judge(const simulation::Scene& scene, const RunResult& result) {
  if (!scene.axes[0].motion || result.judged_to > scene.duration || result.samples[0].empty())
    return std::nullopt;
  std::vector<simulation::ContactSample> positions;
  for (const RunSample& sample : result.samples[0]) positions.push_back({sample.time, sample.true_position});
  simulation::ContactCriterion criterion{.window_begin = result.judged_from,
                                         .window_end = result.judged_to,
                                         .threshold = scene.measurement.threshold,
                                         .wall_position = scene.axes[0].motion->wall_position,
                                         .wall_side = scene.axes[0].motion->wall_side};
  return simulation::measure_contact(positions, criterion);
}
}  // namespace

RunResult run_scene(const simulation::Scene& scene, RunTicks which) {
  const auto real_begin = std::chrono::steady_clock::now();
  SimulatedBoard simulation(scene);
  firmware::Application& application = simulation.board().application();
  // Nobody talks to this board; its link supervision would take the force away.
  application.preset(firmware::entry_of<"link.timeout">(), 0, 0);
  RunResult result;
  const std::size_t axes = scene.axes.size();
  result.samples.resize(axes);
  arm(simulation, axes, which);
  result.axis = axis_to_report(application, axes);
  result.end_state = application.state(result.axis);
  result.refusal = application.refusal(result.axis);
  if (result.end_state != firmware::DriveState::operation_enabled) return result;
  std::array<double, firmware::axis_count> lengths{};
  for (std::size_t axis = 0; axis < axes; ++axis)
    lengths[axis] = firmware::count_length(application.values(), axis);
  const auto ticks = static_cast<std::uint64_t>(scene.duration * firmware::tick_rate_hz + 0.5);
  for (std::size_t axis = 0; axis < axes; ++axis) {
    const auto divider = firmware::haptic_configuration(application.values(), axis).divider;
    result.samples[axis].reserve(ticks / divider + 1);
  }
  const simulation::CoupledHandle& handle = simulation.device().handle(0);
  for (std::uint64_t tick = 0; tick < ticks; ++result.firmware_ticks) {
    std::array<RunSample, firmware::axis_count> samples{};
    const double time = static_cast<double>(tick) / firmware::tick_rate_hz;
    for (std::size_t axis = 0; axis < axes; ++axis)
      samples[axis] = seen(simulation.device().handle(axis), time);
    simulation.board().advance(1);
    ++tick;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const auto& haptic = application.ISR_haptic(axis);
      if (!haptic.new_sample) continue;
      add_report(samples[axis], haptic, lengths[axis]);
      if (axis == 0 && haptic.unstable && !result.first_alarm) result.first_alarm = time;
      samples[axis].applied_force = simulation.device().handle(axis).applied_force();
      result.samples[axis].push_back(samples[axis]);
    }
    if (which == RunTicks::needed) tick += simulation.board().advance_held(ticks - tick);
  }
  const auto& report = application.ISR_report(0);
  result.axis = axis_to_report(application, axes);
  result.end_state = application.state(result.axis);
  result.fault = application.fault(result.axis);
  result.limited_share =
      report.armed_samples == 0 ? 0.0 : static_cast<double>(report.limited_samples) / report.armed_samples;
  result.alarms = report.alarms;
  result.clipped_share = handle.clipped_share();
  result.lost_edges = simulation.device().lost_edges(0);
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
