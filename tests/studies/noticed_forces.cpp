// What people notice of a wall's force: the walls of baselines.cpp by that.
#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/paper_numbers.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {

double noticed_force(const SubjectSet& set) {
  const double limit = set.device.force_limit;
  return noticed_share * (limit > 0.0 ? limit : experiment::paper::touch_force_limit);
}

namespace {
constexpr double finer_count = 5.5e-6;  // m
}  // namespace

NoticedWalls run_noticed_with_finer_encoder(const SubjectSet& set, const StiffnessRun& run) {
  const std::vector<Baseline> laws = law_baselines();
  NoticedWalls walls;
  std::vector<WallChange> changes;
  for (const std::string_view name : {"plain", "damping 8 N s/m, difference", "grows from 2 N/mm in 0.2 s"}) {
    const auto law = std::ranges::find(laws, name, &Baseline::name);
    walls.emplace_back(law->name, PeopleMean{});
    changes.push_back([wall = law->wall](TouchSetup& setup) {
      wall(setup);
      setup.wall.count_length = finer_count;
    });
  }
  StiffnessRun wide = run;
  wide.steps.growth = 0.03;
  wide.protocol.force_threshold = noticed_force(set);
  const std::vector<PeopleMean> found = sweep(set, changes, wide);
  for (std::size_t n = 0; n < walls.size(); ++n) walls[n].second = found[n];
  return walls;
}

report::Section noticed_section(const SubjectSet& set, const std::vector<BaselineResult>& results,
                                const NoticedWalls& finer) {
  const double band = noticed_force(set);
  const double count = experiment::touch_setup(set.device, {}, {}).wall.count_length;
  const auto flickers = [band](double length) { return n_per_mm(band / length); };
  experiment::MarkedMeans marks;
  report::Table table{"Largest stable stiffness, mean of the people, by the swing of the force that counts",
                      {"wall", "moves, N/mm", fmt::format("swings by {:g} N, N/mm", felt_force),
                       fmt::format("swings by {:.3g} N, N/mm", band),
                       fmt::format("swings by {:.3g} N, encoder of {:g} um, N/mm", band, finer_count * 1e6)},
                      {}};
  for (const BaselineResult& result : results) {
    const auto cell = [&](const PeopleMean& found, std::size_t column) {
      return marks.cell(found.mean, found.ends, set.subjects.size(),
                        fmt::format("{}, {}", result.law.name, table.columns[column]));
    };
    const auto fine = std::ranges::find(finer, result.law.name, &NoticedWalls::value_type::first);
    table.rows.push_back({result.law.name, cell(result.moves, 1), cell(result.feels, 2),
                          cell(result.notices, 3), fine == finer.end() ? "-" : cell(fine->second, 4)});
  }
  const auto more_than = [](const PeopleMean& found) {
    return found.ends.beyond_last > 0 ? "more than " : "";
  };
  const auto times = [&](const PeopleMean& most, const PeopleMean& plain) {
    return plain.mean > 0.0
               ? fmt::format("{}{:.1f} times the plain wall", more_than(most), most.mean / plain.mean)
               : std::string("where the plain wall holds none");
  };
  const auto by_mean = [](const PeopleMean& found) { return found.mean; };
  const BaselineResult& most = *std::ranges::max_element(
      results, {}, [&](const BaselineResult& result) { return by_mean(result.notices); });
  const auto& most_finer =
      *std::ranges::max_element(finer, {}, [&](const auto& wall) { return by_mean(wall.second); });
  report::Section section{
      fmt::format("What people notice ({})", experiment::clip_words(set.device)), {}, {}, {}};
  section.paragraphs = {
      fmt::format(
          "A force must differ by about {:g} % to be noticed: so much in matching forces of the arm (Jones "
          "1989, Perception 18, 681 to 687), 5 to 10 % in pinching at 2.5 to 10 N (Pang, Tan and Durlach "
          "1991, Perception and Psychophysics 49, 531 to 540). {:.3g} N is that of {:.3g} N, the most that "
          "the papers' device pushes with. Both are of forces that are held; a vibration in the skin's best "
          "range is felt far below, so that a wall that passes here may still buzz.",
          noticed_share * 100.0, band, band / noticed_share),
      fmt::format(
          "A flicker between two counts of {:g} um swings by {:.3g} N from {} N/mm on. So judged the plain "
          "wall holds {} N/mm, and {} the most of these walls, {}: {}. With counts of {:g} um, where that "
          "begins at {} N/mm, {} holds {}, {}.",
          count * 1e6, band, flickers(count), n_per_mm(results.front().notices.mean),
          more_than(most.notices) + n_per_mm(most.notices.mean), most.law.name,
          times(most.notices, results.front().notices), finer_count * 1e6, flickers(finer_count),
          most_finer.first, more_than(most_finer.second) + n_per_mm(most_finer.second.mean),
          times(most_finer.second, finer.front().second))};
  section.tables.push_back(std::move(table));
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

}  // namespace kmax::studies
