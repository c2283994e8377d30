#pragma once
// One scene simulated over a grid of settings, each point as often as wanted.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/simulation/contact_measure.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::experiment {

/// Points of a grid and runs of a sweep that are computed at most.
inline constexpr std::size_t sweep_runs_max = 1'000'000;

struct SweptSetting {
  std::string name;                 ///< as simulation::SceneSetting has it
  std::string shown;                ///< as it was given, without "parameters."
  std::string unit;                 ///< of the values; empty for none
  std::vector<std::string> values;  ///< numbers in that unit; none is there twice
};

/// "NAME=VALUE", "NAME=A,B,C" or "NAME=FROM..TO:STEP", which ends at the last step that does not pass TO.
/// With a unit at every number or at none. Errors: base::ValueError.
SweptSetting parse_swept_setting(const std::string& text);

struct SceneSweep {
  std::string scene;  ///< name or path
  std::vector<SweptSetting> settings;
  std::size_t repeats = 1;

  std::size_t points() const;
  std::size_t runs() const { return points() * repeats; }
  /// The settings of a run: the last one of the list changes fastest, the repeat before it.
  std::vector<simulation::SceneSetting> settings_of(std::size_t run) const;
  /// What that run simulates. Throws simulation::SceneError.
  simulation::Scene scene_of(std::size_t run) const;
};

/// Opens every point, so that a wrong one is found before anything runs. Returns whether any of them has a
/// part with noise: without one all repeats are equal. Throws simulation::SceneError, and base::ValueError
/// for more than sweep_runs_max runs.
bool check_sweep(const SceneSweep& sweep);

struct SweepRow {
  std::vector<std::string> values;  ///< of the settings
  bool refused = false;             ///< it could not be armed; `outcome` says why
  std::size_t repeat = 0;
  std::uint64_t seed = 0;  ///< repeat 0 has the scene's own: --set seed=... makes any row again
  std::optional<simulation::ContactMeasure> contact;
  double largest_force = 0.0;         ///< N, applied at any time of the run
  std::uint32_t alarms = 0;           ///< so often the device called the wall unstable
  std::optional<double> first_alarm;  ///< s
  double limited_share = 0.0, clipped_share = 0.0;
  std::string outcome;  ///< "done", or why the run could not be armed, ended in a fault or was not judged
};

/// Runs them, `jobs` at a time (0: as many as there are processors), and puts each row in its place:
/// neither rows nor order depend on `jobs`. Runs begin in order, so that after an exception of `report` the
/// rows that are there are the first ones.
void run_sweep(const SceneSweep& sweep, std::size_t jobs, std::vector<std::optional<SweepRow>>& rows,
               const ProgressReport& report = {});

/// One line per row, with a heading: settings by name, all in SI units; a seed that is one of them is not
/// there again, since each row has the one it was run with. Up to the first row that is missing.
std::string sweep_csv(const SceneSweep& sweep, const std::vector<std::optional<SweepRow>>& rows);

}  // namespace kmax::experiment
