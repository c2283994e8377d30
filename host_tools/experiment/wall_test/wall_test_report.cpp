#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "host_tools/base/files.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/experiment/wall_test/wall_test.hpp"
#include "host_tools/plot/figure.hpp"

namespace kmax::experiment {

namespace {

std::string share_text(std::size_t hits, std::size_t trials) {
  return trials == 0 ? "not judged" : fmt::format("{} of {}", hits, trials);
}

std::string interval_text(const WallCell& cell) {
  if (cell.touches == 0) return "-";
  const ShareInterval interval = cell.interval();
  return fmt::format("{:.0f} to {:.0f} %", interval.low * 100, interval.high * 100);
}

std::string scaled(const std::optional<double>& value, double scale, int digits) {
  return value ? fmt::format("{:.{}f}", *value * scale, digits) : "-";
}

std::string file_part(TouchKind kind) {
  std::string name(to_string(kind));
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

report::Table touch_table(const WallTestResult& result) {
  report::Table table{
      "",
      {"stiffness_n_per_m", "touch", "number", "stable_by_position", "stable_by_force", "position_swing_m",
       "force_swing_n", "contact_speed_m_per_s", "deepest_m", "rate_hardness_n_per_m", "peak_force_n",
       "settling_s", "pulse_time_s", "limited_share", "aborted_at_s", "lost_records"},
      {}};
  const auto text = [](const std::optional<double>& value) { return value ? fmt::format("{}", *value) : ""; };
  for (const WallTouch& touch : result.touches) {
    const auto verdict = [&](bool stable) { return std::string(!touch.counts() ? "" : stable ? "1" : "0"); };
    table.rows.push_back({fmt::format("{}", touch.stiffness), std::string(to_string(touch.kind)),
                          fmt::format("{}", touch.number), verdict(touch.stable_by_position),
                          verdict(touch.stable_by_force), fmt::format("{}", touch.position_swing),
                          fmt::format("{}", touch.force_swing), fmt::format("{}", touch.contact_speed),
                          fmt::format("{}", touch.deepest), text(touch.rate_hardness),
                          fmt::format("{}", touch.peak_force), text(touch.settling), text(touch.pulse_time),
                          fmt::format("{}", touch.limited_share), text(touch.aborted_at),
                          fmt::format("{}", touch.lost_records)});
  }
  return table;
}

/// Every sample of every touch of a kind.
std::string trace_csv(const WallTestResult& result, TouchKind kind) {
  std::string text = "stiffness_n_per_m,number,time_s,outside_distance_m,force_n\n";
  for (const WallTouch& touch : result.touches) {
    if (touch.kind != kind) continue;
    for (const RigSample& sample : touch.samples)
      text += fmt::format("{},{},{:.6f},{:.7f},{:.5g}\n", touch.stiffness, touch.number, sample.time,
                          sample.outside_distance, sample.force);
  }
  return text;
}

void draw(const WallTestResult& result, const std::filesystem::path& picture) {
  plot::Figure figure;
  figure.title = "Stable touches by both criteria";
  figure.x_label = "stiffness (N/mm)";
  figure.legend_beside = true;
  plot::Panel panel;
  panel.y_label = "share that is stable (%)";
  panel.y_limits = {-5.0, 105.0};
  for (const TouchKind kind : touch_kinds) {
    plot::Series series;
    series.label = std::string(to_string(kind));
    series.points = true;
    for (const WallCell& cell : result.cells) {
      if (cell.kind != kind || cell.touches == 0) continue;
      series.x.push_back(cell.stiffness / 1e3);
      series.y.push_back(100.0 * static_cast<double>(cell.stable_by(StabilityCriterion::both)) /
                         static_cast<double>(cell.touches));
    }
    if (!series.x.empty()) panel.series.push_back(std::move(series));
  }
  figure.panels = {std::move(panel)};
  plot::write_figure(figure, picture);
}

}  // namespace

std::vector<std::string> wall_test_words(const WallTestResult& result) {
  const WallTestSettings& settings = result.settings;
  std::vector<std::string> words = {
      fmt::format(
          "Wall of law '{}' at {:g} Hz, touched at each stiffness in {} ways, {} each: slow (intended {:g} "
          "m/s), fast ({:g} m/s), with a pulse, and let go. It is held for {:g} s.",
          result.law, result.haptic_rate, touch_kinds.size(), touch_words(settings.repeats), settings.slow,
          settings.fast, settings.hold_time),
      fmt::format(
          "Pulse: {:g} s after the touch the device adds +{:g} N and then -{:g} N to the wall's force, for "
          "{:g} ms each or as long as its link takes{}. Let go: the hand opens at that time; a handle that "
          "has left the wall then and stands still outside counts as stable.",
          settings.event_time(), settings.pulse_force, settings.pulse_force, settings.pulse_time * 1e3,
          [&] {
            double longest = 0.0;
            for (const WallTouch& touch : result.touches)
              longest = std::max(longest, touch.pulse_time.value_or(0.0));
            return longest > 0.0 ? fmt::format(" ({:.0f} ms at most here)", longest * 1e3) : std::string();
          }()),
      fmt::format(
          "Unstable by position: more than {:g} mm peak to peak in every quarter of the last second of the "
          "hold; by force: more than {:g} N. Neither paper gives a measure: the first is three counts of "
          "paper 1's device, the second our own choice, since a stiff wall swings by newtons while it moves "
          "by less than that. A touch is stable if it is by both.",
          settings.threshold * 1e3, settings.force_threshold)};
  words.emplace_back(
      "The trace has at most 500 records a second and whole counts of the encoder, and the force has its "
      "limit: rate-hardness is what these let pass of the stiffness.");
  if (result.grows) words.push_back(growing_wall_words());
  if (!settings.changes.empty()) words.push_back(settings.changes.sentence());
  return words;
}

report::Table limit_table(const WallTestResult& result) {
  report::Table table{"Largest stiffness that is stable in all touches, as all smaller ones are",
                      {"touch", "by position", "by force", "by both"},
                      {}};
  const auto add = [&](const std::string& name, const std::optional<TouchKind>& kind) {
    std::vector<std::string> row{name};
    for (const StabilityCriterion criterion : stability_criteria)
      row.push_back(limit_text(stable_limit(result.cells, criterion, kind)));
    table.rows.push_back(std::move(row));
  };
  for (const TouchKind kind : touch_kinds) add(std::string(to_string(kind)), kind);
  add("all", {});
  return table;
}

report::Table verdict_table(const WallTestResult& result) {
  report::Table table{"Stable touches, with the 95 % confidence interval of their share (Wilson)",
                      {"touch", "N/mm", "stable", "95 %", "by position", "by force", "aborted"},
                      {}};
  for (const WallCell& cell : result.cells)
    table.rows.push_back({std::string(to_string(cell.kind)), fmt::format("{:g}", cell.stiffness / 1e3),
                          share_text(cell.stable_by(StabilityCriterion::both), cell.touches),
                          interval_text(cell),
                          share_text(cell.stable_by(StabilityCriterion::position), cell.touches),
                          share_text(cell.stable_by(StabilityCriterion::force), cell.touches),
                          fmt::format("{}", cell.aborted)});
  return table;
}

report::Table measure_table(const WallTestResult& result) {
  report::Table table{
      "Speed at contact and rate-hardness (the rise of the force over the first 4 ms, over their time and "
      "that speed): median. Depth, force and time to settle: the largest; -: not settled, or nothing to "
      "settle",
      {"touch", "N/mm", "speed (m/s)", "deepest (mm)", "rate-hardness (N/mm)", "peak force (N)",
       "limited (%)", "settles (s)"},
      {}};
  for (const WallCell& cell : result.cells) {
    const bool any = cell.touches > 0;
    const auto number = [any](double value, int digits) {
      return any ? fmt::format("{:.{}f}", value, digits) : std::string("-");
    };
    table.rows.push_back({std::string(to_string(cell.kind)), fmt::format("{:g}", cell.stiffness / 1e3),
                          number(cell.contact_speed, 2), number(cell.deepest * 1e3, 2),
                          scaled(cell.rate_hardness, 1e-3, 1), number(cell.peak_force, 2),
                          number(cell.limited_share * 100, 1), scaled(cell.settling, 1.0, 2)});
  }
  return table;
}

std::vector<std::filesystem::path> write_wall_test(const WallTestResult& result, const Provenance& provenance,
                                                   const std::filesystem::path& folder,
                                                   const std::string& picture_ending) {
  base::make_folder(folder);
  const std::filesystem::path picture = folder / ("wall_test" + picture_ending);
  std::vector<std::string> words = wall_test_words(result);
  if (result.origin != report::Origin::measured)
    words.emplace_back(
        "Device and person are simulated. The person touches always in the same way; only the moment within "
        "a sample differs from touch to touch, so that the intervals are those of that moment alone.");
  report::Page page{"Wall test", {}};
  page.sections.push_back(
      {"Result",
       std::move(words),
       {limit_table(result), verdict_table(result), measure_table(result)},
       {{"Share of the touches that is stable by both criteria, over the stiffness, for each "
         "kind of touch",
         picture}}});
  page.sections.push_back(provenance_section(provenance));
  std::vector<std::filesystem::path> files = report::write_page(page, folder, "wall_test");
  files.push_back(folder / "wall_test_touches.csv");
  report::write_csv(touch_table(result), files.back());
  for (const TouchKind kind : touch_kinds) {
    files.push_back(folder / fmt::format("wall_test_{}.csv", file_part(kind)));
    base::write_file(files.back(), trace_csv(result, kind));
  }
  // Last: what has been measured must not be lost with a picture.
  draw(result, picture);
  files.push_back(picture);
  return files;
}

}  // namespace kmax::experiment
