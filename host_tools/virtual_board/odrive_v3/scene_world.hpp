#pragma once

#include <array>

#include "host_tools/simulation/scene_drives.hpp"
#include "host_tools/virtual_board/odrive_v3/board_world.hpp"

namespace kmax::virtual_board {

/// The motors, handles, people and the supply of a scene, on the board's connectors.
///
/// Everything is integrated from one look of the board to the next: sampling instants and changes of the PWM,
/// some 25 us apart. An axis that the scene does not have, or has without a motor, is an open connector: no
/// current, and an encoder that stands still at 0.
///
/// When people begin and handles are let go, and which defects can be planted: scene_drives.hpp.
class SceneWorld : public BoardWorld {
 public:
  /// Throws what the parts of the scene throw; std::invalid_argument for more axes than the board has, or a
  /// second AS5047P.
  explicit SceneWorld(const simulation::Scene& scene);

  void set_bridge(std::size_t axis, const std::array<PwmLegOutput, 3>& legs, BoardTime now) override;
  bool has_gate_driver(std::size_t axis) const override;
  bool gate_driver_starts(std::size_t axis, BoardTime now) override;
  void set_amplifiers(std::size_t axis, double gain, bool shorted, BoardTime now) override;
  double supply_voltage() const override { return drives_.supply().voltage(); }
  void set_brake(bool on, BoardTime now) override;
  void set_low_sides(std::size_t axis) override { low_sides_of_ = axis; }
  double analogue(unsigned channel, BoardTime now) override;
  EncoderSignals encoder(std::size_t axis, BoardTime now) override;
  SerialEncoderState serial_encoder(BoardTime now) override;

  /// What is plugged in, with its defects, as it was when the board looked last, up to 25 us ago.
  simulation::SceneDrives& drives() { return drives_; }
  /// Throws std::out_of_range for an axis without a motor.
  simulation::MotorDrive& drive(std::size_t axis) { return drives_.drive(axis); }
  bool has_drive(std::size_t axis) const { return drives_.has(axis); }
  simulation::Supply& supply() { return drives_.supply(); }
  simulation::TemperatureSensor& temperature(std::size_t axis) { return drives_.temperature(axis); }
  /// Pulls the plug of an axis' encoder, or puts it back.
  void connect_encoder(std::size_t axis, bool connected);
  std::optional<simulation::SpikesConfig> spikes() const override { return spikes_; }
  bool select_filtered() const override { return select_filtered_; }

 private:
  void advance_to(BoardTime now);
  double current_pin(std::size_t axis, simulation::CurrentSensor::Channel channel);

  simulation::SceneDrives drives_;
  std::optional<simulation::SpikesConfig> spikes_;
  bool select_filtered_ = true;
  BoardTime time_ = 0;
  std::size_t low_sides_of_ = 0;
};

}  // namespace kmax::virtual_board
