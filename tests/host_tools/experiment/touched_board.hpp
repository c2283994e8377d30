#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"

namespace kmax::experiment {

/// A simulated board in virtual time with the simulated person of the supplied scene "touch", behind a link
/// that can be cut and that tells of its requests.
class TouchedBoard : public testing::Test {
 protected:
  class CutLink final : public link::RegisterLink {
   public:
    explicit CutLink(const simulation::Scene& scene) : sim(scene) {}
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
    std::string description() const override { return sim.description(); }
    std::chrono::microseconds now() const override { return sim.now(); }
    void wait(std::chrono::microseconds duration) override { sim.wait(duration); }

    link::SimLink sim;
    bool cut = false;
    std::function<void()> before_request;  ///< may be empty; what it throws, the request throws

   private:
    void require() const {
      if (before_request) before_request();
      if (cut) throw link::LinkError("the cable is gone");
    }
  };

  explicit TouchedBoard(const simulation::Scene& scene = simulated_board::factory_scene())
      : device(std::make_unique<CutLink>(scene)) {}

  static simulation::Scene nobody() {
    simulation::Scene scene = simulated_board::factory_scene();
    scene.axes[0].person.reset();
    scene.axes[0].motion.reset();
    scene.axes[0].start.position = 0.02;
    scene.axes[0].start.velocity = 0.0;
    return scene;
  }

  CutLink& cable() { return dynamic_cast<CutLink&>(device.link()); }
  simulated_board::SimulatedBoard& simulation() { return cable().sim.simulation(); }
  bool forceful() { return simulation().board().output().axis[0].enabled; }
  void expect_disarmed() {
    EXPECT_NE(device::Drive(device, 0).status().state(), firmware::DriveState::operation_enabled);
    EXPECT_FALSE(forceful());
  }
  void set(const std::vector<std::string>& assignments) {
    device.apply(device::parse_assignments(assignments));
  }

  device::Device device;
  std::vector<std::string> told;
  std::function<void(const std::string&)> tell = [this](const std::string& text) { told.push_back(text); };
};

}  // namespace kmax::experiment
