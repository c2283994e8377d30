#include "host_tools/simulated_board/simulated_device.hpp"

#include <stdexcept>

namespace kmax::simulated_board {

SimulatedDevice::SimulatedDevice(const simulation::Scene& scene) : axis_count_(scene.axes.size()) {
  if (scene.axes.size() > axes_.size())
    throw std::invalid_argument("a board has two axes; the scene names more");
  for (std::size_t i = 0; i < scene.axes.size(); ++i) {
    const simulation::SceneAxis& axis = scene.axes[i];
    axes_[i].emplace(
        Axis{axis.make_handle(), simulation::EncoderModel(axis.encoder.count_length()), {}, false});
  }
  encoder_connected_.fill(true);
}

std::uint32_t SimulatedDevice::count(std::size_t axis) const {
  return axes_[axis] ? axes_[axis]->encoder.counts(axes_[axis]->handle.position()) : 0u;
}

void SimulatedDevice::drive(std::size_t axis, const firmware::AxisOutput& output) {
  if (!axes_[axis]) return;
  const bool armed_now = output.enabled && !axes_[axis]->output.enabled;
  axes_[axis]->output = output;
  axes_[axis]->let_go = axes_[axis]->let_go || armed_now;
  if (armed_now && axes_[axis]->handle.has_operator()) axes_[axis]->handle.begin_motion();
}

void SimulatedDevice::advance(double duration) {
  for (auto& axis : axes_) {
    if (!axis || (!axis->let_go && !axis->handle.has_operator())) continue;
    axis->handle.advance(static_cast<double>(axis->output.force),
                         static_cast<double>(axis->output.background_force), duration);
  }
}

}  // namespace kmax::simulated_board
