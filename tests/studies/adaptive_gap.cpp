#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/paper_numbers.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {

using control::AdaptiveMode;

WallChange constant_wall(double coefficient) {
  return [coefficient](TouchSetup& setup) {
    StiffnessCondition condition;
    condition.magnetic_coefficient = coefficient;
    condition.apply(setup);
  };
}

/// `hold_time` in s; 0: the law's own.
WallChange adaptive_wall(AdaptiveMode mode, double hold_time = 0.0) {
  return [mode, hold_time](TouchSetup& setup) {
    StiffnessCondition condition;
    condition.law = control::WallKind::adaptive;
    condition.mode = mode;
    setup.wall.velocity.kind = control::HapticLoopConfig<float>().velocity.kind;  // the firmware's default
    condition.apply(setup);
    if (hold_time > 0.0) setup.wall.wall.adaptive.hold_time = static_cast<float>(hold_time);
  };
}

/// F_MC at the moment of contact, mean over the people.
double coefficient_at_contact(const SubjectSet& set, double speed, double stiffness) {
  double sum = 0.0;
  for (const experiment::Subject& subject : set.subjects) {
    TouchSetup setup = experiment::touch_setup(set.device, subject.person, {});
    adaptive_wall(AdaptiveMode::latched)(setup);
    setup.motion.approach_speed = speed;
    setup.wall.wall.stiffness = static_cast<float>(stiffness);
    sum += experiment::simulate_touch(setup).coefficient_at_contact;
  }
  return sum / static_cast<double>(set.subjects.size());
}

double best_mode(const ApproachResult& result) {
  return std::max({result.walls[1].mean, result.walls[2].mean, result.walls[3].mean});
}

}  // namespace

std::vector<ApproachResult> run_approaches(const SubjectSet& set, const std::vector<double>& speeds,
                                           const StiffnessRun& run) {
  constexpr double for_ever = 1000.0;  // s
  const std::vector<WallChange> walls = {
      constant_wall(2.0), adaptive_wall(AdaptiveMode::instant), adaptive_wall(AdaptiveMode::latched),
      adaptive_wall(AdaptiveMode::peak_hold), adaptive_wall(AdaptiveMode::peak_hold, for_ever)};
  std::vector<ApproachResult> results;
  for (const double speed : speeds) {
    StiffnessRun single = run;
    single.protocol.approach_speeds = {speed};
    ApproachResult result{speed, {}, 0.0};
    const std::vector<PeopleMean> found = sweep(set, walls, single);
    std::copy(found.begin(), found.end(), result.walls.begin());
    result.coefficient_at_contact = coefficient_at_contact(set, speed, result.walls.back().mean);
    results.push_back(result);
  }
  return results;
}

NeededCoefficient coefficient_for(const SubjectSet& set, double target, const StiffnessRun& run) {
  NeededCoefficient best;
  double low = 0.0, high = 4.0, nearest = HUGE_VAL;
  for (int step = 0; step < 10; ++step) {
    const double middle = 0.5 * (low + high);
    const double mean = sweep(set, {constant_wall(middle)}, run).front().mean;
    if (std::abs(mean - target) < nearest) {
      nearest = std::abs(mean - target);
      best.coefficient = middle;
      best.mean = mean;
    }
    (mean < target ? low : high) = middle;
  }
  // Eq. 7: F_MC = gain V / V_max + offset.
  const control::AdaptiveCoefficientConfig<double> law;
  best.approach_speed = (best.coefficient - law.offset) / law.gain * law.velocity_max;
  return best;
}

report::Section adaptive_gap_section(const SubjectSet& set, const std::vector<ApproachResult>& approaches,
                                     const NeededCoefficient& needed) {
  const double printed = experiment::paper::max_stiffness.back().stiffness;
  experiment::MarkedMeans marks;
  report::Table table{"Largest stable stiffness, N/mm, if all touches came at one speed",
                      {"approach, m/s", "constant 2 N", "instant", "latched", "peak_hold",
                       "held for the whole touch", "F_MC at contact, N"},
                      {}};
  for (const ApproachResult& result : approaches) {
    std::vector<std::string> row{fmt::format("{:g}", result.approach_speed)};
    for (const PeopleMean& wall : result.walls)
      row.push_back(marks.cell(wall.mean, wall.ends, set.subjects.size(),
                               fmt::format("{} at {} m/s", table.columns[row.size()], row[0])));
    row.push_back(fmt::format("{:.2f}", result.coefficient_at_contact));
    table.rows.push_back(std::move(row));
  }
  report::Section section{fmt::format("What would make the adaptive wall reach {} N/mm ({})",
                                      n_per_mm(printed), experiment::clip_words(set.device)),
                          {},
                          {std::move(table)},
                          {}};
  const std::string given = fmt::format("Over all touches, a constant F_MC of {:.2f} N gives {} N/mm",
                                        needed.coefficient, n_per_mm(needed.mean));
  section.paragraphs.push_back(
      std::abs(needed.mean - printed) <= experiment::magnetic_tolerance
          ? fmt::format("{}. Eq. 7 commands that much at an approach of {:.2f} m/s and falls back to 0.8 N "
                        "at rest: as the law is printed, {} N/mm needs touches that fast and a coefficient "
                        "that stays for the whole contact, which no mode but one with a very long hold has.",
                        given, needed.approach_speed, n_per_mm(printed))
          : fmt::format("{}, the nearest to {} N/mm that one between 0 and 4 N comes.", given,
                        n_per_mm(printed)));
  const ApproachResult& slowest = approaches.front();
  const double best = best_mode(slowest);
  const bool slow_is_best =
      std::all_of(approaches.begin() + 1, approaches.end(),
                  [&](const ApproachResult& faster) { return best_mode(faster) < best; });
  section.paragraphs.push_back(
      slow_is_best
          ? fmt::format(
                "The other way is to touch slowly only: at {:g} m/s alone the best mode reaches {} N/mm, "
                "with a field of 0.8 N, because a slow touch hardly starts the oscillation. But then the "
                "constant 2 N reaches {}, and the calibration no longer holds: the study \"assumptions\" "
                "fits again to slow touches, in its rows on the approach speed.",
                slowest.approach_speed, n_per_mm(best), n_per_mm(slowest.walls[0].mean))
          : fmt::format("To touch slowly only is no way: at {:g} m/s alone the best mode reaches {} N/mm, "
                        "and no more than at a faster approach.",
                        slowest.approach_speed, n_per_mm(best)));
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

std::vector<report::Section> adaptive_gap(const StudyInput& input) {
  std::vector<report::Section> sections;
  for (const SubjectSet& set : input.sets)
    sections.push_back(adaptive_gap_section(
        set, run_approaches(set, {0.05, 0.1, 0.2, 0.5, 1.0, 1.5}, input.run),
        coefficient_for(set, experiment::paper::max_stiffness.back().stiffness, input.run)));
  return sections;
}

}  // namespace kmax::studies
