#include <fmt/format.h>

#include "host_tools/plot/figure.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {

// Those of the usual touches that end a search for the plain wall and for the field of 2 N.
constexpr std::array map_speeds{0.1, 0.5};  // m/s, intended
constexpr std::array map_pushes{0.6, 1.0};  // N
constexpr const char* by_position = "moves by 0.165 mm";
constexpr const char* by_force = "swings by 1 N";

LoopSetting rate_of(double rate) {
  return {fmt::format("{:g} Hz", rate), [rate](TouchSetup& setup) { setup.wall.tick_rate = rate; }};
}
LoopSetting delay_of(double delay) {
  return {fmt::format("{:g} ms of delay", delay * 1e3),
          [delay](TouchSetup& setup) { setup.device.delay = delay; }};
}
LoopSetting structure_of(double stiffness) {
  return {fmt::format("structure of {} N/mm", n_per_mm(stiffness)),
          [stiffness](TouchSetup& setup) { bend(setup.device, stiffness); }};
}

std::string short_cell(const PeopleMean& found) {
  return fmt::format("{}{}{:.1f}", found.ends.at_zero > 0 ? "<" : "", found.ends.beyond_last > 0 ? ">" : "",
                     found.mean / 1e3);
}

/// The map's place with the most that is stable by both criteria.
std::size_t best_of(const std::array<TwoMeans, map_dampings.size()>& found) {
  const auto best = std::max_element(found.begin(), found.end(), [](const auto& one, const auto& other) {
    return one.both.mean < other.both.mean;
  });
  return static_cast<std::size_t>(best - found.begin());
}

}  // namespace

std::vector<LoopSetting> loop_settings() {
  return {
      rate_of(500.0),      rate_of(1000.0),
      rate_of(2000.0),     {"encoder of 5.5 um", [](TouchSetup& setup) { setup.wall.count_length = 5.5e-6; }},
      delay_of(0.2e-3),    delay_of(0.5e-3),
      delay_of(1e-3),      structure_of(2310.0),
      structure_of(1020.0)};
}

std::vector<DampingMap> run_damping_map(const SubjectSet& set, const std::vector<LoopSetting>& settings,
                                        const StiffnessRun& run) {
  std::vector<WallChange> walls;
  for (const LoopSetting& setting : settings) {
    const auto add = [&](const WallChange& wall) {
      walls.push_back([&setting, wall](TouchSetup& setup) {
        setting.change(setup);
        wall(setup);
      });
    };
    for (const Baseline& law : {plain_wall(), field_of_two(), adaptive_as_printed()}) add(law.wall);
    for (const auto estimator : all_estimators)
      for (const double damping : map_dampings) add(damped(damping, estimator));
  }
  StiffnessRun moving = run;
  moving.steps = {.first = 200.0, .step = 10.0, .growth = 0.03, .last = 200e3};
  const std::vector<TwoMeans> found = sweep_by_both(set, walls, moving);
  std::vector<DampingMap> maps;
  std::size_t next = 0;
  for (const LoopSetting& setting : settings) {
    maps.push_back({setting, {}, {}});
    for (TwoMeans& law : maps.back().laws) law = found[next++];
    for (auto& row : maps.back().damped)
      for (TwoMeans& cell : row) cell = found[next++];
  }
  return maps;
}

report::Section damping_section(const SubjectSet& set, const std::vector<DampingMap>& maps) {
  report::Section section{
      fmt::format("Stiffness against damping ({})", experiment::clip_words(set.device)), {}, {}, {}};
  const DampingMap& usual = maps.front();
  for (const bool force : {false, true}) {
    report::Table table{fmt::format("Largest stable stiffness, N/mm, by damping in N s/m, {}, unstable: {}",
                                    usual.setting.name, force ? by_force : by_position),
                        {"estimator", "0"},
                        {}};
    for (const double damping : map_dampings) table.columns.push_back(fmt::format("{:g}", damping));
    for (std::size_t n = 0; n < all_estimators.size(); ++n) {
      const auto of = [&](const TwoMeans& found) { return short_cell(force ? found.feels : found.moves); };
      table.rows.push_back({estimator_name(all_estimators[n]), of(usual.laws[0])});
      for (const TwoMeans& found : usual.damped[n]) table.rows.back().push_back(of(found));
    }
    section.tables.push_back(std::move(table));
  }
  report::Table best{
      "Largest stiffness, N/mm, stable by both criteria; of a damped plain wall the best, with its damping "
      "in N s/m",
      {"loop and device", "plain", "field of 2 N", "adaptive, instant"},
      {}};
  for (const auto estimator : all_estimators) best.columns.push_back("damped, " + estimator_name(estimator));
  std::size_t damper_wins = 0;
  for (const DampingMap& map : maps) {
    best.rows.push_back({map.setting.name});
    for (const TwoMeans& law : map.laws) best.rows.back().push_back(short_cell(law.both));
    double most = 0.0;
    for (const auto& row : map.damped) {
      const std::size_t at = best_of(row);
      most = std::max(most, row[at].both.mean);
      best.rows.back().push_back(fmt::format("{} (B {:g})", short_cell(row[at].both), map_dampings[at]));
    }
    damper_wins += most > map.laws[1].both.mean ? 1 : 0;
  }
  section.tables.push_back(std::move(best));
  section.paragraphs = {
      fmt::format(
          "{} people, touches at {} m/s with {} N, in steps of 3 % from 0.2 N/mm. A row of the last table "
          "changes one thing of the first; a structure bends between motor and hand (20 of the 45 g behind "
          "it, 1 N s/m). One count of 55 um is 1 N at 18.2 N/mm: by the force more is found only where a "
          "handle comes to rest without flickering between two counts. The last table's means are of what "
          "each of the people can have by the criterion that gives it less.",
          set.subjects.size(), fmt::join(map_speeds, " and "), fmt::join(map_pushes, " and ")),
      fmt::format("The best damped plain wall, without any field, allows more than the field of 2 N in {} "
                  "of {} rows. \"<\" and \">\": some people count with 0, or with the last stiffness of the "
                  "search.",
                  damper_wins, maps.size())};
  return section;
}

report::Picture draw_damping_map(const DampingMap& map, const std::filesystem::path& file) {
  plot::Figure figure{fmt::format("Stiffness against damping, {}", map.setting.name), "damping (N s/m)", {}};
  figure.legend_beside = true;
  for (const bool force : {false, true}) {
    plot::Panel panel{fmt::format("N/mm, unstable: {}", force ? by_force : by_position), {}, {}};
    for (std::size_t n = 0; n < all_estimators.size(); ++n) {
      const auto of = [&](const TwoMeans& found) { return (force ? found.feels : found.moves).mean / 1e3; };
      plot::Series series{
          force ? "" : estimator_name(all_estimators[n]), {0.0}, {of(map.laws[0])}, false, true};
      for (std::size_t damping = 0; damping < map_dampings.size(); ++damping) {
        series.x.push_back(map_dampings[damping]);
        series.y.push_back(of(map.damped[n][damping]));
      }
      panel.series.push_back(std::move(series));
    }
    figure.panels.push_back(std::move(panel));
  }
  plot::write_figure(figure, file);
  return {figure.title + ": largest stable stiffness of a plain wall by velocity estimator.", file};
}

std::vector<report::Section> damping_map(const StudyInput& input) {
  StiffnessRun run = input.run;
  run.protocol.approach_speeds.assign(map_speeds.begin(), map_speeds.end());
  run.protocol.pushes.assign(map_pushes.begin(), map_pushes.end());
  const SubjectSet& set = input.sets.front();
  const std::vector<DampingMap> maps = run_damping_map(set, loop_settings(), run);
  for (const DampingMap& map : maps) {
    const auto keep = [&](const std::string& wall, const TwoMeans& found) {
      const std::string name = fmt::format("{}; {}", wall, map.setting.name);
      input.keep("damping", set, name, "position", found.moves);
      input.keep("damping", set, name, "force", found.feels);
    };
    const std::array laws{plain_wall(), field_of_two(), adaptive_as_printed()};
    for (std::size_t n = 0; n < laws.size(); ++n) keep(laws[n].name, map.laws[n]);
    for (std::size_t n = 0; n < all_estimators.size(); ++n)
      for (std::size_t at = 0; at < map_dampings.size(); ++at)
        keep(fmt::format("damping {:g} N s/m, {}", map_dampings[at], estimator_name(all_estimators[n])),
             map.damped[n][at]);
  }
  report::Section section = damping_section(set, maps);
  if (!input.folder.empty())
    section.pictures = {draw_damping_map(maps.front(), input.folder / "stiffness_against_damping.svg")};
  return {section};
}

}  // namespace kmax::studies
