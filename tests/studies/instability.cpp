#include "tests/studies/instability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host_tools/experiment/job_pool.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::studies {
namespace {

using experiment::SubjectSet;
using experiment::TouchProtocol;
using Detector = control::InstabilityDetector<float>;
using Softening = control::WallSoftening<float>;
using Loop = control::HapticLoop<float>;

constexpr double oscillation = simulation::unstable_motion;
constexpr double longest_period = 1.0 / 15.0;
constexpr double in_time = 0.3;  // s
constexpr double two_pi = 6.283185307179586;

Detector::Coefficients detector_at(double rate) {
  control::InstabilityDetectorConfig<float> config;
  config.rate = static_cast<float>(rate);
  return Detector::prepare(config);
}

/// Times at which a position has come back from its farthest by more than an oscillation.
std::vector<double> turns_of(const std::vector<simulation::ContactSample>& samples) {
  std::vector<double> turns;
  double direction = 1.0, farthest = -1e9;
  for (const auto& sample : samples) {
    const double along = direction * sample.position;
    if (along > farthest) {
      farthest = along;
    } else if (farthest - along > oscillation) {
      turns.push_back(sample.time);
      direction = -direction;
      farthest = -along;
    }
  }
  return turns;
}

void find_oscillation(WatchedContact& watched, const std::vector<double>& turns, double contact) {
  double begin = -1.0;
  std::vector<double> periods;
  for (std::size_t n = 2; n < turns.size(); ++n) {
    const double period = turns[n] - turns[n - 2];
    if (turns[n - 2] < contact || period > longest_period) {
      if (!watched.onset) begin = -1.0;
      continue;
    }
    if (begin < 0.0) begin = turns[n - 2];
    if (!watched.onset && turns[n] - begin >= 0.5) watched.onset = begin;
    periods.push_back(period);
  }
  if (!turns.empty()) watched.ended = turns.back();
  if (periods.empty()) return;
  std::nth_element(periods.begin(), periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2),
                   periods.end());
  watched.frequency = 1.0 / periods[periods.size() / 2];
}

double at_share(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double least, double most) {
    return least + (most - least) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }
  double over_decades(double least, double most) { return least * std::pow(most / least, between(0.0, 1.0)); }
  std::size_t below(std::size_t count) { return engine_() % count; }

 private:
  std::mt19937_64 engine_;
};

experiment::TouchSetup touched(experiment::TouchSetup setup, double stiffness, double speed, double push,
                               double phase) {
  setup.wall.wall.stiffness = static_cast<float>(stiffness);
  setup.motion.approach_speed = speed;
  setup.motion.push_force = push;
  setup.motion.start_position = 0.02 + phase * speed / setup.wall.tick_rate;
  return setup;
}

/// 0: even the first one is unstable.
double largest_stable(const experiment::TouchSetup& setup, const TouchProtocol& protocol, double first,
                      double growth) {
  return experiment::search_max_stiffness(setup, protocol,
                                          {.first = first, .step = 1.0, .growth = growth, .last = 3e5})
      .stiffness;
}

}  // namespace

WatchedContact watch_contact(const ContactCase& contact) {
  const experiment::TouchSetup& setup = contact.setup;
  const double rate = setup.wall.tick_rate, period = 1.0 / rate;
  // The device clips what has been softened; what a trembling hand adds is not its business.
  const double limit = setup.device.force_limit > 0.0 ? setup.device.force_limit : 1e9;
  simulation::DeviceModel device = setup.device;
  device.force_limit = 0.0;
  control::HapticLoopConfig<float> wall = setup.wall;
  wall.force.limit = 1e9F;
  simulation::CoupledHandle handle(device, setup.person, setup.motion);
  handle.begin_motion();
  const auto counted = [&](double position) {
    return static_cast<std::int64_t>(std::floor(position / setup.wall.count_length));
  };
  const auto coefficients = Loop::prepare(wall, counted(setup.motion.start_position));
  const auto watch = detector_at(rate);
  const auto soften = Softening::prepare({}, static_cast<float>(period));
  Loop loop;
  Detector detector;
  Softening softening;

  WatchedContact watched;
  std::vector<simulation::ContactSample> positions;
  std::optional<double> first_contact;
  for (std::uint64_t n = 0;; ++n) {
    const double time = static_cast<double>(n) * period;
    const auto phase = handle.motion().phase();
    if (contact.until_released ? phase == simulation::MotionPhase::done
                               : phase == simulation::MotionPhase::release)
      break;
    const std::int64_t count = counted(handle.position());
    const Loop::Output& out = loop.tick(coefficients, count, true);
    if (out.inside && !first_contact) first_contact = time;
    const float scaled = out.force * softening.factor();
    const auto force = static_cast<float>(std::clamp(static_cast<double>(scaled), -limit, limit));
    // The encoder's own displacement: a coarser resolution is the wall's, not the handle's motion.
    const bool unstable = detector.update(watch, Loop::outside_distance(coefficients, count), force);
    if (contact.softens) softening.update(soften, unstable);
    if (unstable && !watched.found) watched.found = time;
    positions.push_back({time, handle.position()});
    const double background = std::abs(static_cast<double>(out.magnetic_force));
    const double trembling = contact.trembling.force * std::sin(two_pi * contact.trembling.frequency * time);
    handle.advance(static_cast<double>(force) + trembling, background, period);
  }
  watched.length = positions.back().time;
  watched.factor = static_cast<double>(softening.factor());
  watched.touched = first_contact.has_value();
  const auto end = handle.motion().hold_end();
  simulation::ContactCriterion criterion;
  criterion.window_end = end ? std::min(*end, watched.length) : watched.length;
  criterion.window_begin = criterion.window_end - std::min(1.0, setup.motion.hold_time);
  criterion.threshold = oscillation;
  watched.stable =
      simulation::measure_contact(positions, criterion).verdict != simulation::ContactVerdict::unstable;
  find_oscillation(watched, turns_of(positions), first_contact.value_or(0.0));
  return watched;
}

bool alarms_when_thrown(const Throw& thrown) {
  simulation::DeviceModel device = thrown.device;
  device.force_limit = 0.0;
  simulation::CoupledHandle handle(device, simulation::HandleStart{0.02, -thrown.speed});
  auto wall = experiment::touched_wall(thrown.rate, 5.5e-6, thrown.device.force_limit);
  wall.wall.stiffness = static_cast<float>(thrown.stiffness);
  const auto counted = [&](double position) {
    return static_cast<std::int64_t>(std::floor(position / wall.count_length));
  };
  const auto coefficients = Loop::prepare(wall, counted(handle.position()));
  const auto watch = detector_at(thrown.rate);
  Loop loop;
  Detector detector;
  bool found = false;
  for (int n = 0; n < static_cast<int>(2.0 * thrown.rate); ++n) {
    const Loop::Output& out = loop.tick(coefficients, counted(handle.position()), true);
    found = detector.update(watch, out.outside_distance, out.force) || found;
    handle.advance(static_cast<double>(out.force) - thrown.weight, 0.0, 1.0 / thrown.rate);
  }
  return found;
}

std::vector<RatioResult> watch_ratios(const std::vector<SubjectSet>& sets, const std::vector<double>& ratios,
                                      const TouchProtocol& protocol, std::size_t threads) {
  struct Job {
    const SubjectSet* set;
    std::size_t person;
    experiment::StiffnessCondition law;
  };
  std::vector<Job> jobs;
  for (const SubjectSet& set : sets)
    for (const auto& law : experiment::stiffness_conditions())
      for (std::size_t person = 0; person < set.subjects.size(); ++person)
        jobs.push_back({&set, person, law});
  const auto parts =
      experiment::collect_jobs<std::vector<RatioResult>>(jobs.size(), threads, [&](std::size_t index) {
        const Job& job = jobs[index];
        Random random(index + 1);
        const auto setup =
            experiment::touch_setup(job.set->device, job.set->subjects[job.person].person, job.law);
        const double most = experiment::search_max_stiffness(setup, TouchProtocol{}, {}).stiffness;
        std::vector<RatioResult> results;
        for (const double ratio : ratios) {
          RatioResult& result = results.emplace_back();
          result.ratio = ratio;
          if (!(most > 0.0)) continue;
          for (const double speed : protocol.approach_speeds) {
            for (const double push : protocol.pushes) {
              ContactCase contact{touched(setup, ratio * most, speed, push, random.between(0.0, 1.0))};
              const WatchedContact watched = watch_contact(contact);
              if (!watched.touched) continue;
              if (watched.stable) {
                ++result.stable;
                result.alarms += watched.found ? 1 : 0;
                continue;
              }
              ++result.unstable;
              if (watched.onset) {
                ++result.steady;
                result.frequencies.push_back(watched.frequency);
                const double delay = watched.found ? std::max(0.0, *watched.found - *watched.onset) : 1e9;
                result.delays.push_back(delay);
                result.found_in_time += delay <= in_time ? 1 : 0;
              }
              contact.softens = true;
              const WatchedContact softened = watch_contact(contact);
              if (!softened.found) continue;
              ++result.softened;
              const double ended = softened.ended.value_or(0.0);
              const bool silenced = ended < softened.length - 0.5;
              result.silenced += silenced ? 1 : 0;
              if (!silenced) continue;
              result.endings.push_back(std::max(0.0, ended - *softened.found));
              result.factors.push_back(softened.factor);
            }
          }
        }
        return results;
      });
  std::vector<RatioResult> sum(ratios.size());
  for (const auto& part : parts) {
    for (std::size_t n = 0; n < ratios.size(); ++n) {
      RatioResult& to = sum[n];
      const RatioResult& from = part[n];
      to.ratio = from.ratio;
      to.unstable += from.unstable;
      to.steady += from.steady;
      to.found_in_time += from.found_in_time;
      to.stable += from.stable;
      to.alarms += from.alarms;
      to.softened += from.softened;
      to.silenced += from.silenced;
      to.delays.insert(to.delays.end(), from.delays.begin(), from.delays.end());
      to.frequencies.insert(to.frequencies.end(), from.frequencies.begin(), from.frequencies.end());
      to.endings.insert(to.endings.end(), from.endings.begin(), from.endings.end());
      to.factors.insert(to.factors.end(), from.factors.begin(), from.factors.end());
    }
  }
  return sum;
}

StableResult watch_stable(const std::vector<SubjectSet>& sets, std::size_t walls, std::size_t touches,
                          double margin, std::size_t threads) {
  using Kind = control::VelocityEstimatorKind;
  constexpr Kind kinds[] = {Kind::difference, Kind::low_pass, Kind::foaw, Kind::foaw_end_fit, Kind::tracking};
  constexpr double rates[] = {500.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0};
  constexpr double counts[] = {55e-6, 23e-6, 5.5e-6};
  constexpr double resolutions[] = {0.0, 0.0, 0.1e-3, 0.4e-3};
  const auto laws = experiment::stiffness_conditions();
  const auto parts = experiment::collect_jobs<StableResult>(walls, threads, [&](std::size_t index) {
    Random random(index + 1);
    const SubjectSet& set = sets[random.below(sets.size())];
    auto setup = experiment::touch_setup(set.device, set.subjects[random.below(set.subjects.size())].person,
                                         laws[random.below(laws.size())]);
    setup.wall.tick_rate = rates[random.below(std::size(rates))];
    setup.wall.count_length = counts[random.below(std::size(counts))];
    setup.wall.position_resolution = resolutions[random.below(std::size(resolutions))];
    setup.wall.wall.damping = random.below(2) == 0 ? 0.0F : static_cast<float>(random.between(0.5, 3.0));
    setup.wall.velocity.kind = kinds[random.below(std::size(kinds))];
    StableResult result;
    setup.motion.hold_time = 1.5;
    auto plain = setup;
    plain.wall.wall.kind = control::WallKind::plain;
    // By the swing of the force: a wall that is newtons a count stiff oscillates without being seen to move.
    const double most = largest_stable(
        plain, {.approach_speeds = {0.2, 1.0}, .pushes = {0.5, 1.5}, .force_threshold = 1.0}, 50.0, 0.15);
    // A field is as stiff as its slope at the surface, 2 F_MC / x_0; the adaptive law's F_MC goes to 2 N.
    const auto& law = setup.wall.wall;
    const double coefficient =
        law.kind == control::WallKind::adaptive ? 2.0 : static_cast<double>(law.magnetic_coefficient);
    if (2.0 * coefficient / static_cast<double>(law.magnetic_length) > margin * most) setup = plain;
    if (!(most > 0.0)) {
      result.not_stable = touches;
      return result;
    }
    for (std::size_t n = 0; n < touches; ++n) {
      if (n % 10 == 9) {
        // Free of any hand a wall is stable to b > K T / 2 only.
        Throw thrown{.device = set.device, .rate = setup.wall.tick_rate};
        thrown.stiffness =
            std::min(5000.0, random.between(0.1, 0.9) * 2.0 * set.device.damping * thrown.rate);
        thrown.speed = random.over_decades(0.02, 3.0);
        ++result.throws;
        result.alarms += alarms_when_thrown(thrown) ? 1 : 0;
        continue;
      }
      ContactCase contact{touched(setup, most * random.over_decades(0.05 * margin, margin),
                                  random.over_decades(0.02, 1.5), random.between(0.2, 1.5),
                                  random.between(0.0, 1.0))};
      contact.until_released = true;
      // A tap, a short press that is let go of quickly, a hold.
      contact.setup.motion.hold_time = n % 3 == 0 ? 0.02 : n % 3 == 1 ? random.between(0.1, 0.5) : 1.2;
      if (random.below(2) == 0)
        contact.trembling = {random.between(0.0, 0.5),
                             random.below(2) == 0 ? random.between(8.0, 12.0) : random.between(0.5, 3.0)};
      const WatchedContact watched = watch_contact(contact);
      result.simulated_time += watched.length;
      // What trembles moves, and a tap is over within what would be judged: the wall's margin says enough.
      const bool judged = contact.trembling.force == 0.0 && n % 3 == 2;
      if (judged && !watched.stable) {
        ++result.not_stable;
        continue;
      }
      ++result.touches;
      result.alarms += watched.found ? 1 : 0;
    }
    return result;
  });
  StableResult sum;
  for (const StableResult& part : parts) {
    sum.touches += part.touches;
    sum.throws += part.throws;
    sum.not_stable += part.not_stable;
    sum.alarms += part.alarms;
    sum.simulated_time += part.simulated_time;
  }
  return sum;
}

report::Page instability_page(const std::vector<RatioResult>& ratios, const StableResult& stable,
                              double margin) {
  report::Section found{"Unstable walls", {}, {}, {}};
  found.paragraphs.push_back(
      "Walls that are stiffer than the largest stable stiffness of each simulated person with each law (500 "
      "Hz, 0.055 mm), touched at 0.05 to 1 m/s with 0.3 to 1 N, counted where contact_measure.hpp calls the "
      "held contact unstable. The onset is the first of the swings of more than 0.165 mm that follow each "
      "other for half a second; where there is none, the oscillation comes and goes around what counts as "
      "one at all, and no time can be given.");
  report::Table found_table{
      "",
      {"stiffness / largest stable", "unstable touches", "with an onset", "found within 0.3 s", "share",
       "share of all unstable", "delay, median (s)", "95 % (s)", "frequency, 5 % (Hz)", "95 % (Hz)"},
      {}};
  report::Section soft{"Softening", {}, {}, {}};
  soft.paragraphs.push_back(
      "The same touches, with the wall's force halved for every 0.1 s that the alarm lasts. Ended: no swing "
      "of more than 0.165 mm in the last half second of the hold.");
  report::Table soft_table{"",
                           {"stiffness / largest stable", "softened touches", "ended",
                            "alarm to end, median (s)", "95 % (s)", "factor left, median", "5 %"},
                           {}};
  report::Section calm{"Stable touches", {}, {}, {}};
  calm.paragraphs.push_back(
      fmt::format("Walls of at most {:g} of the stiffness of a plain wall that is stable (less than 1 N peak "
                  "to peak) under the same hand in the same loop, the slope of a field included: 500 Hz to "
                  "20 kHz, encoders of 55, 23 and 5.5 um, resolutions of 0.1 and 0.4 mm, all laws, no "
                  "damping or 0.5 to 3 N s/m, all velocity estimators but the edge period; taps, presses that are let go of, "
                  "holds, at 0.02 to 1.5 m/s with 0.2 to 1.5 N; half of them with a hand that trembles at 8 "
                  "to 12 Hz or presses more and less at 0.5 to 3 Hz; and handles that nobody holds, thrown "
                  "at 0.02 to 3 m/s with their weight on them. {} alarms in {} touches and {} throws ({} "
                  "touches left out that were not stable).",
                  margin, stable.alarms, stable.touches, stable.throws, stable.not_stable));
  calm.paragraphs.push_back(
      "Nearer to the limit a stable wall rings after a hard touch, and may ring for longer than anybody "
      "wants to wait for a verdict. How often that is called unstable (500 Hz, 0.055 mm, the touches of "
      "above):");
  report::Table calm_table{"", {"stiffness / largest stable", "stable touches", "alarms", "share"}, {}};
  const auto percent = [](std::size_t part, std::size_t all) {
    return all == 0 ? std::string("-")
                    : fmt::format("{:.1f} %", 100.0 * static_cast<double>(part) / static_cast<double>(all));
  };
  RatioResult all;
  for (const RatioResult& r : ratios) {
    const std::string ratio = fmt::format("{:g}", r.ratio);
    if (r.ratio > 1.0) {
      all.unstable += r.unstable;
      all.steady += r.steady;
      all.found_in_time += r.found_in_time;
      found_table.rows.push_back({ratio, fmt::format("{}", r.unstable), fmt::format("{}", r.steady),
                                  fmt::format("{}", r.found_in_time), percent(r.found_in_time, r.steady),
                                  percent(r.found_in_time, r.unstable),
                                  fmt::format("{:.3f}", at_share(r.delays, 0.5)),
                                  fmt::format("{:.3f}", at_share(r.delays, 0.95)),
                                  fmt::format("{:.0f}", at_share(r.frequencies, 0.05)),
                                  fmt::format("{:.0f}", at_share(r.frequencies, 0.95))});
      soft_table.rows.push_back({ratio, fmt::format("{}", r.softened), percent(r.silenced, r.softened),
                                 fmt::format("{:.2f}", at_share(r.endings, 0.5)),
                                 fmt::format("{:.2f}", at_share(r.endings, 0.95)),
                                 fmt::format("{:.2f}", at_share(r.factors, 0.5)),
                                 fmt::format("{:.2f}", at_share(r.factors, 0.05))});
    } else {
      calm_table.rows.push_back(
          {ratio, fmt::format("{}", r.stable), fmt::format("{}", r.alarms), percent(r.alarms, r.stable)});
    }
  }
  found.paragraphs.push_back(fmt::format(
      "Of all {} touches with an onset, {} are found within 0.3 s of it, {}: {} of all {} unstable ones.",
      all.steady, all.found_in_time, percent(all.found_in_time, all.steady),
      percent(all.found_in_time, all.unstable), all.unstable));
  found.tables.push_back(std::move(found_table));
  soft.tables.push_back(std::move(soft_table));
  calm.tables.push_back(std::move(calm_table));
  const control::InstabilityDetectorConfig<float> defaults;
  const report::Section what{
      "What it finds",
      {fmt::format(
           "control/instability_detector.hpp watches displacement and force in the interrupt, and calls a "
           "wall unstable that makes the handle swing by at least {:g} mm and the force by at least {:g} N "
           "(amplitudes), faster than {:g} Hz, without dying down within spans of {:g} ms. Unstable walls of "
           "simulated people oscillate at 30 to 70 Hz, by half a millimetre and more; a hand trembles at 8 "
           "to 12 Hz.",
           1e3 * static_cast<double>(defaults.displacement_threshold), defaults.force_threshold,
           defaults.lowest_frequency, 1e3 * static_cast<double>(defaults.settling_time)),
       "Everything here is simulated. Made by build/native/tests/studies/kmax-studies instability --out "
       "docs."},
      {},
      {}};
  return {"Instability detector", {what, found, calm, soft}};
}

}  // namespace kmax::studies
