#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/paper_numbers.hpp"
#include "tests/studies/audit.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {

using control::AdaptiveMode;
using control::AdaptiveRelation;
using control::VelocityEstimatorKind;
using Output = control::HapticLoop<float>::Output;

constexpr double priced_stiffness = 5500.0;  // N/m
constexpr double priced_speed = 0.2;         // m/s, intended

WallChange field(double coefficient, double length = 1e-3) {
  return [=](TouchSetup& setup) {
    setup.wall.wall.kind = coefficient > 0.0 ? control::WallKind::magnetic : control::WallKind::plain;
    setup.wall.wall.magnetic_coefficient = static_cast<float>(coefficient);
    setup.wall.wall.magnetic_length = static_cast<float>(length);
  };
}

/// Eq. 7 with a rest at the interval's lower end; the paper's slope, 1 N s/m, unless `velocity_max` differs.
struct Eq7 {
  AdaptiveMode mode = AdaptiveMode::instant;
  AdaptiveRelation relation = AdaptiveRelation::linear;
  double least = 0.8, most = 2.0;  // N
  double velocity_max = 2.4;       // m/s
  VelocityEstimatorKind estimator = control::HapticLoopConfig<float>().velocity.kind;

  void operator()(TouchSetup& setup) const {
    setup.wall.wall.kind = control::WallKind::adaptive;
    setup.wall.velocity.kind = estimator;
    auto& law = setup.wall.wall.adaptive;
    law.mode = mode;
    law.relation = relation;
    law.offset = law.force_min = static_cast<float>(least);
    law.force_max = static_cast<float>(most);
    law.velocity_max = static_cast<float>(velocity_max);
  }
};

WallChange both(WallChange one, WallChange other) {
  return [one = std::move(one), other = std::move(other)](TouchSetup& setup) {
    one(setup);
    other(setup);
  };
}

}  // namespace

double PassivityController::added(std::int64_t count, const Output& last) {
  const double position = static_cast<double>(count) * count_length_;
  const double moved = position - position_;
  position_ = position;
  given_ += static_cast<double>(last.force - last.magnetic_force) * moved;
  if (position > 0.0) given_ = 0.0;
  const double excess = given_ + 0.5 * stored_stiffness_ * position * position;
  if (position > 0.0 || !(excess > 0.0) || moved == 0.0) return 0.0;
  return -std::min(excess * period_ / (moved * moved), most_) * moved / period_;
}

WallChange damped(double damping, VelocityEstimatorKind estimator) {
  return [=](TouchSetup& setup) {
    setup.wall.wall.damping = static_cast<float>(damping);
    setup.wall.velocity.kind = estimator;
  };
}

WallChange passivity_controlled(double most, bool keeps_spring) {
  return [=](TouchSetup& change) {
    change.added_force = [=](const TouchSetup& setup) -> experiment::AddedForce {
      PassivityController controller(setup.wall.count_length, 1.0 / setup.wall.tick_rate, most,
                                     keeps_spring ? static_cast<double>(setup.wall.wall.stiffness) : 0.0);
      return [controller](std::int64_t count, const Output& last) mutable {
        return controller.added(count, last);
      };
    };
  };
}

Baseline plain_wall() {
  return {"plain", field(0.0), &experiment::paper::max_stiffness[0]};
}
Baseline field_of_two() {
  return {"field of 2 N", field(2.0), &experiment::paper::max_stiffness[1]};
}
Baseline adaptive_as_printed() {
  return {"adaptive, instant", Eq7{}, &experiment::paper::max_stiffness[2]};
}

std::vector<Baseline> law_baselines() {
  constexpr auto difference = VelocityEstimatorKind::difference;
  std::vector<Baseline> laws;
  const auto add = [&](std::string family, std::vector<Baseline> walls) {
    for (Baseline& wall : walls) {
      wall.family = family;
      laws.push_back(std::move(wall));
    }
  };
  add("plain", {plain_wall()});
  add("field of 2 N", {field_of_two(), {"field of 2 N, x_0 = 5 mm", field(2.0, 5e-3)}});
  add("adaptive",
      {adaptive_as_printed(),
       {"adaptive, V_max = 0.24 m/s, difference", Eq7{.velocity_max = 0.24, .estimator = difference}}});
  for (const double damping : {4.0, 8.0, 12.0, 16.0})
    add("damping, difference",
        {{fmt::format("damping {:g} N s/m, difference", damping), damped(damping, difference)}});
  for (const auto estimator :
       {VelocityEstimatorKind::low_pass, VelocityEstimatorKind::foaw, VelocityEstimatorKind::foaw_end_fit,
        VelocityEstimatorKind::tracking, VelocityEstimatorKind::edge_period})
    add("damping, other estimators",
        {{fmt::format("damping 8 N s/m, {}", estimator_name(estimator)), damped(8.0, estimator)}});
  add("field and damping",
      {{"field of 2 N, damping 8 N s/m, difference", both(field(2.0), damped(8.0, difference))}});
  add("growing", {{"grows from 2 N/mm in 0.2 s", growing(2000.0, 0.2, 0.0)},
                  {"grows from 3 N/mm in 0.2 s, damping 6 N s/m", growing(3000.0, 0.2, 6.0)}});
  add("growing, field", {{"grows from 3 N/mm in 0.2 s, damping 6 N s/m, field of 2 N",
                          both(growing(3000.0, 0.2, 6.0), field(2.0))}});
  add("passivity",
      {{"passivity controller, alpha <= 15 N s/m", passivity_controlled(15.0, false)},
       {"passivity controller against the spring's energy", passivity_controlled(15.0, true)},
       {"field of 2 N, against the spring's energy", both(field(2.0), passivity_controlled(15.0, true))}});
  return laws;
}

std::vector<Baseline> relation_baselines() {
  std::vector<Baseline> laws;
  for (const auto& [relation, name] :
       {std::pair{AdaptiveRelation::linear, "linear"}, std::pair{AdaptiveRelation::square, "square"},
        std::pair{AdaptiveRelation::square_root, "square root"}}) {
    for (const auto& [mode, how] :
         {std::pair{AdaptiveMode::instant, "instant"}, std::pair{AdaptiveMode::latched, "latched"},
          std::pair{AdaptiveMode::peak_hold, "peak_hold"}})
      laws.push_back({fmt::format("{}, {}, 0.8 to 2 N", name, how), Eq7{.mode = mode, .relation = relation}});
  }
  for (const auto& [least, most] : {std::pair{0.0, 2.0}, std::pair{0.4, 2.0}, std::pair{0.8, 1.4},
                                    std::pair{0.8, 3.0}, std::pair{1.2, 2.0}, std::pair{1.6, 2.0}})
    laws.push_back(
        {fmt::format("linear, instant, {:g} to {:g} N", least, most), Eq7{.least = least, .most = most}});
  return laws;
}

WallPrice price_of(const SubjectSet& set, const WallChange& wall, double stiffness) {
  WallPrice price;
  const auto people = static_cast<double>(set.subjects.size());
  for (const experiment::Subject& subject : set.subjects) {
    TouchSetup setup = experiment::touch_setup(set.device, subject.person, {});
    wall(setup);
    setup.motion.approach_speed = priced_speed;
    setup.wall.wall.stiffness = static_cast<float>(stiffness);
    const WallPrice paid = experiment::price_of(setup);
    price.depth += paid.depth / people;
    price.work += paid.work / people;
    price.field_at_rest += paid.field_at_rest / people;
    price.rate_hardness += paid.rate_hardness / people;
    price.peak_force += paid.peak_force / people;
    price.touch_work += paid.touch_work / people;
  }
  return price;
}

std::vector<BaselineResult> run_baselines(const SubjectSet& set, const std::vector<Baseline>& laws,
                                          const StiffnessRun& run) {
  std::vector<WallChange> walls;
  for (const Baseline& law : laws) walls.push_back(law.wall);
  std::vector<TouchProtocol> protocols = by_both(run);
  protocols.push_back(run.protocol);
  protocols.back().phases = 4;
  protocols.push_back(run.protocol);
  protocols.back().force_threshold = noticed_force(set);
  const auto found = sweep(set, walls, protocols, run);
  std::vector<BaselineResult> results;
  for (std::size_t n = 0; n < laws.size(); ++n)
    results.push_back({laws[n], found[0][n], found[2][n], found[1][n],
                       smaller_of_each(found[0][n], found[1][n]), found[3][n],
                       price_of(set, laws[n].wall, priced_stiffness)});
  return results;
}

namespace {

report::Table baseline_table(std::string caption, const SubjectSet& set,
                             const std::vector<BaselineResult>& results, experiment::MarkedMeans& marks) {
  report::Table table{std::move(caption),
                      {"wall", "moves, N/mm", "moves, 4 phases, N/mm", "swings by 1 N, N/mm", "both, N/mm",
                       "field at rest, N", "work on the way in, mJ", "work over the touch, mJ",
                       "peak force, N", "deepest, mm", "rate-hardness, N/mm", "rated by people"},
                      {}};
  for (const BaselineResult& result : results) {
    const auto cell = [&](const PeopleMean& found, const char* which) {
      return fmt::format("{} ± {}",
                         marks.cell(found.mean, found.ends, set.subjects.size(),
                                    fmt::format("{}, {}", result.law.name, which)),
                         n_per_mm(experiment::mean_interval(found.people)));
    };
    table.rows.push_back(
        {result.law.name, cell(result.moves, "moves"), cell(result.phases, "4 phases"),
         cell(result.feels, "swings"), cell(result.both, "both"),
         fmt::format("{:.2f}", result.price.field_at_rest), fmt::format("{:.2f}", result.price.work * 1e3),
         fmt::format("{:.2f}", result.price.touch_work * 1e3), fmt::format("{:.2f}", result.price.peak_force),
         fmt::format("{:.2f}", result.price.depth * 1e3), n_per_mm(result.price.rate_hardness),
         result.law.paper ? fmt::format("{:g}", result.law.paper->transparency) : "-"});
  }
  return table;
}

/// Costs no more in any way, and allows as much by both criteria, one of them more.
bool beats(const BaselineResult& one, const BaselineResult& other) {
  // A mean of a dozen people moves in steps of 8 N/m; half a step of the search is no difference.
  constexpr double same = 50.0;  // N/m
  constexpr double same_field = 0.01, same_work = 1e-5, same_depth = 1e-5;
  return one.price.field_at_rest <= other.price.field_at_rest + same_field &&
         one.price.work <= other.price.work + same_work &&
         one.price.depth <= other.price.depth + same_depth &&
         one.price.rate_hardness >= 0.99 * other.price.rate_hardness &&
         one.moves.mean >= other.moves.mean - same && one.feels.mean >= other.feels.mean - same &&
         one.moves.mean + one.feels.mean > other.moves.mean + other.feels.mean + 2.0 * same;
}

std::string front_words(const std::vector<BaselineResult>& results) {
  std::vector<std::string> front;
  for (const BaselineResult& one : results) {
    if (std::none_of(results.begin(), results.end(), [&](const auto& other) { return beats(other, one); }))
      front.push_back(one.law.name);
  }
  return fmt::format(
      "Not beaten, which is by a wall that allows as much by both criteria, costs no more field and no more "
      "work, lets nobody deeper in and meets the hand as hard: {}.",
      fmt::join(front, "; "));
}

/// Do work and field put the walls in the order that the paper's people did?
std::string rating_words(const std::vector<BaselineResult>& results) {
  std::vector<const BaselineResult*> rated;
  for (const BaselineResult& result : results)
    if (result.law.paper) rated.push_back(&result);
  std::sort(rated.begin(), rated.end(), [](const auto* one, const auto* other) {
    return one->law.paper->transparency > other->law.paper->transparency;
  });
  const auto rises = [&](double WallPrice::*cost) {
    return std::is_sorted(rated.begin(), rated.end(), [&](const auto* one, const auto* other) {
      return one->price.*cost < other->price.*cost;
    });
  };
  return fmt::format(
      "Transparency was rated by people (paper 1, Figs. 7 and 8), and nothing here computes a rating. What a "
      "wall costs is the field's force on a handle at rest on the surface and the work against it on the way "
      "in. The paper's three ratings fall as the field at rest rises: {}; as the work rises: {}.",
      rises(&WallPrice::field_at_rest) ? "yes" : "no", rises(&WallPrice::work) ? "yes" : "no");
}

const BaselineResult& named(const std::vector<BaselineResult>& results, std::string_view name) {
  return *std::find_if(results.begin(), results.end(), [&](const auto& one) { return one.law.name == name; });
}

}  // namespace

report::Section baseline_section(const SubjectSet& set, const std::vector<BaselineResult>& results) {
  experiment::MarkedMeans marks;
  report::Section section{
      fmt::format("Baselines, and what they cost ({})", experiment::clip_words(set.device)), {}, {}, {}};
  section.tables.push_back(baseline_table(
      "Largest stable stiffness, mean of the people with its 95 % interval, and what the wall costs", set,
      results, marks));
  const BaselineResult& field = named(results, "field of 2 N");
  const BaselineResult& damper = named(results, "damping 8 N s/m, difference");
  section.paragraphs = {
      fmt::format(
          "A wall counts as unstable when the handle moves by more than 0.165 mm, or when its force swings "
          "by more than {:g} N. With 4 phases every touch is made four times, meeting the surface at other "
          "times within a sample. 'Both' is the mean of what each of the people can have by the one of "
          "position and force that gives it less. Costs are of one touch of {} N/mm at {:g} m/s. {:g} N is "
          "our own choice, three tenths of what the papers' device can push with; what people notice is in "
          "the next section.",
          felt_force, n_per_mm(priced_stiffness), priced_speed, felt_force),
      fmt::format(
          "Peak force is the most that wall and field push with until the end of the hold; the work over the "
          "touch is what the hand has put in against them by then: stored in the spring, or taken by a "
          "damper. Below 0 an oscillating wall has given more than it took; the plain wall allows {} N/mm. "
          "Rate-hardness (Lawrence, Pao, Dougherty, Salada, Pavlou 2000) is how fast the force rises in the "
          "first 4 ms after the contact, for each m/s of the handle's speed there; below 0 a damper or field "
          "has pushed more at the contact than the wall does 4 ms later.",
          n_per_mm(results.front().moves.mean)),
      fmt::format(
          "Damping of 8 N s/m without any field allows {} N/mm, the paper's 2 N field {}; by the force that "
          "swings {} and {}.",
          n_per_mm(damper.moves.mean), n_per_mm(field.moves.mean), n_per_mm(damper.feels.mean),
          n_per_mm(field.feels.mean)),
      front_words(results),
      rating_words(results),
      "The passivity controller (Hannaford and Ryu 2002) damps with at most alpha once the wall has given "
      "more energy than it took; against the spring's energy, once it has given more than the spring would "
      "hold. It is not in the firmware."};
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

report::Section relation_section(const SubjectSet& set, const std::vector<BaselineResult>& results) {
  constexpr std::string_view chosen = "linear, instant, 0.8 to 2 N";
  experiment::MarkedMeans marks;
  report::Section section{
      fmt::format("Relation and interval of eq. 7 ({})", experiment::clip_words(set.device)), {}, {}, {}};
  section.tables.push_back(
      baseline_table("The adaptive wall by relation, mode and interval of F_MC", set, results, marks));
  section.tables.front().columns.pop_back();
  for (auto& row : section.tables.front().rows) row.pop_back();
  const auto found = [&](std::string_view name) { return n_per_mm(named(results, name).moves.mean); };
  std::vector<std::string> better;
  for (const BaselineResult& one : results)
    if (beats(one, named(results, chosen))) better.push_back(one.law.name);
  section.paragraphs = {
      "The paper tried a linear, a square and a square-root relation, chose the linear one and calls [0.8, "
      "2.0] N the best interval; it prints no numbers of the others and does not say what best means.",
      fmt::format(
          "Instant, from 0.8 to 2 N: linear {}, square {}, square root {} N/mm. V_k stays below 0.3 at these "
          "speeds, where the square hardly leaves 0.8 N and the square root rises most, which costs more "
          "work on the way in.",
          found(chosen), found("square, instant, 0.8 to 2 N"), found("square root, instant, 0.8 to 2 N")),
      fmt::format(
          "Linear and instant, up to 2 N: {} N/mm from 0 N, {} from 0.8, {} from 1.6; from 0.8 N up to 1.4 N "
          "{}, up to 3 N {}. The lower end decides and is paid for as a field at rest; the upper one is "
          "reached at 1.2 m/s only. Better than {} by both criteria at no higher cost: {}. So stiffness and "
          "cost do not single the paper's interval out.",
          found("linear, instant, 0 to 2 N"), found(chosen), found("linear, instant, 1.6 to 2 N"),
          found("linear, instant, 0.8 to 1.4 N"), found("linear, instant, 0.8 to 3 N"), chosen,
          better.empty() ? "none of these" : fmt::format("{}", fmt::join(better, "; ")))};
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

plot::Figure price_front(const SubjectSet& set, const std::vector<BaselineResult>& results) {
  struct Price {
    const char* label;
    double WallPrice::*value;
    double scale;
  };
  plot::Figure figure{fmt::format("What a stiff wall costs ({})", experiment::clip_words(set.device)),
                      "largest stiffness, stable by both criteria (N/mm)",
                      {}};
  figure.legend_beside = true;
  for (const Price& price : {Price{"deepest (mm)", &WallPrice::depth, 1e3},
                             Price{"rate-hardness (N/mm)", &WallPrice::rate_hardness, 1e-3},
                             Price{"field at rest (N)", &WallPrice::field_at_rest, 1.0},
                             Price{"peak force (N)", &WallPrice::peak_force, 1.0},
                             Price{"work over the touch (mJ)", &WallPrice::touch_work, 1e3}}) {
    plot::Panel panel{price.label, {}, {}};
    std::string_view family;
    for (const BaselineResult& result : results) {
      if (result.law.family != family || panel.series.empty())
        panel.series.push_back({figure.panels.empty() ? result.law.family : "", {}, {}, false, true});
      family = result.law.family;
      panel.series.back().x.push_back(result.both.mean / 1e3);
      panel.series.back().y.push_back(result.price.*price.value * price.scale);
    }
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

namespace {

void keep(const StudyInput& input, std::string_view study, const SubjectSet& set,
          const std::vector<BaselineResult>& results) {
  for (const BaselineResult& result : results) {
    input.keep(study, set, result.law.name, "position", result.moves);
    input.keep(study, set, result.law.name, "position, 4 phases", result.phases);
    input.keep(study, set, result.law.name, "force", result.feels);
    input.keep(study, set, result.law.name, "force that is noticed", result.notices);
  }
}

}  // namespace

std::vector<report::Section> baselines(const StudyInput& input) {
  std::vector<report::Section> sections;
  std::vector<std::pair<const SubjectSet*, std::vector<BaselineResult>>> of_sets;
  for (const SubjectSet& set : input.sets) {
    of_sets.emplace_back(&set, run_baselines(set, law_baselines(), input.run));
    const std::vector<BaselineResult>& results = of_sets.back().second;
    keep(input, "baselines", set, results);
    sections.push_back(baseline_section(set, results));
    if (!input.folder.empty()) {
      const std::filesystem::path file =
          input.folder /
          fmt::format("price_of_stiffness_{}.svg", set.device.force_limit > 0.0 ? "clipped" : "unclipped");
      const plot::Figure figure = price_front(set, results);
      plot::write_figure(figure, file);
      sections.back().pictures = {{figure.title +
                                       ": the further right, the stiffer; shallow, hard and without a field "
                                       "is better.",
                                   file}};
    }
    const NoticedWalls finer = run_noticed_with_finer_encoder(set, input.run);
    for (const auto& [name, found] : finer)
      input.keep("baselines", set, name, "force that is noticed, encoder of 5.5 um", found);
    sections.push_back(noticed_section(set, results, finer));
    const std::vector<BaselineResult> relations = run_baselines(set, relation_baselines(), input.run);
    keep(input, "relations", set, relations);
    sections.push_back(relation_section(set, relations));
  }
  const auto with_limit = [&](bool limited) {
    return std::ranges::find_if(
        of_sets, [&](const auto& of) { return limited == (of.first->device.force_limit > 0.0); });
  };
  const auto clipped = with_limit(true), unclipped = with_limit(false);
  if (clipped == of_sets.end() || unclipped == of_sets.end()) return sections;
  const AuditComparison comparison =
      compare_with_audit(*clipped->first, clipped->second, unclipped->second, input.run);
  for (const ReadResult& one : comparison.readings) {
    const std::string wall = fmt::format("{}; {}", one.reading.law, one.reading.what);
    input.keep("audit", *clipped->first, wall, "position", one.moves);
    input.keep("audit", *clipped->first, wall, "force", one.feels);
  }
  sections.push_back(audit_section(comparison));
  return sections;
}

}  // namespace kmax::studies
