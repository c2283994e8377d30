#include "host_tools/experiment/max_stiffness/stiffness_studies.hpp"

#include <fmt/format.h>

#include <functional>
#include <stdexcept>

#include "host_tools/experiment/max_stiffness/adaptive_gap_section.hpp"
#include "host_tools/experiment/max_stiffness/held_wall_section.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_pictures.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"
#include "host_tools/experiment/max_stiffness/rate_section.hpp"
#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {
namespace {

// x_0 of the field that is looked at alone, m.
const std::vector<double> field_lengths{0.25e-3, 0.5e-3, 1e-3, 2e-3, 5e-3};
const std::vector<double> approach_speeds{0.05, 0.1, 0.2, 0.5, 1.0, 1.5};  // m/s

std::vector<report::Section> figures(const std::vector<SubjectSet>& sets, const StiffnessRun& run) {
  std::vector<report::Section> sections;
  for (const SubjectSet& set : sets)
    sections.push_back(held_wall_section(set, run_held_walls(set, paper::contact_stiffness, run)));
  return sections;
}

std::vector<report::Section> causes(const std::vector<SubjectSet>& sets, const StiffnessRun& run) {
  std::vector<ClippedCauses> results;
  for (const SubjectSet& set : sets)
    results.push_back({set, run_cause_study(set, run), run_field_lengths(set, field_lengths, run)});
  return {cause_section(results)};
}

std::vector<report::Section> variations(
    const std::string& heading, const std::vector<SubjectSet>& sets, const StiffnessRun& run,
    const std::function<std::vector<StudyVariation>(const SubjectSet&)>& make) {
  std::vector<report::Section> sections;
  for (const SubjectSet& set : sets) {
    CalibrationSettings calibration = paper_targets();
    calibration.tolerance = 20.0;
    sections.push_back(variation_section(fmt::format("{} ({})", heading, clip_words(set.device)),
                                         run_variations(make(set), calibration, run)));
  }
  return sections;
}

std::vector<report::Section> adaptive(const std::vector<SubjectSet>& sets, const StiffnessRun& run) {
  std::vector<report::Section> sections;
  for (const SubjectSet& set : sets) {
    sections.push_back(
        adaptive_gap_section(set, run_approaches(set, approach_speeds, run),
                             coefficient_for(set, paper::max_stiffness.back().stiffness, run)));
  }
  return sections;
}

std::vector<report::Section> rates(const std::vector<SubjectSet>& sets, const StiffnessRun& run,
                                   const std::filesystem::path& folder) {
  RateStudySettings settings;
  settings.device = sets.front().device;
  settings.run = run;
  settings.run.protocol.approach_speeds = {0.1, 0.5};
  settings.run.protocol.pushes = {0.6};
  std::vector<RateCase> cases;
  for (const double count_length : {55e-6, 5.5e-6}) {
    for (const RateMeasure measure : {RateMeasure::moves, RateMeasure::feels}) {
      const std::vector<RateCase> more = rate_cases(count_length, measure);
      cases.insert(cases.end(), more.begin(), more.end());
    }
  }
  const std::vector<RateResult> results = run_rate_study(cases, settings);
  report::Section section = rate_section(results);
  if (!folder.empty()) {
    section.pictures.push_back(
        draw_rates(results, 5.5e-6, RateMeasure::moves, folder / "rates_fine_encoder_moves.svg"));
    section.pictures.push_back(
        draw_rates(results, 55e-6, RateMeasure::feels, folder / "rates_coarse_encoder_feels.svg"));
  }
  return {section};
}

}  // namespace

std::vector<report::Section> run_stiffness_study(std::string_view name, const std::vector<SubjectSet>& sets,
                                                 const StiffnessRun& run,
                                                 const std::filesystem::path& folder) {
  if (sets.empty()) throw std::invalid_argument("a study needs at least one subject set");
  if (name == "figures") return figures(sets, run);
  if (name == "causes") return causes(sets, run);
  if (name == "assumptions")
    return variations("What nobody knows", sets, run,
                      [&](const SubjectSet& set) { return assumption_variations(set, run.protocol); });
  if (name == "draws")
    return variations("Other people", {sets.front()}, run, [&](const SubjectSet& set) {
      return draw_variations(set, run.protocol, drawn_groups);
    });
  if (name == "adaptive") return adaptive(sets, run);
  if (name == "rates") return rates(sets, run, folder);
  std::string names;
  for (const StudyName& study : stiffness_studies)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", study.name);
  throw std::invalid_argument(fmt::format("{}: there is no such study; allowed are {}", name, names));
}

}  // namespace kmax::experiment
