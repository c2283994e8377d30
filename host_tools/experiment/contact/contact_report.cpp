#include "host_tools/experiment/contact/contact_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "host_tools/base/files.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

std::string_view to_string(simulation::ContactVerdict verdict) {
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

namespace {
std::string agreement(const ContactResult& result) {
  return yes_no(result.agrees_with_paper(), "not compared");
}
}  // namespace

report::Table contact_table(const std::vector<ContactResult>& results) {
  report::Table table{"",
                      {"condition", "at contact", "peak to peak", "verdict", "unstable in", "limited",
                       "figure", "paper 1 says", "agrees"},
                      {}};
  for (const ContactResult& result : results) {
    table.rows.push_back({result.condition.name, fmt::format("{:.2f} m/s", result.contact_speed),
                          fmt::format("{:.3f} mm", result.measure.peak_to_peak * 1e3),
                          std::string(to_string(result.measure.verdict)),
                          fmt::format("{} of {}", result.unstable_trials, result.trials),
                          fmt::format("{:.1f} %", result.limited_share * 100),
                          "Fig. " + result.condition.figure, result.condition.paper_words,
                          agreement(result)});
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
  base::make_folder(folder);
  const std::filesystem::path csv = folder / (base_name(result.condition) + ".csv");
  std::string table = "time_s,position_m,force_n,magnetic_coefficient_n\n";
  plot::Series distance{"", {}, {}, true}, force{"", {}, {}, true}, coefficient{"", {}, {}, true};
  for (const RigSample& sample : result.samples) {
    table += fmt::format("{},{},{},{}\n", sample.time, result.position(sample), sample.force,
                         sample.magnetic_coefficient);
    for (plot::Series* series : {&distance, &force, &coefficient}) series->x.push_back(sample.time);
    distance.y.push_back(sample.outside_distance * 1e3);
    force.y.push_back(sample.force);
    coefficient.y.push_back(sample.magnetic_coefficient);
  }
  base::write_file(csv, table);

  plot::Figure figure;
  figure.title = fmt::format("{}: {}, {:.2f} mm peak to peak", result.condition.name,
                             to_string(result.measure.verdict), result.measure.peak_to_peak * 1e3);
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

std::vector<std::string> contact_words(const ContactSettings& settings, std::size_t trials,
                                       const std::string& velocity_estimator,
                                       const std::optional<simulation::IntendedMotionConfig>& intended) {
  std::vector<std::string> words = {
      fmt::format("Contact with a wall of {:g} N/mm at {:g} Hz, held for {:g} s, the last second judged.",
                  settings.stiffness / 1000, settings.haptic_rate, settings.hold_time),
      fmt::format("Unstable: more than {:g} mm peak to peak in every quarter of it{}.",
                  settings.threshold * 1000,
                  trials == 1 ? "" : fmt::format("; the worst of {} trials counts", trials)),
      fmt::format("Velocity estimator: {}.", velocity_estimator)};
  if (intended)
    words.push_back(fmt::format(
        "The hand intends {:g} m/s after a run-up of {:g} mm. The speed at contact is the handle's, over the "
        "30 ms before, as the encoder shows it.",
        intended->approach_speed, std::abs(intended->start_position - intended->wall_position) * 1e3));
  if (!settings.changes.empty()) words.push_back(settings.changes.sentence());
  if (settings.changes.changes("wall.touch_stiffness")) words.push_back(growing_wall_words());
  if (!settings.papers_wall())
    words.push_back(fmt::format(
        "The paper's verdicts are of {}. This wall is another, so none of its verdicts is compared.",
        papers_wall_words()));
  return words;
}

std::string papers_wall_words() {
  return fmt::format("a wall of {:g} N/mm at {:g} Hz", paper::contact_stiffness / 1000, paper::update_rate);
}

std::vector<std::filesystem::path> write_contact_page(const std::vector<ContactResult>& results,
                                                      const std::vector<std::string>& words,
                                                      const std::vector<std::filesystem::path>& pictures,
                                                      const std::filesystem::path& folder,
                                                      report::Origin origin, const Provenance& provenance) {
  const std::string ours(report::to_string(origin)), theirs(report::to_string(report::Origin::paper));
  report::Table table;
  const bool simulated = origin != report::Origin::measured;
  table.columns = {"wall",
                   "speed at contact (m/s)",
                   "peak to peak (mm), " + ours,
                   "verdict, " + ours,
                   "unstable touches",
                   "force limited",
                   "figure",
                   "verdict, " + theirs + " 1",
                   "agrees"};
  if (simulated) table.columns.emplace_back("ours is");
  report::Section section{"Result", words, {}, {}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    const ContactResult& result = results[i];
    table.rows.push_back({result.condition.name, fmt::format("{:.2f}", result.contact_speed),
                          fmt::format("{:.3f}", result.measure.peak_to_peak * 1e3),
                          std::string(to_string(result.measure.verdict)),
                          fmt::format("{} of {}", result.unstable_trials, result.trials),
                          fmt::format("{:.1f} %", result.limited_share * 100), result.condition.figure,
                          result.condition.paper_words, agreement(result)});
    if (simulated)
      table.rows.back().emplace_back(result.implied_by_the_fit() ? "implied by the fit"
                                     : result.papers_wall        ? "a test"
                                                                 : "predicted");
    section.pictures.push_back({fmt::format("{}: position, force and coefficient over time, {}",
                                            result.condition.name, to_string(result.measure.verdict)),
                                pictures.at(i)});
  }
  section.tables.push_back(table);
  if (simulated)
    section.paragraphs.push_back(fmt::format(
        "The device and the person are simulated. Friction and stiffening were fitted, on other simulated "
        "hands, to the paper's means without a field, {:g} N/mm, and with 2 N, {:g} N/mm. That a wall "
        "between them is unstable without a field (Fig. 9) and stable with 2 N (Fig. 11) is implied by that "
        "fit; only Figs. 10 and 12 are tests. One simulated person proves no method.",
        paper::max_stiffness[0].stiffness / 1e3, paper::max_stiffness[1].stiffness / 1e3));
  return report::write_page(
      {"Contact with a stiff wall (paper 1, Figs. 9 to 12)", {section, provenance_section(provenance)}},
      folder, "contact");
}

}  // namespace kmax::experiment
