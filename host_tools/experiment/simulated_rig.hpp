#pragma once
// Simulated people at a simulated handle: control::HapticLoop<float>, the firmware's own code, on
// simulation::CoupledHandle, with an encoder of its own.
//
// Recorded touches: a person answers to resisted_force(), with `reaction` as the share of F_I along the
// normal (InterferenceMode::perpendicular). With InterferenceMode::parallel the loop's own interference gives
// both forces inside the wall, and a second handle of the same person lies along the surface, whose arm is
// activated by the same forces as the first one's and who intends to stay where the handle is. That the hand
// is the same in both directions is an assumption. Judged touches: simulated_touch.hpp.

#include <vector>

#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/rig.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::experiment {

/// How they hold what. The papers give none of these numbers but the device's.
struct SimulatedHands {
  simulation::DeviceModel device{.force_limit = 0.0};  ///< not clipped: F_I exceeds the paper's own 3.3 N
  double count_length = paper::touch_resolution;       ///< m, both axes
  double approach_speed = 0.2;                         ///< m/s
  double push = 1.0;                                   ///< N, static, without what the person answers to
  double reaction = 1.0;      ///< 0 to 1, the share of F_I that the person answers to
  double waiting_time = 0.0;  ///< s under F_B before the approach
};

class SimulatedRig final : public Rig {
 public:
  /// `experiment`: what is refused begins with its name. Throws std::invalid_argument, also when nobody is
  /// there.
  SimulatedRig(const char* experiment, std::vector<simulation::OperatorModel> people,
               const SimulatedHands& hands);

  void set(const RigWall& wall) override;
  double resolution_step() override;
  std::size_t people() const override { return people_.size(); }
  bool simulated() const override { return true; }

  /// A judged touch before it is simulated.
  TouchSetup setup_of(const TouchPlan& plan) const;
  /// One that is recorded, whatever the plan says.
  RigTouch record(const TouchPlan& plan) const;

 private:
  RigTouch hold(const TouchPlan& plan) override;

  const char* experiment_;
  std::vector<simulation::OperatorModel> people_;
  SimulatedHands hands_;
  RigWall wall_;
};

}  // namespace kmax::experiment
