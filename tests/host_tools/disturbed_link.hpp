#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"
#include "host_tools/device/sim/sim_link.hpp"

namespace kmax::host_tools_test {

inline constexpr const char* motor_scenes[] = {"dc_coreless_a", "dc_coreless_b", "gimbal_a", "gimbal_b",
                                               "drone"};

/// All that is set, volatile or not, but commands.
inline std::vector<std::uint32_t> all_settings(device::Device& device) {
  std::vector<device::Parameter> all;
  for (const device::Parameter& parameter : device::all_parameters()) {
    const std::string name(parameter.definition().name);
    const bool passing = name.ends_with("drive.controlword") || name == "capture.command" ||
                         name == "transaction.control" || name == "store.command";
    if (parameter.writable() && !passing) all.push_back(parameter);
  }
  return device.read(all);
}

/// A simulated board in virtual time behind a link that can be cut and that tells of its requests.
class DisturbedLink final : public device::RegisterLink {
 public:
  explicit DisturbedLink(const simulation::Scene& scene) : sim(scene) {}

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
    require();
    return sim.read_holding(address, count);
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    require();
    return sim.read_input(address, count);
  }
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override {
    require();
    sim.write_holding(address, values);
  }
  std::map<std::string, std::string> identify() override { return sim.identify(); }
  void follow_serial_settings(std::optional<std::uint8_t> unit,
                              std::optional<std::uint32_t> baud_rate) override {
    sim.follow_serial_settings(unit, baud_rate);
  }
  std::string description() const override { return sim.description(); }
  std::chrono::microseconds now() const override { return sim.now(); }
  void wait(std::chrono::microseconds duration) override { sim.wait(duration); }

  device::SimLink sim;
  bool cut = false;
  std::function<void()> before_request;  ///< may be empty; what it throws, the request throws

 private:
  void require() const {
    if (before_request) before_request();
    if (cut) throw device::LinkError("the cable is gone");
  }
};

}  // namespace kmax::host_tools_test
