// kmax sweep.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <map>
#include <set>

#include "host_tools/base/files.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/sweep/scene_sweep.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/simulation/scene_options.hpp"

namespace kmax::cli {

using experiment::SceneSweep;
using experiment::SweepRow;
using Rows = std::vector<std::optional<SweepRow>>;

namespace {
struct SweepOptions {
  std::string scene, file;
  std::vector<std::string> settings;
  std::size_t repeats = 1, jobs = 0;

  void declare(CLI::App& command) {
    add_scene_argument(command, scene, true);
    command
        .add_option("--set", settings,
                    "Values of a key of the scene or a parameter: FROM..TO:STEP or A,B,C; may be repeated: "
                    "every combination is simulated")
        ->required()
        ->type_name("NAME=VALUES")
        ->take_all();
    add_number(command, "--repeat", repeats, "Runs of each combination, with seeds of their own", 1, 100000);
    command.add_option("--jobs", jobs, "Runs at a time; all processors without it. Changes no result")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    command.add_option("--out", file, "CSV file to write (default, or -: standard output)")
        ->type_name("FILE");
  }
};

class SweepInterrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

std::string verdict_of(const SweepRow& row) {
  return row.contact ? std::string(experiment::to_string(row.contact->verdict)) : "not judged";
}

/// A number as a number, a word as text.
Json value_json(const std::string& value) {
  Json number = Json::parse(value, nullptr, false);
  return number.is_number() ? number : Json(value);
}

Json row_json(const SceneSweep& sweep, const SweepRow& row) {
  Json settings = Json::object();
  for (std::size_t i = 0; i < row.values.size(); ++i)
    settings[sweep.settings[i].shown] = value_json(row.values[i]);
  return {{"settings", settings},
          {"repeat", row.repeat},
          {"seed", row.seed},
          {"verdict", row.contact ? Json(verdict_of(row)) : Json(nullptr)},
          {"peak_to_peak_m", row.contact ? Json(row.contact->peak_to_peak) : Json(nullptr)},
          {"deepest_m", row.contact ? Json(row.contact->deepest) : Json(nullptr)},
          {"largest_force_n", row.largest_force},
          {"alarms", row.alarms},
          {"first_alarm_s", row.first_alarm ? Json(*row.first_alarm) : Json(nullptr)},
          {"limited_share", row.limited_share},
          {"clipped_share", row.clipped_share},
          {"outcome", row.outcome}};
}

Json sweep_json(const SceneSweep& sweep, const Rows& rows) {
  Json units = Json::object(), runs = Json::array();
  for (const auto& setting : sweep.settings) units[setting.shown] = setting.unit;
  for (const auto& row : rows) {
    if (row) runs.push_back(row_json(sweep, *row));
  }
  return {{"scene", sweep.scene}, {"units", units}, {"runs", runs}};
}

std::string counted_verdicts(const Rows& rows) {
  std::map<std::string, std::size_t> counts;
  for (const auto& row : rows) {
    if (row) ++counts[verdict_of(*row)];
  }
  std::vector<std::string> words;
  for (const auto& [verdict, count] : counts) words.push_back(fmt::format("{} {}", count, verdict));
  return fmt::format("{}", fmt::join(words, ", "));
}

void write_result(Context& context, const SweepOptions& options, const SceneSweep& sweep, const Rows& rows) {
  const bool to_file = !options.file.empty() && options.file != "-";
  if (to_file) base::write_file(options.file, experiment::sweep_csv(sweep, rows));
  if (context.json) {
    Json document = sweep_json(sweep, rows);
    if (to_file) document["out"] = options.file;
    context.print(document);
  } else if (to_file) {
    base::print(context.out, "{}: {}\n{}\n", sweep.scene, counted_verdicts(rows), options.file);
  } else {
    context.out << experiment::sweep_csv(sweep, rows);
  }
}

/// Whether any run was armed. Says how many were not, and why.
bool note_refused(Context& context, const Rows& rows) {
  std::size_t refused = 0;
  std::set<std::string> why;
  for (const auto& row : rows) {
    if (!row || !row->refused) continue;
    ++refused;
    why.insert(row->outcome);
  }
  if (refused > 0)
    context.note(
        fmt::format("{} of {} runs were not armed: {}", refused, rows.size(), fmt::join(why, "; or ")));
  return refused < rows.size();
}

int run_sweep_command(Context& context, const SweepOptions& options) {
  SceneSweep sweep{options.scene, {}, options.repeats};
  for (const std::string& text : options.settings) {
    sweep.settings.push_back(experiment::parse_swept_setting(text));
    for (std::size_t i = 0; i + 1 < sweep.settings.size(); ++i) {
      if (sweep.settings[i].name == sweep.settings.back().name)
        throw UsageError(fmt::format("{}: it is given twice; put all its values into one --set",
                                     sweep.settings.back().shown));
    }
  }
  base::require_different_files({{"SCENE", options.scene}, {"--out", options.file}});
  if (!options.file.empty() && options.file != "-") base::check_writable(options.file);
  if (!experiment::check_sweep(sweep) && options.repeats > 1)
    context.note(
        fmt::format("no part of {} has noise: the repeats of a combination are equal", options.scene));
  const base::Interruption interruption;
  Rows rows;
  try {
    base::Progress progress(context.messages());
    experiment::run_sweep(sweep, options.jobs, rows, [&](std::size_t run, std::size_t all) {
      if (interruption.requested()) throw SweepInterrupted("interrupted");
      progress.show(fmt::format("{} of {} runs", run, all));
    });
  } catch (const SweepInterrupted&) {
    const auto whole =
        static_cast<std::size_t>(std::find(rows.begin(), rows.end(), std::nullopt) - rows.begin());
    rows.resize(whole);
    write_result(context, options, sweep, rows);
    context.note(fmt::format("interrupted after {} of {} runs; those are whole", whole, sweep.runs()));
    return base::failed;
  }
  write_result(context, options, sweep, rows);
  return note_refused(context, rows) ? base::done : base::failed;
}
}  // namespace

void add_sweep_command(CLI::App& app, Context& context) {
  add_command<SweepOptions>(
      app, context,
      {"sweep", "Simulates a scene over a grid of settings and writes a table, one row a run.",
       R"(  kmax sweep touch --set wall.stiffness=1000..10000:500 --out k.csv
  kmax sweep touch --set wall.stiffness=1N/mm..10N/mm:1N/mm --set wall.law=plain,magnetic --out law.csv
  kmax sweep noisy_encoder --set operator.grip_stiffness=200,400,800 --repeat 5 --jobs 2

Names are those of 'kmax simulate --set'. A range has three numbers, all with a unit or none. The table has
every setting in SI units, the seed, and of axis 0 the verdict on the held contact, its peak to peak and
deepest point, the largest force, the device's own alarms, and how the run ended. Repeat 0 has the scene's
own seed; 'kmax simulate SCENE --set seed=...' runs any row again. Ctrl-C keeps the runs that are done. Ends with code 1 if no run could be armed.)"},
      Takes::nothing, run_sweep_command);
}

}  // namespace kmax::cli
