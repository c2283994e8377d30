#include "host_tools/experiment/max_stiffness/adaptive_gap_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/max_stiffness/marked_means.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"
#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {

namespace {
std::string n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1e3);
}
}  // namespace

report::Section adaptive_gap_section(const SubjectSet& set, const std::vector<ApproachResult>& approaches,
                                     const NeededCoefficient& needed) {
  const double printed = paper::max_stiffness.back().stiffness;
  report::Section section{fmt::format("What would make the adaptive wall reach {} N/mm ({})",
                                      n_per_mm(printed), clip_words(set.device)),
                          {},
                          {},
                          {}};
  MarkedMeans marks;
  report::Table table{"Largest stable stiffness, N/mm, if all touches came at one speed",
                      {"approach, m/s", "constant 2 N", "instant", "latched", "peak_hold",
                       "held for the whole touch", "F_MC at contact, N"},
                      {}};
  for (const ApproachResult& result : approaches) {
    std::vector<std::string> row{fmt::format("{:g}", result.approach_speed)};
    const auto add = [&](double mean, const CountedEnds& ends) {
      row.push_back(marks.cell(mean, ends, set.subjects.size(),
                               fmt::format("{} at {} m/s", table.columns[row.size()], row[0])));
    };
    add(result.constant, result.constant_ends);
    for (std::size_t mode = 0; mode < result.by_mode.size(); ++mode)
      add(result.by_mode[mode],
          mode < result.by_mode_ends.size() ? result.by_mode_ends[mode] : CountedEnds{});
    add(result.held, result.held_ends);
    row.push_back(fmt::format("{:.2f}", result.coefficient_at_contact));
    table.rows.push_back(std::move(row));
  }
  section.tables.push_back(std::move(table));
  const std::string given = fmt::format("Over all touches, a constant F_MC of {:.2f} N gives {} N/mm",
                                        needed.coefficient, n_per_mm(needed.mean));
  section.paragraphs.push_back(
      std::abs(needed.mean - printed) <= magnetic_tolerance
          ? fmt::format(
                "{}. Eq. 7 commands that much at an approach of {:.2f} m/s and falls back to 0.8 N at "
                "rest: as the law is printed, {} N/mm needs touches that fast and a coefficient that "
                "stays for the whole contact, which no mode but one with a very long hold has.",
                given, needed.approach_speed, n_per_mm(printed))
          : fmt::format("{}, the nearest to {} N/mm that one between 0 and 4 N comes.", given,
                        n_per_mm(printed)));
  const auto best_of = [](const ApproachResult& result) {
    return *std::max_element(result.by_mode.begin(), result.by_mode.end());
  };
  const ApproachResult& slowest = approaches.front();
  const double best = best_of(slowest);
  const bool slow_is_best = std::all_of(approaches.begin() + 1, approaches.end(),
                                        [&](const ApproachResult& faster) { return best_of(faster) < best; });
  section.paragraphs.push_back(
      slow_is_best
          ? fmt::format(
                "The other way is to touch slowly only: at {:g} m/s alone the best mode reaches {} "
                "N/mm, with a field of 0.8 N, because a slow touch hardly starts the oscillation. But "
                "then the constant 2 N reaches {}, and the calibration no longer holds: --study "
                "assumptions fits again to slow touches, in its rows on the approach speed.",
                slowest.approach_speed, n_per_mm(best), n_per_mm(slowest.constant))
          : fmt::format(
                "To touch slowly only is no way: at {:g} m/s alone the best mode reaches {} N/mm, and "
                "no more than at a faster approach.",
                slowest.approach_speed, n_per_mm(best)));
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

}  // namespace kmax::experiment
