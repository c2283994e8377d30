#pragma once
// Whoever holds a device. LimitedTouches keeps the person safe: on the wall's axis, and on the other one too
// where forces act along the surface (two_axis_touch.hpp).
//
// A person simulated on a device answers to F_B on the wall's axis, and on the other one where its scene says
// that it is the same person's hand (operator.same_person).

#include <optional>
#include <string>
#include <vector>

#include "host_tools/experiment/limited_touches.hpp"
#include "host_tools/experiment/rig.hpp"
#include "host_tools/experiment/two_axis_touch.hpp"

namespace kmax::experiment {

enum class RigAxes : std::uint8_t {
  wall,        ///< one: the limits'
  wall_along,  ///< the limits' axis is the normal, the other one lies along the surface
};

class DeviceRig final : public Rig {
 public:
  /// LimitedTouches while it lives. Errors as Device::apply().
  DeviceRig(device::Device& device, const TouchLimits& limits, const TouchParty& party,
            RigAxes axes = RigAxes::wall);

  void set(const RigWall& wall) override;
  double resolution_step() override;
  bool simulated() const override { return false; }
  void note(const std::string& text) const override;

  /// At work on the wall's axis, N: a force beyond it is not what the paper had.
  double force_limit() const { return touches_.force_limit(); }
  std::string description() const { return device_.description(); }
  const TouchLimits& limits() const { return limits_; }

 private:
  RigTouch hold(const TouchPlan& plan) override;
  RigTouch hold_on_two_axes(const TouchPlan& plan, TouchWatch watch);
  const TouchSession* session() const override { return &touches_.session(); }

  device::Device& device_;
  TouchLimits limits_;
  RigAxes axes_;
  const Tell& notice_;
  LimitedTouches touches_;
  RigWall wall_;
};

/// What a device is set to for a wall, NAME=VALUE, on the wall's axis unless it says otherwise.
std::vector<std::string> wall_assignments(const RigWall& wall, std::size_t axis, RigAxes axes);

/// Towards the wall, m/s, over the last 30 ms before time 0; 0 without samples there.
double touch_speed(const WatchedTouch& touch);

}  // namespace kmax::experiment
