// A board with the motors of a supplied scene, told the truth about them or not, and a hand on its
// parameters.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::simulated_board {

inline constexpr const char* calibration_scenes[] = {"dc_coreless_a", "dc_coreless_b", "gimbal_a", "gimbal_b",
                                                     "drone"};

inline simulation::Scene identified(const std::string& name) {
  simulation::Scene scene = open_scene(name);
  scene.identified = true;
  return scene;
}

class MotorBench {
 public:
  explicit MotorBench(const simulation::Scene& scene) : simulation_(scene) {}

  firmware::Application& application() { return simulation_.board().application(); }
  board::NativeBoard<SimulatedDevice>& board() { return simulation_.board(); }
  SimulatedPower& power() { return simulation_.device().power(); }
  simulation::SceneDrives& drives() { return power().drives(); }
  simulation::MotorDrive& drive(std::size_t axis = 0) { return drives().drive(axis); }
  firmware::AxisReport report(std::size_t axis = 0) { return application().ISR_report(axis); }
  std::uint64_t now_us() const { return simulation_.board().now_us(); }

  template <firmware::FixedName name>
  firmware::Refusal set(double value, std::size_t axis = 0) {
    constexpr std::size_t entry = firmware::entry_of<name>();
    return application()
        .preset(entry, axis, firmware::raw_from_number(firmware::entry_at(entry).type, value))
        .refusal;
  }

  void run(double seconds) {
    simulation_.board().advance(static_cast<std::uint64_t>(std::lround(seconds * firmware::tick_rate_hz)));
  }
  void tick() { simulation_.board().advance(1); }

  bool armed(std::size_t axis = 0) {
    return application().state(axis) == firmware::DriveState::operation_enabled;
  }
  bool arm(std::size_t axis = 0) {
    for (const unsigned word : {0x06u, 0x07u, 0x0Fu}) {
      set<"drive.controlword">(word, axis);
      run(150e-6);
    }
    return armed(axis);
  }
  void disarm(std::size_t axis = 0) {
    set<"drive.controlword">(0x06, axis);
    run(150e-6);
  }
  void clear(std::size_t axis = 0) {
    set<"drive.controlword">(0x00, axis);
    tick();
    set<"drive.controlword">(0x80, axis);
    run(150e-6);
  }

  /// A wall whose field reaches the handle where it is, without strength yet. Then the power stage is ready.
  void prepare_wall(double side = 1.0) {
    run(1e-3);
    const double at =
        static_cast<double>(report().haptic.position) * firmware::count_length(application().values(), 0);
    EXPECT_EQ(set<"wall.law">(2), firmware::Refusal::none);
    set<"wall.magnetic_coefficient">(0.0);
    set<"force.ceiling">(100.0);  // set_wall_force() raises it while armed
    set<"wall.position">(at - side * 0.0005);
    set<"wall.side">(side);
    set<"force.ramp_time">(0.0);
    run(0.1);
  }
  /// N of force that this wall makes on the handle there.
  void set_wall_force(double force) { set<"wall.magnetic_coefficient">(2.25 * force); }

  /// N that the motor's current makes on the handle, without cogging.
  double current_force() {
    const simulation::MotorDrive& motor = drive();
    const double transmission = motor.encoder().config().transmission;
    const double cogging = motor.synchronous_motor() == nullptr
                               ? 0.0
                               : motor.synchronous_motor()->cogging_torque(motor.shaft_angle());
    return motor.force() - cogging / transmission;
  }

 private:
  SimulatedBoard simulation_;
};

}  // namespace kmax::simulated_board
