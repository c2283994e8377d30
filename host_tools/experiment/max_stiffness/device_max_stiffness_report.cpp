#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/base/files.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

namespace {
std::string in_n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1000);
}

std::string found_words(const DeviceStiffnessResult& result) {
  const std::string number = in_n_per_mm(result.found.stiffness);
  if (result.found.beyond_last) return ">= " + number;
  if (result.found.stiffness == 0.0 && !result.found.never_touched) return "none stable";
  return number;
}

std::string remark(const DeviceStiffnessResult& result) {
  std::vector<std::string> remarks;
  const auto aborted = std::count_if(result.touches.begin(), result.touches.end(),
                                     [](const DeviceStiffnessTouch& touch) { return touch.aborted; });
  if (aborted > 0) remarks.push_back(fmt::format("touches ended by the host: {}", aborted));
  if (result.found.beyond_last) remarks.emplace_back("still stable where the search ended");
  if (result.found.never_touched) remarks.emplace_back("ended: the wall was not held");
  return fmt::format("{}", fmt::join(remarks, "; "));
}

void draw(const std::vector<DeviceStiffnessResult>& results, double threshold,
          const std::filesystem::path& file) {
  plot::Figure figure;
  figure.title = "Oscillation of each touch";
  figure.x_label = "stiffness (N/mm)";
  plot::Panel panel{"peak to peak (mm)", {}, {{threshold * 1e3, false, "unstable above"}}};
  double highest = threshold * 1e3;
  for (const DeviceStiffnessResult& result : results) {
    if (result.touches.empty()) continue;
    plot::Series series{result.condition.name, {}, {}};
    std::vector<DeviceStiffnessTouch> touches = result.touches;
    // A search that went down is drawn upwards too.
    std::stable_sort(touches.begin(), touches.end(),
                     [](const auto& a, const auto& b) { return a.stiffness < b.stiffness; });
    for (const DeviceStiffnessTouch& touch : touches) {
      series.x.push_back(touch.stiffness / 1000);
      series.y.push_back(touch.peak_to_peak * 1e3);
      highest = std::max(highest, touch.peak_to_peak * 1e3);
    }
    panel.series.push_back(series);
  }
  panel.y_limits = {-0.02 * highest, 1.1 * highest};
  figure.panels = {panel};
  plot::write_figure(figure, file);
}
}  // namespace

report::Table device_stiffness_table(const std::vector<DeviceStiffnessResult>& results) {
  report::Table table;
  table.columns = {"wall",
                   fmt::format("K_max (N/mm), {}", report::to_string(report::Origin::measured)),
                   fmt::format("K_max (N/mm), {} 1", report::to_string(report::Origin::paper)),
                   "touches",
                   "force limited",
                   "remark"};
  for (const DeviceStiffnessResult& result : results)
    table.rows.push_back({result.condition.name, found_words(result),
                          result.condition.paper ? in_n_per_mm(*result.condition.paper) : "-",
                          std::to_string(result.found.touches),
                          fmt::format("{:.1f} %", result.found.saturated_share * 100), remark(result)});
  return table;
}

report::Table device_touch_table(const std::vector<DeviceStiffnessResult>& results) {
  report::Table table;
  table.columns = {"wall",           "stiffness_n_per_m", "touch",         "verdict",
                   "peak_to_peak_m", "limited_share",     "ended_by_host", "lost_records"};
  for (const DeviceStiffnessResult& result : results) {
    for (const DeviceStiffnessTouch& touch : result.touches)
      table.rows.push_back({result.condition.name, fmt::format("{}", touch.stiffness),
                            std::to_string(touch.trial), std::string(to_string(touch.verdict)),
                            fmt::format("{}", touch.peak_to_peak), fmt::format("{}", touch.limited_share),
                            touch.aborted ? "yes" : "no", std::to_string(touch.lost_records)});
  }
  return table;
}

std::vector<std::string> device_stiffness_words(const DeviceStiffnessSettings& settings,
                                                const TouchLimits& limits, const std::string& device) {
  const ContactSettings& touch = settings.touch;
  std::vector<std::string> words = {
      fmt::format("Largest stable stiffness on {}, axis {}, at {:g} Hz: from {:g} N/mm ({:g} N/mm for "
                  "adaptive walls) in steps of {:g} N/mm, {} at each, held for {:g} s.",
                  device, limits.axis, touch.haptic_rate, settings.steps.first / 1000,
                  settings.steps.first_of(true) / 1000, settings.steps.step / 1000,
                  settings.trials == 1 ? "one touch" : fmt::format("{} touches", settings.trials),
                  touch.hold_time),
      fmt::format(
          "Unstable: more than {:g} mm peak to peak in every quarter of the last second, or more than {:g} "
          "mm within 0.25 s, at which the host ended the touch. The force is limited to {:g} N or less.",
          touch.threshold * 1000, limits.abort_amplitude * 1000, limits.force_limit)};
  if (!touch.changes.empty()) words.push_back(touch.changes.sentence());
  if (touch.changes.changes("wall.touch_stiffness")) words.push_back(growing_wall_words());
  return words;
}

std::vector<std::filesystem::path> write_device_stiffness(
    const std::vector<DeviceStiffnessResult>& results, const DeviceStiffnessSettings& settings,
    const TouchLimits& limits, const std::string& device, const Provenance& provenance,
    const std::filesystem::path& folder, const std::string& picture_ending) {
  base::make_folder(folder);
  const std::filesystem::path picture = folder / ("max_stiffness" + picture_ending);
  const std::filesystem::path csv = folder / "max_stiffness.csv",
                              touches = folder / "max_stiffness_touches.csv";
  report::Table table = device_stiffness_table(results);
  report::write_csv(table, csv);
  report::write_csv(device_touch_table(results), touches);
  report::Page page{"Largest stable stiffness (paper 1, Figs. 6 and 8)", {}};
  page.sections.push_back({"Result", device_stiffness_words(settings, limits, device), {table}, {}});
  const bool touched = std::any_of(results.begin(), results.end(), [](const DeviceStiffnessResult& result) {
    return !result.touches.empty();
  });
  if (touched)
    page.sections.back().pictures.push_back(
        {"Peak-to-peak oscillation of each touch over the stiffness of the wall", picture});
  page.sections.push_back(provenance_section(provenance));
  std::vector<std::filesystem::path> files = report::write_page(page, folder, "max_stiffness");
  files.insert(files.end(), {csv, touches});
  if (touched) {
    // Last: what has been measured must not be lost with a picture.
    draw(results, settings.touch.threshold, picture);
    files.push_back(picture);
  }
  return files;
}

}  // namespace kmax::experiment
