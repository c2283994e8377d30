#include "host_tools/experiment/contact_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>

#include "host_tools/plot/figure.hpp"

namespace kmax::experiment {

std::string_view words_of(simulation::ContactVerdict verdict) {
  switch (verdict) {
    case simulation::ContactVerdict::stable:
      return "stable";
    case simulation::ContactVerdict::unstable:
      return "unstable";
    case simulation::ContactVerdict::no_contact:
      return "no contact";
  }
  return "";
}

std::string contact_table(const std::vector<ContactResult>& results) {
  std::string table =
      fmt::format("{:<22}{:>14}  {:<11}{:<13}{:>8}  {:<9}{:<33}{}\n", "condition", "peak to peak", "verdict",
                  "unstable in", "limited", "figure", "paper 1 says", "agrees");
  for (const ContactResult& result : results) {
    table += fmt::format("{:<22}{:>11.3f} mm  {:<11}{:<13}{:>6.1f} %  {:<9}{:<33}{}\n", result.condition.name,
                         result.measure.peak_to_peak * 1e3, words_of(result.measure.verdict),
                         fmt::format("{} of {}", result.unstable_trials, result.trials),
                         result.limited_share * 100, "Fig. " + result.condition.figure,
                         result.condition.paper_words, result.agrees_with_paper() ? "yes" : "no");
  }
  return table;
}

namespace {
std::string base_name(const ContactCondition& condition) {
  std::string name = "contact_" + condition.name;
  std::string clean;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      clean += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (!clean.empty() && clean.back() != '_') {
      clean += '_';
    }
  }
  return clean;
}
}  // namespace

std::vector<std::filesystem::path> write_contact(const ContactResult& result,
                                                 const std::filesystem::path& folder,
                                                 const std::string& picture_ending) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path csv = folder / (base_name(result.condition) + ".csv");
  std::ofstream file(csv);
  file << "time_s,position_m,force_n,magnetic_coefficient_n\n";
  plot::Series distance{"", {}, {}, true}, force{"", {}, {}, true}, coefficient{"", {}, {}, true};
  for (const device::TraceSample& sample : result.samples) {
    file << fmt::format("{},{},{},{}\n", sample.time, sample.position, sample.force,
                        sample.magnetic_coefficient);
    for (plot::Series* series : {&distance, &force, &coefficient}) series->x.push_back(sample.time);
    distance.y.push_back(result.outside_distance(sample) * 1e3);
    force.y.push_back(sample.force);
    coefficient.y.push_back(sample.magnetic_coefficient);
  }
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written", csv.string()));

  plot::Figure figure;
  figure.title = fmt::format("{}: {}, {:.2f} mm peak to peak", result.condition.name,
                             words_of(result.measure.verdict), result.measure.peak_to_peak * 1e3);
  figure.x_label = "time since the first touch (s)";
  const std::vector<plot::Mark> judged = {{result.judged_from, true, "judged"}, {result.judged_to, true, ""}};
  const std::vector<plot::Mark> unnamed = {{result.judged_from, true, ""}, {result.judged_to, true, ""}};
  figure.panels = {{"position from the surface (mm)", {distance}, judged},
                   {"force (N)", {force}, unnamed},
                   {"F_{MC} (N)", {coefficient}, unnamed}};
  // The approach from centimetres away would hide what happens at the surface.
  const double deepest = *std::min_element(distance.y.begin(), distance.y.end());
  figure.panels[0].y_limits = {deepest - 0.3, std::max(2.0, -2 * deepest)};
  figure.panels[2].y_limits = {
      -0.1, std::max(2.2, 1.1 * *std::max_element(coefficient.y.begin(), coefficient.y.end()))};
  const std::filesystem::path picture = folder / (base_name(result.condition) + picture_ending);
  plot::write_figure(figure, picture);
  return {picture, csv};
}

}  // namespace kmax::experiment
