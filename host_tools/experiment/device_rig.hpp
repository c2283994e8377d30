#pragma once
// Whoever holds a device: what is the same for the touches of every experiment, whatever wall they are of and
// whatever is measured.
//
// Before anybody is asked for anything, the limits that keep the person safe are at work (TouchLimits,
// protective_assignments()), and all that is going to change has been read, to be put back at the end. Each
// touch is asked for, watched within these limits (watched_touch.hpp), made again if it did not count or if a
// standstill of this computer cut it off (bench/held_up.hpp), and kept in the journal (touch_journal.hpp).
//
// A person simulated on a device answers to F_B on the wall's axis, and on the other one where its scene says
// that it is the same person's hand (operator.same_person).

#include <string>
#include <vector>

#include "firmware/drive/axes_law.hpp"
#include "firmware/object_dictionary/entry.hpp"
#include "host_tools/bench/journal.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/rig.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

/// The axis along the surface of this one's wall.
constexpr std::size_t along(std::size_t axis) {
  return firmware::axis_along<firmware::axis_count>(axis);
}

/// Of every touch of an experiment.
struct TouchLimits {
  std::size_t axis = 0;                           ///< of the wall
  double force_limit = paper::touch_force_limit;  ///< N; force.limit is lowered to it
  double abort_amplitude = 0.01;                  ///< m; TouchWatch::abort_amplitude
  double patience = 20.0;                         ///< s to wait for the touch
  double wall_abort_amplitude = 1e-3;             ///< m, against a wall that forces act along: TouchWatch
};

/// Everything the touches of `experiment` depend on, for a journal: the device's circumstances, the
/// experiment's `own` settings (an object), the limits. Not the patience, which no touch depends on.
RunJournal::Json touch_settings(const std::string& experiment, device::Device& device,
                                const TouchLimits& limits, const RunJournal::Json& own);

/// Who makes the touches, and who hears of them.
struct TouchParty {
  bench::Prompter* prompter = nullptr;  ///< null: nobody is asked, as a simulated person needs no asking
  RunJournal* journal = nullptr;        ///< null: none is kept
  const ReportText& report;             ///< progress; what it throws ends the experiment
  const ReportText& notice;             ///< what went wrong and was lived with; may be empty
};

enum class RigAxes : std::uint8_t {
  wall,        ///< one: the limits'
  wall_along,  ///< the limits' axis is the normal, along() it lies along the surface
};

/// While it lives, the limits are at work, on every axis of the rig. Afterwards all parameters are as they
/// were, however it ends; the party's notice hears if that fails.
class DeviceRig final : public Rig {
 public:
  /// Reads all that may change, then writes what protective_assignments() asks for, in one transaction. The
  /// device and the party must outlive this. Errors as Device::apply().
  DeviceRig(device::Device& device, const TouchLimits& limits, const TouchParty& party,
            RigAxes axes = RigAxes::wall);

  void set(const RigWall& wall) override;
  double resolution_step() override;
  bool simulated() const override { return false; }
  void note(const std::string& text) const override;

  /// At work on the wall's axis, N: the device's own if that is lower. A force beyond it is not what the
  /// paper had.
  double force_limit() const { return force_limit_; }
  /// What the velocities came from in the last touch whose plan had a wall.
  const std::string& velocity_estimator() const { return velocity_estimator_; }
  std::string description() const { return device_.description(); }
  const TouchLimits& limits() const { return limits_; }

 private:
  RigTouch hold(const TouchPlan& plan) override;
  const TouchSession* session() const override { return &session_; }
  /// Somebody else may have raised a limit since the touch before.
  void set_with_limits(const RigWall& wall);
  /// Notes what was there before.
  void apply(const std::vector<std::string>& assignments);

  device::Device& device_;
  TouchLimits limits_;
  RigAxes axes_;
  const ReportText& notice_;
  bench::Journal before_;
  bench::Standstill standstill_;
  TouchSession session_;
  double force_limit_ = 0.0;
  RigWall wall_;
  std::string velocity_estimator_;
};

/// What a device is set to for a wall, NAME=VALUE, on the wall's axis unless it says otherwise: the same
/// parameters whatever its law. Every setting of wall and interference is among them, its default where
/// nothing is said of it, so that no wall that somebody has saved shows through; but for the place of the
/// surface and the ceilings, which stay the device's. Of a wall `as_set` only stiffness and forces.
std::vector<std::string> wall_assignments(const RigWall& wall, std::size_t axis, RigAxes axes);

/// Towards the wall, m/s, over the last 30 ms before time 0; 0 without samples there.
double touch_speed(const WatchedTouch& touch);

}  // namespace kmax::experiment
