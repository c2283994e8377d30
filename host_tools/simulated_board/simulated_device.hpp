#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "firmware/application.hpp"
#include "host_tools/simulated_board/simulated_power.hpp"
#include "host_tools/simulation/quadrature_encoder.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::simulated_board {

/// The axes of a scene behind a board (board::PoweredDevice).
///
/// An axis that names a motor is driven through it, with everything that lies between a duty and a force:
/// simulated_power.hpp. An axis without a motor has an ideal force source and an encoder that is ideal unless
/// the scene gives it noise or dropouts. An axis that the scene does not have stands still at count 0 and
/// costs nothing.
///
/// A person who has a motion begins the approach when the axis is armed, as one would who was told "now";
/// arming again begins another trial. The person answers to the background force that the firmware renders,
/// the field's and the interference's F_B (set_background_force()). A handle that nobody holds stays at
/// its start until its axis is armed for the first time, and is let go then.
class SimulatedDevice {
 public:
  /// Throws std::invalid_argument for a scene whose parts are not allowed.
  explicit SimulatedDevice(const simulation::Scene& scene);

  /// Once in a tick. Without a motor there are no currents, and nothing keeps the axis from being driven.
  firmware::AxisInput sample(std::size_t axis);
  /// With a motor, or with an encoder that has defects: of the last sample().
  std::uint32_t count(std::size_t axis) const;
  bool count_valid(std::size_t axis) const;
  void drive(std::size_t axis, const firmware::AxisOutput& output);
  /// N, outwards, from now on.
  void set_background_force(std::size_t axis, float force);
  void advance(double duration);
  /// So many times, with what drives it unchanged.
  void advance(double duration, std::uint32_t times);
  /// board::HoldingDevice: no axis has a motor, and every encoder that is there is ideal.
  bool only_moves() const;
  firmware::BoardReadings readings() const { return power_ ? power_->readings() : firmware::BoardReadings{}; }
  float supply_ceiling() const { return power_ ? power_->supply_ceiling() : 0.0f; }
  void poll(const firmware::Application& application, std::uint32_t now_us) {
    if (power_) power_->poll(application, now_us);
  }

  /// Pulls the plug of an axis' encoder, or puts it back.
  void connect_encoder(std::size_t axis, bool connected);

  std::size_t axis_count() const { return axis_count_; }
  const simulation::CoupledHandle& handle(std::size_t axis) const;
  /// Edges lost in the cable of an axis without a motor, number of.
  std::int64_t lost_edges(std::size_t axis) const {
    return axes_[axis] ? axes_[axis]->encoder.lost_edges() : 0;
  }
  bool has_motor(std::size_t axis) const { return power_ && power_->has(axis); }
  /// The motors' board and what is plugged into it, with its defects. Throws std::logic_error for a scene
  /// without a motor.
  SimulatedPower& power();

 private:
  struct Axis {
    simulation::CoupledHandle handle;
    simulation::AxisEncoder encoder;
    firmware::AxisOutput output{};
    float background_force = 0.0f;  ///< N, outwards
    bool moves = false;             ///< somebody holds it who has a motion
    bool first_person = false;      ///< axis 0's holds it, or would
    bool let_go = false;
  };

  double background_force(const Axis& axis) const;

  std::array<std::optional<Axis>, firmware::axis_count> axes_;       ///< without a motor
  std::unique_ptr<SimulatedPower> power_;                            ///< those with
  std::array<firmware::AxisInput, firmware::axis_count> samples_{};  ///< of the axes with a motor
  std::array<bool, firmware::axis_count> encoder_connected_{};
  std::size_t axis_count_ = 0;
};

}  // namespace kmax::simulated_board
