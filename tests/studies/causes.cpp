#include <fmt/format.h>

#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {
constexpr double taken_apart = 2.0;  // N: the F_MC whose effect is taken apart

/// A row for each condition, a column of means for each set behind those of `begin`.
template <typename Begin, typename Means, typename What>
report::Table cause_table(report::Table table, const std::vector<CausesOfSet>& results, const char* unit,
                          std::size_t rows, experiment::MarkedMeans& marks, const Begin& begin,
                          const Means& means, const What& what) {
  for (const CausesOfSet& result : results)
    table.columns.push_back(experiment::clip_words(result.set.device) + unit);
  for (std::size_t n = 0; n < rows; ++n) {
    table.rows.push_back(begin(n));
    for (const CausesOfSet& result : results) {
      const PeopleMean& found = means(result)[n];
      table.rows.back().push_back(
          marks.cell(found.mean, found.ends, result.set.subjects.size(),
                     fmt::format("{}, {}", what(n), experiment::clip_words(result.set.device))));
    }
  }
  return table;
}
}  // namespace

void CauseCondition::apply(TouchSetup& setup) const {
  auto& wall = setup.wall;
  wall.wall.kind = field ? control::WallKind::magnetic : control::WallKind::plain;
  wall.wall.magnetic_coefficient = static_cast<float>(taken_apart);
  wall.wall.magnetic_length = static_cast<float>(magnetic_length);
  if (preload) {
    wall.interference.mode = control::InterferenceMode::perpendicular;
    wall.interference.background_force = static_cast<float>(taken_apart);
    wall.interference.force = 0.0F;
  }
  if (!stiffens) setup.person.activation_gain = 0.0;
  setup.person.grip_stiffness *= grip_factor;
  setup.person.grip_damping *= grip_factor;
  setup.person.arm_stiffness *= arm_factor;
  setup.person.arm_damping *= arm_factor;
}

std::vector<CauseCondition> cause_conditions(double grown) {
  constexpr double no_length = 1e-9;  // m
  return {
      {"plain wall", "none of them"},
      {"field, hand unchanged", "the field in front of the wall and its preload", true},
      {"preload, hand unchanged", "2 N everywhere, no slope in front of the wall", false, 1e-3, true},
      {"2 N inside only, hand unchanged", "the force steps at the surface", true, no_length},
      {"grip stiffer, no field", "k1 and b1 grown", false, 1e-3, false, false, grown},
      {"arm stiffer, no field", "k2 and b2 grown", false, 1e-3, false, false, 1.0, grown},
      {"grip and arm stiffer, no field", "all four grown", false, 1e-3, false, false, grown, grown},
      {"preload, hand stiffens", "2 N everywhere, and the hand answers", false, 1e-3, true, true},
      {"2 N inside only, hand stiffens", "the step at the surface, and the hand answers", true, no_length,
       false, true},
      {"field, hand stiffens", "all of them", true, 1e-3, false, true},
  };
}

std::vector<CauseCondition> fields_of(const std::vector<double>& lengths) {
  std::vector<CauseCondition> conditions;
  for (const double length : lengths) conditions.push_back({"field alone", "", true, length});
  return conditions;
}

std::vector<PeopleMean> run_causes(const SubjectSet& set, const std::vector<CauseCondition>& conditions,
                                   const StiffnessRun& run) {
  StiffnessRun low = run;
  low.steps.first = cause_first_stiffness;
  std::vector<WallChange> walls;
  for (const CauseCondition& condition : conditions)
    walls.push_back([&condition](TouchSetup& setup) { condition.apply(setup); });
  return sweep(set, walls, low);
}

report::Section cause_section(const std::vector<CausesOfSet>& results) {
  const std::vector<CauseCondition> conditions = cause_conditions(1.0);
  experiment::MarkedMeans marks;
  report::Section section{"The causes, one by one", {}, {}, {}};
  section.paragraphs.push_back(fmt::format(
      "Adding a field of F_MC = 2 N changes four things: the hand stiffens, the field reaches out in front "
      "of the wall, its force is a preload, and a force limit is met sooner. Each row leaves only some of "
      "them; the columns are the force limit. The search begins at {:g} N/m.",
      cause_first_stiffness));
  using Row = std::vector<std::string>;
  section.tables.push_back(cause_table(
      {"Largest stable stiffness, N/mm, mean of the people", {"what is there", "which is"}, {}}, results, "",
      conditions.size(), marks,
      [&](std::size_t n) {
        return Row{conditions[n].name, conditions[n].what};
      },
      [](const CausesOfSet& result) { return std::span(result.causes); },
      [&](std::size_t n) { return conditions[n].name; }));
  const auto length_text = [](std::size_t n) { return fmt::format("{:g}", field_lengths[n] * 1e3); };
  section.tables.push_back(cause_table(
      {"The field alone (hand unchanged) by its length", {"x_0, mm", "slope 2 F_MC/x_0, N/mm"}, {}}, results,
      ", N/mm", results.front().lengths.size(), marks,
      [&](std::size_t n) {
        return Row{length_text(n), n_per_mm(2.0 * taken_apart / field_lengths[n])};
      },
      [](const CausesOfSet& result) { return std::span(result.lengths); },
      [&](std::size_t n) { return fmt::format("x_0 = {} mm", length_text(n)); }));
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

std::vector<report::Section> causes(const StudyInput& input) {
  std::vector<CausesOfSet> results;
  for (const SubjectSet& set : input.sets) {
    const double grown = 1.0 + taken_apart * set.subjects.front().person.activation_gain;
    results.push_back({set, run_causes(set, cause_conditions(grown), input.run),
                       run_causes(set, fields_of(field_lengths), input.run)});
  }
  return {cause_section(results)};
}

}  // namespace kmax::studies
