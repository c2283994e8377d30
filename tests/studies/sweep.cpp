#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "tests/studies/studies.hpp"

namespace kmax::studies {

std::string n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1e3);
}

std::vector<TouchProtocol> by_both(const StiffnessRun& run) {
  std::vector<TouchProtocol> protocols(2, run.protocol);
  protocols.front().force_threshold = 0.0;
  protocols.back().force_threshold = felt_force;
  return protocols;
}

std::vector<std::vector<MaxStiffness>> search_by_each(const std::vector<TouchSetup>& setups,
                                                      const std::vector<TouchProtocol>& protocols,
                                                      const StiffnessRun& run) {
  const auto of_setups = experiment::collect_jobs<std::vector<MaxStiffness>>(
      setups.size(), run.threads,
      [&](std::size_t index) {
        TouchSetup setup = setups[index];
        setup.integrator = run.integrator;
        return experiment::search_max_stiffness_by_each(setup, protocols, run.steps);
      },
      run.progress);
  std::vector<std::vector<MaxStiffness>> of_protocols(protocols.size());
  for (const std::vector<MaxStiffness>& found : of_setups)
    for (std::size_t n = 0; n < protocols.size(); ++n) of_protocols[n].push_back(found[n]);
  return of_protocols;
}

namespace {

/// Everybody's touch of each wall, [wall * people + person].
std::vector<TouchSetup> setups_of(const SubjectSet& set, const std::vector<WallChange>& walls) {
  std::vector<TouchSetup> setups;
  for (const WallChange& change : walls) {
    for (const experiment::Subject& subject : set.subjects) {
      setups.push_back(experiment::touch_setup(set.device, subject.person, {}));
      change(setups.back());
    }
  }
  return setups;
}

}  // namespace

PeopleMean mean_of(std::span<const MaxStiffness> people) {
  PeopleMean mean{experiment::mean_stiffness(people),
                  experiment::counted_ends(people),
                  0.0,
                  {people.begin(), people.end()}};
  for (const MaxStiffness& person : people)
    mean.saturated_share = std::max(mean.saturated_share, person.saturated_share);
  return mean;
}

PeopleMean smaller_of_each(const PeopleMean& one, const PeopleMean& other) {
  std::vector<MaxStiffness> smaller;
  for (std::size_t n = 0; n < one.people.size(); ++n)
    smaller.push_back(other.people[n].stiffness < one.people[n].stiffness ? other.people[n] : one.people[n]);
  return mean_of(smaller);
}

void StudyInput::keep(std::string_view study, const SubjectSet& set, std::string_view wall,
                      std::string_view criterion, const PeopleMean& found) const {
  if (raw != nullptr) raw->add(study, set, wall, criterion, found.people);
}

std::vector<report::Section> largest(const StudyInput& input) {
  std::vector<experiment::MaxStiffnessStudy> studies;
  for (const SubjectSet& set : input.sets) {
    studies.push_back(
        experiment::run_max_stiffness_study(set, experiment::stiffness_conditions(), input.run));
    for (const experiment::ConditionResult& result : studies.back().conditions)
      input.keep("largest", set, result.condition.name, "position", mean_of(result.subjects));
  }
  report::Section section = experiment::max_stiffness_section(studies);
  if (!input.folder.empty())
    section.pictures.push_back(experiment::draw_max_stiffness(studies, input.folder / "max_stiffness.svg"));
  return {section};
}

std::vector<std::vector<PeopleMean>> sweep(const SubjectSet& set, const std::vector<WallChange>& walls,
                                           const std::vector<TouchProtocol>& protocols,
                                           const StiffnessRun& run) {
  std::vector<std::vector<PeopleMean>> means;
  for (const std::vector<MaxStiffness>& found : search_by_each(setups_of(set, walls), protocols, run)) {
    means.emplace_back();
    for (std::size_t wall = 0; wall < walls.size(); ++wall)
      means.back().push_back(
          mean_of(std::span(found).subspan(wall * set.subjects.size(), set.subjects.size())));
  }
  return means;
}

std::vector<TwoMeans> sweep_by_both(const SubjectSet& set, const std::vector<WallChange>& walls,
                                    const StiffnessRun& run) {
  const auto found = sweep(set, walls, by_both(run), run);
  std::vector<TwoMeans> means;
  for (std::size_t wall = 0; wall < walls.size(); ++wall)
    means.push_back({found[0][wall], found[1][wall], smaller_of_each(found[0][wall], found[1][wall])});
  return means;
}

std::vector<PeopleMean> sweep(const SubjectSet& set, const std::vector<WallChange>& walls,
                              const StiffnessRun& run) {
  return sweep(set, walls, {run.protocol}, run).front();
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
