// kmax experiment jitter.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include "host_tools/experiment/jitter/jitter_report.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment_commands.hpp"
#include "host_tools/kmax/experiment_options.hpp"
#include "host_tools/kmax/finite_number.hpp"
#include "host_tools/kmax/interruption.hpp"
#include "host_tools/kmax/progress.hpp"
#include "host_tools/kmax/terminal_prompter.hpp"
#include "host_tools/kmax/value_json.hpp"
#include "host_tools/report/terminal_text.hpp"

namespace kmax::cli {
namespace {

struct JitterOptions {
  experiment::JitterSettings simulated;
  experiment::JitterDeviceSettings device;
  double clip = 0.0, activation_gain = -1.0;
  std::string subjects;
  ExperimentFiles files;
  bool no_prompt = false, resume = false;
};

constexpr auto interrupted = "interrupted; nothing is armed";

experiment::JitterStudy simulate(Context& context, const JitterOptions& options,
                                 const Interruption& interruption) {
  experiment::JitterSettings settings = options.simulated;
  std::vector<simulation::OperatorModel> people = people_of(options.subjects, settings.device);
  settings.device.force_limit = options.clip;
  set_activation_gain(people, options.activation_gain);
  Progress progress(context.messages());
  try {
    return experiment::study_jitter(settings, people, [&](std::size_t done, std::size_t all) {
      if (interruption.requested()) throw ExperimentInterrupted(interrupted);
      progress.show(fmt::format("{} of {} pairs of forces", done, all));
    });
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

experiment::JitterStudy measure(Context& context, const JitterOptions& options,
                                const Interruption& interruption) {
  experiment::JitterDeviceSettings settings = options.device;
  settings.axis = context.axis();
  settings.wall = options.simulated.wall;
  settings.touches = options.simulated.touches;
  device::Device device = context.connect();
  const auto journal = open_touch_journal(context, options.files.folder, "jitter",
                                          experiment::journal_settings(device, settings), options.resume);
  const auto check_interruption = [&] {
    if (interruption.requested())
      throw ExperimentInterrupted(journal ? "interrupted; nothing is armed; --resume goes on" : interrupted);
  };
  TerminalPrompter prompter(context, check_interruption, experiment_prompt_advice);
  Progress progress(context.messages());
  const experiment::JitterDeviceResult result = experiment::run_jitter_on_device(
      device, settings, options.no_prompt ? nullptr : &prompter,
      [&](const std::string& text) {
        check_interruption();
        progress.show(text);
      },
      journal.get(), [&](const std::string& text) { context.note(text); });
  experiment::JitterStudy study;
  study.wall = settings.wall;
  study.origin = report::Origin::measured;
  study.results = result.results;
  study.verdict = experiment::judge_jitter(study.results);
  study.circumstances = fmt::format(
      "Measured on {}: {} touches per pair, wall of {:g} N/mm at {:g} Hz, force limit {:g} N, which took "
      "something "
      "away in up to {:.0f} % of a touch's samples; {} trace records lost.",
      device.description(), settings.touches, settings.wall.stiffness / 1000, settings.wall.haptic_rate,
      result.force_limit, 100 * result.limited_share, result.lost_records);
  return study;
}

Json pairs_json(const std::vector<experiment::JitterResult>& results) {
  Json pairs = Json::array();
  for (const experiment::JitterResult& result : results) {
    const bool known = result.touches > 0;
    pairs.push_back(
        {{"background_force_n", result.paper.background},
         {"interference_force_n", result.paper.interference},
         {"jitter_m", known ? Json(result.amplitude) : Json(nullptr)},
         {"adjustment_time_s", known && result.unsettled == 0 ? Json(result.adjustment_time) : Json(nullptr)},
         {"touches", result.touches},
         {"not_settled", result.unsettled},
         {"aborted", result.aborted},
         {"beyond_paper_force_limit_share", result.beyond_limit_share},
         {"paper_jitter_m", result.paper.amplitude},
         {"paper_adjustment_time_s", result.paper.adjustment_time}});
  }
  return pairs;
}

Json verdict_json(const experiment::JitterVerdict& verdict) {
  return {{"jitter_falls", verdict.amplitude_falls()},
          {"adjustment_time_falls", verdict.time_falls()},
          {"claim_met", verdict.claim_met()},
          {"jitter_rank_correlation", optional_json(verdict.amplitude_rank)},
          {"adjustment_time_rank_correlation", optional_json(verdict.time_rank)}};
}

int run_jitter_experiment(Context& context, const JitterOptions& options) {
  const Interruption interruption;
  make_folder(options.files);
  const experiment::JitterStudy study = context.simulated() ? simulate(context, options, interruption)
                                                            : measure(context, options, interruption);
  std::vector<std::filesystem::path> files;
  if (!options.files.folder.empty())
    files = experiment::write_jitter(study, options.files.folder, options.files.ending);
  const int code = study.verdict.claim_met() ? done : verdict_is_no;
  if (context.json) {
    Json document = {{"origin", std::string(report::words_of(study.origin))},
                     {"circumstances", study.circumstances},
                     {"pairs", pairs_json(study.results)},
                     {"verdict", verdict_json(study.verdict)}};
    Json variations = Json::array();
    for (const experiment::JitterVariation& variation : study.variations)
      variations.push_back({{"name", variation.name},
                            {"pairs", pairs_json(variation.results)},
                            {"verdict", verdict_json(variation.verdict)}});
    document["variations"] = std::move(variations);
    document["files"] = names_json(files);
    context.print(document);
    return code;
  }
  for (const std::string& words : experiment::jitter_words(study)) fmt::print(context.out, "{}\n\n", words);
  fmt::print(context.out, "{}\n{}\n", report::terminal_text(experiment::jitter_table(study)),
             report::terminal_text(experiment::jitter_claims_table(study)));
  if (!study.variations.empty())
    fmt::print(context.out, "{}\n", report::terminal_text(experiment::jitter_variations_table(study)));
  print_names(context.out, files);
  return code;
}
}  // namespace

void add_jitter_experiment(CLI::App& experiment, Context& context) {
  auto* command = add_command(
      experiment, context,
      {"jitter",
       "Throws a hand out of the wall and sees how far, and how long until it is back (paper 1, Table I).",
       "  kmax experiment jitter                                    simulated people, takes seconds\n"
       "  kmax experiment jitter --subjects unclipped --out results with pictures and a page\n"
       "  kmax experiment jitter --activation-gain 0                a hand that cannot stiffen\n"
       "  kmax experiment jitter --device serial:/dev/ttyUSB0       somebody's own hand\n\n"
       "Inside the wall an interference force F_I is added, everywhere a background force F_B (1 to 7 N and "
       "0 to\n"
       "4 N). The paper finds that jitter and adjustment time fall when F_B increases. On a device you are "
       "told\n"
       "before each touch what to do; the force limit is lowered, each touch is disarmed at its end and when "
       "the\n"
       "handle swings too far, and all parameters are put back, on Ctrl-C too.\n"
       "Exit code 3: jitter or adjustment time did not fall."});
  auto options = std::make_shared<JitterOptions>();
  experiment::JitterSettings& simulated = options->simulated;
  command
      ->add_option("--stiffness", simulated.wall.stiffness,
                   "Stiffness of the wall, N/m; the paper gives none")
      ->check(finite_number() & CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command->add_option("--rate", simulated.wall.haptic_rate, "Rate of the haptic loop, Hz")
      ->check(finite_number() & CLI::Range(100.0, 20000.0))
      ->capture_default_str();
  command->add_option("--window", simulated.wall.window, "Time after the touch that is judged, s")
      ->check(finite_number() & CLI::Range(0.5, 60.0))
      ->capture_default_str();
  command->add_option("--touches", simulated.touches, "Touches per person and pair of forces")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add_file_options(*command, options->files);

  auto* people = command->add_option_group("Simulated", "Without --device");
  add_subjects_option(*people, options->subjects);
  add_activation_gain_option(*people, options->activation_gain);
  people->add_option("--push", simulated.push, "Push without the forces that the person answers to, N")
      ->check(finite_number() & CLI::Range(0.01, 100.0))
      ->capture_default_str();
  people->add_option("--speed", simulated.approach_speed, "Speed of the approach, m/s")
      ->check(finite_number() & CLI::Range(0.001, 5.0))
      ->capture_default_str();
  people->add_option("--reaction", simulated.reaction, "Share of F_I that the person answers to, 0 to 1")
      ->check(finite_number() & CLI::Range(0.0, 1.0))
      ->capture_default_str();
  people->add_option("--clip", options->clip, "Largest force of the simulated device, N; 0: no limit")
      ->check(finite_number() & CLI::Range(0.0, 1000.0))
      ->capture_default_str();

  auto* device = command->add_option_group("Device", "With --device");
  add_safety_options(*device, options->device.force_limit, options->device.abort_amplitude);
  add_touch_options(*device, options->no_prompt, options->device.patience);
  add_resume_option(*device, options->resume);
  command->callback([&context, options, people, device] {
    context.action = [&context, options, people, device] {
      require_kind(context, *people, *device);
      return run_jitter_experiment(context, *options);
    };
  });
}

}  // namespace kmax::cli
