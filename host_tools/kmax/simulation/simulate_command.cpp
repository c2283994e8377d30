// kmax simulate.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>

#include "host_tools/base/files.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/simulation/scene_options.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/simulated_board/scene_run.hpp"
#include "host_tools/simulated_board/setting_names.hpp"
#include "host_tools/simulation/scene_keys.hpp"

namespace kmax::cli {

using simulated_board::RunResult;
using simulated_board::RunSample;

namespace {
struct SimulateOptions {
  std::string scene, csv, picture;
  std::vector<std::string> settings;
  bool keys = false;

  void declare(CLI::App& command) {
    add_scene_argument(command, scene, false);  // --keys needs none
    command
        .add_option("--set", settings,
                    "In place of what the scene says: one of its keys or a parameter; may be repeated")
        ->type_name("NAME=VALUE")
        ->take_all();
    command.add_flag("--keys", keys, "Prints every key that a scene may have, as docs/scenes.md");
    command.add_option("--csv", csv, "Table of every haptic sample to write")->type_name("FILE");
    command.add_option("--picture", picture, "Picture to draw, .svg or .png")->type_name("FILE");
  }
};

/// What the table has of an axis; the time stands before.
struct Column {
  const char* name;
  double RunSample::*member;
};
constexpr std::array columns{
    Column{"true_position_m", &RunSample::true_position},
    Column{"true_velocity_m_per_s", &RunSample::true_velocity},
    Column{"hand_position_m", &RunSample::hand_position},
    Column{"intended_position_m", &RunSample::intended_position},
    Column{"position_m", &RunSample::position},
    Column{"velocity_m_per_s", &RunSample::velocity},
    Column{"force_n", &RunSample::force},
    Column{"applied_force_n", &RunSample::applied_force},
    Column{"magnetic_coefficient_n", &RunSample::magnetic_coefficient},
};
constexpr Column tip_column{"tip_position_m", &RunSample::tip_position};

/// The rows of all axes are those of the same samples as long as they have the same haptic.rate; else those
/// beside axis 0 stand with their last sample.
void write_csv(const simulation::Scene& scene, const RunResult& result, const std::string& path) {
  struct Cell {
    std::size_t axis;
    Column column;
  };
  std::vector<Cell> cells;
  std::string head = "time_s";
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    if (result.samples[axis].empty()) continue;
    std::vector<Column> of_axis(columns.begin(), columns.end());
    if (scene.axes[axis].device.structure) of_axis.push_back(tip_column);
    for (const Column& column : of_axis) {
      cells.push_back({axis, column});
      head += fmt::format(",{}{}", axis == 0 ? "" : fmt::format("axis{}_", axis), column.name);
    }
  }
  std::string table = head + '\n';
  std::vector<std::size_t> at(scene.axes.size());
  for (const RunSample& sample : result.samples[0]) {
    for (std::size_t axis = 0; axis < at.size(); ++axis) {
      const std::vector<RunSample>& own = result.samples[axis];
      while (at[axis] + 1 < own.size() && own[at[axis] + 1].time <= sample.time) ++at[axis];
    }
    table += fmt::format("{}", sample.time);
    for (const auto& [axis, column] : cells)
      table += fmt::format(",{}", result.samples[axis][at[axis]].*column.member);
    table += '\n';
  }
  base::write_file(path, table);
}

plot::Series series(const std::vector<RunSample>& samples, double RunSample::*member, double scale,
                    const char* label, bool held) {
  plot::Series s{label, {}, {}, held};
  for (const RunSample& sample : samples) {
    s.x.push_back(sample.time);
    s.y.push_back(sample.*member * scale);
  }
  return s;
}

void write_picture(const simulation::Scene& scene, const RunResult& result, const std::string& path) {
  plot::Figure figure;
  figure.title = scene.description.empty() ? scene.name : scene.description;
  figure.x_label = "time since arming (s)";
  std::vector<plot::Mark> judged;
  if (result.contact) judged = {{result.judged_from, true, "judged"}, {result.judged_to, true, ""}};
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    const std::vector<RunSample>& samples = result.samples[axis];
    if (samples.empty()) continue;
    const std::string of_axis = axis == 0 ? "" : fmt::format("axis {}: ", axis);
    plot::Panel position{
        of_axis + "position (mm)", {series(samples, &RunSample::true_position, 1e3, "handle", false)}, {}};
    if (scene.axes[axis].device.structure) {
      position.series[0].label = "encoder";
      position.series.push_back(series(samples, &RunSample::tip_position, 1e3, "handle", false));
    }
    if (scene.axes[axis].person)
      position.series.push_back(series(samples, &RunSample::hand_position, 1e3, "hand", false));
    figure.panels.push_back(std::move(position));
    figure.panels.push_back(
        {of_axis + "force (N)", {series(samples, &RunSample::applied_force, 1, "", true)}, {}});
    if (std::any_of(samples.begin(), samples.end(),
                    [](const RunSample& sample) { return sample.magnetic_coefficient != 0.0; }))
      figure.panels.push_back(
          {of_axis + "F_{MC} (N)", {series(samples, &RunSample::magnetic_coefficient, 1, "", true)}, {}});
  }
  for (plot::Panel& panel : figure.panels) {
    panel.marks = judged;
    // Said once; in the others it would stand on the lines.
    if (!judged.empty()) judged.front().label.clear();
  }
  plot::write_figure(figure, path);
}

Json parts_json(const simulation::Scene& scene) {
  Json axes = Json::array();
  for (const simulation::SceneAxis& axis : scene.axes) axes.push_back(simulation::integrated_parts(axis));
  return axes;
}

Json result_json(const simulation::Scene& scene, const RunResult& result) {
  Json contact = nullptr;
  if (result.contact) {
    contact = {{"verdict", std::string(experiment::to_string(result.contact->verdict))},
               {"peak_to_peak_m", result.contact->peak_to_peak},
               {"deepest_m", result.contact->deepest},
               {"judged_from_s", result.judged_from},
               {"judged_to_s", result.judged_to}};
  }
  return {{"scene", scene.name},
          {"integrator", simulation::to_string(scene.integrator)},
          {"parts", parts_json(scene)},
          {"state", std::string(device::name_of(result.end_state))},
          {"fault", std::string(firmware::text_of(result.fault).name)},
          {"samples", result.samples[0].size()},
          {"contact", contact},
          {"alarms", result.alarms},
          {"first_alarm_s", result.first_alarm ? Json(*result.first_alarm) : Json(nullptr)},
          {"limited_share", result.limited_share},
          {"clipped_share", result.clipped_share},
          {"lost_edges", result.lost_edges},
          {"simulated_s", result.simulated_s},
          {"simulated_per_real_s", result.simulated_s / result.real_s}};
}

int print_keys(Context& context, const SimulateOptions& options) {
  if (!options.scene.empty() || !options.settings.empty() || !options.csv.empty() || !options.picture.empty())
    throw UsageError("--keys simulates nothing; give it alone");
  if (!context.json) {
    context.out << simulation::scene_keys_markdown();
    return base::done;
  }
  Json keys = Json::array();
  for (const simulation::SceneKey& key : simulation::scene_keys())
    keys.push_back({{"table", std::string(key.table)},
                    {"key", std::string(key.name)},
                    {"motor", key.motor.empty() ? Json(nullptr) : Json(std::string(key.motor))},
                    {"unit", std::string(key.unit)},
                    {"default", key.initial.empty() ? Json(nullptr) : Json(key.initial)},
                    {"allowed", key.allowed},
                    {"meaning", std::string(key.meaning)}});
  context.print({{"keys", keys}});
  return base::done;
}

int run_simulate(Context& context, const SimulateOptions& options) {
  if (options.keys) return print_keys(context, options);
  if (options.scene.empty())
    throw UsageError(fmt::format("a SCENE is missing: a TOML file, or one of {}", supplied_scene_names()));
  base::require_different_files(
      {{"SCENE", options.scene}, {"--csv", options.csv}, {"--picture", options.picture}});
  if (!options.csv.empty()) base::check_writable(options.csv);
  const simulation::Scene scene =
      simulated_board::open_scene(options.scene, simulated_board::parse_settings(options.settings));
  const RunResult result = simulated_board::run_scene(scene);
  const std::string axis = scene.axes.size() > 1 ? fmt::format("axis {}", result.axis) : "the axis";
  if (result.samples[0].empty())
    throw std::runtime_error(fmt::format("{}: {} could not be armed: {}", scene.name, axis,
                                         unarmed_text(options.scene, result.refusal)));
  if (!options.csv.empty()) write_csv(scene, result, options.csv);
  if (!options.picture.empty()) write_picture(scene, result, options.picture);
  if (context.json) {
    context.print(result_json(scene, result));
  } else {
    context.say(fmt::format("{}: {}", scene.name, scene.description));
    base::print(context.out, "  {:.3g} s simulated, {:.0f} times as fast as real time\n", result.simulated_s,
                result.simulated_s / result.real_s);
    base::print(context.out, "  integrator: {}\n", simulation::to_string(scene.integrator));
    for (std::size_t n = 0; n < scene.axes.size(); ++n)
      context.say(fmt::format("  axis {} integrates: {}", n,
                              fmt::join(simulation::integrated_parts(scene.axes[n]), ", ")),
                  4);
    if (result.contact)
      context.say(
          fmt::format(
              "  held contact: {}, {:.3f} mm peak to peak between {:.2f} and {:.2f} s, deepest {:.3f} mm",
              experiment::to_string(result.contact->verdict), result.contact->peak_to_peak * 1e3,
              result.judged_from, result.judged_to, result.contact->deepest * 1e3),
          4);
    if (result.first_alarm)
      context.say(fmt::format("  the device called the wall unstable {} time{}, first at {:.2f} s",
                              result.alarms, result.alarms == 1 ? "" : "s", *result.first_alarm),
                  4);
    context.say(fmt::format("  force limited in {:.1f} % of the samples, clipped by the device in {:.1f} %",
                            result.limited_share * 100, result.clipped_share * 100),
                4);
    if (result.lost_edges > 0)
      base::print(context.out, "  {} edges of the encoder lost\n", result.lost_edges);
    base::print(context.out, "  at the end: {}\n", device::to_string(result.end_state));
    for (const std::string& file : {options.csv, options.picture}) {
      if (!file.empty()) base::print(context.out, "  {}\n", file);
    }
  }
  if (result.fault == firmware::Fault::none) return base::done;
  context.note(fmt::format("the run ended in a fault of {}: {}", axis, firmware::text_of(result.fault).what));
  return base::failed;
}
}  // namespace

void add_simulate_command(CLI::App& app, Context& context) {
  add_command<SimulateOptions>(
      app, context,
      {"simulate", "Runs one scene through the firmware on a simulated device.",
       "  kmax simulate touch\n"
       "  kmax simulate touch --set wall.stiffness=3N/mm --set operator.grip_stiffness=800 --set "
       "device.mass=60g\n"
       "  kmax simulate my_scene.toml --csv run.csv --picture run.svg\n"
       "  kmax simulate --keys           what a scene may say: key, unit, default, allowed, meaning\n\n"
       "The axes of the scene are armed at time 0 and the person begins to move; everything goes through\n"
       "the firmware. A name of --set that is both a scene's key and a parameter is the key;\n"
       "parameters.NAME is the parameter. 'kmax sweep' simulates a grid of such settings."},
      Takes::nothing, run_simulate);
}

}  // namespace kmax::cli
