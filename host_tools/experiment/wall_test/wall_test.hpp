#pragma once
// A standard test of a rendered wall: what two people who have two devices do in the same way, so that their
// results can be compared. At each of several stiffnesses the wall is touched in four ways, several times:
//
//   slow     the handle meets the wall at about 0.05 m/s and is pressed against it
//   fast     at about 0.5 m/s
//   pulse    while it is pressed, the device pushes it by +1.5 N and then by -1.5 N, 20 ms each
//   let go   while it is pressed, the hand lets it go
//
// Pulse and letting go are 1.5 s before the hold ends: half a second is left for what dies out before the
// last second, which is judged, by two criteria:
//
//   position  unstable if it moves by more than 0.165 mm in every quarter of that second
//             (contact_measure.hpp)
//   force     unstable if it swings by more than 1 N in every quarter: a stiff wall on a coarse encoder
//             swings by newtons, which a hand feels, while the handle moves by less than three counts
//
// Neither paper gives a measure; both criteria are this project's. A touch is stable if it is by both. A
// handle that was let go and has left the wall is stable: nothing of the wall moves it.
//
// The pulse is a change of interference.force, which acts inside the wall beside the wall's own force. The
// device's excitation cannot be used: where it is at work there is no wall. The host times the pulse: each
// half lasts 20 ms, or as long as a change takes on the link if that is longer; WallTouch::pulse_time has it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/experiment/rig.hpp"
#include "host_tools/experiment/touch_changes.hpp"
#include "host_tools/experiment/wilson_interval.hpp"
#include "host_tools/report/page.hpp"
#include "host_tools/simulation/contact_measure.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::experiment {

enum class TouchKind : std::uint8_t { slow, fast, pulse, let_go };
inline constexpr std::array touch_kinds{TouchKind::slow, TouchKind::fast, TouchKind::pulse,
                                        TouchKind::let_go};
/// "slow", "fast", "pulse", "let go".
std::string_view to_string(TouchKind kind);

enum class StabilityCriterion : std::uint8_t { position, force, both };
inline constexpr std::array stability_criteria{StabilityCriterion::position, StabilityCriterion::force,
                                               StabilityCriterion::both};
std::string_view to_string(StabilityCriterion criterion);

struct WallTestSettings {
  std::vector<double> stiffnesses{1e3, 2e3, 3e3, 4e3, 5e3, 6e3};  ///< N/m, rising
  std::size_t repeats = 3;                                        ///< touches of each kind at each stiffness
  double hold_time = 3.0;  ///< s from the first touch, 2 at least; the last second is judged
  double threshold = simulation::unstable_motion;  ///< m peak to peak
  double force_threshold = 1.0;                    ///< N peak to peak
  double slow = 0.05, fast = 0.5;                  ///< m/s, intended
  double usual = 0.2;                              ///< m/s, of the other two kinds
  double pulse_force = 1.5;                        ///< N
  double pulse_time = 0.02;                        ///< s, of each half
  TouchChanges changes{};                          ///< of every touch

  /// s from the first touch, of the pulse and of letting go.
  double event_time() const { return hold_time - 1.5; }
  double speed(TouchKind kind) const {
    return kind == TouchKind::slow ? slow : kind == TouchKind::fast ? fast : usual;
  }
};

struct WallTouch {
  TouchKind kind = TouchKind::slow;
  double stiffness = 0.0;  ///< N/m
  std::size_t number = 1;  ///< of its kind at its stiffness, from 1
  bool judged = false;     ///< long enough in the wall, with enough records
  bool stable_by_position = false, stable_by_force = false;
  double position_swing = 0.0;          ///< m peak to peak over the judged second
  double force_swing = 0.0;             ///< N, likewise
  double contact_speed = 0.0;           ///< m/s towards the wall over the 30 ms before it, from the encoder
  double deepest = 0.0;                 ///< m, from the first touch to the end of the hold
  double peak_force = 0.0;              ///< N, asked for, likewise
  std::optional<double> rate_hardness;  ///< N/m; see rate_hardness.hpp
  /// s from the touch, or from the end of the pulse, after which the handle no longer swings to and fro by
  /// more than the threshold within 0.25 s. Nothing: it does so until the end, or it was let go.
  std::optional<double> settling;
  std::optional<double> pulse_time;  ///< s, of the mean half, where there was a pulse
  double limited_share = 0.0;        ///< of the haptic samples
  std::optional<double> aborted_at;  ///< s after the touch, by the host: unstable by both
  std::uint64_t lost_records = 0;
  std::vector<RigSample> samples;

  bool counts() const { return judged; }
  bool stable(StabilityCriterion criterion) const {
    return (stable_by_position || criterion == StabilityCriterion::force) &&
           (stable_by_force || criterion == StabilityCriterion::position);
  }
};

/// What is made of a touch. Its samples are kept.
WallTouch measure_wall_touch(TouchKind kind, RigTouch touch, const WallTestSettings& settings);

/// What a person is asked before a touch.
std::string request_of(TouchKind kind, double stiffness, const WallTestSettings& settings);

/// The simulated device and the person who makes touches of that kind by himself, with the changes.
simulation::Scene scene_of(TouchKind kind, const WallTestSettings& settings);

/// 15 mm of oscillation end a touch, which must begin within 10 s: a fast touch of a soft wall whose force is
/// limited goes 6 mm in and out again, which is no instability.
TouchLimits wall_test_limits();

/// All touches of a kind, stiffness by stiffness. `made` hears before each which one it is, from 0, and
/// `touched` gets it. Errors: std::invalid_argument for settings out of range; those of the rig and of the
/// two.
void make_wall_touches(Rig& rig, TouchKind kind, const WallTestSettings& settings,
                       const std::function<void(std::size_t number)>& made,
                       const std::function<void(WallTouch touch)>& touched);

/// The touches of one kind at one stiffness that count.
struct WallCell {
  TouchKind kind = TouchKind::slow;
  double stiffness = 0.0;  ///< N/m
  std::size_t touches = 0;
  std::array<std::size_t, stability_criteria.size()> stable{};  ///< by each criterion
  double contact_speed = 0.0;                                   ///< m/s, median
  double deepest = 0.0, peak_force = 0.0;                       ///< m and N, largest
  std::optional<double> rate_hardness;                          ///< N/m, median
  std::optional<double> settling;                               ///< s, longest; nothing if any never did
  double limited_share = 0.0;                                   ///< largest
  std::size_t aborted = 0;

  std::size_t stable_by(StabilityCriterion criterion) const {
    return stable[static_cast<std::size_t>(criterion)];
  }
  /// Of the share that is stable by both; without touches anything.
  ShareInterval interval() const {
    if (touches == 0) return {0.0, 1.0};
    return wilson_interval(stable_by(StabilityCriterion::both), touches);
  }
};

/// Kind by kind, stiffness by stiffness.
std::vector<WallCell> wall_cells(const std::vector<WallTouch>& touches, const WallTestSettings& settings);

/// The largest stiffness that was stable in every touch, as every smaller one was.
struct StableLimit {
  enum class End : std::uint8_t {
    unstable,  ///< the next one was unstable in some touch
    nothing,   ///< nothing was unstable: it is larger than all that were tested
    unjudged,  ///< of the next one no touch could be judged
  };
  std::optional<double> largest;  ///< N/m; nothing: it lies below the smallest one tested
  double next = 0.0;              ///< N/m, of the end; without one the last
  End end = End::unstable;
};

/// Of touches of `kind`; of all kinds together without one.
StableLimit stable_limit(const std::vector<WallCell>& cells, StabilityCriterion criterion,
                         const std::optional<TouchKind>& kind = {});

/// "3 N/mm", "at least 6 N/mm: nothing was unstable", "below 1 N/mm: unstable already there", ...
std::string limit_text(const StableLimit& limit);

/// What came of it.
struct WallTestResult {
  WallTestSettings settings;
  double haptic_rate = 0.0;  ///< Hz
  std::string law;           ///< the wall's, as the parameter names it
  bool grows = false;        ///< it meets the handle softer (wall.touch_stiffness)
  std::vector<WallTouch> touches;
  std::vector<WallCell> cells;
  report::Origin origin = report::Origin::predicted;
};

// What is said of it.

/// How it was done, by which criteria, in sentences.
std::vector<std::string> wall_test_words(const WallTestResult& result);
/// The limits: a row for each kind of touch and one for all.
report::Table limit_table(const WallTestResult& result);
/// The verdicts: a row for each cell.
report::Table verdict_table(const WallTestResult& result);
/// What was measured: a row for each cell.
report::Table measure_table(const WallTestResult& result);

/// wall_test.md and .html with a picture of the stable share over the stiffness, a table of all touches
/// (wall_test_touches.csv), and for each kind of touch every sample of every touch (wall_test_SLOW.csv).
/// Returns the names written. Throws plot::FigureError or std::runtime_error.
std::vector<std::filesystem::path> write_wall_test(const WallTestResult& result, const Provenance& provenance,
                                                   const std::filesystem::path& folder,
                                                   const std::string& picture_ending);

}  // namespace kmax::experiment
