#include "host_tools/experiment/resolution/resolution_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "control/resolution_criterion.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {
namespace {
std::string resolution_mm(double metres) {
  return fmt::format("{:.3g}", metres * 1e3);
}

std::string cell_text(const ResolutionCell& cell) {
  if (!cell.judged()) return "no contact";
  if (!cell.vibrates())
    return cell.unstable > 0 ? fmt::format("still ({} of {})", cell.unstable, cell.touches) : "still";
  return fmt::format("vibrates ({} of {}, {:.1f} mm)", cell.unstable, cell.touches, cell.peak_to_peak * 1e3);
}

std::string claim_text(const TestedClaim& claim) {
  return yes_no(claim, "not tested");
}

/// Where a touch is missing for a claim to be tested; empty if none is.
std::string untested_places(const ResolutionVerdict& verdict) {
  std::string places;
  const auto add = [&](const TestedClaim& claim, const char* place) {
    if (!claim) places += fmt::format("{}{}", places.empty() ? "" : ", ", place);
  };
  add(verdict.coarse_vibrates, "0.4 mm at any speed");
  add(verdict.fine_is_still, "0.1 mm below 0.1 m/s");
  add(verdict.fine_vibrates_fast, "0.1 mm above 0.1 m/s");
  return places;
}

std::string onset_text(const ResolutionRun& run, double resolution) {
  const auto onset = onset_speed(run.cells, resolution);
  return onset ? fmt::format("{:g}", *onset) : std::string("none");
}

}  // namespace

std::string to_string(const ResolutionHand& hand) {
  return fmt::format("grip x {:g}, delay {:g} ms", hand.grip, hand.delay * 1e3);
}

ResolutionStudy study_resolution(const ResolutionSettings& settings, const ResolutionHand& weak,
                                 const SimulatedHands& hands,
                                 const std::vector<simulation::OperatorModel>& people,
                                 const ProgressReport& progress) {
  ResolutionStudy study;
  study.wall = settings.wall;
  study.pushes = settings.pushes;
  // The variations take about three times as long as the runs.
  const ProgressReport of_runs = part_of(progress, 0, 1, 4);
  study.runs = run_hands(settings, weak, hands, people, of_runs);
  if (!study.chosen_to_agree()) study.origin = report::Origin::predicted;
  study.variations = vary_resolution(settings, weak, hands, people, part_of(progress, 1, 3, 4));
  SimulatedRig rig = rig_with(weak, people, hands);
  const auto record = [&](double resolution) {
    rig.set(rig_wall(settings.wall, resolution));
    TouchPlan plan = resolution_plan(settings.wall, 0.0, 0.05, 0, 1);
    plan.push = settings.pushes.front();
    std::vector<TouchSample> samples;
    simulate_touch(rig.setup_of(plan), &samples);
    return samples;
  };
  const std::vector<TouchSample> coarse = record(0.4e-3), fine = record(0.1e-3);
  for (std::size_t n = 0; n < std::min(coarse.size(), fine.size()); ++n) {
    study.trace_time.push_back(coarse[n].time);
    study.trace_coarse.push_back(coarse[n].position);
    study.trace_fine.push_back(fine[n].position);
  }
  study.circumstances = fmt::format(
      "Simulated: {}, {} with each push of {:g} N, wall of {:g} N/mm at {:g} Hz, encoder of {} mm, friction "
      "{:g} N. A wall vibrates for a person when any touch does (more than {} mm peak to peak in every "
      "quarter of the last second){}.",
      people_words(people.size()), touch_words(static_cast<std::size_t>(settings.touches)),
      fmt::join(settings.pushes, ", "), settings.wall.stiffness / 1000, settings.wall.haptic_rate,
      resolution_mm(hands.count_length), hands.device.friction, resolution_mm(settings.wall.threshold),
      people.size() == 1 ? "" : ", and is said to vibrate when it does for half of the people");
  return study;
}

ResolutionStudy study_resolution(DeviceRig& rig, const ResolutionSettings& settings) {
  ResolutionTouches run = run_resolution(rig, settings);
  ResolutionStudy study;
  study.wall = settings.wall;
  study.origin = report::Origin::measured;
  study.circumstances = fmt::format(
      "Measured on {}: {}, {} of them aborted because the handle swung too far, wall of {:g} N/mm at {:g} "
      "Hz, force limit {:g} N; {} trace records lost. Speeds are those measured at the touch.",
      rig.description(), touch_words(run.cells.size()), run.aborted, settings.wall.stiffness / 1000,
      settings.wall.haptic_rate, rig.force_limit(), run.lost_records);
  study.runs = {{{}, std::move(run.cells)}};
  return study;
}

report::Table resolution_table(const ResolutionStudy& study) {
  report::Table table{"Paper 2, section 3: what vibrates", {"asked (mm)", "step (mm)", "speed (m/s)"}, {}};
  for (const ResolutionRun& run : study.runs)
    table.columns.push_back(study.pushes.empty() ? "measured" : to_string(run.hand));
  table.columns.push_back("K max(eta, v T) (N)");
  if (!study.pushes.empty()) table.columns.push_back("pushes that meet it");
  for (std::size_t i = 0; i < study.runs.back().cells.size(); ++i) {
    const ResolutionCell& cell = study.runs.back().cells[i];
    table.rows.push_back({cell.resolution > 0 ? resolution_mm(cell.resolution) : "encoder",
                          resolution_mm(cell.step), fmt::format("{:.3g}", cell.speed)});
    for (const ResolutionRun& run : study.runs) table.rows.back().push_back(cell_text(run.cells[i]));
    table.rows.back().push_back(fmt::format("{:.2f}", cell.force_step));
    if (study.pushes.empty()) continue;
    const auto met = std::count_if(study.pushes.begin(), study.pushes.end(),
                                   [&](double push) { return cell.force_step <= push; });
    table.rows.back().push_back(fmt::format("{} of {}", met, study.pushes.size()));
  }
  return table;
}

report::Table resolution_claims_table(const ResolutionStudy& study) {
  report::Table table{"The paper's claims for each hand",
                      {"hand", "0.4 mm vibrates at every speed", "0.1 mm still below 0.1 m/s",
                       "0.1 mm vibrates above 0.1 m/s", "onset at 0.4 mm (m/s)", "onset at 0.1 mm (m/s)",
                       "onset at the encoder's own step (m/s)"},
                      {}};
  for (const ResolutionRun& run : study.runs) {
    const ResolutionVerdict verdict = judge_resolution(run.cells);
    table.rows.push_back({study.pushes.empty() ? "measured" : to_string(run.hand),
                          claim_text(verdict.coarse_vibrates), claim_text(verdict.fine_is_still),
                          claim_text(verdict.fine_vibrates_fast), onset_text(run, 0.4e-3),
                          onset_text(run, 0.1e-3), onset_text(run, 0.0)});
  }
  table.rows.push_back({"paper", "yes (Figure 2)", "yes (Figure 1)", "yes (section 3)", "-", "0.1", "-"});
  return table;
}

report::Table resolution_variations_table(const ResolutionStudy& study) {
  report::Table table{
      fmt::format("With {}, and one number changed", to_string(study.runs.back().hand)),
      {"changed to", "0.4 mm vibrates at every speed", "0.1 mm still below 0.1 m/s",
       "0.1 mm vibrates above 0.1 m/s", "both claims", "onset at 0.4 mm (m/s)", "onset at 0.1 mm (m/s)"},
      {}};
  const auto onset = [](const std::optional<double>& speed) {
    return speed ? fmt::format("{:g}", *speed) : std::string("none");
  };
  for (const ResolutionVariation& one : study.variations)
    table.rows.push_back({one.change, claim_text(one.verdict.coarse_vibrates),
                          claim_text(one.verdict.fine_is_still), claim_text(one.verdict.fine_vibrates_fast),
                          claim_text(one.verdict.claim_met()), onset(one.coarse_onset),
                          onset(one.fine_onset)});
  return table;
}

namespace {
/// What it is worth that a hand shows both claims.
std::string_view hand_origin_words(const ResolutionStudy& study) {
  return study.chosen_to_agree() ? "These two numbers were chosen so that they do: calibrated, not predicted."
                                 : "Hand and wall are as asked for, and nothing was fitted: that both appear "
                                   "says that such a hand suffices, not that anybody has one.";
}

/// By how much 0.4 mm vibrates, and how many other settings show both claims.
std::string narrowness_words(const ResolutionStudy& study) {
  double least = 1.0;
  for (const ResolutionCell& cell : study.runs.back().cells)
    if (cell.resolution == paper::resolution_verdicts[1].resolution)
      least = std::min(least, cell.peak_to_peak);
  const auto met =
      std::count_if(study.variations.begin(), study.variations.end(),
                    [](const ResolutionVariation& one) { return one.verdict.claim_met() == true; });
  return fmt::format(
      "How narrow that is: the weakest vibration of 0.4 mm has {:.2f} mm, with a threshold of {:.3g} mm, and "
      "of {} settings that differ in one number both claims appear in {}.",
      least * 1e3, study.wall.threshold * 1e3, study.variations.size(), met);
}
}  // namespace

std::vector<std::string> resolution_words(const ResolutionStudy& study) {
  std::vector<std::string> words = {study.circumstances};
  const ResolutionVerdict verdict = study.verdict();
  const TestedClaim claim_met = verdict.claim_met();
  if (!study.pushes.empty()) {
    const ResolutionVerdict full = judge_resolution(study.runs.front().cells);
    words.push_back(fmt::format("With a full grip and no delay {}.",
                                full.any_vibrates ? "some touches vibrate"
                                : full.claim_met() == false
                                    ? "nothing vibrates, at any step and speed: the claims do not appear"
                                    : "nothing vibrates of what was touched"));
    const std::string hand = to_string(study.runs.back().hand);
    words.push_back(claim_met == true
                        ? fmt::format("With {} both claims appear. {}", hand, hand_origin_words(study))
                    : claim_met == false ? fmt::format("With {} the two claims do not both appear.", hand)
                                         : fmt::format("With {} the two claims were not both tested.", hand));
    if (verdict.all_tested()) words.push_back(narrowness_words(study));
  } else {
    words.push_back(fmt::format("On this device the paper's claims are {}.", claim_met == true ? "met"
                                                                             : claim_met == false
                                                                                 ? "not met"
                                                                                 : "not all tested"));
  }
  if (const std::string places = untested_places(verdict); !places.empty())
    words.push_back(fmt::format("Not tested, for want of a touch there: {}.", places));
  if (verdict.onset_from_resolution)
    words.push_back(
        *verdict.onset_from_resolution
            ? "At some speed 0.1 mm vibrates and the encoder's own step does not: there the step is the "
              "cause."
            : "Where 0.1 mm vibrates, the encoder's own step does so too: the onset with speed is not the "
              "work of the resolution here but of the loop itself (delay, sampling, a light grip), which a "
              "fast touch sets going. Only the vibration of 0.4 mm at low speed is that of a coarse step.");
  words.push_back(fmt::format(
      "The paper's criterion K max(eta, delta v T) <= F_h is quasi-static and not a condition of passivity. "
      "It asks {:.2f} N of a hand at 0.4 mm and {:.2f} N at 0.1 mm, and begins to depend on the speed at "
      "{:g} and {:g} m/s. The table has what it asks at the step of whole counts, which is a little smaller.",
      study.wall.stiffness * 0.4e-3, study.wall.stiffness * 0.1e-3, 0.4e-3 * study.wall.haptic_rate,
      0.1e-3 * study.wall.haptic_rate));
  return words;
}

std::vector<std::filesystem::path> write_resolution(const ResolutionStudy& study,
                                                    const Provenance& provenance,
                                                    const std::filesystem::path& folder,
                                                    const std::string& ending) {
  base::make_folder(folder);
  std::vector<std::filesystem::path> files = {folder / "resolution.csv", folder / "resolution_claims.csv"};
  report::write_csv(resolution_table(study), files[0]);
  report::write_csv(resolution_claims_table(study), files[1]);

  constexpr double floor = 0.01;  // mm, where a handle that stands still is drawn
  plot::Figure amplitude{study.pushes.empty() ? "Largest peak to peak of a held touch"
                                              : "Largest peak to peak of a held touch, by grip and delay",
                         "approach speed (m/s)",
                         {}};
  amplitude.legend_beside = amplitude.log_x = true;
  for (const ResolutionRun& run : study.runs) {
    plot::Panel panel{study.pushes.empty()
                          ? "mm"
                          : fmt::format("x {:g}, {:g} ms (mm)", run.hand.grip, run.hand.delay * 1e3),
                      {},
                      {}};
    panel.log_y = true;
    panel.y_limits = {0.5 * floor, 20.0};
    for (const double resolution : {0.0, 0.1e-3, 0.4e-3}) {
      plot::Series series{
          resolution > 0 ? fmt::format("{:g} mm", resolution * 1e3) : "encoder's own", {}, {}, false, true};
      for (const ResolutionCell& cell : run.cells) {
        if (cell.resolution != resolution || !(cell.speed > 0.0)) continue;
        series.x.push_back(cell.speed);
        series.y.push_back(std::max(floor, cell.peak_to_peak * 1e3));
      }
      if (!series.x.empty()) panel.series.push_back(std::move(series));
    }
    panel.marks.push_back({study.wall.threshold * 1e3, false, ""});
    if (!panel.series.empty()) amplitude.panels.push_back(std::move(panel));
  }
  std::vector<report::Picture> pictures;
  if (!amplitude.panels.empty()) {
    files.push_back(folder / ("resolution_speeds" + ending));
    plot::write_figure(amplitude, files.back());
    pictures.push_back(
        {"A touch vibrates above the horizontal line; a handle that stands still is drawn at 0.01 mm.",
         files.back()});
  }

  report::Page page{"Position resolution and vibration", {}};
  page.sections.push_back({"Paper 2, section 3",
                           resolution_words(study),
                           {resolution_claims_table(study), resolution_table(study)},
                           std::move(pictures)});
  if (!study.variations.empty())
    page.sections.push_back(
        {"How much hangs on the numbers chosen", {}, {resolution_variations_table(study)}, {}});
  if (!study.trace_time.empty()) {
    plot::Figure touch{fmt::format("Touched at 0.05 m/s with {:g} N: {}", study.pushes.front(),
                                   to_string(study.runs.back().hand)),
                       "time (s)",
                       {}};
    for (const auto& [label, values] : {std::pair("0.1 mm: position (mm)", &study.trace_fine),
                                        std::pair("0.4 mm: position (mm)", &study.trace_coarse)}) {
      plot::Series series{"", study.trace_time, {}, true};
      for (const double position : *values) series.y.push_back(position * 1e3);
      touch.panels.push_back({label, {std::move(series)}, {}, std::pair(-1.5, 1.5)});
    }
    files.push_back(folder / ("resolution_touch" + ending));
    plot::write_figure(touch, files.back());
    page.sections.push_back(
        {"One touch, as in Figures 1 and 2", {}, {}, {{"Subject 1 of the simulation.", files.back()}}});
  }
  page.sections.push_back(provenance_section(provenance));
  for (const auto& file : report::write_page(page, folder, "resolution")) files.push_back(file);
  return files;
}

}  // namespace kmax::experiment
