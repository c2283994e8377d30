#include "host_tools/simulated_board/simulated_device.hpp"

#include <stdexcept>
#include <utility>

namespace kmax::simulated_board {

SimulatedDevice::SimulatedDevice(const simulation::Scene& scene) : axis_count_(scene.axes.size()) {
  if (scene.axes.size() > axes_.size())
    throw std::invalid_argument("a board has two axes; the scene names more");
  for (std::size_t i = 0; i < scene.axes.size(); ++i) {
    const simulation::SceneAxis& axis = scene.axes[i];
    if (axis.motor) {
      if (!power_) power_ = std::make_unique<SimulatedPower>(scene);
      continue;
    }
    axes_[i].emplace(
        Axis{axis.make_handle(), simulation::EncoderModel(axis.encoder.count_length()), {}, false});
  }
  encoder_connected_.fill(true);
}

firmware::AxisInput SimulatedDevice::sample(std::size_t axis) {
  if (has_motor(axis)) return samples_[axis] = power_->sample(axis);
  firmware::AxisInput input{};
  input.count = count(axis);
  input.count_valid = count_valid(axis);
  return input;
}

std::uint32_t SimulatedDevice::count(std::size_t axis) const {
  if (has_motor(axis)) return samples_[axis].count;
  return axes_[axis] ? axes_[axis]->encoder.counts(axes_[axis]->handle.position()) : 0u;
}

bool SimulatedDevice::count_valid(std::size_t axis) const {
  return has_motor(axis) ? samples_[axis].count_valid : encoder_connected_[axis];
}

void SimulatedDevice::drive(std::size_t axis, const firmware::AxisOutput& output) {
  if (has_motor(axis)) return power_->drive(axis, output);
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
  if (power_) power_->advance(duration);
}

void SimulatedDevice::connect_encoder(std::size_t axis, bool connected) {
  if (!has_motor(axis)) {
    encoder_connected_[axis] = connected;
    return;
  }
  using simulation::Defect;
  if (connected) {
    power_->drives().mend(axis, Defect::encoder_unplugged);
  } else {
    power_->drives().plant(axis, Defect::encoder_unplugged);
  }
}

const simulation::CoupledHandle& SimulatedDevice::handle(std::size_t axis) const {
  if (power_ && power_->has(axis)) return std::as_const(*power_).drives().drive(axis).handle();
  return axes_[axis]->handle;
}

SimulatedPower& SimulatedDevice::power() {
  if (!power_) throw std::logic_error("no axis of the scene has a motor");
  return *power_;
}

}  // namespace kmax::simulated_board
