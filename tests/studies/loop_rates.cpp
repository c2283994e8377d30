#include <fmt/format.h>

#include <algorithm>

#include "host_tools/plot/figure.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {

std::string measure_words(RateMeasure measure) {
  return measure == RateMeasure::moves ? "moves by 3 counts" : "swings by 1 N";
}

TouchSetup setup_of(const RateCase& setting, const simulation::DeviceModel& device) {
  TouchSetup setup;
  setup.device = device;
  setup.device.force_limit = 0.0;
  setup.device.delay = setting.delay_samples / setting.rate + setting.delay;
  setup.wall = experiment::touched_wall(setting.rate, setting.count_length, 0.0);
  setup.wall.wall.kind = control::WallKind::plain;
  setup.wall.wall.damping = static_cast<float>(setting.wall_damping);
  setup.wall.velocity.kind = setting.estimator;
  return setup;
}

/// Of one encoder, in their order: each loop's name with its results.
using ByName = std::vector<std::pair<std::string, std::vector<const RateResult*>>>;
ByName by_name(const std::vector<RateResult>& results, double count_length) {
  ByName loops;
  for (const RateResult& result : results) {
    if (result.setting.count_length != count_length) continue;
    const std::string name = result.setting.name();
    auto loop = std::find_if(loops.begin(), loops.end(), [&](const auto& one) { return one.first == name; });
    if (loop == loops.end()) loop = loops.insert(loop, {name, {}});
    loop->second.push_back(&result);
  }
  return loops;
}

}  // namespace

std::string RateCase::name() const {
  if (wall_damping > 0.0)
    return fmt::format("damping {:g} N s/m, {}", wall_damping, estimator_name(estimator));
  if (delay_samples > 0.0) return fmt::format("{:g} sample of delay", delay_samples);
  if (delay > 0.0) return fmt::format("{:g} ms of delay", delay * 1e3);
  return "no damping";
}

std::vector<RateCase> rate_cases(double count_length) {
  std::vector<RateCase> cases;
  for (const double rate : study_rates) {
    const RateCase plain{.rate = rate, .count_length = count_length};
    cases.insert(cases.end(), 3, plain);
    cases.end()[-2].delay_samples = 1.0;
    cases.end()[-1].delay = 0.5e-3;
    for (const control::VelocityEstimatorKind estimator : all_estimators) {
      cases.push_back(plain);
      cases.back().wall_damping = 2.0;
      cases.back().estimator = estimator;
    }
  }
  return cases;
}

std::vector<RateResult> run_rates(const std::vector<RateCase>& cases, const simulation::DeviceModel& device,
                                  const StiffnessRun& run) {
  // Every encoder has a threshold of its own, which is the protocol's.
  return experiment::collect_jobs<RateResult>(
      cases.size(), run.threads,
      [&](std::size_t index) {
        const RateCase& setting = cases[index];
        std::vector<TouchProtocol> protocols = by_both(run);
        protocols.front().threshold = 3.0 * setting.count_length;
        const std::vector<MaxStiffness> found = experiment::search_max_stiffness_by_each(
            setup_of(setting, device), protocols,
            {.first = 100.0, .step = 10.0, .growth = 0.03, .last = 1e6});
        return RateResult{setting, found[0], found[1]};
      },
      run.progress);
}

namespace {

/// What the walls without delay hold at the highest rate, of each encoder.
std::string strongest_words(const std::vector<RateResult>& results) {
  constexpr double held = 15e3;  // N/m, which at 500 Hz none of them does
  std::string words;
  for (const double encoder : {5.5e-6, 55e-6}) {
    std::size_t walls = 0, still = 0, by_each = 0, at_first = 0;
    double most = 0.0, most_at_first = 0.0;
    for (const RateResult& result : results) {
      const RateCase& setting = result.setting;
      if (setting.count_length != encoder || setting.delay > 0.0 || setting.delay_samples > 0.0) continue;
      const double both = std::min(result.moves.stiffness, result.feels.stiffness);
      if (setting.rate == study_rates.front()) {
        at_first += both >= held ? 1 : 0;
        most_at_first = std::max(most_at_first, both);
      }
      if (setting.rate != study_rates.back()) continue;
      ++walls;
      still += result.moves.stiffness >= held ? 1 : 0;
      by_each += both >= held ? 1 : 0;
      most = std::max(most, both);
    }
    if (walls == 0) continue;
    words += fmt::format(
        "{}With {:g} um {} of {} walls without delay hold {:g} N/mm at {:g} kHz by the position and {} by "
        "both criteria, the stiffest of them {:.3g} N/mm; at {:g} Hz {}, the stiffest {:.3g}.",
        words.empty() ? "" : " ", encoder * 1e6, still, walls, held / 1e3, study_rates.back() / 1e3, by_each,
        most / 1e3, study_rates.front(), at_first == 0 ? "none does" : std::to_string(at_first),
        most_at_first / 1e3);
  }
  return words;
}

}  // namespace

report::Section rate_section(const std::vector<RateResult>& results) {
  report::Section section{"Rate of the loop, encoder and velocity estimator", {}, {}, {}};
  if (std::string words = strongest_words(results); !words.empty())
    section.paragraphs.push_back(std::move(words));
  section.paragraphs.push_back(
      "One person, force not clipped, steps of 3 %. Unstable is what moves by more than three counts of the "
      "encoder peak to peak in the first table of each encoder, and what swings by more than 1 N in the "
      "second: one count is that much at 1 N / count length, so what flickers between two counts ends there, "
      "at any rate.");
  std::vector<double> encoders;
  for (const RateResult& result : results) encoders.push_back(result.setting.count_length);
  std::sort(encoders.begin(), encoders.end(), std::greater<>());
  encoders.erase(std::unique(encoders.begin(), encoders.end()), encoders.end());
  for (const double encoder : encoders) {
    for (const RateMeasure measure : {RateMeasure::moves, RateMeasure::feels}) {
      report::Table table{fmt::format("Largest stable stiffness, N/mm, encoder of {:g} um, unstable: {}",
                                      encoder * 1e6, measure_words(measure)),
                          {"loop"},
                          {}};
      for (const double rate : study_rates) table.columns.push_back(fmt::format("{:g} Hz", rate));
      for (const auto& [name, found] : by_name(results, encoder)) {
        table.rows.push_back({name});
        for (const double rate : study_rates) {
          const auto at = std::find_if(found.begin(), found.end(), [&](const RateResult* result) {
            return result->setting.rate == rate;
          });
          if (at == found.end()) {
            table.rows.back().push_back("-");
            continue;
          }
          const MaxStiffness& largest = (*at)->by(measure);
          table.rows.back().push_back(
              fmt::format("{}{:.3g}", largest.beyond_last ? ">" : "", largest.stiffness / 1e3));
        }
      }
      section.tables.push_back(std::move(table));
    }
  }
  return section;
}

report::Picture draw_rates(const std::vector<RateResult>& results, double count_length, RateMeasure measure,
                           const std::filesystem::path& file) {
  plot::Figure figure{
      fmt::format("Encoder of {:g} um, unstable: {}", count_length * 1e6, measure_words(measure)),
      "rate of the haptic loop (Hz)",
      {}};
  figure.log_x = figure.legend_beside = true;
  plot::Panel panel{"largest stable stiffness (N/mm)", {}, {}};
  panel.log_y = true;
  for (const auto& [name, found] : by_name(results, count_length)) {
    plot::Series series{name, {}, {}, false, true};
    for (const RateResult* result : found) {
      series.x.push_back(result->setting.rate);
      series.y.push_back(result->by(measure).stiffness / 1e3);
    }
    panel.series.push_back(std::move(series));
  }
  figure.panels.push_back(std::move(panel));
  plot::write_figure(figure, file);
  return {figure.title + ": largest stable stiffness over the rate of the loop.", file};
}

std::vector<report::Section> loop_rates(const StudyInput& input) {
  StiffnessRun run = input.run;
  run.protocol.approach_speeds = {0.1, 0.5};
  run.protocol.pushes = {0.6};
  std::vector<RateCase> cases;
  for (const double count_length : {55e-6, 5.5e-6}) {
    const std::vector<RateCase> more = rate_cases(count_length);
    cases.insert(cases.end(), more.begin(), more.end());
  }
  const std::vector<RateResult> results = run_rates(cases, input.sets.front().device, run);
  SubjectSet one;
  one.name = "the person of the supplied scenes";
  one.device.force_limit = 0.0;
  for (const RateResult& result : results) {
    const std::string wall = fmt::format("{}; {:g} Hz, {:g} um", result.setting.name(), result.setting.rate,
                                         result.setting.count_length * 1e6);
    input.keep("rates", one, wall, "position", mean_of({&result.moves, 1}));
    input.keep("rates", one, wall, "force", mean_of({&result.feels, 1}));
  }
  report::Section section = rate_section(results);
  if (!input.folder.empty())
    section.pictures = {
        draw_rates(results, 5.5e-6, RateMeasure::moves, input.folder / "rates_fine_encoder_moves.svg"),
        draw_rates(results, 55e-6, RateMeasure::feels, input.folder / "rates_coarse_encoder_feels.svg")};
  return {section};
}

}  // namespace kmax::studies
