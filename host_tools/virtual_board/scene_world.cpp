#include "host_tools/virtual_board/scene_world.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "drivers/as5047p_frames.hpp"
#include "drivers/stm32f4/current_sampling.hpp"

namespace kmax::virtual_board {

using simulation::CurrentSensor;
using simulation::EncoderKind;

SceneWorld::SceneWorld(const simulation::Scene& scene) : supply_(scene.make_supply()) {
  if (scene.axes.size() > axes_.size())
    throw std::invalid_argument("a board has two axes; the scene names more");
  std::size_t serial_encoders = 0;
  for (std::size_t i = 0; i < scene.axes.size(); ++i) {
    if (!scene.axes[i].motor) continue;
    axes_[i].drive.emplace(scene.make_drive(i));
    axes_[i].encoder_kind = scene.axes[i].encoder.kind;
    serial_encoders += axes_[i].encoder_kind == EncoderKind::as5047p ? 1 : 0;
    if (!axes_[i].drive->handle().has_operator()) axes_[i].drive->block(true);
  }
  if (serial_encoders > 1)
    throw std::invalid_argument("encoder.kind = as5047p on both axes: this board has one chip select for it");
}

simulation::MotorDrive& SceneWorld::drive(std::size_t axis) {
  if (!has_drive(axis)) throw std::out_of_range(fmt::format("axis {} of the scene has no motor", axis));
  return *axes_[axis].drive;
}

void SceneWorld::advance_to(BoardTime now) {
  if (now <= time_) return;
  // The circuits take at most 10 ms at a time.
  constexpr BoardTime longest = units_per_second / 100;
  while (time_ < now) {
    const BoardTime step = now - time_ < longest ? now - time_ : longest;
    const double duration = seconds(step);
    for (Axis& axis : axes_) {
      if (axis.drive) axis.drive->advance(duration, axis.command, supply_);
    }
    supply_.advance(duration);
    time_ += step;
  }
  for (Axis& axis : axes_) {
    if (axis.drive) axis.drive->encoder().update(axis.drive->handle().position());
  }
}

void SceneWorld::set_bridge(std::size_t index, const std::array<PwmLegOutput, 3>& legs, BoardTime now) {
  advance_to(now);
  Axis& axis = axes_[index];
  bool was_driven = false, driven = false;
  for (std::size_t leg = 0; leg < legs.size(); ++leg) {
    was_driven = was_driven || axis.command.legs[leg].enabled;
    driven = driven || legs[leg].enabled;
    axis.command.legs[leg] = {legs[leg].enabled, legs[leg].high_duty};
    if (legs[leg].enabled) axis.command.dead_time = legs[leg].dead_time;
  }
  if (!axis.drive || !driven || was_driven) return;
  if (axis.drive->handle().has_operator()) {
    axis.drive->handle().begin_motion();
  } else if (!axis.let_go) {
    axis.let_go = true;
    axis.drive->block(false);
  }
}

void SceneWorld::set_amplifiers(std::size_t index, double gain, bool shorted, BoardTime now) {
  advance_to(now);
  if (!axes_[index].drive) return;
  CurrentSensor& sensor = axes_[index].drive->current_sensor();
  sensor.set_gain(gain);
  sensor.short_inputs(CurrentSensor::Channel::b, shorted);
  sensor.short_inputs(CurrentSensor::Channel::c, shorted);
}

void SceneWorld::set_brake(bool on, BoardTime now) {
  advance_to(now);
  supply_.set_brake(on ? 1.0 : 0.0);
}

double SceneWorld::current_pin(std::size_t axis, CurrentSensor::Channel channel) {
  if (!axes_[axis].drive) return CurrentSensor::reference / 2.0;
  return axes_[axis].drive->current_pin(channel, true);
}

double SceneWorld::analogue(unsigned channel, BoardTime now) {
  advance_to(now);
  constexpr drivers::stm32f4::CurrentSamplingConfig wiring{};
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    if (channel == wiring.axes[axis].b) return current_pin(axis, CurrentSensor::Channel::b);
    if (channel == wiring.axes[axis].c) return current_pin(axis, CurrentSensor::Channel::c);
    if (channel == wiring.temperatures[axis]) return axes_[axis].temperature.pin_voltage();
  }
  if (channel == wiring.supply) return supply_.pin_voltage();
  if (channel == wiring.auxiliary_temperature) return axes_[0].temperature.pin_voltage();
  return 0.0;
}

EncoderSignals SceneWorld::encoder(std::size_t index, BoardTime now) {
  advance_to(now);
  const Axis& axis = axes_[index];
  if (!axis.drive || axis.encoder_kind != EncoderKind::quadrature) return {};
  return {axis.drive->encoder().edges(), axis.drive->encoder().lines().z};
}

SerialEncoderState SceneWorld::serial_encoder(BoardTime now) {
  advance_to(now);
  for (const Axis& axis : axes_) {
    if (!axis.drive || axis.encoder_kind != EncoderKind::as5047p) continue;
    constexpr double turn = 6.283185307179586476925;
    const double counts =
        axis.drive->shaft_angle() / turn * static_cast<double>(drivers::as5047p::counts_per_turn);
    return {axis.encoder_connected, static_cast<std::int64_t>(std::floor(counts))};
  }
  return {};
}

void SceneWorld::connect_encoder(std::size_t index, bool connected) {
  axes_[index].encoder_connected = connected;
  if (axes_[index].drive) axes_[index].drive->encoder().set_plugged(connected);
}

}  // namespace kmax::virtual_board
