// kmax experiment deviation.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <map>

#include "host_tools/experiment/deviation_device.hpp"
#include "host_tools/experiment/deviation_report.hpp"
#include "host_tools/experiment/subject_set.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment_commands.hpp"
#include "host_tools/kmax/interruption.hpp"
#include "host_tools/kmax/progress.hpp"
#include "host_tools/kmax/terminal_prompter.hpp"
#include "host_tools/report/terminal_text.hpp"

namespace kmax::cli {
namespace {

struct DeviationOptions {
  experiment::DeviationSettings simulated;
  experiment::DeviationDeviceSettings device;
  double clip = 0.0, activation_gain = -1.0;
  std::string subjects, folder, ending = ".svg";
  bool no_prompt = false;
};

class DeviationInterrupted : public std::runtime_error {
 public:
  DeviationInterrupted() : std::runtime_error("interrupted; nothing is armed") {}
};

experiment::DeviationStudy simulate(Context& context, const DeviationOptions& options,
                                    const Interruption& interruption) {
  experiment::DeviationSettings settings = options.simulated;
  std::vector<simulation::OperatorModel> people(1);
  if (!options.subjects.empty()) {
    const experiment::SubjectSet set = experiment::open_subject_set(options.subjects);
    settings.device = set.device;
    people.clear();
    for (const experiment::Subject& subject : set.subjects) people.push_back(subject.person);
  }
  settings.device.force_limit = options.clip;
  if (options.activation_gain >= 0.0)
    for (simulation::OperatorModel& person : people) person.activation_gain = options.activation_gain;
  Progress progress(context.messages());
  try {
    return experiment::study_deviation(settings, people, [&](std::size_t done, std::size_t all) {
      if (interruption.requested()) throw DeviationInterrupted();
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
  const auto check_interruption = [&] {
    if (interruption.requested()) throw DeviationInterrupted();
  };
  TerminalPrompter prompter(context, check_interruption);
  Progress progress(context.messages());
  const experiment::DeviationDeviceResult result = experiment::run_deviation_on_device(
      device, settings, options.no_prompt ? nullptr : &prompter, [&](const std::string& text) {
        check_interruption();
        progress.show(text);
      });
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
  return study;
}

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
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
  // Before anybody presses anything.
  if (!options.folder.empty()) std::filesystem::create_directories(options.folder);
  const experiment::DeviationStudy study = context.simulated() ? simulate(context, options, interruption)
                                                               : measure(context, options, interruption);
  std::vector<std::filesystem::path> files;
  if (!options.folder.empty()) files = experiment::write_deviation(study, options.folder, options.ending);
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
    Json names = Json::array();
    for (const auto& file : files) names.push_back(file.string());
    document["files"] = std::move(names);
    context.print(document);
    return code;
  }
  for (const std::string& words : experiment::deviation_words(study))
    fmt::print(context.out, "{}\n\n", words);
  for (const report::Table& table :
       {experiment::deviation_table(study), experiment::deviation_claims_table(study),
        experiment::deviation_fit_table(study)})
    fmt::print(context.out, "{}\n", report::terminal_text(table));
  for (const auto& file : files) fmt::print(context.out, "{}\n", file.string());
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
  command->add_option("--out", options->folder, "Folder for CSV, pictures and a page")->type_name("DIR");
  command->add_option("--format", options->ending, "Kind of picture")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, std::string>{{"svg", ".svg"}, {"png", ".png"}}))
      ->type_name("svg|png");

  auto* people = command->add_option_group("Simulated", "Without --device");
  people
      ->add_option("--subjects", options->subjects,
                   "People: a file, 'clipped' or 'unclipped'; else subject 1")
      ->type_name("SET");
  people
      ->add_option("--activation-gain", options->activation_gain,
                   "How much the hand stiffens per N, 1/N, for everybody; else as the people are")
      ->check(finite_number() & CLI::Range(0.0, 100.0));
  people->add_option("--push", simulated.push, "Push against the wall, N; above every F_B")
      ->check(finite_number() & CLI::Range(0.01, 100.0))
      ->capture_default_str();
  people->add_option("--clip", options->clip, "Largest force of the simulated device, N; 0: no limit")
      ->check(finite_number() & CLI::Range(0.0, 1000.0))
      ->capture_default_str();

  auto* device = command->add_option_group("Device", "With --device");
  add_safety_options(*device, options->device.force_limit, options->device.abort_amplitude);
  device->add_flag("--no-prompt", options->no_prompt, "Ask nobody: a simulated person needs no asking");
  device->add_option("--patience", options->device.patience, "Time to come to the wall, s")
      ->check(finite_number() & CLI::Range(1.0, 600.0))
      ->capture_default_str();
  command->callback([&context, options] {
    context.action = [&context, options] { return run_deviation_experiment(context, *options); };
  });
}

}  // namespace kmax::cli
