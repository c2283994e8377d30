#include "host_tools/experiment/design/wall_design_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/device/parameter_file.hpp"
#include "host_tools/experiment/job_pool.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/plot/figure.hpp"

namespace kmax::experiment {
namespace {

std::string stiffness_words(double stiffness) {
  return fmt::format("{:.3g} N/mm", stiffness / 1e3);
}

std::string touch_case_text(const DesignTask& task, const TouchCase& touch) {
  return fmt::format("{} at {:g} m/s with a push of {:g} N", task.set.subjects[touch.person].name,
                     touch.speed, touch.push);
}

std::string ending_words(const EndingTouch& ending) {
  if (ending.softer)
    return fmt::format("the wall comes to {:.0f} % of that and no more", 100.0 * ending.rendered_share);
  return ending.by_force
             ? fmt::format("the force swings by {:.3g} N, peak to peak", ending.peak_to_peak)
             : fmt::format("the handle moves by {:.3g} mm, peak to peak", ending.peak_to_peak * 1e3);
}

std::string criteria_words(const DesignTask& task) {
  std::string words =
      fmt::format("the handle moves by no more than {:g} mm and the force swings by no more than {:g} N",
                  task.protocol.threshold * 1e3, task.protocol.force_threshold);
  if (task.growth_time > 0.0)
    words += fmt::format(", and a wall that grows comes to {:g} % of its stiffness or more",
                         100.0 * TouchSetup().least_rendered_share);
  return words;
}

std::string bound_words(const DesignTask& task, const WallDesign& design) {
  if (!design.bound)
    return fmt::format("Bound by nothing: it holds up to {}, the most that is looked at.",
                       stiffness_words(design.largest));
  const DesignBound& bound = *design.bound;
  return fmt::format("Bound by {}: with {} {}.", touch_case_text(task, bound.touch),
                     stiffness_words(bound.stiffness), ending_words(bound.ending));
}

std::string change_words(const WallDesign& design) {
  std::vector<std::string> words;
  for (const DesignChange& change : design.changes)
    words.push_back(change.gain ? fmt::format("{} {:+.0f} %", change.name, 100.0 * *change.gain)
                                : fmt::format("{} (there is none)", change.name));
  return fmt::format("Would change the largest stiffness: {}.", fmt::join(words, "; "));
}

std::string nothing_found_words(const DesignTask& task, const WallDesign& design) {
  if (design.least_depth > 0.0)
    return fmt::format(
        "No wall holds that lets nobody deeper in than {:g} mm: the least found is {:.3g} mm. Allow more "
        "with --depth, take off a smaller --margin, or leave --depth out.",
        *task.depth * 1e3, design.least_depth * 1e3);
  return fmt::format(
      "No wall of {:g} N/m or more holds for all of {}. Allow more with --moves or --feels, or look for a "
      "faster loop (--rate), a finer encoder (--encoder) or a shorter delay.",
      first_rung, people_words(task.set.subjects.size()));
}

}  // namespace

std::vector<std::string> wall_design_words(const DesignTask& task, const WallDesign& design) {
  if (!design.found) return {nothing_found_words(task, design)};
  const DesignedWall& wall = design.wall;
  std::vector<std::string> words{
      fmt::format("{}, damping {:.3g} N s/m, {}{}: a margin of {:.3g} % below {}, the stiffest that "
                  "holds for all of {} ({}).",
                  stiffness_words(wall.stiffness), wall.damping, wall.family.grows() ? "" : "velocity by ",
                  name_of(wall.family), 100.0 * (1.0 - wall.stiffness / design.largest),
                  stiffness_words(design.largest), people_words(task.set.subjects.size()),
                  criteria_words(task)),
      bound_words(task, design),
      fmt::format("Price: field at rest {:.3g} N; deepest {:.3g} mm ({}); rate-hardness {:.3g} N/mm/s per "
                  "mm/s (0.2 m/s, mean of the people).",
                  design.price.field_at_rest, design.price.depth * 1e3, touch_case_text(task, design.deepest),
                  design.price.rate_hardness / 1e3)};
  if (!design.changes.empty()) words.push_back(change_words(design));
  words.push_back(
      fmt::format("{} touches for the wall, {} for the changes.", design.touches, design.changes_touches));
  if (design.event_limit_hits > 0)
    words.push_back(fmt::format("{} friction events could not be resolved: check the device's numbers.",
                                design.event_limit_hits));
  return words;
}

std::string wall_design_file(const DesignTask& task, const WallDesign& design) {
  const simulation::DeviceModel& device = task.set.device;
  std::string text = fmt::format(
      "# A wall by 'kmax design wall', for a simulated device and simulated people: {} of the set {}.\n"
      "# Device: {:g} kg, friction {:g} N, damping {:g} N s/m, force {}, delay {:g} s{}.\n"
      "# Loop of {:g} Hz, encoder of {:g} m at the handle. Holds: {}.\n",
      people_words(task.set.subjects.size()), task.set.name, device.mass, device.friction, device.damping,
      device.force_limit > 0.0 ? fmt::format("up to {:g} N", device.force_limit) : "not limited",
      device.delay,
      device.structure ? fmt::format(", structure of {:g} N/m", device.structure->stiffness) : "", task.rate,
      task.count_length, criteria_words(task));
  text += fmt::format("# Largest that holds: {:g} N/m. {}\n", std::round(design.largest),
                      bound_words(task, design));
  const auto parameters = parameters_of(task, design.wall);
  return text + device::parameter_file_text({"kmax design wall, not a device", "any"}, parameters);
}

void draw_wall_design(const DesignTask& task, const WallDesign& design, const DesignRun& run,
                      const std::filesystem::path& file) {
  std::vector<WallFamily> families{design.wall.family};
  for (const auto kind : {control::VelocityEstimatorKind::difference, control::VelocityEstimatorKind::foaw}) {
    if (kind == design.wall.family.velocity.kind) continue;
    families.push_back(design.wall.family);
    families.back().velocity = {kind};
  }
  std::vector<double> dampings = dampings_of(task);
  dampings.erase(dampings.begin());  // the axis has no 0
  if (design.wall.damping > 0.0) dampings.push_back(design.wall.damping);
  std::sort(dampings.begin(), dampings.end());
  const auto curves = collect_jobs<std::vector<TriedDamping>>(
      families.size(), run.threads,
      [&](std::size_t n) { return stiffness_over_damping(task, families[n], dampings, design.hard); },
      run.progress);
  plot::Figure figure{"Stiffest wall that holds", "damping, N s/m", {{"stiffness, N/mm", {}, {}}}, true};
  for (std::size_t n = 0; n < families.size(); ++n) {
    plot::Series series{name_of(families[n]), {}, {}, false, true};
    for (const TriedDamping& one : curves[n]) {
      if (one.rung < 0) continue;
      series.x.push_back(one.damping);
      series.y.push_back(stiffness_of(one.rung) / 1e3);
    }
    if (!series.x.empty()) figure.panels.front().series.push_back(std::move(series));
  }
  auto& marks = figure.panels.front().marks;
  marks.push_back({design.wall.stiffness / 1e3, false, "the wall"});
  if (design.wall.damping > 0.0) marks.push_back({design.wall.damping, true, ""});
  plot::write_figure(figure, file);
}

}  // namespace kmax::experiment
