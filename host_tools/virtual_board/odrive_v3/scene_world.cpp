#include "host_tools/virtual_board/odrive_v3/scene_world.hpp"

#include "board/odrive_v3/description.hpp"
#include "drivers/analog_converter.hpp"

namespace kmax::virtual_board {

using simulation::CurrentSensor;
using simulation::EncoderKind;

SceneWorld::SceneWorld(const simulation::Scene& scene) : drives_(scene), spikes_(scene.spikes) {
  for (const simulation::SceneAxis& axis : scene.axes)
    select_filtered_ = select_filtered_ && axis.encoder.select_filtered;
}

void SceneWorld::advance_to(BoardTime now) {
  if (now <= time_) return;
  drives_.advance(seconds(now - time_));
  time_ = now;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (drives_.has(axis)) drives_.drive(axis).update_encoder();
  }
}

void SceneWorld::set_bridge(std::size_t axis, const std::array<PwmLegOutput, 3>& legs, BoardTime now) {
  advance_to(now);
  simulation::InverterCommand command = drives_.bridge(axis);
  for (std::size_t leg = 0; leg < legs.size(); ++leg) {
    command.legs[leg] = {legs[leg].enabled, legs[leg].high_duty};
    if (legs[leg].enabled) command.dead_time = legs[leg].dead_time;
  }
  drives_.set_bridge(axis, command);
}

void SceneWorld::set_amplifiers(std::size_t axis, double gain, bool shorted, BoardTime now) {
  advance_to(now);
  if (!drives_.has(axis)) return;
  CurrentSensor& sensor = drives_.drive(axis).current_sensor();
  sensor.set_gain(gain);
  sensor.short_inputs(CurrentSensor::Channel::b, shorted);
  sensor.short_inputs(CurrentSensor::Channel::c, shorted);
}

bool SceneWorld::has_gate_driver(std::size_t axis) const {
  return !drives_.planted(axis, simulation::Defect::gate_driver_missing);
}

bool SceneWorld::gate_driver_starts(std::size_t axis, BoardTime now) {
  advance_to(now);
  return drives_.gate_driver_starts(axis);
}

void SceneWorld::set_brake(bool on, BoardTime now) {
  advance_to(now);
  drives_.supply().set_brake(on ? 1.0 : 0.0);
}

double SceneWorld::current_pin(std::size_t axis, CurrentSensor::Channel channel) {
  if (!drives_.has(axis)) return drivers::converter_reference / 2.0;
  using enum CurrentSensor::Half;
  return drives_.drive(axis).current_pin(channel, axis == low_sides_of_ ? low_sides : high_sides);
}

double SceneWorld::analogue(unsigned channel, BoardTime now) {
  advance_to(now);
  constexpr const drivers::stm32f4::CurrentSamplingConfig& wiring = board::odrive_v3::sampling_config;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (channel == wiring.axes[axis].b) return current_pin(axis, CurrentSensor::Channel::b);
    if (channel == wiring.axes[axis].c) return current_pin(axis, CurrentSensor::Channel::c);
    if (channel == wiring.temperatures[axis]) return drives_.temperature(axis).pin_voltage();
  }
  if (channel == wiring.supply) return drives_.supply().pin_voltage();
  return 0.0;
}

EncoderSignals SceneWorld::encoder(std::size_t axis, BoardTime now) {
  advance_to(now);
  if (!drives_.has(axis) || drives_.encoder_kind(axis) != EncoderKind::quadrature) return {};
  const simulation::QuadratureEncoder& encoder = drives_.drive(axis).encoder();
  return {encoder.edges(), encoder.lines().z};
}

SerialEncoderState SceneWorld::serial_encoder(BoardTime now) {
  advance_to(now);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!drives_.has(axis) || drives_.encoder_kind(axis) != EncoderKind::as5047p) continue;
    return {drives_.drive(axis).encoder().plugged(), drives_.serial_angle(axis)};
  }
  return {};
}

void SceneWorld::connect_encoder(std::size_t axis, bool connected) {
  if (!drives_.has(axis)) return;
  using simulation::Defect;
  if (connected) {
    drives_.mend(axis, Defect::encoder_unplugged);
  } else {
    drives_.plant(axis, Defect::encoder_unplugged);
  }
}

}  // namespace kmax::virtual_board
