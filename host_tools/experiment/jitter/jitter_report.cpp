#include "host_tools/experiment/jitter/jitter_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/base/files.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {
namespace {
std::string jitter_mm(double metres) {
  return fmt::format("{:.1f}", metres * 1e3);
}
std::string mm_fine(const std::optional<double>& metres) {
  return metres ? fmt::format("{:.2f}", *metres * 1e3) : std::string("-");
}
std::string ms(double seconds) {
  return fmt::format("{:.0f}", seconds * 1e3);
}
std::string ms(const std::optional<double>& seconds) {
  return seconds ? ms(*seconds) : std::string("-");
}

std::string amplitude_text(const JitterResult& result) {
  return result.touches > 0 ? mm_fine(result.amplitude) : std::string("-");
}

constexpr auto untested = "not shown";

std::string time_text(const JitterResult& result) {
  if (result.touches == 0) return "-";
  // A touch that never settled has no adjustment time: what is known is that it is longer.
  return (result.unsettled > 0 ? "> " : "") + ms(result.adjustment_time);
}
}  // namespace

JitterStudy study_jitter(const JitterSettings& settings, const SimulatedHands& hands,
                         const std::vector<simulation::OperatorModel>& people,
                         const ProgressReport& progress) {
  const auto run = [&](const SimulatedHands& holding, const std::vector<simulation::OperatorModel>& held_by,
                       std::size_t number) {
    SimulatedRig rig("jitter", held_by, holding);
    return run_jitter(rig, settings, part_of(progress, number, 1, 3)).results;
  };
  JitterStudy study;
  study.wall = settings.wall;
  study.results = run(hands, people, 0);
  study.verdict = judge_jitter(study.results);
  std::vector<simulation::OperatorModel> never_stiffer = people;
  for (simulation::OperatorModel& person : never_stiffer) person.activation_gain = 0.0;
  SimulatedHands indifferent = hands;
  indifferent.reaction = 0.0;
  study.variations = {{"hand does not stiffen (activation_gain = 0)", run(hands, never_stiffer, 1), {}},
                      {"person answers to F_B only (reaction = 0)", run(indifferent, people, 2), {}}};
  for (JitterVariation& variation : study.variations) variation.verdict = judge_jitter(variation.results);
  SimulatedRig rig("jitter", people, hands);
  const auto record = [&](double background) {
    rig.set({settings.wall.stiffness, settings.wall.haptic_rate, control::InterferenceMode::perpendicular,
             5.0, background});
    TouchPlan plan;
    plan.hold_time = settings.wall.window;
    return rig.record(plan).samples;
  };
  study.without = record(0.0);
  study.with = record(3.0);
  study.circumstances = fmt::format(
      "Simulated: {}, {} each, wall of {:g} N/mm at {:g} Hz, push {:g} N at {:g} m/s; the force is {}. {}",
      people_words(people.size()), touch_words(static_cast<std::size_t>(settings.touches)),
      settings.wall.stiffness / 1000, settings.wall.haptic_rate, hands.push, hands.approach_speed,
      clipping_words(hands.device), model_words(hands.device, people.front()));
  return study;
}

JitterStudy study_jitter(DeviceRig& rig, const JitterSettings& settings) {
  const JitterRun run = run_jitter(rig, settings);
  JitterStudy study;
  study.wall = settings.wall;
  study.origin = report::Origin::measured;
  study.results = run.results;
  study.verdict = judge_jitter(study.results);
  study.circumstances = fmt::format(
      "Measured on {}: {} per pair, wall of {:g} N/mm at {:g} Hz, force limit {:g} N, which took something "
      "away in up to {:.0f} % of a touch's samples; {} trace records lost.",
      rig.description(), touch_words(static_cast<std::size_t>(settings.touches)),
      settings.wall.stiffness / 1000, settings.wall.haptic_rate, rig.force_limit(), 100 * run.limited_share,
      run.lost_records);
  return study;
}

report::Table jitter_table(const JitterStudy& study) {
  const std::string origin(report::to_string(study.origin));
  report::Table table{
      "Table I of paper 1: jitter (Jit) and adjustment time (AT)",
      {"F_B (N)", "F_I (N)", "Jit, paper (mm)", fmt::format("Jit, {} (mm)", origin), "AT, paper (ms)",
       fmt::format("AT, {} (ms)", origin), "not settled", "aborted", "beyond 3.3 N (%)"},
      {}};
  for (const JitterResult& result : study.results) {
    table.rows.push_back(
        {fmt::format("{:g}", result.paper.background), fmt::format("{:g}", result.paper.interference),
         jitter_mm(result.paper.amplitude), amplitude_text(result), ms(result.paper.adjustment_time),
         time_text(result), fmt::format("{} of {}", result.unsettled, result.touches),
         fmt::format("{}", result.aborted), fmt::format("{:.0f}", 100 * result.beyond_limit_share)});
  }
  return table;
}

report::Table jitter_claims_table(const JitterStudy& study) {
  report::Table table{"Do they fall when F_B increases?",
                      {"F_I (N)", "number", "F_B = 0", "largest F_B", "rank with F_B", "falls"},
                      {}};
  for (const BackgroundTrend& trend : study.verdict.amplitude)
    table.rows.push_back({fmt::format("{:g}", trend.interference), "Jit (mm)", mm_fine(trend.without),
                          mm_fine(trend.with), rank_text(trend.rank), yes_no(trend.falls(), untested)});
  for (const BackgroundTrend& trend : study.verdict.time)
    table.rows.push_back({fmt::format("{:g}", trend.interference), "AT (ms)", ms(trend.without),
                          ms(trend.with), rank_text(trend.rank),
                          yes_no(study.verdict.all_settled ? trend.falls() : std::nullopt, untested)});
  return table;
}

report::Table jitter_variations_table(const JitterStudy& study) {
  report::Table table{"With one thing taken out of the model",
                      {"model", "Jit falls with F_B", "AT falls with F_B", "touches that never settle",
                       "Jit at 7 N, F_B = 0 -> 4 N (mm)", "AT at 7 N, F_B = 0 -> 4 N (ms)"},
                      {}};
  const auto row = [&](const std::string& name, const std::vector<JitterResult>& results,
                       const JitterVerdict& verdict) {
    std::size_t unsettled = 0, touches = 0;
    const JitterResult *first = nullptr, *last = nullptr;
    for (const JitterResult& result : results) {
      unsettled += result.unsettled;
      touches += result.touches;
      if (result.paper.interference != 7.0) continue;
      if (result.paper.background == 0.0) first = &result;
      if (result.paper.background == 4.0) last = &result;
    }
    if (first == nullptr || last == nullptr) return;
    table.rows.push_back({name, yes_no(verdict.amplitude_falls(), untested),
                          yes_no(verdict.time_falls(), untested), fmt::format("{} of {}", unsettled, touches),
                          amplitude_text(*first) + " -> " + amplitude_text(*last),
                          time_text(*first) + " -> " + time_text(*last)});
  };
  row("all of it", study.results, study.verdict);
  for (const JitterVariation& variation : study.variations)
    row(variation.name, variation.results, variation.verdict);
  const auto first = paper::jitter(0, 7), last = paper::jitter(4, 7);
  table.rows.push_back({"paper", "yes", "yes", "-",
                        jitter_mm(first->amplitude) + " -> " + jitter_mm(last->amplitude),
                        ms(first->adjustment_time) + " -> " + ms(last->adjustment_time)});
  return table;
}

std::vector<std::string> jitter_words(const JitterStudy& study) {
  std::vector<std::string> words = {study.circumstances};
  const JitterVerdict& verdict = study.verdict;
  words.push_back(fmt::format(
      "Claim of the paper: both fall when F_B increases. Jit: {}. AT: {}.",
      fall_words(verdict.amplitude_falls(),
                 "not shown, since not every F_I was touched both without F_B and with it"),
      fall_words(verdict.time_falls(), "not shown, since touches did not settle or were aborted")));
  double size = 0.0, time = 0.0;
  std::size_t counted = 0;
  for (const JitterResult& result : study.results) {
    if (result.paper.amplitude == 0.0 || result.touches == 0) continue;
    size += result.amplitude / result.paper.amplitude;
    time += result.adjustment_time / result.paper.adjustment_time;
    ++counted;
  }
  if (counted > 0)
    words.push_back(fmt::format(
        "Sizes are {}: Jit is {:.2f} times the paper's in the mean, AT {:.1f} times. {}The paper's "
        "adjustment times are whole multiples of 15 ms and do not fall steadily: only their trend can be "
        "compared.",
        study.origin == report::Origin::measured ? "as measured" : "not reproduced",
        size / static_cast<double>(counted), time / static_cast<double>(counted),
        study.origin == report::Origin::measured
            ? ""
            : "Its values come from people who answer at will; the model's time is that of its push lag. "));
  if (verdict.amplitude_rank || verdict.time_rank)
    words.push_back(fmt::format(
        "Rank correlation with the paper over all pairs: Jit {}, AT {}. Most of it is the work of F_I, which "
        "anything that yields to a force would show; the trend with F_B is in the table of claims.",
        rank_text(verdict.amplitude_rank), rank_text(verdict.time_rank)));
  if (study.variations.size() == 2) {
    std::size_t unsettled = 0, touches = 0;
    for (const JitterResult& result : study.variations[1].results) {
      unsettled += result.unsettled;
      touches += result.touches;
    }
    words.push_back(fmt::format(
        "{} With a person who does not answer to F_I {} of {} touches never settle and have no adjustment "
        "time.",
        cause_words("Jit", verdict.amplitude_falls(), study.variations[0].verdict.amplitude_falls()),
        unsettled, touches));
  }
  return words;
}

namespace {
plot::Panel trend_panel(const JitterStudy& study, const std::string& label, double scale,
                        double JitterResult::*ours, double paper::JitterCell::*theirs) {
  plot::Panel panel{label, {}, {}, {}};
  for (const double interference : {3.0, 5.0, 7.0}) {
    plot::Series mine{
        fmt::format("{:g} N, {}", interference, report::to_string(study.origin)), {}, {}, false, true};
    plot::Series paper{fmt::format("{:g} N, paper", interference), {}, {}, false, true};
    for (const JitterResult& result : study.results) {
      if (result.paper.interference != interference) continue;
      if (result.touches > 0) {
        mine.x.push_back(result.paper.background);
        mine.y.push_back(result.*ours * scale);
      }
      paper.x.push_back(result.paper.background);
      paper.y.push_back(result.paper.*theirs * scale);
    }
    panel.series.push_back(std::move(mine));
    panel.series.push_back(std::move(paper));
  }
  return panel;
}

plot::Series trace(const std::string& label, const std::vector<RigSample>& samples, bool force) {
  plot::Series series{label, {}, {}, true};
  for (const RigSample& sample : samples) {
    if (sample.time < -0.1 || sample.time > 1.5) continue;
    series.x.push_back(sample.time);
    series.y.push_back(force ? sample.force : sample.outside_distance * 1e3);
  }
  return series;
}
}  // namespace

std::vector<std::filesystem::path> write_jitter(const JitterStudy& study, const Provenance& provenance,
                                                const std::filesystem::path& folder,
                                                const std::string& ending) {
  base::make_folder(folder);
  std::vector<std::filesystem::path> files = {folder / "jitter.csv"};
  report::write_csv(jitter_table(study), files.front());

  report::Page page{"Jitter under a perpendicular interference force", {}};
  report::Section section{
      "Table I of paper 1", jitter_words(study), {jitter_claims_table(study), jitter_table(study)}, {}};
  plot::Figure trends{"Jitter and adjustment time under F_I, by F_B", "background force F_B (N)", {}};
  trends.legend_beside = true;
  trends.panels = {
      trend_panel(study, "jitter (mm)", 1e3, &JitterResult::amplitude, &paper::JitterCell::amplitude),
      trend_panel(study, "adjustment time (ms)", 1e3, &JitterResult::adjustment_time,
                  &paper::JitterCell::adjustment_time)};
  trends.panels.back().log_y = true;
  files.push_back(folder / ("jitter_trends" + ending));
  plot::write_figure(trends, files.back());
  section.pictures.push_back(
      {"Both numbers over F_B for each F_I, beside the paper's. A touch that never settled counts with its "
       "whole window.",
       files.back()});
  page.sections.push_back(std::move(section));
  if (!study.variations.empty()) {
    files.push_back(folder / "jitter_variations.csv");
    report::write_csv(jitter_variations_table(study), files.back());
    page.sections.push_back({"Causes", {}, {jitter_variations_table(study)}, {}});
  }
  if (!study.without.empty() && !study.with.empty()) {
    plot::Figure touches{"F_I = 5 N, without and with a background force",
                         "time since the first touch (s)",
                         {{"distance outside (mm)",
                           {trace("F_B = 0", study.without, false), trace("F_B = 3 N", study.with, false)},
                           {},
                           std::pair(-3.0, 3.0)},
                          {"force (N)",
                           {trace("F_B = 0", study.without, true), trace("F_B = 3 N", study.with, true)},
                           {},
                           {}}}};
    touches.legend_beside = true;
    files.push_back(folder / ("jitter_touch" + ending));
    plot::write_figure(touches, files.back());
    page.sections.push_back(
        {"One touch, as in Fig. 2", {}, {}, {{"Subject 1 of the simulation.", files.back()}}});
  }
  page.sections.push_back(provenance_section(provenance));
  for (const auto& file : report::write_page(page, folder, "jitter")) files.push_back(file);
  return files;
}

}  // namespace kmax::experiment
