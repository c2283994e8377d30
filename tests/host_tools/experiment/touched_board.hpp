#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/simulation/scene.hpp"
#include "tests/host_tools/disturbed_link.hpp"

namespace kmax::experiment {

/// A simulated board with the simulated person of the supplied scene "touch", behind a link to disturb.
class TouchedBoard : public testing::Test {
 protected:
  using CutLink = host_tools_test::DisturbedLink;

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

  /// Once, when this axis begins to be armed, the hand is in the wall of axis 0, until it is asked to go
  /// back. (It is the wall that comes: the hand rests at 0.02 m until its axis is armed.)
  void come_while_arming(std::size_t axis) {
    cable().before_request = [this, axis, asking = false]() mutable {
      if (came || asking) return;
      asking = true;
      came = device::Drive(device, axis).status().state() == firmware::DriveState::ready_to_switch_on;
      if (came) set({"wall.position=0.05"});
      asking = false;
    };
    report = [this](const std::string& text) {
      reported.push_back(text);
      if (text.ends_with("take the handle out of the wall")) set({"wall.position=0"});
    };
  }
  void expect_came_and_went(const std::string& touch) {
    EXPECT_TRUE(came);
    EXPECT_EQ(std::ranges::count(reported, touch + ": take the handle out of the wall"), 1);
  }

  device::Device device;
  bool came = false;
  std::vector<std::string> reported;
  std::function<void(const std::string&)> report = [this](const std::string& text) {
    reported.push_back(text);
  };
};

/// What stands still in the touches of a board that are to be disturbed, always at the same request.
struct Stall {
  enum class Of {
    nothing,
    program,  ///< the host sends nothing while the device goes on
    link,     ///< the host gets no answers while the device goes on
    device,   ///< the host gets no answers, and the device's time does not pass
  };
  Of of = Of::nothing;
  int at_request = 40;                  ///< of the touch, counted from arming
  std::function<bool(int touch)> when;  ///< touches are counted from 1
};

/// A touched board on whose way to the host something stands still.
class StalledBoard : public TouchedBoard {
 protected:
  explicit StalledBoard(const simulation::Scene& scene = simulated_board::factory_scene())
      : TouchedBoard(scene) {
    cable().before_request = [this] { each_request(); };
  }

  Stall stall;
  int touches = 0;  ///< times that axis 0 was armed

 private:
  void each_request() {
    constexpr int unanswered_requests = 2;
    if (unanswered_ > 0) lose();
    const bool on = forceful();
    if (on && !was_on_) {
      ++touches;
      requests_ = 0;
    }
    was_on_ = on;
    if (stall.of == Stall::Of::nothing || !on || ++requests_ != stall.at_request || !stall.when(touches))
      return;
    if (stall.of == Stall::Of::program) return cable().sim.wait(std::chrono::milliseconds(1500));
    unanswered_ = unanswered_requests;
    lose();
  }
  [[noreturn]] void lose() {
    --unanswered_;
    if (stall.of == Stall::Of::link) cable().sim.wait(std::chrono::milliseconds(1500));
    throw device::LinkError("no answer");
  }

  bool was_on_ = false;
  int requests_ = 0, unanswered_ = 0;
};

/// Somebody who does what is asked at once, and remembers it.
class AskedPerson final : public bench::Prompter {
 public:
  void ask(const std::string& what_to_do) override {
    requests.push_back(what_to_do);
    if (answer) answer();
  }

  std::vector<std::string> requests;
  std::function<void()> answer;  ///< may be empty
};

/// Axis 0 pressed against its wall, axis 1 held where it is.
inline simulation::Scene two_held_axes() {
  simulation::Scene scene = simulated_board::factory_scene();
  scene.axes[0].motion->push_force = 2.5;
  scene.axes[0].motion->hold_time = 3.6;
  scene.axes.push_back(scene.axes[0]);
  scene.axes[1].motion->start_position = scene.axes[1].motion->wall_position = 0.0;
  scene.axes[1].motion->push_force = 0.0;
  return scene;
}

}  // namespace kmax::experiment
