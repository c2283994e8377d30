#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host_tools/experiment/wilson_interval.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {

using Kind = control::VelocityEstimatorKind;
constexpr auto difference = Kind::difference;
constexpr std::string_view finer_encoder = "5.5 um", damper_alone = "damping 8 N s/m";
constexpr std::uint32_t drawn_seed = 5;
constexpr std::size_t drawn_count = 200;

/// Evenly by the logarithm, from bits that are the same with every standard library.
double drawn(std::mt19937& random, double from, double to) {
  const double share = static_cast<double>(random()) / 4294967296.0;
  return from * std::exp(share * std::log(to / from));
}

std::string growing_name(double touch_stiffness, double growth_time, double damping) {
  return fmt::format("grows from {:g} N/mm in {:g} s{}", touch_stiffness / 1e3, growth_time,
                     damping > 0.0 ? fmt::format(", damping {:g} N s/m", damping) : "");
}

}  // namespace

WallChange growing(double touch_stiffness, double growth_time, double damping,
                   control::VelocityEstimatorKind calm_by) {
  return [=](TouchSetup& setup) {
    setup.wall.velocity = {.kind = calm_by};
    setup.wall.wall.growing.touch_stiffness = static_cast<float>(touch_stiffness);
    setup.wall.wall.growing.growth_time = static_cast<float>(growth_time);
    setup.wall.wall.damping = static_cast<float>(damping);
    setup.wall.damping_window = 1;
  };
}

void pulse(TouchSetup& setup) {
  setup.added_force = [](const TouchSetup& made) -> experiment::AddedForce {
    return [period = 1.0 / made.wall.tick_rate, since = -1.0](
               std::int64_t, const control::HapticLoop<float>::Output& last) mutable {
      if (since >= 0.0 || last.inside) since = std::max(since, 0.0) + period;
      if (since >= 1.9 && since < 1.92) return -1.5;
      return since >= 2.05 && since < 2.07 ? 1.5 : 0.0;
    };
  };
}

std::vector<LoopSetting> growing_situations() {
  return {{"usual", [](TouchSetup&) {}},
          {"pulses", pulse},
          {"0.5 ms of delay", [](TouchSetup& setup) { setup.device.delay = 0.5e-3; }},
          {"structure of 2.31 N/mm", [](TouchSetup& setup) { bend(setup.device, 2310.0); }},
          {"structure of 1.02 N/mm", [](TouchSetup& setup) { bend(setup.device, 1020.0); }},
          {std::string(finer_encoder), [](TouchSetup& setup) { setup.wall.count_length = 5.5e-6; }},
          {"1 kHz", [](TouchSetup& setup) { setup.wall.tick_rate = 1000.0; }}};
}

/// Whatever it comes to.
WallChange at_any_stiffness(const WallChange& wall) {
  return [wall](TouchSetup& setup) {
    wall(setup);
    setup.least_rendered_share = 0.0;
  };
}

/// N/m, with each one's own largest stiffness, mean of all touches.
double rendered_stiffness(const SubjectSet& set, const WallChange& wall, const PeopleMean& found,
                          const StiffnessRun& run) {
  double sum = 0.0;
  for (std::size_t n = 0; n < set.subjects.size(); ++n) {
    TouchSetup setup = experiment::touch_setup(set.device, set.subjects[n].person, {});
    wall(setup);
    setup.wall.wall.stiffness = static_cast<float>(found.people[n].stiffness);
    for (const double speed : run.protocol.approach_speeds)
      for (const double push : run.protocol.pushes) {
        setup.motion.approach_speed = speed;
        setup.motion.push_force = push;
        std::vector<experiment::TouchSample> to_the_end;
        sum += simulate_touch(setup, &to_the_end).rendered_share * found.people[n].stiffness;
      }
  }
  return sum / static_cast<double>(set.subjects.size() * run.protocol.approach_speeds.size() *
                                   run.protocol.pushes.size());
}

std::vector<SeemingResult> run_seeming_walls(const SubjectSet& set, const StiffnessRun& run) {
  std::vector<SeemingResult> results;
  std::vector<WallChange> walls;
  for (const auto& [touch, time, damping] : {std::tuple{2000.0, 0.2, 0.0}, std::tuple{2000.0, 0.4, 6.0}})
    for (const Kind kind : {Kind::foaw, difference}) {
      results.push_back({growing_name(touch, time, damping), std::string(estimator_name(kind)), {}, 0.0});
      walls.push_back(at_any_stiffness(growing(touch, time, damping, kind)));
    }
  const std::vector<TwoMeans> found = sweep_by_both(set, walls, run);
  for (std::size_t n = 0; n < results.size(); ++n) {
    results[n].stable = found[n].both;
    results[n].rendered = rendered_stiffness(set, walls[n], found[n].both, run);
  }
  return results;
}

std::vector<GrowingResult> run_growing_walls(const SubjectSet& set, const StiffnessRun& run) {
  std::vector<Baseline> laws{
      plain_wall(), field_of_two(), {std::string(damper_alone), damped(8.0, difference)}};
  for (const double touch : {2000.0, 3000.0})
    for (const double time : {0.2, 0.4})
      for (const double damping : {0.0, 6.0})
        laws.push_back({growing_name(touch, time, damping), growing(touch, time, damping)});
  std::vector<WallChange> walls;
  const std::vector<LoopSetting> situations = growing_situations();
  for (const Baseline& law : laws)
    for (const LoopSetting& situation : situations)
      walls.push_back([law, situation](TouchSetup& setup) {
        law.wall(setup);
        situation.change(setup);
      });
  const std::vector<TwoMeans> found = sweep_by_both(set, walls, run);
  std::vector<GrowingResult> results;
  std::size_t next = 0;
  for (const Baseline& law : laws) {
    results.push_back({law.name, {}});
    for (std::size_t n = 0; n < situations.size(); ++n, ++next)
      results.back().situations.push_back(found[next]);
  }
  return results;
}

namespace {
/// What a finer encoder gives the walls that grow.
std::string finer_encoder_words(const std::vector<GrowingResult>& walls) {
  const std::vector<LoopSetting> situations = growing_situations();
  const auto at = static_cast<std::size_t>(std::ranges::find(situations, finer_encoder, &LoopSetting::name) -
                                           situations.begin());
  const GrowingResult* best = nullptr;
  for (const GrowingResult& wall : walls)
    if (wall.wall.starts_with("grows") &&
        (best == nullptr || wall.situations[at].both.mean > best->situations[at].both.mean))
      best = &wall;
  const PeopleMean& most = best->situations[at].both;
  const double usual = best->situations.front().both.mean, plain = walls.front().situations[at].both.mean;
  const std::string_view more = most.ends.beyond_last > 0 ? "more than " : "";
  return fmt::format(
      "With an encoder of {} the wall that {} holds {}{} N/mm, {}{:.1f} times the plain wall with that "
      "encoder.{}",
      finer_encoder, best->wall, more, n_per_mm(most.mean), more, plain > 0.0 ? most.mean / plain : 0.0,
      most.mean > 2.0 * usual
          ? " So the count bounds this wall: a handle that rests at the edge of one shakes "
            "the wall out of its calm."
          : "");
}
}  // namespace

report::Section growing_section(const SubjectSet& set, const std::vector<GrowingResult>& walls,
                                const std::vector<SeemingResult>& seeming) {
  report::Section section{
      fmt::format("Walls that grow while the contact is calm ({})", experiment::clip_words(set.device)),
      {},
      {},
      {}};
  report::Table table{
      "Largest stiffness, N/mm, held by both criteria, mean of the people with its 95 % interval (of the "
      "plain wall's)",
      {"wall"},
      {}};
  for (const LoopSetting& situation : growing_situations()) table.columns.push_back(situation.name);
  const auto best = std::ranges::max_element(walls, {}, [](const GrowingResult& wall) {
    return wall.wall.starts_with("grows") ? wall.situations.front().both.mean : -1.0;
  });
  const auto damped = std::ranges::find(walls, damper_alone, &GrowingResult::wall);
  experiment::MarkedMeans marks;
  for (const GrowingResult& wall : walls) {
    table.rows.push_back({wall.wall});
    for (std::size_t n = 0; n < wall.situations.size(); ++n) {
      const PeopleMean& found = wall.situations[n].both;
      const double plain = walls.front().situations[n].both.mean;
      table.rows.back().push_back(
          fmt::format("{} ± {} ({:.1f})",
                      marks.cell(found.mean, found.ends, set.subjects.size(),
                                 fmt::format("{}, {}", wall.wall, table.columns[n + 1])),
                      n_per_mm(mean_interval(found.people)), plain > 0.0 ? found.mean / plain : 0.0));
    }
  }
  report::Table seems{
      "Two of these walls where nobody asks what they come to: the largest stiffness that is stable by both "
      "criteria, N/mm, and what is rendered of it in the hold's last quarter of a second, mean of all "
      "touches",
      {"wall", "calm by", "set to", "rendered, %", "rendered, N/mm"},
      {}};
  for (const SeemingResult& one : seeming)
    seems.rows.push_back({one.wall, one.calm_by,
                          marks.cell(one.stable.mean, one.stable.ends, set.subjects.size(),
                                     fmt::format("{}, calm by {}", one.wall, one.calm_by)),
                          fmt::format("{:.0f}", 100.0 * one.rendered / one.stable.mean),
                          n_per_mm(one.rendered)});
  section.tables = {std::move(table), std::move(seems)};
  section.paragraphs = {
      fmt::format(
          "A wall with wall.touch_stiffness meets the handle with that, and grows to wall.stiffness while "
          "the handle is slower than wall.calm_velocity (0.01 m/s), by the firmware's default estimator. Its "
          "damper takes the difference over one sample (wall.damping_window = 1). No field, so nothing is "
          "felt at rest in front of it. It counts as held only if it is stable and comes to {:g} % of its "
          "stiffness in the hold's last quarter of a second. Pulses push the hand with 1.5 N into the wall "
          "and then out of it, for 20 ms each, 1.9 and 2.05 s after the contact. After them it has 0.8 s to "
          "grow again, too short for 0.4 s. In steps of 3 %, where the baselines take 0.1 N/mm: the same "
          "wall differs by some per cent.",
          100.0 * TouchSetup().least_rendered_share),
      fmt::format("Best of them where nothing disturbs: {}, {} N/mm by both criteria, {:.1f} times the plain "
                  "wall; a damper of 8 N s/m alone holds {} N/mm.",
                  best->wall, n_per_mm(best->situations.front().both.mean),
                  best->situations.front().both.mean / walls.front().situations.front().both.mean,
                  n_per_mm(damped->situations.front().both.mean)),
      "Why that is asked: near its limit such a wall takes back what it has grown at each count that the "
      "handle goes on, and can be set far higher without ever oscillating or getting there, the more so the "
      "sooner a motion is noticed. The second table says what such a wall really is.",
      finer_encoder_words(walls),
      "It is paid for at the contact: a tap meets the touch stiffness and the damper, and 95 % of what is "
      "missing comes within three growth times of calm. The rate-hardness above says how hard the contact "
      "itself is."};
  for (std::string& note : marks.notes()) section.paragraphs.push_back(std::move(note));
  return section;
}

std::vector<DrawnDevice> draw_devices(const SubjectSet& set, std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<DrawnDevice> devices;
  for (std::size_t n = 0; n < count; ++n) {
    DrawnDevice drawn_device{set.device, n % set.subjects.size()};
    simulation::DeviceModel& device = drawn_device.device;
    device.mass = drawn(random, 0.02, 0.2);
    device.friction = drawn(random, 0.04, 0.4);
    device.damping = drawn(random, 0.02, 0.5);
    device.force_limit = drawn(random, 3.3, 20.0);
    device.delay = 0.5e-3 * static_cast<double>(random()) / 4294967296.0;
    const double structure = drawn(random, 2e3, 2e4);
    if (n % 2 == 1) {
      device.structure = simulation::StructureModel{structure, 1.0, 0.4 * device.mass};
      device.mass *= 0.6;
    }
    devices.push_back(drawn_device);
  }
  return devices;
}

double DrawnResult::ratio() const {
  return plain_moves > 0.0 && plain_feels > 0.0
             ? std::min(growing_moves / plain_moves, growing_feels / plain_feels)
             : 0.0;
}

std::vector<DrawnResult> run_drawn_devices(const SubjectSet& set, const std::vector<DrawnDevice>& devices,
                                           const GrowthRule& rule, const StiffnessRun& run) {
  StiffnessRun moving = run;
  moving.steps = {.first = 100.0, .step = 10.0, .growth = 0.03, .last = 200e3};
  const auto setup_of = [&](const DrawnDevice& drawn_device) {
    return experiment::touch_setup(drawn_device.device, set.subjects[drawn_device.person].person, {});
  };
  const auto largest = [&](const std::function<WallChange(std::size_t)>& wall) {
    std::vector<TouchSetup> setups;
    for (std::size_t n = 0; n < devices.size(); ++n) {
      setups.push_back(setup_of(devices[n]));
      setups.back().wall.force.limit = static_cast<float>(devices[n].device.force_limit);
      wall(n)(setups.back());
    }
    return search_by_each(setups, by_both(moving), moving);
  };
  const auto plain = [](std::size_t) -> WallChange { return [](TouchSetup&) {}; };
  const auto found = largest(plain);
  const std::vector<MaxStiffness>&plain_moves = found[0], &plain_feels = found[1];
  const auto grown = [&](std::size_t n) {
    const double touch = rule.touch_share * std::min(plain_moves[n].stiffness, plain_feels[n].stiffness);
    // m / T
    const double most = devices[n].mass() * setup_of(devices[n]).wall.tick_rate;
    return growing(touch, rule.growth_time, rule.damping_share * most);
  };
  const auto of_grown = largest(grown);
  const std::vector<MaxStiffness>&growing_moves = of_grown[0], &growing_feels = of_grown[1];
  std::vector<DrawnResult> results;
  for (std::size_t n = 0; n < devices.size(); ++n) {
    DrawnResult result{devices[n],
                       plain_moves[n].stiffness,
                       plain_feels[n].stiffness,
                       growing_moves[n].stiffness,
                       growing_feels[n].stiffness,
                       0.0,
                       0.0};
    SubjectSet one{set};
    one.device = devices[n].device;
    one.subjects = {set.subjects[devices[n].person]};
    const double stiffness = std::min(result.plain_moves, result.plain_feels);
    result.plain_depth = price_of(one, plain(n), stiffness).depth;
    result.growing_depth = price_of(one, grown(n), stiffness).depth;
    results.push_back(result);
  }
  return results;
}

report::Section drawn_section(const std::vector<DrawnResult>& results) {
  report::Section section{"The same on drawn devices", {}, {}, {}};
  if (results.empty()) return section;
  report::Table table{
      "Largest stiffness, N/mm, by who decides", {"criterion", "plain", "grows", "mean's ratio"}, {}};
  const auto mean = [&](double DrawnResult::*value) {
    double sum = 0.0;
    for (const DrawnResult& result : results) sum += result.*value;
    return sum / static_cast<double>(results.size());
  };
  const auto row = [&](const char* name, double DrawnResult::*plain, double DrawnResult::*grown) {
    table.rows.push_back({name, n_per_mm(mean(plain)), n_per_mm(mean(grown)),
                          fmt::format("{:.2f}", mean(plain) > 0.0 ? mean(grown) / mean(plain) : 0.0)});
  };
  row("moves by 0.165 mm", &DrawnResult::plain_moves, &DrawnResult::growing_moves);
  row("swings by 1 N", &DrawnResult::plain_feels, &DrawnResult::growing_feels);
  std::vector<double> ratios;
  std::size_t tripled = 0, deeper = 0, coarse = 0, coarse_tripled = 0;
  for (const DrawnResult& result : results) {
    ratios.push_back(result.ratio());
    const bool three = result.ratio() >= 3.0, by_count = 3.0 * result.plain_feels > 1.0 / 55e-6;
    tripled += three ? 1 : 0;
    coarse += by_count ? 1 : 0;
    coarse_tripled += three && by_count ? 1 : 0;
    deeper += result.growing_depth > result.plain_depth ? 1 : 0;
  }
  std::sort(ratios.begin(), ratios.end());
  const auto softer = std::ranges::count_if(ratios, [](double ratio) { return ratio < 1.0; });
  const experiment::ShareInterval share = experiment::wilson_interval(tripled, results.size());
  section.tables = {std::move(table)};
  section.paragraphs = {
      fmt::format(
          "{} devices: 20 to 200 g, 0.04 to 0.4 N of friction, force limits of 3.3 to 20 N, up to 0.5 ms of "
          "delay, every other one bends; each in the hand of one of the people, at 500 Hz with 55 um. The "
          "wall grows from {:g} of what the plain wall allows, in {:g} s, with a damper of {:g} mass/T over "
          "one sample.",
          results.size(), GrowthRule().touch_share, GrowthRule().growth_time, GrowthRule().damping_share),
      fmt::format("By both criteria at least three times the plain wall: {} of {} (of all such devices "
                  "{:.0f} to {:.0f} %, with 95 %); softer than the plain wall: {}; smallest ratio {:.2f}, "
                  "median {:.2f}, largest {:.2f}. Three times the plain wall would be more than one count at "
                  "1 N (18.2 N/mm) on {} of them, {} of which are tripled all the same: a handle at rest "
                  "swings by no count.",
                  tripled, results.size(), 100.0 * share.low, 100.0 * share.high, softer, ratios.front(),
                  ratios[ratios.size() / 2], ratios.back(), coarse, coarse_tripled),
      fmt::format("Deeper in than the plain wall at that wall's own largest stiffness: {} of {}.", deeper,
                  results.size())};
  return section;
}

std::vector<report::Section> growing_walls(const StudyInput& input) {
  StiffnessRun run = input.run;
  run.steps.growth = 0.03;
  const SubjectSet& set = input.sets.front();
  StiffnessRun drawn_run = run;
  drawn_run.protocol.approach_speeds = {0.1, 0.5, 1.0};
  drawn_run.protocol.pushes = {0.3, 1.0};
  const std::vector<GrowingResult> walls = run_growing_walls(set, run);
  for (const GrowingResult& wall : walls)
    for (std::size_t n = 0; n < wall.situations.size(); ++n) {
      const std::string name = fmt::format("{}; {}", wall.wall, growing_situations()[n].name);
      input.keep("growing", set, name, "position", wall.situations[n].moves);
      input.keep("growing", set, name, "force", wall.situations[n].feels);
    }
  return {growing_section(set, walls, run_seeming_walls(set, run)),
          drawn_section(run_drawn_devices(set, draw_devices(set, drawn_count, drawn_seed), {}, drawn_run))};
}

}  // namespace kmax::studies
