#include "host_tools/experiment/max_stiffness/max_stiffness_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/plot/figure.hpp"

namespace kmax::experiment {

plot::Figure max_stiffness_figure(const std::vector<MaxStiffnessStudy>& studies) {
  plot::Figure figure;
  figure.title = "Largest stable stiffness, mean of the people";
  figure.x_label = "F_{MC} of the constant field (N)";
  figure.legend_beside = true;
  plot::Panel panel{"largest stable stiffness (N/mm)", {}, {}};
  plot::Series printed{"paper 1", {}, {}};
  printed.points = true;
  for (const paper::MaxStiffness& number : paper::max_stiffness) {
    if (number.adaptive) {
      panel.marks.push_back({number.stiffness / 1e3, false, "paper 1, adaptive"});
      continue;
    }
    // Two points, and no line between them: the paper prints nothing there.
    for (const double y : {number.stiffness / 1e3, std::nan("")}) {
      printed.x.push_back(number.magnetic_coefficient);
      printed.y.push_back(y);
    }
  }
  panel.series.push_back(printed);
  for (const MaxStiffnessStudy& study : studies) {
    const char* clipped = study.set.device.force_limit > 0.0 ? "clipped" : "not clipped";
    plot::Series constant{std::string("constant, ") + clipped, {}, {}};
    constant.points = true;
    for (const ConditionResult& result : study.conditions) {
      if (result.condition.adaptive) continue;
      constant.x.push_back(result.condition.magnetic_coefficient);
      constant.y.push_back(result.mean() / 1e3);
    }
    panel.series.push_back(constant);
    plot::Series modes{std::string("adaptive, ") + clipped, {}, {}};
    double least = 1e300, most = 0.0;
    for (const ConditionResult& result : study.conditions) {
      if (!result.condition.adaptive) continue;
      least = std::min(least, result.mean() / 1e3);
      most = std::max(most, result.mean() / 1e3);
    }
    if (most == 0.0) continue;
    const double at = study.set.device.force_limit > 0.0 ? 0.78 : 0.82;  // eq. 7 commands 0.8 N at rest
    modes.x = {at, at};
    modes.y = {least, most};
    modes.points = true;
    panel.series.push_back(modes);
  }
  double top = 0.0;
  for (const plot::Mark& mark : panel.marks) top = std::max(top, mark.at);
  for (const plot::Series& series : panel.series) {
    for (const double y : series.y) top = std::max(top, std::isnan(y) ? 0.0 : y);
  }
  panel.y_limits = {0.0, std::ceil(1.05 * top)};
  figure.panels.push_back(std::move(panel));
  return figure;
}

std::string max_stiffness_caption(const std::vector<MaxStiffnessStudy>& studies) {
  std::vector<std::string> calibrated;
  for (const MaxStiffnessStudy& study : studies) {
    std::string values;
    for (const ConditionResult& result : study.conditions) {
      if (result.condition.origin != report::Origin::calibrated) continue;
      values += fmt::format("{}{:g}", values.empty() ? "" : " and ", result.condition.magnetic_coefficient);
    }
    if (!values.empty()) calibrated.push_back(fmt::format("{} N ({})", values, clip_words(study.set.device)));
  }
  return fmt::format(
      "Largest stable stiffness over F_MC. {}; the adaptive wall, from its worst mode to its best, stands at "
      "the 0.8 N that eq. 7 commands at rest.",
      calibrated.empty() ? std::string("All values of ours are predicted, nothing was fitted to these people")
                         : fmt::format("The values at {} are calibrated, all others of ours predicted",
                                       fmt::join(calibrated, ", ")));
}

report::Picture draw_max_stiffness(const std::vector<MaxStiffnessStudy>& studies,
                                   const std::filesystem::path& file) {
  plot::write_figure(max_stiffness_figure(studies), file);
  return {max_stiffness_caption(studies), file};
}

report::Picture draw_rates(const std::vector<RateResult>& results, double count_length, RateMeasure measure,
                           const std::filesystem::path& file) {
  plot::Figure figure;
  const bool moves = measure == RateMeasure::moves;
  figure.title = fmt::format("Encoder of {:g} um, unstable: {}", count_length * 1e6,
                             moves ? "moves by 3 counts" : "swings by 1 N");
  figure.x_label = "rate of the haptic loop (Hz)";
  figure.log_x = true;
  figure.legend_beside = true;
  plot::Panel panel{"largest stable stiffness (N/mm)", {}, {}};
  panel.log_y = true;
  for (const RateResult& result : results) {
    if (result.setting.count_length != count_length || result.setting.measure != measure) continue;
    const std::string name = name_of(result.setting);
    auto series = std::find_if(panel.series.begin(), panel.series.end(),
                               [&](const plot::Series& known) { return known.label == name; });
    if (series == panel.series.end()) {
      panel.series.push_back({name, {}, {}});
      series = panel.series.end() - 1;
      series->points = true;
    }
    series->x.push_back(result.setting.rate);
    series->y.push_back(result.found.stiffness / 1e3);
  }
  figure.panels.push_back(std::move(panel));
  plot::write_figure(figure, file);
  return {figure.title + ": largest stable stiffness over the rate of the loop.", file};
}

}  // namespace kmax::experiment
