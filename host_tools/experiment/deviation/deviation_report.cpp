#include "host_tools/experiment/deviation/deviation_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/base/files.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {
namespace {
std::string deviation_mm(double metres) {
  return fmt::format("{:.2f}", metres * 1e3);
}
std::string deviation_mm(const std::optional<double>& metres) {
  return metres ? deviation_mm(*metres) : std::string("-");
}

const DeviationResult* at(const std::vector<DeviationResult>& results, const paper::DeviationCell& cell) {
  for (const DeviationResult& result : results)
    if (result.paper.background == cell.background && result.paper.interference == cell.interference)
      return &result;
  return nullptr;
}

const DeviationFit* fit_named(const DeviationStudy& study, std::string_view name) {
  for (const DeviationFit& fit : study.fits)
    if (fit.kind.name == name) return &fit;
  return nullptr;
}
}  // namespace

DeviationStudy study_deviation(const DeviationSettings& settings, const SimulatedHands& hands,
                               const std::vector<simulation::OperatorModel>& people,
                               const ProgressReport& progress) {
  const DeviationProtocol& protocol = settings.protocol;
  for (const paper::DeviationCell& pair : settings.pairs)
    if (!(hands.push > pair.background))
      throw std::invalid_argument(fmt::format(
          "deviation: a push of {} N loses the wall against F_B = {} N: push harder than every F_B",
          hands.push, pair.background));
  SimulatedRig rig("deviation", people, hands);
  DeviationStudy study;
  study.results = run_deviation(rig, settings, part_of(progress, 0, 1, 2)).results;
  study.verdict = judge_deviation(study.results);
  std::vector<simulation::OperatorModel> never_stiffer = people;
  for (simulation::OperatorModel& person : never_stiffer) person.activation_gain = 0.0;
  SimulatedRig slack("deviation", never_stiffer, hands);
  study.without_stiffening = run_deviation(slack, settings, part_of(progress, 1, 1, 2)).results;
  study.verdict_without_stiffening = judge_deviation(study.without_stiffening);
  study.fits = fit_table_2();
  study.touch = rig.record(deviation_plan(protocol, *paper::deviation(3.0, 5.0))).samples;
  std::erase_if(study.touch, [](const RigSample& sample) { return sample.time < 0.0; });
  double contact = 1.0;
  for (const DeviationResult& result : study.results) contact = std::min(contact, result.contact_share);
  study.circumstances = fmt::format(
      "Simulated: {}, wall of {:g} N/mm at {:g} Hz, push {:g} N, {} pulses of {:g} s without and {} with "
      "F_B, {:g} s for the arm to adjust; the force is {}. In contact for at least {:.2f} % of a touch. {}",
      people_words(people.size()), protocol.stiffness / 1000, protocol.haptic_rate, hands.push,
      protocol.pulses, protocol.pulse_on, protocol.pulses, protocol.rest, clipping_words(hands.device),
      100 * contact, model_words(hands.device, people.front()));
  return study;
}

DeviationStudy study_deviation(DeviceRig& rig, const DeviationSettings& settings) {
  const DeviationProtocol& protocol = settings.protocol;
  const DeviationRun run = run_deviation(rig, settings);
  DeviationStudy study;
  study.origin = report::Origin::measured;
  study.results = run.results;
  study.verdict = judge_deviation(study.results);
  study.fits = fit_table_2();
  const std::size_t axis = rig.limits().axis;
  study.circumstances = fmt::format(
      "Measured on {}: wall of {:g} N/mm at {:g} Hz on axis {}, pulses of {:g} s on axis {}, force limit "
      "{:g} N, which took something away in up to {:.0f} % of a touch's samples; {} trace records lost.",
      rig.description(), protocol.stiffness / 1000, protocol.haptic_rate, axis, protocol.pulse_on,
      along(axis), rig.force_limit(), 100 * run.limited_share, run.lost_records);
  for (const DeviationResult& one : study.results) {
    const std::string pair =
        fmt::format("F_B = {:g} N, F_I = {:g} N: not counted", one.paper.background, one.paper.interference);
    if (one.without_contact > 0)
      rig.note(
          fmt::format("{}, the wall was touched less than {:.0f} % of the time", pair, 100 * least_contact));
    if (one.aborted > 0)
      rig.note(fmt::format(
          "{}, the handle swung too far or left the wall before the {:g} s of the touch were over", pair,
          protocol.duration()));
  }
  return study;
}

report::Table deviation_table(const DeviationStudy& study) {
  const std::string origin(report::to_string(study.origin));
  const bool simulated = !study.without_stiffening.empty();
  report::Table table{"Table II of paper 1: deviation (Dev) along the surface",
                      {"F_B (N)", "F_I (N)", "Dev, paper (mm)", fmt::format("Dev, {} (mm)", origin),
                       "before F_B (mm)", "aborted"},
                      {}};
  if (simulated) {
    table.columns.push_back("activation_gain = 0 (mm)");
    table.columns.push_back("beyond 3.3 N (%)");
  }
  for (const DeviationResult& result : study.results) {
    table.rows.push_back(
        {fmt::format("{:g}", result.paper.background), fmt::format("{:g}", result.paper.interference),
         deviation_mm(result.paper.deviation), result.touches > 0 ? deviation_mm(result.deviation) : "-",
         result.touches > 0 ? deviation_mm(result.before) : "-", fmt::format("{}", result.aborted)});
    if (!simulated) continue;
    const DeviationResult* other = at(study.without_stiffening, result.paper);
    table.rows.back().push_back(other != nullptr && other->touches > 0 ? deviation_mm(other->deviation)
                                                                       : "-");
    table.rows.back().push_back(fmt::format("{:.0f}", 100 * result.beyond_limit_share));
  }
  return table;
}

report::Table deviation_claims_table(const DeviationStudy& study) {
  report::Table table{
      "Does Dev fall when F_B increases?",
      {"hand", "F_I (N)", "F_B = 0 (mm)", "largest F_B (mm)", "ratio", "rank with F_B", "falls"},
      {}};
  const auto ratio = [](const BackgroundTrend& trend) {
    return trend.without > 0.0 && trend.with ? fmt::format("{:.2f}", *trend.with / *trend.without) : "-";
  };
  const auto rows = [&](const std::string& name, const std::vector<BackgroundTrend>& trends) {
    for (const BackgroundTrend& trend : trends)
      table.rows.push_back({name, fmt::format("{:g}", trend.interference), deviation_mm(trend.without),
                            deviation_mm(trend.with), ratio(trend), rank_text(trend.rank),
                            yes_no(trend.falls(), "not shown")});
  };
  rows(std::string(report::to_string(study.origin)), study.verdict.trends);
  if (!study.without_stiffening.empty()) rows("activation_gain = 0", study.verdict_without_stiffening.trends);
  for (const BackgroundTrend& trend : printed_deviation_trends())
    table.rows.push_back({"paper", fmt::format("{:g}", trend.interference), deviation_mm(trend.without),
                          deviation_mm(trend.with), ratio(trend), "-", yes_no(trend.falls(), "not shown")});
  return table;
}

report::Table deviation_fit_table(const DeviationStudy& study) {
  report::Table table{"The paper's table as max(0, F_I - D - c F_B)/(k (1 + gamma F_B)), by least squares",
                      {"what F_B raises", "k (N/m)", "D (N)", "gamma (1/N)", "c", "rms residual (mm)"},
                      {}};
  const auto with_error = [](double value, double error, int digits) {
    return fmt::format("{:.{}f} +- {:.{}f}", value, digits, error, digits);
  };
  for (const DeviationFit& fit : study.fits) {
    table.rows.push_back(
        {std::string(fit.kind.name), with_error(fit.hand.stiffness, fit.error.stiffness, 0),
         with_error(fit.hand.threshold, fit.error.threshold, 2),
         fit.kind.stiffening ? with_error(fit.hand.stiffening, fit.error.stiffening, 2) : "0",
         fit.kind.threshold_rise ? with_error(fit.hand.threshold_rise, fit.error.threshold_rise, 2) : "0",
         fmt::format("{:.2f}", fit.rms * 1e3)});
  }
  return table;
}

std::vector<std::string> deviation_words(const DeviationStudy& study) {
  std::vector<std::string> words = {study.circumstances};
  const TestedClaim falls = study.verdict.claim_met();
  words.push_back(
      fmt::format("Claim of the paper: the deviation falls when F_B increases. Here {}.",
                  falls ? fmt::format("it {} at every F_I", fall_words(falls, ""))
                        : "this is not shown: not every F_I was touched both without F_B and with it"));
  if (!study.without_stiffening.empty()) {
    words.push_back(cause_words("it", falls, study.verdict_without_stiffening.claim_met()));
    double size = 0.0;
    std::size_t counted = 0;
    for (const DeviationResult& result : study.results) {
      if (result.paper.deviation == 0.0 || result.touches == 0) continue;
      size += result.deviation / result.paper.deviation;
      ++counted;
    }
    if (counted > 0)
      words.push_back(fmt::format(
          "Sizes are not reproduced: {:.1f} times the paper's in the mean. The model's arm yields to a force "
          "as long as it lasts; the paper's people push back, and 1 N does not move them at all.",
          size / static_cast<double>(counted)));
  }
  if (study.verdict.rank)
    words.push_back(fmt::format(
        "Rank correlation with the paper over all pairs: {}. {}", rank_text(study.verdict.rank),
        study.without_stiffening.empty()
            ? "Most of it is the work of F_I."
            : fmt::format(
                  "A hand that does not stiffen has {}: it is the work of F_I and no evidence for the trend.",
                  rank_text(study.verdict_without_stiffening.rank))));
  const DeviationFit* stiffening = fit_named(study, fit_stiffening.name);
  const DeviationFit* threshold = fit_named(study, fit_threshold.name);
  const DeviationFit* both = fit_named(study, fit_both.name);
  if (stiffening != nullptr && threshold != nullptr && both != nullptr)
    words.push_back(fmt::format(
        "The paper's table hardly identifies a stiffness gain: a hand that stiffens by {:.2f} per N leaves "
        "{:.2f} mm, one that does not stiffen but resists {:.2f} N more for each N of F_B leaves {:.2f} mm, "
        "and with both allowed the gain is {:.2f} +- {:.2f}. Only the sign of the trend is firm.",
        stiffening->hand.stiffening, stiffening->rms * 1e3, threshold->hand.threshold_rise,
        threshold->rms * 1e3, both->hand.stiffening, both->error.stiffening));
  return words;
}

std::vector<std::filesystem::path> write_deviation(const DeviationStudy& study, const Provenance& provenance,
                                                   const std::filesystem::path& folder,
                                                   const std::string& ending) {
  base::make_folder(folder);
  std::vector<std::filesystem::path> files = {folder / "deviation.csv", folder / "deviation_fit.csv"};
  report::write_csv(deviation_table(study), files[0]);
  report::write_csv(deviation_fit_table(study), files[1]);

  plot::Figure trends{"Deviation along the surface under F_I, by F_B", "background force F_B (N)", {}};
  trends.legend_beside = true;
  plot::Panel own{"deviation (mm)", {}, {}}, paper{"paper's deviation (mm)", {}, {}};
  for (const double interference : {3.0, 5.0, 7.0}) {
    const auto series = [&](const std::string& name) {
      return plot::Series{fmt::format("{:g} N, {}", interference, name), {}, {}, false, true};
    };
    plot::Series ours = series(std::string(report::to_string(study.origin))), flat = series("no stiffening"),
                 theirs = series("paper"), fitted = series("fitted, gamma");
    const DeviationFit* fit = fit_named(study, fit_stiffening.name);
    fitted.points = false;
    for (const DeviationResult& result : study.results) {
      if (result.paper.interference != interference) continue;
      theirs.x.push_back(result.paper.background);
      theirs.y.push_back(result.paper.deviation * 1e3);
      if (fit != nullptr) {
        fitted.x.push_back(result.paper.background);
        fitted.y.push_back(1e3 * quasi_static_deviation(fit->hand, result.paper.background, interference));
      }
      if (result.touches == 0) continue;
      ours.x.push_back(result.paper.background);
      ours.y.push_back(result.deviation * 1e3);
      const DeviationResult* other = at(study.without_stiffening, result.paper);
      if (other != nullptr && other->touches > 0) {
        flat.x.push_back(result.paper.background);
        flat.y.push_back(other->deviation * 1e3);
      }
    }
    if (!ours.x.empty()) own.series.push_back(std::move(ours));
    if (!flat.x.empty()) own.series.push_back(std::move(flat));
    paper.series.push_back(std::move(theirs));
    if (fit != nullptr) paper.series.push_back(std::move(fitted));
  }
  // Without any touch there is nothing to draw of ours.
  if (!own.series.empty()) trends.panels.push_back(std::move(own));
  trends.panels.push_back(std::move(paper));
  files.push_back(folder / ("deviation_trends" + ending));
  plot::write_figure(trends, files.back());

  report::Page page{"Deviation under a parallel interference force", {}};
  page.sections.push_back({"Table II of paper 1",
                           deviation_words(study),
                           {deviation_claims_table(study), deviation_table(study)},
                           {{"Note the two scales.", files.back()}}});
  page.sections.push_back({"What the paper's table tells of the hand", {}, {deviation_fit_table(study)}, {}});
  if (!study.touch.empty()) {
    plot::Series along{"", {}, {}, true}, force{"", {}, {}, true};
    for (const RigSample& sample : study.touch) {
      for (plot::Series* series : {&along, &force}) series->x.push_back(sample.time);
      along.y.push_back(sample.tangential * 1e3);
      force.y.push_back(sample.tangential_force);
    }
    const plot::Figure touch{"F_I = 5 N in pulses, F_B = 3 N in the second half",
                             "time since the touch (s)",
                             {{"along the surface (mm)", {along}, {}}, {"F_I (N)", {force}, {}}}};
    files.push_back(folder / ("deviation_touch" + ending));
    plot::write_figure(touch, files.back());
    page.sections.push_back(
        {"One touch, as in Fig. 3", {}, {}, {{"Subject 1 of the simulation.", files.back()}}});
  }
  page.sections.push_back(provenance_section(provenance));
  for (const auto& file : report::write_page(page, folder, "deviation")) files.push_back(file);
  return files;
}

}  // namespace kmax::experiment
