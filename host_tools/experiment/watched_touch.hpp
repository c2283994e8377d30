#pragma once
// A touch of a wall on a device, watched by the host while it lasts: what every experiment on a device does
// between two changes of its parameters. The wall is on one axis; others may be armed with it, and parameters
// may be switched meanwhile.
//
// Who holds the handle stands outside the wall; the axes are armed, the touch is awaited, the hold is traced,
// the axes are disarmed. They are disarmed however this ends. Where a hand comes to the wall before they are
// armed, which is then refused, all this starts over. What keeps a person safe meanwhile, from the
// fastest: the device's own limits and trips (force.limit, velocity.limit); link.timeout, which removes the
// force when this program or its link dies; the host, which disarms when the handle oscillates more than it
// should (abort_amplitude). protective_assignments() sees to the first two.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/trace_reader.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::experiment {

/// Nobody came to the wall in time. Worth another try, which no other error of a touch is.
class NobodyTouched : public base::DeviceError {
 public:
  using base::DeviceError::DeviceError;
};

inline constexpr double wall_settling = 0.5;  ///< s; a first bounce has died out then

struct TimedChange {
  double time;                           ///< s after the touch
  std::vector<std::string> assignments;  ///< NAME=VALUE, a name without prefix is on the wall's axis
  bool moves_wall_axis = false;          ///< and may let it overshoot
};

struct TouchWatch {
  /// Armed in this order: the wall's last, since it is what begins to push. The trace is of the first one.
  /// Where that is not the wall's, there is a reading of the wall's a round (20 ms and the requests), which
  /// finds the touch and shows more than half of an oscillation.
  std::vector<std::size_t> axes = {0};
  std::string name;                ///< what is touched, for whoever is told
  double hold_time = 3.0;          ///< s from the first touch
  double release = 0.3;            ///< s traced after the hold, for the picture
  double contact_patience = 10.0;  ///< s from arming to the first touch
  /// Records per s: 500 are 8 kB/s, of 11.5 that a serial line carries at 115200 baud. With readings of the
  /// wall's axis besides, a round would then take a quarter of a second, in which a wall is unstable unseen:
  /// 100 leave room for them.
  double trace_rate = 500.0;
  /// m; an oscillation of the traced axis larger than this ends the touch. 0: none does. Watched from the
  /// first touch until the hold is over; the host sees it 20 to 100 ms after it has happened, by the link.
  double abort_amplitude = 0.0;
  double abort_window = 0.25;  ///< s
  /// m; where the wall's axis is not traced, an oscillation of it beyond this ends the touch too, from
  /// wall_settling after the touch and after every change that moves that axis on; sooner, while a hand
  /// bounces by millimetres, five times as much does. 0: none does.
  double wall_abort_amplitude = 0.0;
  /// In order of time; each is made at the first round after its time. One that is due less than 30 ms after
  /// the one before follows it in that time, or as soon as the link allows, without a look in between.
  std::vector<TimedChange> changes{};
};

struct WatchedTouch {
  std::vector<device::TraceSample> samples;  ///< from arming on; time 0 is the first touch
  double surface = 0, side = 1;      ///< m; wall.position and wall.side, where the wall's axis is traced
  std::vector<double> change_times;  ///< s after the touch, of those changes that were made
  /// Where the wall's axis is not traced: of the looks at it, 20 a second or more, that saw it touched.
  double contact_share = 0.0;
  double limited_share = 0;  ///< of the haptic samples since arming, on the axis that was limited most
  std::uint64_t lost_records = 0;
  std::optional<double> aborted_at;  ///< s from the first touch
  double aborted_amplitude = 0;      ///< m, of what it was aborted for
};

using ReportText = std::function<void(const std::string&)>;

/// Sets nothing but the changes; wall and law must be what they should be. `report`: progress, called about
/// five times a second with a short text; what it throws ends the touch.
///
/// Errors: std::invalid_argument (require_sound); NobodyTouched; base::DeviceError (a fault with its words,
/// a trace that stops, an axis that cannot be armed or disarmed; for the wall's axis, because the handle is
/// inside, only after contact_patience), base::ValueError (a change), device::LinkError.
WatchedTouch watch_touch(device::Device& device, const TouchWatch& watch, const ReportText& report);

/// A parameter of one axis, by its name without prefix.
double axis_number(device::Device& device, std::size_t axis, const char* name);

/// Axes, and times and amplitudes that can end a touch. Throws std::invalid_argument naming them if not.
void require_sound(const TouchWatch& watch);

/// The share of `window` seconds before the last one of these samples that goes both ways: the smaller one of
/// the largest rise and the largest fall, m. An oscillation's peak to peak; nearly 0 for a handle that is
/// taken away or sinks in.
double oscillation(std::span<const device::TraceSample> samples, double window);

/// The touch by contact_measure.hpp's rule over the last second of the hold (all of a shorter one). A touch
/// that was aborted is unstable, with the amplitude that it was aborted for; one whose records were lost, so
/// that too few are left to judge, is no_contact without samples: to be made again.
simulation::ContactMeasure measure_touch(const WatchedTouch& touch, double hold_time, double threshold);

/// What the device should have set before anybody is asked to touch a wall: force.limit, lowered to
/// `force_limit` N if it is above, and link.timeout, if that is off or longer than 1 s.
std::vector<std::string> protective_assignments(device::Device& device, std::size_t axis, double force_limit);

// Tells an oscillation of an armed axis from what a handle does after its force was removed unseen.
//
// A host that stood still for longer than link.timeout reads the trace of that time afterwards, and sees in
// it the handle leave the place where the force held it. That is no instability of the wall.

class LateAbort {
 public:
  /// At each look at the trace: the time of its last record, s.
  void looked(double time) { looks_.push_back(time); }

  /// Whether the device, which has `status` after the touch, had removed the force for link.timeout before
  /// `time` of the trace. It cannot have done so earlier than link.timeout after the last look before the
  /// first gap that is as long; a tenth is for requests between two looks.
  bool is_late(double time, const device::DriveStatus& status) const {
    if (device::fault_of(status) != firmware::Fault::link_silent) return false;
    const double timeout = 0.9 * static_cast<double>(status.fault_bound);
    double before = 0.0;
    for (const double look : looks_) {
      if (look - before >= timeout) return time > before + timeout;
      before = look;
    }
    return false;
  }

 private:
  std::vector<double> looks_;
};

}  // namespace kmax::experiment
