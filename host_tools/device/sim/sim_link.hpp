#pragma once

#include <memory>

#include "host_tools/device/serial/register_link.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::device {

/// A simulated device in this process, fresh from the factory: it lives as long as the link.
///
/// The whole path is there: requests travel as Modbus RTU characters at the device's baud rate into the
/// firmware's own server. Only the clock is virtual: time passes while a request is under way and in wait(),
/// as fast as the processor can compute it.
class SimLink final : public FrameLink {
 public:
  /// Throws simulation::SceneError for parameters that the firmware refuses.
  explicit SimLink(const simulation::Scene& scene);

  std::string description() const override { return "sim"; }
  std::chrono::microseconds now() const override;
  void wait(std::chrono::microseconds duration) override;

  simulated_board::SimulatedBoard& simulation() { return simulation_; }

 private:
  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> frame, Repeat /*repeat*/) override;

  simulated_board::SimulatedBoard simulation_;
};

/// With simulated_board::factory_scene().
std::unique_ptr<SimLink> make_sim_link();

}  // namespace kmax::device
