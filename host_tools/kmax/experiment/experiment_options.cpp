#include "host_tools/kmax/experiment/experiment_options.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <ctime>
#include <map>
#include <memory>

#include "host_tools/base/files.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/kmax/supplied_files.hpp"

namespace kmax::cli {

namespace {
/// "2026-11-26".
CLI::Validator calendar_date() {
  return {[](std::string& text) -> std::string {
            std::tm date{};
            const char* end = strptime(text.c_str(), "%Y-%m-%d", &date);
            if (end != nullptr && *end == '\0') return {};
            return fmt::format("{}: is no date; give year, month and day as in 2026-11-26", text);
          },
          ""};
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm date{};
  localtime_r(&now, &date);
  return fmt::format("{:04}-{:02}-{:02}", date.tm_year + 1900, date.tm_mon + 1, date.tm_mday);
}
}  // namespace

void add_file_options(CLI::App& command, ExperimentFiles& files, const std::string& contents) {
  command.add_option("--out", files.folder, contents)->type_name("DIR");
  command.add_option("--date", files.date, "Date that the page names; else today")
      ->check(calendar_date())
      ->type_name("YYYY-MM-DD");
  command.add_option("--commit", files.commit, "Commit that the page names; else what --version says")
      ->type_name("TEXT");
  add_format_option(command, files.ending);
}

void add_format_option(CLI::App& command, std::string& ending) {
  command.add_option("--format", ending, "Kind of picture")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, std::string>{{"svg", ".svg"}, {"png", ".png"}}))
      ->type_name("svg|png");
}

experiment::Provenance provenance_of(const ExperimentFiles& files) {
  experiment::Provenance provenance;
  provenance.date = files.date.empty() ? today() : files.date;
  provenance.program = program_text(files.commit);
  return provenance;
}

void make_folder(const ExperimentFiles& files) {
  if (!files.folder.empty()) base::make_folder(files.folder);
}

Json names_json(const std::vector<std::filesystem::path>& written) {
  Json names = Json::array();
  for (const auto& file : written) names.push_back(file.string());
  return names;
}

void print_names(std::ostream& out, const std::vector<std::filesystem::path>& written) {
  for (const auto& file : written) base::print(out, "{}\n", file.string());
}

void add_subjects_option(CLI::App& command, std::string& people) {
  command.add_option("--subjects", people, "People: a file, 'clipped' or 'unclipped'; else subject 1")
      ->type_name("SET");
}

std::vector<simulation::OperatorModel> people_of(const std::string& set, simulation::DeviceModel& device) {
  if (set.empty()) return std::vector<simulation::OperatorModel>(1);
  const experiment::SubjectSet opened = experiment::open_subject_set(set);
  device = opened.device;
  std::vector<simulation::OperatorModel> people;
  for (const experiment::Subject& subject : opened.subjects) people.push_back(subject.person);
  return people;
}

void add_people_options(CLI::App& command, PeopleOptions& options) {
  add_subjects_option(command, options.subjects);
  command
      .add_option("--activation-gain", options.activation_gain,
                  "How much the hand stiffens per N, 1/N, for everybody; else as the people are")
      ->check(within(0.0, 100.0));
}

void add_clip_option(CLI::App& command, double& clip) {
  add_quantity(command, "--clip", clip, "N", "Largest force of the simulated device, N; 0: no limit", 0.0,
               1000.0);
}

std::vector<simulation::OperatorModel> people_of(const PeopleOptions& options,
                                                 simulation::DeviceModel& device) {
  std::vector<simulation::OperatorModel> people = people_of(options.subjects, device);
  device.force_limit = options.clip;
  if (options.activation_gain >= 0.0)
    for (simulation::OperatorModel& person : people) person.activation_gain = options.activation_gain;
  return people;
}

device::Device simulated_device(Context& context, const simulation::Scene& scene) {
  return device::Device(std::make_unique<device::SimLink>(scene),
                        [&context](const std::string& text) { context.note(text); });
}

void add_expect_paper_option(CLI::App& command, bool& expect) {
  command.add_flag("--expect-paper", expect, "Exit code 3 where the result differs from the paper's");
}

int paper_exit_code(bool expect, bool as_paper) {
  return expect && !as_paper ? base::verdict_is_no : base::done;
}

void add_touch_settings_option(CLI::App& command, std::vector<std::string>& settings) {
  command
      .add_option(
          "--set", settings,
          "Of every touch, in place of what it would have: a parameter of wall, estimator or loop, or, "
          "simulated, a number of device, structure, operator or motion; may be repeated")
      ->type_name("NAME=VALUE")
      ->take_all();
}

experiment::TouchChanges touch_changes(const std::vector<std::string>& settings,
                                       experiment::Touching touching, experiment::Varied varied) {
  try {
    return {settings, touching, varied};
  } catch (const simulation::SceneError& error) {
    throw UsageError(error.what());
  }
}

void change_touches(experiment::ContactSettings& touch, const experiment::TouchChanges& changes,
                    const CLI::Option& rate) {
  touch.changes = changes;
  const auto asked = changes.haptic_rate();
  if (!asked) return;
  if (rate.count() > 0) throw UsageError("--rate and --set haptic.rate say the same: leave one of them out");
  touch.haptic_rate = *asked;
}

void add_safety_options(CLI::App& command, experiment::TouchLimits& limits) {
  add_quantity(command, "--force-limit", limits.force_limit, "N",
               "Largest force on a device, N: lowers force.limit, never raises it", 0.01, 1000.0);
  add_quantity(
      command, "--abort-amplitude", limits.abort_amplitude, "m",
      "Oscillation within 0.25 s, m, at which a device is disarmed at once; the touch is unstable then", 1e-5,
      1.0);
}

void add_touch_options(CLI::App& command, bool& no_prompt, double& patience) {
  command.add_flag("--no-prompt", no_prompt, "Ask nobody: a simulated person needs no asking");
  add_quantity(command, "--patience", patience, "s", "How long to wait for the touch, s", 1.0, 600.0);
}

}  // namespace kmax::cli
