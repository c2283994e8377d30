#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/application.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::simulated_board {

/// The handles of a scene behind the encoders and forces of a board (board::SimulatedDevice).
///
/// An axis that the scene does not have stands still at count 0 and costs nothing. A person begins the
/// approach when the axis is armed, as one would who was told "now"; arming again begins another trial. A
/// handle that nobody holds stays at its start until its axis is armed for the first time, and is let go
/// then.
class SimulatedDevice {
 public:
  /// Throws std::invalid_argument for a scene whose parts are not allowed.
  explicit SimulatedDevice(const simulation::Scene& scene);

  std::uint32_t count(std::size_t axis) const;
  bool count_valid(std::size_t axis) const { return encoder_connected_[axis]; }
  void drive(std::size_t axis, const firmware::AxisOutput& output);
  void advance(double duration);

  /// Pulls the plug of an axis' encoder, or puts it back.
  void connect_encoder(std::size_t axis, bool connected) { encoder_connected_[axis] = connected; }

  std::size_t axis_count() const { return axis_count_; }
  const simulation::CoupledHandle& handle(std::size_t axis) const { return axes_[axis]->handle; }

 private:
  struct Axis {
    simulation::CoupledHandle handle;
    simulation::EncoderModel encoder;
    firmware::AxisOutput output{};
    bool let_go = false;
  };

  std::array<std::optional<Axis>, firmware::axis_count> axes_;
  std::array<bool, firmware::axis_count> encoder_connected_{};
  std::size_t axis_count_ = 0;
};

}  // namespace kmax::simulated_board
