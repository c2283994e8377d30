#include "host_tools/experiment/sweep/scene_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/job_pool.hpp"
#include "host_tools/simulated_board/scene_run.hpp"
#include "host_tools/simulated_board/setting_names.hpp"
#include "host_tools/simulation/noise_generator.hpp"

namespace kmax::experiment {

namespace {
[[noreturn]] void fail(const std::string& name, const std::string& what) {
  throw base::ValueError(fmt::format("{}: {}", name, what));
}

double number_of(const SweptSetting& setting, std::string_view text) {
  try {
    return base::written_number(text, setting.unit, "a number", "a number").value;
  } catch (const base::ValueError& error) {
    fail(setting.shown, error.what());
  }
}

bool has_unit(std::string_view text) {
  const std::string_view bare = base::trimmed(text);
  return !bare.empty() && std::string_view("0123456789.").find(bare.back()) == std::string_view::npos;
}

/// What adding steps leaves behind the last digit that anybody wrote.
std::string without_rounding(double value) {
  return base::number_text(std::stod(fmt::format("{:.12g}", value)));
}

std::vector<std::string> range_of(const SweptSetting& setting, std::string_view text, std::size_t dots) {
  const std::size_t colon = text.find(':', dots);
  if (colon == std::string_view::npos)
    fail(setting.shown, fmt::format("'{}' has no step: write FROM..TO:STEP, as in 1000..10000:500", text));
  const std::string_view parts[] = {text.substr(0, dots), text.substr(dots + 2, colon - dots - 2),
                                    text.substr(colon + 1)};
  if (has_unit(parts[0]) != has_unit(parts[1]) || has_unit(parts[0]) != has_unit(parts[2]))
    fail(setting.shown, fmt::format("'{}': give all three numbers their unit, or none", text));
  const double from = number_of(setting, parts[0]), to = number_of(setting, parts[1]),
               step = number_of(setting, parts[2]);
  if (!(step > 0.0)) fail(setting.shown, fmt::format("'{}': the step must be above 0", text));
  if (!(from <= to)) fail(setting.shown, fmt::format("'{}': FROM is above TO; exchange them", text));
  const double steps = std::floor((to - from) / step * (1.0 + 1e-12) + 1e-9);
  if (!(steps < static_cast<double>(sweep_runs_max)))
    fail(setting.shown,
         fmt::format("'{}' has more than {} values; take a larger step", text, sweep_runs_max));
  std::vector<std::string> values;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(steps); ++i)
    values.push_back(without_rounding(from + static_cast<double>(i) * step));
  return values;
}

std::vector<std::string> list_of(const SweptSetting& setting, std::string_view text, bool numbers) {
  std::vector<std::string> values;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string_view one = base::trimmed(text.substr(at, comma - at));
    if (one.empty()) fail(setting.shown, fmt::format("'{}': a value is missing", text));
    std::string value = numbers ? base::number_text(number_of(setting, one)) : std::string(one);
    if (std::find(values.begin(), values.end(), value) != values.end())
      fail(setting.shown, fmt::format("'{}': {} is given twice; leave one out (--repeat runs a combination "
                                      "more than once)",
                                      text, value));
    values.push_back(std::move(value));
    at = comma + 1;
  }
  return values;
}

std::uint64_t seed_of_repeat(std::uint64_t seed, std::size_t repeat) {
  simulation::NoiseGenerator seeds(seed);
  // A seed in a scene is a whole number of 63 bits.
  for (std::size_t n = 0; n < repeat; ++n) seed = seeds.bits() >> 1;
  return seed;
}

bool has_noise(const simulation::Scene& scene) {
  return std::any_of(scene.axes.begin(), scene.axes.end(), [](const simulation::SceneAxis& axis) {
    return simulation::has_defects(axis.encoder) || (axis.motor && axis.current_sensor.noise > 0.0);
  });
}

std::string outcome_of(const simulated_board::RunResult& result) {
  if (result.samples[0].empty()) return std::string(firmware::to_string(result.refusal));
  if (result.fault != firmware::Fault::none) return std::string(firmware::text_of(result.fault).name);
  return "done";
}

SweepRow run_one(const SceneSweep& sweep, std::size_t run) {
  SweepRow row;
  for (const auto& setting : sweep.settings_of(run)) row.values.push_back(setting.value);
  row.repeat = run % sweep.repeats;
  const simulation::Scene scene = sweep.scene_of(run);
  row.seed = scene.seed;
  try {
    const simulated_board::RunResult result = simulated_board::run_scene(scene);
    row.outcome = outcome_of(result);
    row.refused = result.samples[0].empty();
    row.contact = result.contact;
    for (const auto& sample : result.samples[0])
      row.largest_force = std::max(row.largest_force, std::abs(sample.applied_force));
    row.alarms = result.alarms;
    row.first_alarm = result.first_alarm;
    row.limited_share = result.limited_share;
    row.clipped_share = result.clipped_share;
  } catch (const std::invalid_argument& error) {
    // Too few samples to judge, say: a point of the grid that tells nothing, and no reason to lose the rest.
    row.outcome = error.what();
  }
  return row;
}

std::string cell(std::string_view text) {
  if (text.find_first_of(",\"\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + '"';
}
}  // namespace

SweptSetting parse_swept_setting(const std::string& text) {
  const simulation::SceneSetting given = simulated_board::split_setting(text);
  const simulated_board::NamedSetting named = simulated_board::resolve_setting(given.name);
  SweptSetting setting{named.name, given.name, std::string(named.unit), {}};
  const std::size_t dots = given.value.find("..");
  if (dots != std::string::npos && !named.number)
    fail(setting.shown, fmt::format("'{}': it is not a number; give a list, A,B,C", given.value));
  setting.values = dots != std::string::npos ? range_of(setting, given.value, dots)
                                             : list_of(setting, given.value, named.number);
  return setting;
}

std::size_t SceneSweep::points() const {
  std::size_t count = 1;
  for (const SweptSetting& setting : settings) {
    count *= setting.values.size();
    if (count > sweep_runs_max) return count;  // before it overflows
  }
  return count;
}

std::vector<simulation::SceneSetting> SceneSweep::settings_of(std::size_t run) const {
  std::size_t point = run / repeats;
  std::vector<simulation::SceneSetting> chosen(settings.size());
  for (std::size_t i = settings.size(); i-- > 0;) {
    const SweptSetting& setting = settings[i];
    chosen[i] = {setting.name, setting.values[point % setting.values.size()]};
    point /= setting.values.size();
  }
  return chosen;
}

simulation::Scene SceneSweep::scene_of(std::size_t run) const {
  simulation::Scene opened = simulated_board::open_scene(scene, settings_of(run));
  opened.seed = seed_of_repeat(opened.seed, run % repeats);
  return opened;
}

bool check_sweep(const SceneSweep& sweep) {
  if (sweep.points() > sweep_runs_max || sweep.runs() > sweep_runs_max)
    throw base::ValueError(
        fmt::format("these are more than {} runs; take larger steps or fewer repeats", sweep_runs_max));
  bool noise = false;
  for (std::size_t run = 0; run < sweep.runs(); run += sweep.repeats)
    noise = has_noise(sweep.scene_of(run)) || noise;
  return noise;
}

void run_sweep(const SceneSweep& sweep, std::size_t jobs, std::vector<std::optional<SweepRow>>& rows,
               const ProgressReport& report) {
  rows.assign(sweep.runs(), std::nullopt);
  run_jobs(
      rows.size(), jobs, [&](std::size_t run) { rows[run] = run_one(sweep, run); }, report);
}

std::string sweep_csv(const SceneSweep& sweep, const std::vector<std::optional<SweepRow>>& rows) {
  std::string table;
  const auto has_column = [](const SweptSetting& setting) { return setting.name != "seed"; };
  for (const SweptSetting& setting : sweep.settings) {
    if (has_column(setting)) table += cell(setting.shown) + ',';
  }
  table +=
      "repeat,seed,verdict,peak_to_peak_m,deepest_m,largest_force_n,alarms,first_alarm_s,limited_share,"
      "clipped_share,outcome\n";
  for (const std::optional<SweepRow>& row : rows) {
    if (!row) break;
    for (std::size_t i = 0; i < row->values.size(); ++i) {
      if (has_column(sweep.settings[i])) table += cell(row->values[i]) + ',';
    }
    table += fmt::format("{},{},", row->repeat, row->seed);
    table += row->contact ? fmt::format("{},{},{}", to_string(row->contact->verdict),
                                        row->contact->peak_to_peak, row->contact->deepest)
                          : ",,";
    table += fmt::format(",{},{},{},{},{},{}\n", row->largest_force, row->alarms,
                         row->first_alarm ? fmt::format("{}", *row->first_alarm) : "", row->limited_share,
                         row->clipped_share, cell(row->outcome));
  }
  return table;
}

}  // namespace kmax::experiment
