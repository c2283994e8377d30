// kmax experiment deviation.
#include <fmt/format.h>

#include "host_tools/experiment/deviation/deviation_experiment.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {
namespace {

struct DeviationOptions : StudyOptions {
  DeviationOptions() {
    hands = experiment::deviation_hands();
    limits = experiment::deviation_limits();
  }
  experiment::DeviationSettings settings;

  void declare(CLI::App& command, Context& context) {
    add_quantity(command, "--stiffness", settings.protocol.stiffness, "N/m",
                 "Stiffness of the wall, N/m; the paper gives none", 1.0, 1e6);
    add_quantity(command, "--rate", settings.protocol.haptic_rate, "Hz", "Rate of the haptic loop, Hz", 100.0,
                 20000.0);
    add_quantity(command, "--pulse", settings.protocol.pulse_on, "s",
                 "Length of a pulse, s; the paper gives none", 0.1, 10.0);
    add_quantity(command, "--pause", settings.protocol.pulse_off, "s", "Time between pulses, s", 0.1, 10.0);
    add_number(command, "--pulses", settings.protocol.pulses, "Pulses without F_B, and as many with it", 1,
               100);
    add_quantity(command, "--rest", settings.protocol.rest, "s",
                 "Time for the arm to adjust, after the touch and with F_B, s", 0.1, 60.0);
    add_file_options(command, files);

    declare_for_people(command);
    add_people_options(*simulated, people);
    add_quantity(*simulated, "--push", hands.push, "N", "Push against the wall, N; above every F_B", 0.01,
                 100.0);
    add_clip_option(*simulated, people.clip);
    declare_for_device(command, context);
  }
};

experiment::DeviationStudy simulate(Context& context, const DeviationOptions& options,
                                    const base::Interruption& interruption,
                                    experiment::Provenance& /*provenance*/) {
  experiment::SimulatedHands hands = options.hands;
  const auto people = people_of(options.people, hands.device);
  return simulate_study(context, interruption, force_pairs_words,
                        [&](const experiment::ProgressReport& progress) {
                          return experiment::study_deviation(options.settings, hands, people, progress);
                        });
}

experiment::DeviationStudy measure(Context& context, const DeviationOptions& options,
                                   const base::Interruption& interruption,
                                   experiment::Provenance& provenance) {
  return measure_study(context, interruption, "deviation", options.settings, options, provenance,
                       experiment::RigAxes::wall_along,
                       [&](experiment::DeviceRig& rig) { return study_deviation(rig, options.settings); });
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
  for (const experiment::BackgroundTrend& trend : verdict.trends)
    trends.push_back({{"interference_force_n", trend.interference},
                      {"without_m", json::optional_json(trend.without)},
                      {"with_m", json::optional_json(trend.with)},
                      {"rank_with_background_force", json::optional_json(trend.rank)},
                      {"falls", json::optional_json(trend.falls())}});
  return {{"claim_met", json::optional_json(verdict.claim_met())},
          {"rank_correlation", json::optional_json(verdict.rank)},
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

StudyReport report_of(const experiment::DeviationStudy& study) {
  StudyReport report{study.verdict.claim_met() == true,
                     document_of(study),
                     experiment::deviation_words(study),
                     {experiment::deviation_table(study), experiment::deviation_claims_table(study),
                      experiment::deviation_fit_table(study)}};
  report.document["pairs"] = pairs_json(study.results);
  report.document["verdict"] = verdict_json(study.verdict);
  if (!study.without_stiffening.empty())
    report.document["without_stiffening"] = {{"pairs", pairs_json(study.without_stiffening)},
                                             {"verdict", verdict_json(study.verdict_without_stiffening)}};
  report.document["paper_table_fits"] = fits_json(study.fits);
  return report;
}

constexpr StudyCommand<experiment::DeviationStudy, DeviationOptions> deviation_study{
    simulate, measure, experiment::write_deviation, report_of};

int run_deviation(Context& context, const DeviationOptions& options) {
  return run_study(context, options, deviation_study);
}
}  // namespace

void add_deviation_experiment(CLI::App& experiment, Context& context) {
  add_command<DeviationOptions>(
      experiment, context,
      {"deviation", "Pushes a hand along the wall and sees how far it gives way (paper 1, Table II).",
       R"(  kmax experiment deviation                                          simulated people, takes seconds
  kmax experiment deviation --subjects unclipped --out results       with pictures and a page
  kmax experiment deviation --activation-gain 0                      a hand that cannot stiffen
  kmax experiment deviation --device serial:/dev/ttyUSB0             somebody's own hand
  kmax experiment deviation --device serial:/tmp/kmax --no-prompt    whom 'kmax serve --scene paper1_deviation'
                                                                     simulates, in real time: 5 minutes

Pulses of F_I act along the surface, five without and five with a background force F_B away from it. The
paper finds that the deviation falls when F_B increases. A device needs two axes: the wall is on --axis, the
other one lies along the surface. You are told before each touch what to do; both axes' force limits are
lowered, each touch is disarmed at its end and when the handle swings too far, and all parameters are put
back, on Ctrl-C too.
With --expect-paper the exit code is 3 if the deviation did not fall, or too little was touched to tell.)"},
      Takes::device, run_deviation);
}

}  // namespace kmax::cli
