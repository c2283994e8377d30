#pragma once
// A touch on two axes of a device while parameters are switched: the wall is on one axis, the trace is of the
// other one, which lies along the surface. watched_touch.hpp has the touch on one axis and says what keeps a
// person safe; the same holds here. Both axes are armed for the touch, and disarmed however it ends.

#include <optional>
#include <string>
#include <vector>

#include "firmware/drive/axes_law.hpp"
#include "firmware/object_dictionary/entry.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

/// The axis along the surface of this one's wall.
constexpr std::size_t along(std::size_t axis) {
  return firmware::axis_along<firmware::axis_count>(axis);
}

inline constexpr double wall_settling = 0.5;  ///< s; a first bounce has died out then

struct TimedChange {
  double time;                           ///< s after the touch
  std::vector<std::string> assignments;  ///< NAME=VALUE, a name without prefix is on the wall's axis
  bool moves_wall_axis = false;          ///< and may let it overshoot
};

struct TwoAxisTouch {
  std::vector<device::TraceSample> samples;  ///< of the axis along the surface; time 0 is the touch
  std::vector<double> change_times;          ///< s after the touch, of those changes that were made
  double contact_share = 0.0;  ///< of the looks at the wall's axis, 20 a second or more, that saw it touched
  double limited_share = 0.0;  ///< of the haptic samples, on the axis that was limited more
  std::uint64_t lost_records = 0;
  std::optional<double> aborted_at;  ///< s after the touch
  bool wall_oscillated = false;      ///< what it was aborted for: the wall, not the axis along the surface
};

/// `watch`: the wall's axis; hold_time is the whole touch; an oscillation of the other axis beyond
/// abort_amplitude ends it. `wall_abort_amplitude`, m: an oscillation of the wall's axis beyond it ends the
/// touch too, from wall_settling after the touch and after every change that moves the wall's axis on;
/// sooner, while a hand bounces by millimetres, five times as much does. 0: none does. Of that axis there is
/// a reading a round (20 ms and the requests), which shows more than half of an oscillation. `changes` in
/// order of time; each is made at the first round after its time, and when it was made is returned. Errors:
/// as watch_touch(), device::ValueError.
TwoAxisTouch watch_two_axes(device::Device& device, const TouchWatch& watch,
                            const std::vector<TimedChange>& changes, const ReportText& report,
                            double wall_abort_amplitude = 0.0);

}  // namespace kmax::experiment
