// kmax check.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <tuple>

#include "firmware/parameters/parameter_rules.hpp"
#include "host_tools/base/axis_name.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/check/hand_choice.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/check/stability_map.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/json/judgement_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_options.hpp"
#include "host_tools/plot/gnuplot_picture.hpp"

namespace kmax::cli {

using check::CriterionText;
using check::MapAxis;
using check::Verdict;
using device::Parameter;

namespace {
struct CheckOptions {
  std::vector<std::string> assignments, sides, explained;
  std::string hand = "none", picture, csv;
  const CLI::Option* explain = nullptr;  ///< --explain, which may be given without a name

  void declare(CLI::App& command) {
    command
        .add_option("--set", assignments,
                    "Parameter to judge in place of the device's, or a number of the structure that bends "
                    "between motor and handle (structure.stiffness, .damping, .handle_mass); may be repeated")
        ->type_name("NAME=VALUE")
        ->take_all();
    command
        .add_option(
            "--hand", hand,
            "Who holds the handle: none (default), subject_1, or a TOML file with an [operator] table")
        ->type_name("HAND");
    command
        .add_option("--map", sides,
                    "Side of a map, twice: a parameter over a range, 60 points; :log for equal ratios")
        ->type_name("NAME=FROM..TO[:log][,POINTS]")
        ->take_all();
    command.add_option("--picture", picture, "Map as .svg or .png")->type_name("FILE");
    command.add_option("--csv", csv, "Map as a table: which criteria pass at every point")->type_name("FILE");
    explain = command
                  .add_option("--explain", explained,
                              "Shows formula, assumptions and source of criteria, and does nothing else")
                  ->type_name("[CRITERION]")
                  ->expected(0, -1);
  }
};

/// --set, by what it sets.
struct Settings {
  std::vector<std::string> of_parameters;
  check::Structure structure;
};

/// "axis7" of a device that has fewer is nobody's.
void require_axis(std::string_view named, const std::string& text) {
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    if (named == fmt::format("axis{}", axis)) return;
  throw UsageError(
      fmt::format("--set {}: there is no {}; the axes are 0 to {}", text, named, firmware::axis_count - 1));
}

/// A structure is read as that of simulated touches is ('kmax experiment'); what is not set of it has its
/// default. UsageError or base::ValueError.
Settings settings_of(Context& context, const CheckOptions& options) {
  Settings settings;
  std::vector<std::string> of_structure;
  for (const std::string& text : options.assignments) {
    const auto [axis, bare, digits] = base::split_axis(base::trimmed(text));
    if (!bare.starts_with("structure.")) {
      settings.of_parameters.push_back(text);
    } else if (!axis.empty() && axis != fmt::format("axis{}", context.axis())) {
      // Refused if it is none.
      std::ignore = touch_changes(std::vector{std::string(bare)}, experiment::Touching::set_of_people);
      require_axis(axis, text);
      context.note(fmt::format("{} is not judged by any criterion of axis {}", text, context.axis()));
    } else {
      of_structure.emplace_back(bare);
    }
  }
  if (!of_structure.empty())
    settings.structure = touch_changes(of_structure, experiment::Touching::set_of_people)
                             .simulated_device()
                             .axes.front()
                             .device.structure;
  return settings;
}

/// A side of a map; what is no parameter of the device has one value all over it.
MapAxis map_side(const std::string& text, std::size_t axis) {
  if (base::split_axis(base::trimmed(text)).rest.starts_with("structure."))
    throw UsageError(fmt::format(
        "--map {}: a map's sides are parameters of the device; give the structure with --set, and it is the "
        "same at every point of the map",
        text));
  return check::parse_map_axis(text, axis);
}

std::size_t slot_of(const Parameter& parameter) {
  return firmware::slot_of(parameter.entry(), parameter.axis());
}

/// The device's parameters, as far as they are judged or asked for, with those of --set in their place.
firmware::ParameterValues values_of(Context& context, const std::vector<std::string>& settings,
                                    const std::vector<MapAxis>& sides) {
  const auto assignments = device::parse_assignments(settings, context.axis());
  std::vector<Parameter> read = check::parameters_of_judgement(context.axis());
  for (const auto& assignment : assignments) {
    if (std::find(read.begin(), read.end(), assignment.parameter) == read.end())
      context.note(fmt::format("{} is not judged by any criterion of axis {}", assignment.parameter.name(),
                               context.axis()));
  }
  for (const MapAxis& side : sides) {
    if (std::find(read.begin(), read.end(), side.parameter) != read.end()) continue;
    context.note(fmt::format("{} changes no criterion of axis {}: the map is the same all along it",
                             side.parameter.name(), context.axis()));
    read.push_back(side.parameter);
  }
  firmware::ParameterValues values;
  device::Device device = context.connect();
  const auto raw = device.read(read);
  for (std::size_t i = 0; i < read.size(); ++i) values.set_raw(slot_of(read[i]), raw[i]);
  for (const auto& assignment : assignments) values.set_raw(slot_of(assignment.parameter), assignment.raw);
  if (const auto broken = firmware::check_rules(values); broken.refusal != firmware::Refusal::none)
    throw base::ValueError(std::string(firmware::to_string(broken.refusal)));
  return values;
}

/// Of tables and paragraphs: the terminal's, or what a file is best read in.
std::size_t text_width(const Context& context) {
  return context.width() == 0 ? 110 : context.columns();
}

int judge_set(Context& context, const CheckOptions& options) {
  const check::HandChoice hand = check::choose_hand(options.hand);
  const Settings settings = settings_of(context, options);
  const firmware::ParameterValues values = values_of(context, settings.of_parameters, {});
  const check::Judgement judgement =
      check::judge_parameters(values, context.axis(), hand.hand, settings.structure);
  if (context.json) {
    context.print(json::judgement_json(judgement, hand.name));
  } else {
    context.out << check::judgement_text(judgement, hand.name, text_width(context));
  }
  return judgement.pass ? base::done : base::verdict_is_no;
}

/// "met nowhere: ...", and what to do about it; empty if every criterion that applies is met somewhere.
std::string met_nowhere(const check::StabilityMap& map) {
  std::vector<std::string> names;
  for (const CriterionText& text : check::all_criteria()) {
    const auto result_at = [&](const check::Results& results) -> const auto& {
      return results[static_cast<std::size_t>(text.criterion)];
    };
    const bool applies =
        std::any_of(map.results.begin(), map.results.end(),
                    [&](const check::Results& results) { return result_at(results).applies; });
    const bool met = std::any_of(map.results.begin(), map.results.end(), [&](const check::Results& results) {
      return result_at(results).applies && result_at(results).pass;
    });
    if (applies && !met) names.emplace_back(text.name());
  }
  if (names.empty()) return {};
  return fmt::format(
      "Met nowhere on this map: {0}. 'kmax check --explain {1}' says what it needs; 'kmax check' says what "
      "to change. A handle whose friction and damping are not entered (guard.friction, guard.damping) meets "
      "few.",
      fmt::join(names, ", "), names.front());
}

int draw_map(Context& context, const CheckOptions& options) {
  if (options.sides.size() != 2)
    throw UsageError(
        fmt::format("a map has two sides: give --map twice, not {}",
                    options.sides.size() == 1 ? "once" : fmt::format("{} times", options.sides.size())));
  if (options.picture.empty() && options.csv.empty())
    throw UsageError("--map needs --picture FILE.svg, --csv FILE, or both");
  std::vector<MapAxis> sides;
  for (const std::string& side : options.sides) sides.push_back(map_side(side, context.axis()));
  if (sides[0].parameter == sides[1].parameter)
    throw UsageError(fmt::format("--map: both sides are {}; name two parameters", sides[0].parameter.name()));
  base::require_different_files({{"--picture", options.picture}, {"--csv", options.csv}});
  if (!options.picture.empty()) plot::require_picture_name(options.picture);
  if (!options.csv.empty()) base::check_writable(options.csv);
  const check::HandChoice hand = check::choose_hand(options.hand);
  const Settings settings = settings_of(context, options);
  const firmware::ParameterValues values = values_of(context, settings.of_parameters, sides);
  const check::StabilityMap map =
      check::map_stability(values, context.axis(), hand.hand, sides[0], sides[1], settings.structure);
  if (!options.csv.empty()) check::write_map_csv(map, options.csv);
  if (!options.picture.empty() && !check::write_map_picture(map, values, hand.name, options.picture))
    context.note("the present parameters lie outside the map and are not marked");

  Json passing = Json::object();
  passing["all"] = std::count_if(map.results.begin(), map.results.end(), [](const check::Results& results) {
    return std::all_of(results.begin(), results.end(), [](const auto& result) { return result.pass; });
  });
  for (const CriterionText& text : check::all_criteria())
    passing[std::string(text.name())] =
        std::count_if(map.results.begin(), map.results.end(), [&text](const check::Results& results) {
          const auto& result = results[static_cast<std::size_t>(text.criterion)];
          return result.applies && result.pass;
        });
  if (context.json) {
    context.print({{"points", map.results.size()},
                   {"points_that_pass", passing},
                   {"picture", options.picture.empty() ? Json(nullptr) : Json(options.picture)},
                   {"csv", options.csv.empty() ? Json(nullptr) : Json(options.csv)}});
    return base::done;
  }
  base::print(context.out, "{} of {} points meet every criterion\n", passing["all"].get<std::size_t>(),
              map.results.size());
  if (const std::string nowhere = met_nowhere(map); passing["all"] == 0 && !nowhere.empty())
    context.say(nowhere, 0);
  for (const std::string& file : {options.picture, options.csv}) {
    if (!file.empty()) base::print(context.out, "{}\n", file);
  }
  return base::done;
}

int explain(Context& context, const std::vector<std::string>& names) {
  std::vector<control::Criterion> chosen;
  for (const std::string& name : names) {
    if (name.empty()) continue;  // --explain alone
    const auto criterion = check::criterion_of(name);
    if (!criterion)
      throw UsageError(fmt::format("--explain: there is no criterion '{}'; criteria are {}", name,
                                   check::criterion_names()));
    chosen.push_back(*criterion);
  }
  const bool everything = chosen.empty();
  if (everything) {
    for (const CriterionText& text : check::all_criteria()) chosen.push_back(text.criterion);
  }
  if (context.json) {
    Json all = Json::array();
    for (const control::Criterion criterion : chosen) {
      const CriterionText& text = check::text_of(criterion);
      all.push_back({{"name", std::string(text.name())},
                     {"worth", std::string(check::name_of(text.worth))},
                     {"value", std::string(text.value)},
                     {"relation", std::string(text.relation)},
                     {"bound", std::string(text.bound)},
                     {"unit", std::string(text.unit)},
                     {"needs", std::string(text.needs)},
                     {"assumptions", std::string(text.assumptions)},
                     {"with_structure", std::string(text.with_structure)},
                     {"source", std::string(text.source)}});
    }
    context.print({{"criteria", all}});
    return base::done;
  }
  for (const control::Criterion criterion : chosen)
    base::print(context.out, "{}\n", check::explanation(criterion, text_width(context)));
  if (!everything) return base::done;
  for (const check::Worth worth : {check::Worth::guarantee, check::Worth::necessary, check::Worth::heuristic})
    context.say(fmt::format("{}: {}", check::name_of(worth), check::meaning_of(worth)));
  base::print(context.out, "\n{}", check::symbols_text());
  return base::done;
}

int run_check(Context& context, const CheckOptions& options) {
  if (options.explain->count() > 0) {
    if (!options.sides.empty()) throw UsageError("--explain and --map do not go together");
    return explain(context, options.explained);
  }
  if (!options.sides.empty()) return draw_map(context, options);
  if (!options.picture.empty() || !options.csv.empty())
    throw UsageError("--picture and --csv are of a map: give --map NAME=FROM..TO twice");
  return judge_set(context, options);
}
}  // namespace

void add_check_command(CLI::App& app, Context& context) {
  add_command<CheckOptions>(
      app, context,
      {"check", "Judges by stability criteria whether the wall of a parameter set will hold still.",
       R"(  kmax check                                 the device's parameters
  kmax check --set guard.damping=0.5 --set wall.stiffness=2N/mm --hand subject_1
  kmax check --explain colgate               formula, assumptions, source; without a name, of all
  kmax check --set guard.friction=0.1 --map wall.stiffness=100..10000:log --map guard.damping=0.01..10:log \
             --picture map.svg             blue where every criterion passes, as a line where each begins to

Sets nothing. 'pass' means that every criterion that applies is met; most walls in use are without a guarantee and
still hold: the table says which criteria guarantee, which are necessary, and which are heuristics.
See docs/stability_check.md. Exit code of a map: 0.

A device that bends: --set structure.stiffness=2.3N/mm and, in place of their
defaults, structure.damping and structure.handle_mass ('kmax simulate --keys'). device.mass,
guard.damping and guard.friction are then of the motor's side, and the hand holds the tip.)"},
      Takes::device_and_axis, run_check);
}

}  // namespace kmax::cli
