#pragma once

#include <memory>

#include "host_tools/device/link.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::link {

/// A simulated device in this process, fresh from the factory: it lives as long as the link.
///
/// The whole path is there: requests travel as Modbus RTU characters at the device's baud rate into the
/// firmware's own server. Only the clock is virtual: time passes while a request is under way and in wait(),
/// as fast as the processor can compute it.
class SimLink final : public Link {
 public:
  /// Throws simulation::SceneError for parameters that the firmware refuses.
  explicit SimLink(const simulation::Scene& scene);

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override;
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override;
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override;
  std::map<std::string, std::string> identify() override;
  void follow_line_settings(std::optional<std::uint8_t> unit,
                            std::optional<std::uint32_t> baud_rate) override;
  std::string description() const override { return "sim"; }
  std::chrono::microseconds now() const override;
  void wait(std::chrono::microseconds duration) override;

  simulated_board::SimulatedBoard& simulation() { return simulation_; }

 private:
  /// The reply's PDU; empty after a second of virtual silence.
  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> pdu);
  std::vector<std::uint16_t> read(std::uint8_t function, std::uint16_t address, std::uint16_t count);

  simulated_board::SimulatedBoard simulation_;
  std::uint8_t unit_;
};

/// With simulated_board::factory_scene().
std::unique_ptr<Link> make_sim_link();

}  // namespace kmax::link
