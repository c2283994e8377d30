// kmax experiment contact.
#include <fmt/format.h>

#include <algorithm>

#include "host_tools/base/print.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {

namespace {
struct ContactOptions {
  experiment::ContactSettings settings;
  experiment::TouchLimits limits = experiment::contact_limits();
  int trials = 3;
  ExperimentFiles files;
  bool no_prompt = false, expect_paper = false;
  std::vector<std::string> changed;  ///< --set
  const CLI::Option* rate = nullptr;

  void declare(CLI::App& command) {
    add_quantity(command, "--stiffness", settings.stiffness, "N/m", "Stiffness of the wall, N/m", 0.0, 1e6);
    rate = add_quantity(command, "--rate", settings.haptic_rate, "Hz", "Rate of the haptic loop, Hz", 100.0,
                        20000.0);
    add_quantity(command, "--hold", settings.hold_time, "s",
                 "Time from the first touch to the end of judging, s", 1.0, 60.0);
    add_quantity(command, "--threshold", settings.threshold, "m",
                 "Peak to peak above which a wall is unstable, m", 1e-9, 1.0);
    add_number(command, "--trials", trials, "Touches per condition; the worst one counts", 1, 1000);
    add_file_options(command, files, "Folder for a page, and a picture and a CSV file per condition");
    add_expect_paper_option(command, expect_paper);
    add_touch_settings_option(command, changed);
    add_safety_options(command, limits);
    add_touch_options(command, no_prompt, limits.patience);
  }
};

Json contact_json(const experiment::ContactResult& result) {
  return {{"name", result.condition.name},
          {"figure", result.condition.figure},
          {"assignments", result.condition.assignments},
          {"peak_to_peak_m", result.measure.peak_to_peak},
          {"verdict", std::string(experiment::to_string(result.measure.verdict))},
          {"trials", result.trials},
          {"unstable_trials", result.unstable_trials},
          {"paper_verdict", result.condition.paper_stable ? "stable" : "unstable"},
          {"agrees", json::optional_json(result.agrees_with_paper())},
          {"contact_speed_m_per_s", result.contact_speed},
          {"limited_share", result.limited_share},
          {"deepest_m", result.measure.deepest},
          {"aborted", result.aborted_at.has_value()},
          {"samples", result.samples.size()},
          {"lost_records", result.lost_records}};
}

/// The device in use; a simulated one with what is changed of it.
device::Device connect(Context& context, const experiment::TouchChanges& changes) {
  if (!changes.of_simulation()) return context.connect();
  return simulated_device(context, changes.simulated_device());
}

int run_contact_experiment(Context& context, const ContactOptions& options) {
  const base::Interruption interruption;
  experiment::ContactSettings settings = options.settings;
  using experiment::Touching;
  change_touches(
      settings,
      touch_changes(options.changed, context.simulated() ? Touching::simulated_person : Touching::device),
      *options.rate);
  const auto trials = static_cast<std::size_t>(options.trials);
  if (options.expect_paper && !settings.papers_wall())
    throw UsageError(
        fmt::format("--expect-paper: the paper's verdicts are of {}; leave --stiffness, --rate and "
                    "--set out, or --expect-paper",
                    experiment::papers_wall_words()));
  make_folder(options.files);
  device::Device device = connect(context, settings.changes);
  TouchRun run{options.limits, !options.no_prompt && !context.simulated()};  // who presses by itself
  experiment::Provenance provenance = provenance_of(options.files);
  run.provenance = &provenance;
  std::string so_far;
  run.so_far = [&so_far] { return so_far; };
  std::vector<experiment::ContactResult> results;
  const std::string velocity_estimator =
      make_touches(context, device, interruption, run, [&](experiment::DeviceRig& rig) {
        results = run_contacts(rig, settings, trials, [&so_far](std::size_t made, std::size_t all) {
          so_far = fmt::format("{} of {}, ", made + 1, all);
        });
        return rig.velocity_estimator();
      });
  auto words = experiment::contact_words(
      settings, trials, velocity_estimator,
      context.simulated() ? settings.changes.simulated_device().axes[0].motion : std::nullopt);
  if (context.simulated()) {
    const simulation::SceneAxis axis = settings.changes.simulated_device().axes[0];
    if (axis.person) words.push_back(experiment::model_words(axis.device, *axis.person));
  }
  std::vector<std::filesystem::path> files, pictures;
  if (!options.files.folder.empty()) {
    for (const experiment::ContactResult& result : results) {
      const auto written = experiment::write_contact(result, options.files.folder, options.files.ending);
      files.insert(files.end(), written.begin(), written.end());
      pictures.push_back(written.front());
    }
    const auto origin = context.simulated() ? report::Origin::predicted : report::Origin::measured;
    if (context.simulated()) provenance.seed = settings.changes.simulated_device().seed;
    const auto pages =
        experiment::write_contact_page(results, words, pictures, options.files.folder, origin, provenance);
    files.insert(files.end(), pages.begin(), pages.end());
  }
  const bool all_agree = std::all_of(results.begin(), results.end(), [](const experiment::ContactResult& r) {
    return r.agrees_with_paper() == true;
  });
  const int verdict = paper_exit_code(options.expect_paper, all_agree);
  if (context.json) {
    Json list = Json::array();
    for (const experiment::ContactResult& result : results) list.push_back(contact_json(result));
    context.print({{"stiffness_n_per_m", settings.stiffness},
                   {"haptic_rate_hz", settings.haptic_rate},
                   {"hold_time_s", settings.hold_time},
                   {"threshold_m", settings.threshold},
                   {"changed", settings.changes.words()},
                   {"velocity_estimator", velocity_estimator},
                   {"conditions", list},
                   {"files", names_json(files)}});
    return verdict;
  }
  for (const std::string& line : words)
    base::print(context.out, "{}\n", base::wrapped(line, context.width()));
  base::print(context.out, "\n{}",
              report::terminal_text(experiment::contact_table(results), context.width()));
  print_names(context.out, files);
  for (const auto& result : results) {
    if (result.lost_records > 0)
      context.note(fmt::format("{}: {} trace records were lost on the way", result.condition.name,
                               result.lost_records));
    if (result.aborted_at)
      context.note(fmt::format("{}: ended {:.2f} s after the touch, the handle oscillated by {:.1f} mm",
                               result.condition.name, *result.aborted_at,
                               result.measure.peak_to_peak * 1000));
  }
  return verdict;
}
}  // namespace

void add_contact_experiment(CLI::App& experiment, Context& context) {
  add_command<ContactOptions>(
      experiment, context,
      {"contact",
       "Touches a stiff wall under each law and judges whether it holds still (paper 1, Figs. 9 to 12).",
       "  kmax experiment contact                                       on the simulated device\n"
       "  kmax experiment contact --device serial:/dev/ttyUSB0 --out results\n\n"
       "On a device you are told what to do: before each touch take the handle out of the wall and press "
       "Enter, then\n"
       "press against the wall until the time is over; a simulated person does so by itself. The axis is "
       "disarmed after each trial and on Ctrl-C, and its parameters are put back at the end.\n"
       "A fast touch bounces by millimetres, which is no instability: approach at 0.2 m/s or so.\n"
       "With --expect-paper the exit code is 3 if some condition did not come out as the paper says."},
      Takes::device_and_axis, run_contact_experiment);
}

}  // namespace kmax::cli
