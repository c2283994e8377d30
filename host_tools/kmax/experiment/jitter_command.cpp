// kmax experiment jitter.
#include <fmt/format.h>

#include "host_tools/experiment/jitter/jitter_experiment.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {
namespace {

struct JitterOptions : StudyOptions {
  JitterOptions() {
    hands = experiment::jitter_hands();
    limits = experiment::jitter_limits();
  }
  experiment::JitterSettings settings;

  void declare(CLI::App& command, Context& context) {
    add_quantity(command, "--stiffness", settings.wall.stiffness, "N/m",
                 "Stiffness of the wall, N/m; the paper gives none", 1.0, 1e6);
    add_quantity(command, "--rate", settings.wall.haptic_rate, "Hz", "Rate of the haptic loop, Hz", 100.0,
                 20000.0);
    add_quantity(command, "--window", settings.wall.window, "s", "Time after the touch that is judged, s",
                 0.5, 60.0);
    add_number(command, "--touches", settings.touches, "Touches per person and pair of forces", 1, 1000);
    add_file_options(command, files);

    declare_for_people(command);
    add_people_options(*simulated, people);
    add_quantity(*simulated, "--push", hands.push, "N",
                 "Push without the forces that the person answers to, N", 0.01, 100.0);
    add_quantity(*simulated, "--speed", hands.approach_speed, "m/s", "Speed of the approach, m/s", 0.001,
                 5.0);
    add_number(*simulated, "--reaction", hands.reaction, "Share of F_I that the person answers to, 0 to 1",
               0.0, 1.0);
    add_clip_option(*simulated, people.clip);
    declare_for_device(command, context);
  }
};

experiment::JitterStudy simulate(Context& context, const JitterOptions& options,
                                 const base::Interruption& interruption,
                                 experiment::Provenance& /*provenance*/) {
  experiment::SimulatedHands hands = options.hands;
  const auto people = people_of(options.people, hands.device);
  return simulate_study(context, interruption, force_pairs_words,
                        [&](const experiment::ProgressReport& progress) {
                          return experiment::study_jitter(options.settings, hands, people, progress);
                        });
}

experiment::JitterStudy measure(Context& context, const JitterOptions& options,
                                const base::Interruption& interruption, experiment::Provenance& provenance) {
  return measure_study(context, interruption, "jitter", options.settings, options, provenance,
                       experiment::RigAxes::wall,
                       [&](experiment::DeviceRig& rig) { return study_jitter(rig, options.settings); });
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
  return {{"jitter_falls", json::optional_json(verdict.amplitude_falls())},
          {"adjustment_time_falls", json::optional_json(verdict.time_falls())},
          {"claim_met", json::optional_json(verdict.claim_met())},
          {"jitter_rank_correlation", json::optional_json(verdict.amplitude_rank)},
          {"adjustment_time_rank_correlation", json::optional_json(verdict.time_rank)}};
}

StudyReport report_of(const experiment::JitterStudy& study) {
  StudyReport report{study.verdict.claim_met() == true,
                     document_of(study),
                     experiment::jitter_words(study),
                     {experiment::jitter_table(study), experiment::jitter_claims_table(study)}};
  if (!study.variations.empty()) report.tables.push_back(experiment::jitter_variations_table(study));
  report.document["pairs"] = pairs_json(study.results);
  report.document["verdict"] = verdict_json(study.verdict);
  Json variations = Json::array();
  for (const experiment::JitterVariation& variation : study.variations)
    variations.push_back({{"name", variation.name},
                          {"pairs", pairs_json(variation.results)},
                          {"verdict", verdict_json(variation.verdict)}});
  report.document["variations"] = std::move(variations);
  return report;
}

constexpr StudyCommand<experiment::JitterStudy, JitterOptions> jitter_study{
    simulate, measure, experiment::write_jitter, report_of};

int run_jitter(Context& context, const JitterOptions& options) {
  return run_study(context, options, jitter_study);
}
}  // namespace

void add_jitter_experiment(CLI::App& experiment, Context& context) {
  add_command<JitterOptions>(
      experiment, context,
      {"jitter",
       "Pushes the hand out of the wall by a force pulse; measures how far it goes and how soon it returns "
       "(paper 1, Table I).",
       R"(  kmax experiment jitter                                        simulated people, takes seconds
  kmax experiment jitter --subjects unclipped --out results     with pictures and a page
  kmax experiment jitter --activation-gain 0                    a hand that cannot stiffen
  kmax experiment jitter --device serial:/dev/ttyUSB0           somebody's own hand

Inside the wall an interference force F_I is added, everywhere a background force F_B (1 to 7 N and 0 to
4 N). The paper finds that jitter and adjustment time fall when F_B increases. On a device you are told
before each touch what to do; the force limit is lowered, each touch is disarmed at its end and when the
handle swings too far, and all parameters are put back, on Ctrl-C too.
With --expect-paper the exit code is 3 if jitter or adjustment time did not fall, or too little was
touched to tell.)"},
      Takes::device, run_jitter);
}

}  // namespace kmax::cli
