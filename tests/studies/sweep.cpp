#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "tests/studies/studies.hpp"

namespace kmax::studies {

std::string n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1e3);
}

std::vector<PeopleMean> sweep(const SubjectSet& set, const std::vector<WallChange>& walls,
                              const StiffnessRun& run) {
  std::vector<experiment::StiffnessJob> jobs;
  for (const WallChange& change : walls) {
    for (const experiment::Subject& subject : set.subjects) {
      jobs.push_back({"", experiment::touch_setup(set.device, subject.person, {})});
      change(jobs.back().setup);
    }
  }
  const std::vector<experiment::MaxStiffness> found = experiment::run_stiffness_jobs(jobs, run);
  std::vector<PeopleMean> means;
  for (std::size_t wall = 0; wall < walls.size(); ++wall) {
    const auto people = std::span(found).subspan(wall * set.subjects.size(), set.subjects.size());
    means.push_back({experiment::mean_stiffness(people), experiment::counted_ends(people), 0.0});
    for (const experiment::MaxStiffness& person : people)
      means.back().saturated_share = std::max(means.back().saturated_share, person.saturated_share);
  }
  return means;
}

std::vector<report::Section> run_studies(const std::vector<std::string>& names, const StudyInput& input) {
  if (input.sets.empty()) throw std::invalid_argument("a study needs at least one subject set");
  std::vector<report::Section> sections;
  for (const std::string& name : names) {
    bool known = false;
    for (const Study& study : all_studies) {
      if (name != "all" && name != study.name) continue;
      known = true;
      for (report::Section& section : study.run(input)) sections.push_back(std::move(section));
      if (input.done) input.done(study.name);
    }
    if (known) continue;
    std::string allowed;
    for (const Study& study : all_studies) allowed += fmt::format("{}, ", study.name);
    throw std::invalid_argument(fmt::format("{}: there is no such study; allowed are {}all", name, allowed));
  }
  return sections;
}

}  // namespace kmax::studies
