#include "host_tools/experiment/max_stiffness/held_wall_section.hpp"

#include <fmt/format.h>

#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"

namespace kmax::experiment {

report::Section held_wall_section(const SubjectSet& set, const std::vector<HeldWallResult>& results) {
  report::Section section{
      fmt::format("A wall of 5.5 N/mm held (paper 1, Figs. 9 to 12; {})", clip_words(set.device)),
      {},
      {},
      {}};
  report::Table table{
      fmt::format("Stable when none of {} touches is unstable; nothing was fitted to this",
                  results.front().named.touches),
      {"condition", "figure", "paper 1", fmt::format("{}, mm p-p", named_person), std::string(named_person),
       "agrees", fmt::format("stable of {}", set.subjects.size()), "median worst, mm p-p", "ours is"},
      {}};
  for (const HeldWallResult& result : results) {
    table.rows.push_back(
        {result.condition.name, result.figure, result.paper_stable ? "stable" : "unstable",
         fmt::format("{:.2f}", result.named.worst * 1e3), result.named.stable() ? "stable" : "unstable",
         result.named.stable() == result.paper_stable ? "yes" : "no",
         fmt::format("{}", result.stable_people()), fmt::format("{:.2f}", result.median_worst() * 1e3),
         std::string(report::to_string(result.condition.origin))});
  }
  section.tables.push_back(std::move(table));
  return section;
}

}  // namespace kmax::experiment
