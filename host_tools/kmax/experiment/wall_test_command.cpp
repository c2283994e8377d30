// kmax experiment wall-test.
#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "host_tools/base/print.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/experiment/sweep/scene_sweep.hpp"
#include "host_tools/experiment/wall_test/wall_test.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {

namespace {
using experiment::TouchKind;
using experiment::WallTestResult;

struct WallTestOptions {
  experiment::WallTestSettings settings;
  experiment::TouchLimits limits = experiment::wall_test_limits();
  std::string stiffnesses;
  int repeats = 3;
  ExperimentFiles files;
  bool no_prompt = false;
  std::vector<std::string> changed;  ///< --set

  void declare(CLI::App& command) {
    command
        .add_option("--stiffness", stiffnesses,
                    "Stiffnesses, N/m: A,B,C or FROM..TO:STEP, rising; else 1 to 6 N/mm in steps of 1")
        ->type_name("LIST");
    add_number(command, "--repeats", repeats, "Touches of each kind at each stiffness", 1, 1000);
    add_quantity(command, "--hold", settings.hold_time, "s",
                 "Time from the first touch to the end of judging, s", 2.0, 60.0);
    add_quantity(command, "--threshold", settings.threshold, "m",
                 "Peak to peak above which a touch is unstable by position, m", 1e-9, 1.0);
    add_quantity(command, "--force-threshold", settings.force_threshold, "N",
                 "Peak to peak above which it is unstable by force, N", 1e-6, 1000.0);
    add_file_options(command, files, "Folder for a page, a picture and all samples as CSV");
    add_touch_settings_option(command, changed);
    add_safety_options(command, limits);
    add_touch_options(command, no_prompt, limits.patience);
  }
};

std::vector<double> stiffnesses_of(const std::string& text) {
  std::vector<double> stiffnesses;
  try {
    const experiment::SweptSetting list = experiment::parse_swept_setting("wall.stiffness=" + text);
    for (const std::string& value : list.values) stiffnesses.push_back(std::stod(value));
  } catch (const base::ValueError& error) {
    throw UsageError(fmt::format("--stiffness {}: {}", text, error.what()));
  }
  for (std::size_t i = 0; i < stiffnesses.size(); ++i) {
    if (stiffnesses[i] < 1.0 || stiffnesses[i] > 1e6)
      throw UsageError(
          fmt::format("--stiffness {}: {:g} N/m is not within 1 .. 1e6 N/m", text, stiffnesses[i]));
    if (i > 0 && stiffnesses[i] <= stiffnesses[i - 1])
      throw UsageError(fmt::format("--stiffness {}: {:g} N/m stands after {:g} N/m; list them rising", text,
                                   stiffnesses[i], stiffnesses[i - 1]));
  }
  return stiffnesses;
}

Json limit_json(const std::string& touch, const WallTestResult& result,
                const std::optional<TouchKind>& kind) {
  Json row = {{"touch", touch}};
  for (const experiment::StabilityCriterion criterion : experiment::stability_criteria) {
    using End = experiment::StableLimit::End;
    const experiment::StableLimit limit = experiment::stable_limit(result.cells, criterion, kind);
    const char* found = limit.end == End::unjudged  ? "not judged further"
                        : limit.end == End::nothing ? "at least"
                        : limit.largest             ? "found"
                                                    : "below";
    row[std::string("by_") + std::string(to_string(criterion))] = {
        {"stiffness_n_per_m", json::optional_json(limit.largest)},
        {"is", found},
        {"words", experiment::limit_text(limit)}};
  }
  return row;
}

Json cell_json(const experiment::WallCell& cell) {
  using experiment::StabilityCriterion;
  const experiment::ShareInterval interval = cell.interval();
  return {{"touch", std::string(to_string(cell.kind))},
          {"stiffness_n_per_m", cell.stiffness},
          {"touches", cell.touches},
          {"stable", cell.stable_by(StabilityCriterion::both)},
          {"stable_by_position", cell.stable_by(StabilityCriterion::position)},
          {"stable_by_force", cell.stable_by(StabilityCriterion::force)},
          {"share_low", interval.low},
          {"share_high", interval.high},
          {"contact_speed_m_per_s", cell.contact_speed},
          {"deepest_m", cell.deepest},
          {"rate_hardness_n_per_m", json::optional_json(cell.rate_hardness)},
          {"peak_force_n", cell.peak_force},
          {"settling_s", json::optional_json(cell.settling)},
          {"limited_share", cell.limited_share},
          {"aborted", cell.aborted}};
}

Json provenance_json(const experiment::Provenance& provenance) {
  return {{"date", provenance.date},
          {"program", provenance.program},
          {"device", provenance.device},
          {"parameters", provenance.parameters},
          {"seed", json::optional_json(provenance.seed)},
          {"papers", experiment::references()}};
}

Json document_of(const WallTestResult& result, const experiment::Provenance& provenance) {
  Json limits = Json::array(), cells = Json::array();
  for (const TouchKind kind : experiment::touch_kinds)
    limits.push_back(limit_json(std::string(to_string(kind)), result, kind));
  limits.push_back(limit_json("all", result, {}));
  for (const experiment::WallCell& cell : result.cells) cells.push_back(cell_json(cell));
  const experiment::WallTestSettings& settings = result.settings;
  return {{"origin", std::string(report::to_string(result.origin))},
          {"law", result.law},
          {"grows", result.grows},
          {"haptic_rate_hz", result.haptic_rate},
          {"hold_time_s", settings.hold_time},
          {"threshold_m", settings.threshold},
          {"force_threshold_n", settings.force_threshold},
          {"repeats", settings.repeats},
          {"changed", settings.changes.words()},
          {"limits", limits},
          {"cells", cells},
          {"provenance", provenance_json(provenance)}};
}

/// The wall as it is set on the device for the touches; one without force is refused.
void describe_wall(device::Device& device, std::size_t axis, WallTestResult& result) {
  const auto name = [axis](const char* parameter) { return fmt::format("axis{}.{}", axis, parameter); };
  const device::Parameter law = device::resolve(name("wall.law"));
  result.law = device::value_text(law, device.read(law));
  result.haptic_rate = device.read_number(name("haptic.rate"));
  const double touch = device.read_number(name("wall.touch_stiffness"));
  result.grows = touch > 0.0 && touch < std::ranges::max(result.settings.stiffnesses);
  if (result.law == "none")
    throw UsageError(fmt::format(
        "wall.law of axis {} is none: there is no wall to test; set one, or give --set wall.law=plain",
        axis));
}

class WallTestRun {
 public:
  WallTestRun(Context& context, const WallTestOptions& options, const experiment::WallTestSettings& settings,
              experiment::Provenance& provenance)
      : context_(context),
        run_{options.limits, !options.no_prompt && !context.simulated()},
        provenance_(provenance) {
    result_.settings = settings;
    result_.origin = context.simulated() ? report::Origin::predicted : report::Origin::measured;
    run_.provenance = &provenance;
    run_.so_far = [this] {
      const experiment::WallTestSettings& all = result_.settings;
      return fmt::format("{} of {}, ", result_.touches.size() + 1,
                         experiment::touch_kinds.size() * all.stiffnesses.size() * all.repeats);
    };
  }

  WallTestResult make() {
    if (!context_.simulated()) {
      device::Device device = context_.connect();
      touch(device, experiment::touch_kinds);
    } else {
      // A simulated person comes as fast as his scene says: one for each kind of touch.
      for (const TouchKind kind : experiment::touch_kinds) {
        const simulation::Scene scene = experiment::scene_of(kind, result_.settings);
        provenance_.seed = scene.seed;
        device::Device device = simulated_device(context_, scene);
        touch(device, std::span(&kind, 1));
      }
    }
    result_.cells = experiment::wall_cells(result_.touches, result_.settings);
    return std::move(result_);
  }

 private:
  void touch(device::Device& device, std::span<const TouchKind> kinds) {
    make_touches(context_, device, interruption_, run_, [&](experiment::DeviceRig& rig) {
      // Before anybody is asked for a touch.
      experiment::RigWall wall;
      wall.as_set = true;
      wall.stiffness = result_.settings.stiffnesses.front();
      wall.changes = result_.settings.changes.assignments();
      rig.set(wall);
      describe_wall(device, context_.axis(), result_);
      for (const TouchKind kind : kinds)
        experiment::make_wall_touches(
            rig, kind, result_.settings, [](std::size_t) {},
            [this](experiment::WallTouch one) { result_.touches.push_back(std::move(one)); });
    });
  }

  Context& context_;
  TouchRun run_;
  experiment::Provenance& provenance_;
  const base::Interruption interruption_;
  WallTestResult result_;
};

int run_wall_test(Context& context, const WallTestOptions& options) {
  using experiment::Touching;
  experiment::WallTestSettings settings = options.settings;
  if (!options.stiffnesses.empty()) settings.stiffnesses = stiffnesses_of(options.stiffnesses);
  settings.repeats = static_cast<std::size_t>(options.repeats);
  settings.changes =
      touch_changes(options.changed, context.simulated() ? Touching::simulated_person : Touching::device,
                    experiment::Varied::stiffness_and_speeds);
  make_folder(options.files);
  experiment::Provenance provenance = provenance_of(options.files);
  const WallTestResult result = WallTestRun(context, options, settings, provenance).make();
  std::vector<std::filesystem::path> files;
  if (!options.files.folder.empty())
    files = experiment::write_wall_test(result, provenance, options.files.folder, options.files.ending);
  if (context.json) {
    Json document = document_of(result, provenance);
    document["files"] = names_json(files);
    context.print(document);
  } else {
    const std::size_t width = std::min<std::size_t>(context.columns(), 80);
    for (const std::string& line : experiment::wall_test_words(result))
      base::print(context.out, "{}\n", base::wrapped(line, width));
    for (const report::Table& table : {experiment::verdict_table(result), experiment::measure_table(result),
                                       experiment::limit_table(result)})
      base::print(context.out, "\n{}", report::terminal_text(table, width));
    print_names(context.out, files);
  }
  for (const experiment::WallTouch& touch : result.touches) {
    const std::string name =
        fmt::format("{:g} N/mm, {}, touch {}", touch.stiffness / 1e3, to_string(touch.kind), touch.number);
    if (touch.lost_records > 0)
      context.note(fmt::format("{}: {} trace records were lost on the way", name, touch.lost_records));
    if (!touch.counts()) context.note(fmt::format("{}: could not be judged and is left out", name));
  }
  return base::done;
}
}  // namespace

void add_wall_test_experiment(CLI::App& experiment, Context& context) {
  add_command<WallTestOptions>(
      experiment, context,
      {"wall-test",
       "Touches the wall that is set at several stiffnesses, in four ways, and says up to where it is "
       "stable.",
       "  kmax experiment wall-test                                     on the simulated device\n"
       "  kmax experiment wall-test --device serial:/dev/ttyUSB0 --out results\n"
       "  kmax experiment wall-test --stiffness 1N/mm..4N/mm:0.5N/mm --set wall.damping=2\n\n"
       "A standard test, whose page two laboratories can compare: a slow touch, a fast one, a pulse while "
       "the wall is pressed, and a handle that is let go in it, each judged by position and by force. Law, "
       "rate and all else of the wall are the device's own.\n"
       "On a device each touch is asked for before it is made. The axis is disarmed after each touch and on "
       "Ctrl-C, and its parameters are put back at the end.\n"
       "Every number that is compared needs its interval: 3 stable touches of 3 say no more than that at "
       "least 44 % are."},
      Takes::device_and_axis, run_wall_test);
}

}  // namespace kmax::cli
