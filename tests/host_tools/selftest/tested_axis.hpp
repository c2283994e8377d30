#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_tools/device/drive.hpp"
#include "host_tools/device/serial/register_link.hpp"
#include "host_tools/selftest/selftest.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/disturbed_link.hpp"

namespace kmax::selftest {

/// A link to the simulated board that looks at the true handle in every tick.
class WatchedLink final : public device::FrameLink {
 public:
  WatchedLink(const simulation::Scene& scene, std::size_t axis) : FrameLink(1), board_(scene), axis_(axis) {
    start_ = position();
    // Until the power stage is ready.
    wait(std::chrono::milliseconds(200));
  }

  std::chrono::microseconds now() const override {
    return std::chrono::microseconds(board_.board().now_us());
  }
  void wait(std::chrono::microseconds duration) override {
    for (auto passed = duration.count(); passed > 0; passed -= 50) tick();
  }
  std::string description() const override { return "sim"; }

  simulated_board::SimulatedDevice& hardware() { return board_.device(); }
  firmware::Application& application() { return board_.board().application(); }
  double position() { return hardware().handle(axis_).position(); }
  double largest_displacement() const { return largest_; }
  /// Loses every n-th message; 0: none.
  void lose_every(int nth) { lose_every_ = nth; }
  /// Loses every message from now on: the cable is pulled, or the program killed.
  void cut() { cut_ = true; }
  /// The adapter sends its bytes without parity.
  bool without_parity = false;
  /// Called before every tick.
  std::function<void()> before_tick;
  /// Called before every message: for how long the host is held up before it sends it.
  std::function<std::chrono::milliseconds()> held_up;

 private:
  void tick() {
    if (before_tick) before_tick();
    board_.board().advance(1);
    largest_ = std::max(largest_, std::abs(position() - start_));
  }
  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> frame,
                                     device::Repeat /*repeat*/) override {
    if (held_up) wait(held_up());
    if (cut_) {
      wait(std::chrono::milliseconds(100));
      throw device::LinkError("no answer");
    }
    if (lose_every_ != 0 && ++messages_ % lose_every_ == 0) {
      wait(std::chrono::milliseconds(100));
      throw device::LinkError("lost");
    }
    board_.board().receive(frame, without_parity);
    for (int tries = 0; tries < 20000; ++tries) {
      tick();
      const std::vector<std::uint8_t> reply = board_.board().transmitted();
      if (reply.size() > 3) return reply;
    }
    throw device::LinkError("no answer");
  }

  simulated_board::SimulatedBoard board_;
  std::size_t axis_;
  double start_ = 0.0, largest_ = 0.0;
  int lose_every_ = 0, messages_ = 0;
  bool cut_ = false;
};

/// One axis of a scene on the simulated board, with defects to plant, and the self-test run on it.
class TestedAxis {
 public:
  explicit TestedAxis(const std::string& scene, bool identified = true, std::size_t tested_axis = 0)
      : TestedAxis(opened(scene, identified), tested_axis) {}
  TestedAxis(const simulation::Scene& scene, std::size_t tested_axis) : axis(tested_axis) {
    auto made = std::make_unique<WatchedLink>(scene, axis);
    link = made.get();
    device = std::make_unique<device::Device>(std::move(made));
  }

  static simulation::Scene opened(const std::string& name, bool identified) {
    simulation::Scene scene = simulated_board::open_scene(name);
    scene.identified = identified;
    // The person of some scenes would begin to move when the axis is armed.
    for (simulation::SceneAxis& one : scene.axes) {
      one.motion.reset();
      one.person.reset();
    }
    return scene;
  }

  simulation::SceneDrives& drives() { return link->hardware().power().drives(); }
  void plant(simulation::Defect defect) { drives().plant(axis, defect); }

  std::vector<std::uint32_t> settings() { return host_tools_test::all_settings(*device); }
  Report run() {
    SelfTestSettings settings;
    settings.axis = axis;
    return run_selftest(*device, settings, [](const std::string&) {});
  }

  bool disarmed() {
    for (std::size_t any = 0; any < firmware::axis_count; ++any) {
      if (device::Drive(*device, any).status().armed()) return false;
    }
    return true;
  }

  std::size_t axis;
  WatchedLink* link = nullptr;
  std::unique_ptr<device::Device> device;
};

inline std::string text_of(const Report& report) {
  std::string text;
  for (const CheckResult& check : report.checks)
    text += check.name + ": " + name_of(check.verdict) + (check.part.empty() ? "" : " [" + check.part + "]") +
            ": " + check.message + "\n";
  return text;
}

inline std::string faulty_part(const Report& report) {
  const CheckResult* failure = report.first_failure();
  return failure == nullptr ? "" : failure->part;
}

}  // namespace kmax::selftest
