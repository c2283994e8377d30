#include "host_tools/simulated_board/simulated_device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace kmax::simulated_board {

SimulatedDevice::SimulatedDevice(const simulation::Scene& scene) : axis_count_(scene.axes.size()) {
  if (scene.axes.size() > axes_.size())
    throw std::invalid_argument(
        fmt::format("a board has {} axes; the scene names {}", axes_.size(), scene.axes.size()));
  for (std::size_t i = 0; i < scene.axes.size(); ++i) {
    const simulation::SceneAxis& axis = scene.axes[i];
    if (axis.motor) {
      if (!power_) power_ = std::make_unique<SimulatedPower>(scene);
      continue;
    }
    simulation::CoupledHandle handle = scene.make_handle(i);
    const simulation::AxisEncoder encoder(axis.encoder, handle.position(), scene.seed_of(i));
    axes_[i].emplace(Axis{
        std::move(handle), encoder, {}, 0.0f, axis.motion.has_value(), i == 0 || axis.same_person, false});
  }
  encoder_connected_.fill(true);
}

firmware::AxisInput SimulatedDevice::sample(std::size_t axis) {
  if (has_motor(axis)) return samples_[axis] = power_->sample(axis);
  firmware::AxisInput input{};
  if (axes_[axis]) input.count = axes_[axis]->encoder.sample(axes_[axis]->handle.position());
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
  if (armed_now && axes_[axis]->moves) axes_[axis]->handle.begin_motion();
}

void SimulatedDevice::set_background_force(std::size_t axis, float force) {
  if (has_motor(axis)) return power_->set_background_force(axis, force);
  if (axes_[axis]) axes_[axis]->background_force = force;
}

void SimulatedDevice::advance(double duration) {
  advance(duration, 1);
}

void SimulatedDevice::advance(double duration, std::uint32_t times) {
  for (auto& axis : axes_) {
    if (!axis || (!axis->let_go && !axis->handle.has_operator())) continue;
    const auto force = static_cast<double>(axis->output.force);
    const double background = background_force(*axis);
    axis->handle.advance(force, background, duration, times);
  }
  for (std::uint32_t n = 0; power_ && n < times; ++n) power_->advance(duration);
}

bool SimulatedDevice::only_moves() const {
  return !power_ && std::none_of(axes_.begin(), axes_.end(),
                                 [](const auto& axis) { return axis && !axis->encoder.ideal(); });
}

/// What the hand on the axis answers to: the axes that one person holds stand at right angles.
double SimulatedDevice::background_force(const Axis& axis) const {
  auto force = static_cast<double>(axis.background_force);
  for (const auto& other : axes_) {
    if (other && &*other != &axis && other->first_person && axis.first_person)
      force = std::hypot(force, static_cast<double>(other->background_force));
  }
  return force;
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
