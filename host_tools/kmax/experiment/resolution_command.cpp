// kmax experiment resolution.
#include <fmt/format.h>

#include "host_tools/experiment/resolution/resolution_experiment.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {
namespace {

struct ResolutionOptions : StudyOptions {
  ResolutionOptions() { hands = experiment::resolution_hands(); }
  experiment::ResolutionWall wall;
  experiment::ResolutionHand weak = experiment::weak_hand;
  std::vector<double> speeds, pushes = experiment::ResolutionSettings().pushes;
  int touches = 0;
  std::string rounding = "nearest";

  void declare(CLI::App& command, Context& context) {
    add_quantity(command, "--stiffness", wall.stiffness, "N/m", "Stiffness of the wall, N/m", 1.0, 1e6);
    add_quantity(command, "--rate", wall.haptic_rate, "Hz",
                 "Rate of the haptic loop, Hz; the paper gives none", 100.0, 20000.0);
    add_quantity(command, "--hold", wall.hold, "s", "Time from the touch to the end of judging, s", 1.0,
                 60.0);
    add_quantity(command, "--threshold", wall.threshold, "m", "Peak to peak above which a wall vibrates, m",
                 1e-9, 1.0);
    command.add_option("--rounding", rounding, "How positions are re-sampled")
        ->check(CLI::IsMember({"nearest", "floor", "hysteresis"}))
        ->capture_default_str();
    command.add_option("--speeds", speeds, "Speeds of the touch, m/s; else some from 0.02 to 0.5")
        ->delimiter(',')
        ->transform(quantity("m/s", 0.001, 5.0));
    command.add_option("--touches", touches, "Touches per speed (and push); else 4, on a device 1")
        ->check(CLI::Range(1, 1000));
    add_file_options(command, files);

    declare_for_people(command);
    add_subjects_option(*simulated, people.subjects);
    add_number(*simulated, "--grip", weak.grip, "Factor of the grip's stiffness and damping", 0.01, 10.0);
    add_quantity(*simulated, "--delay", weak.delay, "s", "From a command to its force, s", 0.0, 0.1);
    add_quantity(*simulated, "--friction", hands.device.friction, "N", "Coulomb friction of the handle, N",
                 0.0, 10.0);
    simulated->add_option("--pushes", pushes, "Static pushes, N; a wall vibrates when it does with any")
        ->delimiter(',')
        ->transform(quantity("N", 0.01, 100.0))
        ->capture_default_str();
    add_quantity(*simulated, "--clip", hands.device.force_limit, "N",
                 "Largest force of the device, N; 0: no limit", 0.0, 1000.0);
    declare_for_device(command, context);
  }
};

control::Rounding rounding_of(const std::string& name) {
  if (name == "floor") return control::Rounding::floor;
  return name == "hysteresis" ? control::Rounding::hysteresis : control::Rounding::nearest;
}

std::string percent_words(std::size_t done, std::size_t all) {
  return fmt::format("{:.0f} % done", 100.0 * static_cast<double>(done) / static_cast<double>(all));
}

/// `usual`: what holds where no option says otherwise.
experiment::ResolutionSettings settings_of(const ResolutionOptions& options,
                                           experiment::ResolutionSettings usual) {
  usual.wall = options.wall;
  usual.wall.rounding = rounding_of(options.rounding);
  usual.pushes = options.pushes;
  if (!options.speeds.empty()) usual.speeds = options.speeds;
  if (options.touches > 0) usual.touches = options.touches;
  return usual;
}

experiment::ResolutionStudy simulate(Context& context, const ResolutionOptions& options,
                                     const base::Interruption& interruption,
                                     experiment::Provenance& /*provenance*/) {
  const experiment::ResolutionSettings settings = settings_of(options, {});
  // Of a set the people only: the device is paper 2's.
  simulation::DeviceModel unused;
  const std::vector<simulation::OperatorModel> people = people_of(options.people.subjects, unused);
  return simulate_study(
      context, interruption, percent_words, [&](const experiment::ProgressReport& progress) {
        return experiment::study_resolution(settings, options.weak, options.hands, people, progress);
      });
}

experiment::ResolutionStudy measure(Context& context, const ResolutionOptions& options,
                                    const base::Interruption& interruption,
                                    experiment::Provenance& provenance) {
  const experiment::ResolutionSettings settings = settings_of(options, experiment::resolution_on_device());
  return measure_study(context, interruption, "resolution", settings, options, provenance,
                       experiment::RigAxes::wall,
                       [&](experiment::DeviceRig& rig) { return study_resolution(rig, settings); });
}

Json verdict_json(const experiment::ResolutionVerdict& verdict) {
  return {{"coarse_vibrates_at_every_speed", json::optional_json(verdict.coarse_vibrates)},
          {"fine_is_still_below_onset", json::optional_json(verdict.fine_is_still)},
          {"fine_vibrates_above_onset", json::optional_json(verdict.fine_vibrates_fast)},
          {"onset_from_resolution", json::optional_json(verdict.onset_from_resolution)},
          {"claim_met", json::optional_json(verdict.claim_met())}};
}

Json run_json(const experiment::ResolutionRun& run, bool simulated) {
  Json cells = Json::array();
  for (const experiment::ResolutionCell& cell : run.cells)
    cells.push_back({{"resolution_m", cell.resolution},
                     {"step_m", cell.step},
                     {"speed_m_per_s", cell.speed},
                     {"vibrates", cell.judged() ? Json(cell.vibrates()) : Json(nullptr)},
                     {"touches", cell.touches},
                     {"unstable_touches", cell.unstable},
                     {"peak_to_peak_m", cell.peak_to_peak},
                     {"force_step_n", cell.force_step}});
  Json document = Json::object();
  if (simulated) document = {{"grip", run.hand.grip}, {"delay_s", run.hand.delay}};
  document["cells"] = std::move(cells);
  document["verdict"] = verdict_json(experiment::judge_resolution(run.cells));
  return document;
}

StudyReport report_of(const experiment::ResolutionStudy& study) {
  const experiment::ResolutionVerdict verdict = study.verdict();
  StudyReport report{verdict.claim_met() == true,
                     document_of(study),
                     experiment::resolution_words(study),
                     {experiment::resolution_table(study), experiment::resolution_claims_table(study)}};
  if (!study.variations.empty()) report.tables.push_back(experiment::resolution_variations_table(study));
  Json runs = Json::array(), variations = Json::array();
  for (const experiment::ResolutionRun& run : study.runs)
    runs.push_back(run_json(run, !study.pushes.empty()));
  for (const experiment::ResolutionVariation& one : study.variations)
    variations.push_back({{"changed_to", one.change}, {"verdict", verdict_json(one.verdict)}});
  report.document["stiffness_n_per_m"] = study.wall.stiffness;
  report.document["runs"] = std::move(runs);
  report.document["verdict"] = verdict_json(verdict);
  report.document["variations"] = std::move(variations);
  return report;
}

constexpr StudyCommand<experiment::ResolutionStudy, ResolutionOptions> resolution_study{
    simulate, measure, experiment::write_resolution, report_of};

int run_resolution(Context& context, const ResolutionOptions& options) {
  return run_study(context, options, resolution_study);
}
}  // namespace

void add_resolution_experiment(CLI::App& experiment, Context& context) {
  add_command<ResolutionOptions>(
      experiment, context,
      {"resolution",
       "Touches a wall with coarser and coarser positions and sees what vibrates (paper 2, section 3).",
       R"(  kmax experiment resolution                                  a simulated hand, takes seconds
  kmax experiment resolution --grip 1 --delay 0               a firm hand and no delay: nothing vibrates
  kmax experiment resolution --out results                    with pictures and a page
  kmax experiment resolution --device serial:/dev/ttyUSB0     somebody's own hand

The paper finds that a wall of 1.2 N/mm vibrates at steps of 0.4 mm, and at 0.1 mm only when it is touched
faster than 0.1 m/s. On a device you are told before each touch what to do; the force limit is lowered, each
touch is disarmed at its end and when the handle swings too far, and all parameters are put back, on Ctrl-C
too.
With --expect-paper the exit code is 3 if one of the two did not come out, or was not tested.)"},
      Takes::device, run_resolution);
}

}  // namespace kmax::cli
