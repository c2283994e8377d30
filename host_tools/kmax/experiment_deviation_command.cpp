// kmax experiment deviation.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include "host_tools/experiment/deviation/deviation_device.hpp"
#include "host_tools/experiment/deviation/deviation_report.hpp"
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

struct DeviationOptions {
  experiment::DeviationSettings simulated;
  experiment::DeviationDeviceSettings device;
  double clip = 0.0, activation_gain = -1.0;
  std::string subjects;
  ExperimentFiles files;
  bool no_prompt = false, resume = false;
};

constexpr auto interrupted = "interrupted; nothing is armed";

experiment::DeviationStudy simulate(Context& context, const DeviationOptions& options,
                                    const Interruption& interruption) {
  experiment::DeviationSettings settings = options.simulated;
  std::vector<simulation::OperatorModel> people = people_of(options.subjects, settings.device);
  settings.device.force_limit = options.clip;
  set_activation_gain(people, options.activation_gain);
  Progress progress(context.messages());
  try {
    return experiment::study_deviation(settings, people, [&](std::size_t done, std::size_t all) {
      if (interruption.requested()) throw ExperimentInterrupted(interrupted);
      progress.show(fmt::format("{} of {} pairs of forces", done, all));
    });
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

experiment::DeviationStudy measure(Context& context, const DeviationOptions& options,
                                   const Interruption& interruption) {
  experiment::DeviationDeviceSettings settings = options.device;
  settings.axis = context.axis();
  settings.protocol = options.simulated.protocol;
  device::Device device = context.connect();
  const auto journal = open_touch_journal(context, options.files.folder, "deviation",
                                          experiment::journal_settings(device, settings), options.resume);
  const auto check_interruption = [&] {
    if (interruption.requested())
      throw ExperimentInterrupted(journal ? "interrupted; nothing is armed; --resume goes on" : interrupted);
  };
  TerminalPrompter prompter(context, check_interruption, experiment_prompt_advice);
  Progress progress(context.messages());
  const experiment::DeviationDeviceResult result = experiment::run_deviation_on_device(
      device, settings, options.no_prompt ? nullptr : &prompter,
      [&](const std::string& text) {
        check_interruption();
        progress.show(text);
      },
      journal.get(), [&](const std::string& text) { context.note(text); });
  experiment::DeviationStudy study;
  study.origin = report::Origin::measured;
  study.results = result.results;
  study.verdict = experiment::judge_deviation(study.results);
  study.fits = experiment::fit_table_2();
  study.circumstances = fmt::format(
      "Measured on {}: wall of {:g} N/mm at {:g} Hz on axis {}, pulses of {:g} s on axis {}, force limit "
      "{:g} N, which "
      "took something away in up to {:.0f} % of a touch's samples; {} trace records lost.",
      device.description(), settings.protocol.stiffness / 1000, settings.protocol.haptic_rate, settings.axis,
      settings.protocol.pulse_on, 1 - settings.axis, result.force_limit, 100 * result.limited_share,
      result.lost_records);
  for (const experiment::DeviationResult& one : study.results) {
    if (one.without_contact > 0)
      context.note(fmt::format(
          "F_B = {:g} N, F_I = {:g} N: not counted, the wall was touched less than {:.0f} % of the time",
          one.paper.background, one.paper.interference, 100 * experiment::least_contact));
  }
  return study;
}

Json pairs_json(const std::vector<experiment::DeviationResult>& results) {
  Json pairs = Json::array();
  for (const experiment::DeviationResult& result : results) {
    const bool known = result.touches > 0;
    pairs.push_back({{"background_force_n", result.paper.background},
                     {"interference_force_n", result.paper.interference},
                     {"deviation_m", known ? Json(result.deviation) : Json(nullptr)},
                     {"deviation_before_m", known ? Json(result.before) : Json(nullptr)},
                     {"touches", result.touches},
                     {"aborted", result.aborted},
                     {"without_contact", result.without_contact},
                     {"contact_share", result.contact_share},
                     {"beyond_paper_force_limit_share", result.beyond_limit_share},
                     {"paper_deviation_m", result.paper.deviation}});
  }
  return pairs;
}

Json verdict_json(const experiment::DeviationVerdict& verdict) {
  Json trends = Json::array();
  for (const experiment::DeviationTrend& trend : verdict.trends)
    trends.push_back({{"interference_force_n", trend.interference},
                      {"without_m", trend.without},
                      {"with_m", trend.with},
                      {"rank_with_background_force", optional_json(trend.rank)},
                      {"falls", trend.falls()}});
  return {{"claim_met", verdict.claim_met()},
          {"rank_correlation", optional_json(verdict.rank)},
          {"trends", trends}};
}

Json fits_json(const std::vector<experiment::DeviationFit>& fits) {
  Json all = Json::array();
  for (const experiment::DeviationFit& fit : fits)
    all.push_back({{"name", std::string(fit.kind.name)},
                   {"stiffness_n_per_m", fit.hand.stiffness},
                   {"threshold_n", fit.hand.threshold},
                   {"stiffening_per_n", fit.hand.stiffening},
                   {"stiffening_error_per_n", fit.error.stiffening},
                   {"threshold_rise", fit.hand.threshold_rise},
                   {"rms_m", fit.rms}});
  return all;
}

int run_deviation_experiment(Context& context, const DeviationOptions& options) {
  const Interruption interruption;
  make_folder(options.files);
  const experiment::DeviationStudy study = context.simulated() ? simulate(context, options, interruption)
                                                               : measure(context, options, interruption);
  std::vector<std::filesystem::path> files;
  if (!options.files.folder.empty())
    files = experiment::write_deviation(study, options.files.folder, options.files.ending);
  const int code = study.verdict.claim_met() ? done : verdict_is_no;
  if (context.json) {
    Json document = {{"origin", std::string(report::words_of(study.origin))},
                     {"circumstances", study.circumstances},
                     {"pairs", pairs_json(study.results)},
                     {"verdict", verdict_json(study.verdict)}};
    if (!study.without_stiffening.empty())
      document["without_stiffening"] = {{"pairs", pairs_json(study.without_stiffening)},
                                        {"verdict", verdict_json(study.verdict_without_stiffening)}};
    document["paper_table_fits"] = fits_json(study.fits);
    document["files"] = names_json(files);
    context.print(document);
    return code;
  }
  for (const std::string& words : experiment::deviation_words(study))
    fmt::print(context.out, "{}\n\n", words);
  for (const report::Table& table :
       {experiment::deviation_table(study), experiment::deviation_claims_table(study),
        experiment::deviation_fit_table(study)})
    fmt::print(context.out, "{}\n", report::terminal_text(table));
  print_names(context.out, files);
  return code;
}
}  // namespace

void add_deviation_experiment(CLI::App& experiment, Context& context) {
  auto* command = add_command(
      experiment, context,
      {"deviation", "Pushes a hand along the wall and sees how far it gives way (paper 1, Table II).",
       "  kmax experiment deviation                                    simulated people, takes seconds\n"
       "  kmax experiment deviation --subjects unclipped --out results with pictures and a page\n"
       "  kmax experiment deviation --activation-gain 0                a hand that cannot stiffen\n"
       "  kmax experiment deviation --device serial:/dev/ttyUSB0       somebody's own hand\n\n"
       "Pulses of F_I act along the surface, five without and five with a background force F_B away from it. "
       "The\n"
       "paper finds that the deviation falls when F_B increases. A device needs two axes: the wall is on "
       "--axis, the\n"
       "other one lies along the surface. You are told before each touch what to do; both axes' force limits "
       "are\n"
       "lowered, each touch is disarmed at its end and when the handle swings too far, and all parameters "
       "are put\n"
       "back, on Ctrl-C too.\n"
       "Exit code 3: the deviation did not fall."});
  auto options = std::make_shared<DeviationOptions>();
  experiment::DeviationSettings& simulated = options->simulated;
  experiment::DeviationProtocol& protocol = simulated.protocol;
  command->add_option("--stiffness", protocol.stiffness, "Stiffness of the wall, N/m; the paper gives none")
      ->check(finite_number() & CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command->add_option("--rate", protocol.haptic_rate, "Rate of the haptic loop, Hz")
      ->check(finite_number() & CLI::Range(100.0, 20000.0))
      ->capture_default_str();
  command->add_option("--pulse", protocol.pulse_on, "Length of a pulse, s; the paper gives none")
      ->check(finite_number() & CLI::Range(0.1, 10.0))
      ->capture_default_str();
  command->add_option("--pause", protocol.pulse_off, "Time between pulses, s")
      ->check(finite_number() & CLI::Range(0.1, 10.0))
      ->capture_default_str();
  command->add_option("--pulses", protocol.pulses, "Pulses without F_B, and as many with it")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--rest", protocol.rest, "Time for the arm to adjust, after the touch and with F_B, s")
      ->check(finite_number() & CLI::Range(0.1, 60.0))
      ->capture_default_str();
  add_file_options(*command, options->files);

  auto* people = command->add_option_group("Simulated", "Without --device");
  add_subjects_option(*people, options->subjects);
  add_activation_gain_option(*people, options->activation_gain);
  people->add_option("--push", simulated.push, "Push against the wall, N; above every F_B")
      ->check(finite_number() & CLI::Range(0.01, 100.0))
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
      return run_deviation_experiment(context, *options);
    };
  });
}

}  // namespace kmax::cli
