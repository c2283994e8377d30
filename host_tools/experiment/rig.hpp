#pragma once
// What makes the touches of an experiment: simulated people at a simulated handle (simulated_rig.hpp), or
// whoever holds a device (device_rig.hpp). An experiment sets a wall up, asks for one touch after the other
// and measures each: the same code for both.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "control/interference.hpp"
#include "control/resampler.hpp"
#include "control/wall_law.hpp"
#include "host_tools/experiment/touch_journal.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::experiment {

/// A wall without damping, and what pushes the hand at it. Its law is the plain one unless it says otherwise;
/// the others have paper 1's constants.
struct RigWall {
  double stiffness = 1000.0;   ///< N/m
  double haptic_rate = 500.0;  ///< Hz
  control::InterferenceMode interference = control::InterferenceMode::none;
  double force = 0.0;             ///< N, F_I
  double background_force = 0.0;  ///< N, F_B
  double resolution = 0.0;        ///< m of the position; 0: the encoder's own
  control::Rounding rounding = control::Rounding::nearest;
  control::WallKind law = control::WallKind::plain;
  double magnetic_coefficient = 0.0;  ///< N, of the magnetic law
  control::AdaptiveMode mode = control::AdaptiveMode::instant;
  /// On a device: its law, its rate and all else that is not the stiffness or a force stay as they are set.
  bool as_set = false;
  /// NAME=VALUE, on a device, in place of what is said above or beside it.
  std::vector<std::string> changes{};
};

/// F_I or F_B during a touch.
struct ForceChange {
  enum class Of : std::uint8_t { interference, background };
  double time;  ///< s after the touch
  Of of;
  double force;  ///< N
};

struct TouchPlan {
  std::string name;        ///< what is touched
  std::string key;         ///< in the journal; empty: the name
  std::string request;     ///< what a person is asked to do
  double hold_time = 3.0;  ///< s from the first touch
  double threshold =
      0.0;  ///< m peak to peak; above 0: the hold is judged by it, and a simulated one not recorded
  std::vector<ForceChange> changes{};  ///< in order of time
  /// Set at each attempt, on a device with its limits; without it the wall that was set stays.
  std::optional<RigWall> wall{};
  double pause = 0.0;  ///< s before it where nobody is asked: a simulated hand goes back meanwhile

  // Of simulated people.
  std::size_t person = 0;
  double phase = 0.0;           ///< 0 to 1: when within a sample the handle meets the surface
  double approach_speed = 0.2;  ///< m/s
  double push = 1.0;            ///< N, static, without what the person answers to
};

struct RigSample {
  double time = 0.0;                  ///< s from the first touch
  double outside_distance = 0.0;      ///< m from the surface, as the encoder shows it; <= 0 inside
  double force = 0.0;                 ///< N
  double tangential = 0.0;            ///< m along the surface, as the encoder shows it
  double tangential_force = 0.0;      ///< N along the surface
  double magnetic_coefficient = 0.0;  ///< N
};

struct RigTouch {
  std::vector<RigSample> samples;
  std::vector<double> change_times;      ///< s after the touch, of the changes that were made
  simulation::ContactMeasure judgement;  ///< with a threshold
  double surface = 0.0, side = 1.0;      ///< m; where the wall is, and on which side is free space
  bool touched = false;
  double speed = 0.0;                ///< m/s towards the wall at the touch
  double contact_share = 0.0;        ///< of the touch, where a wall is on an axis of its own
  double beyond_limit_share = 0.0;   ///< simulated: of the samples, with a force beyond the paper's 3.3 N
  double limited_share = 0.0;        ///< on a device: of the haptic samples
  std::optional<double> aborted_at;  ///< s after the touch, by the host
  std::uint64_t lost_records = 0;
};

class Rig {
 public:
  virtual ~Rig() = default;

  /// For the touches that follow.
  virtual void set(const RigWall& wall) = 0;
  /// m: of the positions in use now, whole counts.
  virtual double resolution_step() = 0;
  /// How many touch each wall.
  virtual std::size_t people() const { return 1; }
  /// Is everybody simulated here? Then each touch is as planned, and a touch that does not count is not
  /// repeated.
  virtual bool simulated() const = 0;
  /// What went wrong and was lived with.
  virtual void note(const std::string&) const {}

  /// What `measure` makes of the touch: on a device journaled_touch() of it. Errors: those of the rig.
  template <typename Touch, typename Measure>
  Touch touch(const TouchPlan& plan, const Measure& measure) {
    const TouchSession* session = this->session();
    if (session == nullptr) return measure(hold(plan));
    const std::function<Touch()> once = [&]() -> Touch { return measure(hold(plan)); };
    if constexpr (!kept_in_a_journal<Touch>) {
      return repeated_touch(*session, plan.name, once);
    } else {
      return journaled_touch(*session, plan.key.empty() ? plan.name : plan.key, plan.name, once);
    }
  }

 protected:
  virtual RigTouch hold(const TouchPlan& plan) = 0;
  virtual const TouchSession* session() const { return nullptr; }
};

}  // namespace kmax::experiment
