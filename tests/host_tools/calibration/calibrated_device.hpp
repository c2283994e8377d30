#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/calibration/procedure.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/disturbed_link.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::calibration_test {

using host_tools_test::all_settings;
using host_tools_test::motor_scenes;

/// One of each kind of motor; a soak takes all.
inline std::vector<const char*> representative_scenes() {
  if (in_a_soak()) return {std::begin(motor_scenes), std::end(motor_scenes)};
  return {"dc_coreless_a", "gimbal_b"};
}

/// How often a calibration reported its progress, and how long it said at the beginning that it usually
/// takes.
struct CalibrationLength {
  int whole = 0;
  std::map<std::string, int> in_step;
  std::chrono::seconds usual{};
};

/// A simulated board with one of the motor scenes, on a fast line, that can be calibrated.
class CalibratedDevice {
 public:
  explicit CalibratedDevice(const std::string& scene_name, std::uint64_t seed = 0)
      : CalibratedDevice(open(scene_name, seed)) {}
  explicit CalibratedDevice(simulation::Scene scene)
      : scene_(std::move(scene)),
        link_(new device::SimLink(scene_)),
        device_(std::unique_ptr<device::Link>(link_)) {
    set({"modbus.baud_rate=921600"});
    link_->wait(std::chrono::milliseconds(300));  // the power stage starts
  }

  void set(const std::vector<std::string>& texts) { device_.apply(device::parse_assignments(texts)); }
  void plant(simulation::Defect defect) { drives().plant(0, defect); }
  simulation::SceneDrives& drives() { return link_->simulation().device().power().drives(); }

  calibration::CalibrationReport calibrate(const calibration::CalibrationSettings& settings = {},
                                           bench::Prompter* prompter = nullptr) {
    length = {};
    step.clear();
    return calibration::calibrate(
        device_, settings, prompter,
        [this](const std::string&) {
          ++length.whole;
          ++length.in_step[step];
          if (on_progress) on_progress();
        },
        [this](std::string_view begun, std::chrono::seconds usual) {
          if (step.empty()) length.usual = usual;
          step = begun;
        });
  }

  std::vector<std::uint32_t> parameters() { return all_settings(device_); }
  bool armed() { return device::Drive(device_, 0).status().armed(); }
  std::uint32_t records() { return device::Store(device_).status().sequence; }

  device::Device& device() { return device_; }
  device::SimLink& link() { return *link_; }
  const simulation::SceneAxis& axis() const { return scene_.axes[0]; }

  std::function<void()> on_progress;  ///< whenever the calibration reports progress
  CalibrationLength length;           ///< so far
  std::string step;                   ///< that has begun last

 private:
  static simulation::Scene open(const std::string& name, std::uint64_t seed) {
    simulation::Scene scene = simulated_board::open_scene(name);
    if (seed != 0) scene.seed = seed;
    return scene;
  }

  simulation::Scene scene_;
  device::SimLink* link_;
  device::Device device_;
};

/// Of the whole calibration of a scene, which is carried out once for all tests.
inline const CalibrationLength& length_of(const std::string& scene) {
  static std::map<std::string, CalibrationLength> known;
  const auto [place, missing] = known.try_emplace(scene);
  if (missing) {
    CalibratedDevice device(scene);
    device.calibrate();
    place->second = device.length;
  }
  return place->second;
}

/// The first failure's cause, else the remarks' that say more than what every fresh device says, else "".
inline std::string cause_of(const calibration::CalibrationReport& report) {
  for (const calibration::StepReport& step : report.steps) {
    if (step.failure) return step.failure->cause;
  }
  return "";
}

inline bool remarked(const calibration::CalibrationReport& report, const std::string& cause) {
  for (const calibration::StepReport& step : report.steps) {
    for (const calibration::Diagnosis& remark : step.remarks) {
      if (remark.cause == cause) return true;
    }
  }
  return false;
}

inline const calibration::IdentifiedValue* value_of(const calibration::CalibrationReport& report,
                                                    const std::string& name) {
  for (const calibration::StepReport& step : report.steps) {
    for (const calibration::IdentifiedValue& value : step.values) {
      if (value.name == name) return &value;
    }
  }
  return nullptr;
}

}  // namespace kmax::calibration_test
