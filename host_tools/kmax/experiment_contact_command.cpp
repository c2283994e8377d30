// kmax experiment contact.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/experiment/contact/contact_report.hpp"
#include "host_tools/experiment/touch_journal.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment_commands.hpp"
#include "host_tools/kmax/experiment_options.hpp"
#include "host_tools/kmax/finite_number.hpp"
#include "host_tools/kmax/terminal_prompter.hpp"

namespace kmax::cli {

namespace {
struct ContactOptions {
  experiment::ContactSettings settings;
  int trials = 3;
  ExperimentFiles files;
  bool no_prompt = false;
};

Json condition_json(const experiment::ContactResult& result) {
  return {{"name", result.condition.name},
          {"figure", result.condition.figure},
          {"assignments", result.condition.assignments},
          {"peak_to_peak_m", result.measure.peak_to_peak},
          {"verdict", std::string(experiment::to_string(result.measure.verdict))},
          {"trials", result.trials},
          {"unstable_trials", result.unstable_trials},
          {"paper_verdict", result.condition.paper_stable ? "stable" : "unstable"},
          {"agrees", result.agrees_with_paper()},
          {"limited_share", result.limited_share},
          {"deepest_m", result.measure.deepest},
          {"aborted", result.aborted_at.has_value()},
          {"samples", result.samples.size()},
          {"lost_records", result.lost_records}};
}

/// A trial that was not held or was cut off is made again, as every experiment does (touch_journal.hpp).
experiment::ContactResult make_trial(device::Device& device, const experiment::ContactCondition& condition,
                                     const experiment::ContactSettings& settings,
                                     const experiment::TouchSession& session) {
  return experiment::repeated_touch<experiment::ContactResult>(session, condition.name, [&] {
    if (session.prompter != nullptr)
      session.prompter->ask(fmt::format(
          "{}: take the handle out of the wall and be ready to press it against the wall for {:g} s",
          condition.name, settings.hold_time));
    return experiment::run_contact(device, condition, settings, session.tell);
  });
}

int run_contact_experiment(Context& context, const ContactOptions& options) {
  const Interruption interruption;
  experiment::ContactSettings settings = options.settings;
  settings.axis = context.axis();
  const auto conditions = experiment::contact_conditions();
  make_folder(options.files);
  device::Device device = context.connect();
  const auto check_interruption = [&] {
    if (interruption.requested()) throw ExperimentInterrupted("interrupted; the axis has been disarmed");
  };
  TerminalPrompter prompter(context, check_interruption, experiment_prompt_advice);
  // The person of the simulated device presses by itself.
  const bool asks = !options.no_prompt && !context.simulated();
  const experiment::RestoredAfterwards restored(device, settings.axis, experiment::contact_changes(settings),
                                                [&](const std::string& text) { context.note(text); });
  std::vector<experiment::ContactResult> results;
  Json list = Json::array();
  std::vector<std::filesystem::path> files, pictures;
  {
    Progress progress(context.messages());
    experiment::Standstill standstill(device, {settings.axis}, [&](const std::string& text) {
      progress.make_room();
      context.note(text);
    });
    const std::size_t all_trials = conditions.size() * static_cast<std::size_t>(options.trials);
    std::size_t done_trials = 0;
    for (const experiment::ContactCondition& condition : conditions) {
      const auto tell = [&](const std::string& text) {
        check_interruption();
        progress.show(fmt::format("{} of {}, {}", done_trials + 1, all_trials, text));
      };
      std::vector<experiment::ContactResult> trials;
      for (int trial = 0; trial < options.trials; ++trial, ++done_trials)
        trials.push_back(make_trial(device, condition, settings,
                                    {asks ? &prompter : nullptr, nullptr, tell, &standstill}));
      results.push_back(experiment::worst_of(std::move(trials)));
      list.push_back(condition_json(results.back()));
      if (options.files.folder.empty()) continue;
      const auto written =
          experiment::write_contact(results.back(), options.files.folder, options.files.ending);
      files.insert(files.end(), written.begin(), written.end());
      pictures.push_back(written.front());
    }
  }
  const auto trials = static_cast<std::size_t>(options.trials);
  if (!options.files.folder.empty()) {
    const auto origin = context.simulated() ? report::Origin::predicted : report::Origin::measured;
    const auto pages =
        experiment::write_contact_page(results, settings, trials, pictures, options.files.folder, origin);
    files.insert(files.end(), pages.begin(), pages.end());
  }
  const bool all_agree = std::all_of(results.begin(), results.end(), [](const experiment::ContactResult& r) {
    return r.agrees_with_paper();
  });
  const int verdict = all_agree ? done : verdict_is_no;
  if (context.json) {
    context.print({{"stiffness_n_per_m", settings.stiffness},
                   {"haptic_rate_hz", settings.haptic_rate},
                   {"hold_time_s", settings.hold_time},
                   {"threshold_m", settings.threshold},
                   {"velocity_estimator", results.front().velocity_estimator},
                   {"conditions", list},
                   {"files", names_json(files)}});
    return verdict;
  }
  for (const std::string& line :
       experiment::contact_words(settings, trials, results.front().velocity_estimator))
    print(context.out, "{}\n", line);
  print(context.out, "\n{}", experiment::contact_table(results));
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
  auto* contact = add_command(
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
       "Exit code 3: some condition did not come out as the paper says."});
  auto options = std::make_shared<ContactOptions>();
  experiment::ContactSettings& settings = options->settings;
  contact->add_option("--stiffness", settings.stiffness, "Stiffness of the wall, N/m")->capture_default_str();
  contact->add_option("--rate", settings.haptic_rate, "Rate of the haptic loop, Hz")->capture_default_str();
  contact->add_option("--hold", settings.hold_time, "Time from the first touch to the end of judging, s")
      ->check(finite_number() & CLI::Range(1.0, 60.0))
      ->capture_default_str();
  contact->add_option("--threshold", settings.threshold, "Peak to peak above which a wall is unstable, m")
      ->check(finite_number() & CLI::Range(1e-9, 1.0))
      ->capture_default_str();
  contact->add_option("--trials", options->trials, "Touches per condition; the worst one counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add_file_options(*contact, options->files, "Folder for a page, and a picture and a CSV file per condition");
  add_safety_options(*contact, settings.force_limit, settings.abort_amplitude);
  add_touch_options(*contact, options->no_prompt, settings.contact_patience);
  contact->callback([&context, options] {
    context.action = [&context, options] { return run_contact_experiment(context, *options); };
  });
}

}  // namespace kmax::cli
