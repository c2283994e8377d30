#pragma once
// How well control/instability_detector.hpp finds the unstable walls of simulated people, what it says of
// stable ones, and whether control/wall_softening.hpp ends what it finds: what docs/instability_detector.md
// rests on. `kmax-studies instability` runs it.
//
// Detector and softening are run beside the firmware's own haptic loop as they would be within it: the
// detector sees the counted displacement and the force that the device makes of what is asked for; the
// softening scales the wall's force before the device clips it.

#include <cstddef>
#include <optional>
#include <vector>

#include "control/instability_detector.hpp"
#include "control/wall_softening.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"
#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"
#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::studies {

/// A force on the handle besides wall and hand: a hand that trembles, or one that presses harder and less so.
struct Trembling {
  double force = 0.0;      ///< N, amplitude
  double frequency = 0.0;  ///< Hz
};

struct WatchedContact {
  bool stable = false, touched = false;  ///< by contact_measure.hpp, over the last second of the hold
  /// s from the beginning: the first turn of the swings of more than 0.165 mm that follow each other within a
  /// period of 15 Hz for half a second. Nothing, where there are no such: the oscillation comes and goes.
  std::optional<double> onset;
  std::optional<double> found;  ///< s from the beginning, of the first alarm
  std::optional<double> ended;  ///< s: no swing of more than 0.165 mm after it
  double frequency = 0.0;       ///< Hz, median over its swings, where there is an onset
  double factor = 1.0;          ///< of the softening, at the end
  double length = 0.0;          ///< s, simulated
};

struct ContactCase {
  experiment::TouchSetup setup;
  Trembling trembling{};
  bool softens = false;
  bool until_released =
      false;  ///< simulated until the hand is back at its start; else to the end of the hold
};
WatchedContact watch_contact(const ContactCase& contact);

/// A handle that nobody holds, thrown at a plain wall with its weight on it, for two seconds.
struct Throw {
  simulation::DeviceModel device;
  double stiffness = 100.0;  ///< N/m
  double rate = 20000.0;     ///< Hz
  double speed = 1.0;        ///< m/s
  double weight = 0.44;      ///< N
};
bool alarms_when_thrown(const Throw& thrown);

/// Touches of one wall, relative to each person's largest stable stiffness.
struct RatioResult {
  double ratio = 1.0;
  std::size_t unstable = 0, steady = 0;  ///< touches; those of them with an onset
  std::size_t found_in_time = 0;         ///< of the steady ones, within 0.3 s of the onset
  std::size_t stable = 0, alarms = 0;    ///< touches; those of them with an alarm
  std::vector<double> delays;            ///< s, onset to alarm; 0 for one before the onset
  std::vector<double> frequencies;       ///< Hz
  // Softened, the unstable ones with an alarm:
  std::size_t softened = 0, silenced = 0;  ///< silenced: still for the last half second
  std::vector<double> endings;             ///< s from the alarm to the end
  std::vector<double> factors;
};
/// Every person of every set with every law, at every ratio, with each of the protocol's touches.
std::vector<RatioResult> watch_ratios(const std::vector<experiment::SubjectSet>& sets,
                                      const std::vector<double>& ratios,
                                      const experiment::TouchProtocol& protocol, std::size_t threads);

/// Stable and rough touches at 500 Hz to 20 kHz, with and without wall damping, by every velocity estimator,
/// on coarse and fine encoders and resolutions, with and without tremor, taps, throws.
struct StableResult {
  std::size_t touches = 0, throws = 0;  ///< judged stable
  std::size_t not_stable = 0;           ///< left out: they were not
  std::size_t alarms = 0;
  double simulated_time = 0.0;  ///< s
};
/// `walls`: of a seed each, with `touches` each; neither wall nor field is steeper than `margin` of the plain
/// wall that is stable under that hand in that loop.
StableResult watch_stable(const std::vector<experiment::SubjectSet>& sets, std::size_t walls,
                          std::size_t touches, double margin, std::size_t threads);

report::Page instability_page(const std::vector<RatioResult>& ratios, const StableResult& stable,
                              double margin);

}  // namespace kmax::studies
