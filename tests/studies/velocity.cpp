#include "tests/studies/velocity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "tests/benchmarks/current_control_cost.hpp"
#include "tests/benchmarks/velocity_estimator_measurement.hpp"
#include "tests/studies/studies.hpp"
#include "tests/studies/velocity_candidates.hpp"

namespace kmax::studies {
namespace {

using benchmark::velocity::Motion;
using benchmark::velocity::Signal;

Motion swing(double time, double amplitude, double frequency) {
  const double omega = 2.0 * std::numbers::pi * frequency;
  return {amplitude * std::sin(omega * time), amplitude * omega * std::cos(omega * time)};
}
Motion slow_sine(double time) {
  return swing(time, 2e-3, 0.5);
}
/// Trembles about an edge of all encoders.
Motion rest(double time) {
  return swing(time, 5.5e-6, 10.0);
}
constexpr std::array<Signal, 5> motions{{{"ramp of 10.4 mm/s", benchmark::velocity::ramp},
                                         {"sine, 2 mm at 0.5 Hz", slow_sine},
                                         {"sine, 5 mm at 2 Hz", benchmark::velocity::sine},
                                         {"impacts at 200 mm/s", benchmark::velocity::impact},
                                         {"rest at an edge, 5.5 um at 10 Hz", rest}}};
constexpr std::array quanta{55e-6, 5.5e-6, 1e-6};
constexpr std::array rates{500.0, 2000.0, 20'000.0};

using Update = std::function<float(std::int32_t)>;
template <typename Candidate>
Update fresh() {
  return [candidate = Candidate{}](std::int32_t steps) mutable { return candidate.update(steps); };
}
/// In the order of velocity_candidates.
constexpr ByCandidate<Update (*)()> makers{fresh<HeldFoaw<1>>,    fresh<HeldFoaw<2>>,
                                           fresh<TwoCones<16>>,   fresh<IntervalTracking>,
                                           fresh<EdgePeriod<16>>, fresh<EdgePeriod<8>>};

/// Steps of 4 s of a motion, and its velocity in steps per sample.
struct Sampled {
  std::vector<std::int32_t> steps;
  std::vector<double> velocity;
};
Sampled sample(const Signal& signal, double quantum, double rate) {
  Sampled sampled;
  std::int32_t last = 0;
  for (double k = 0.0; k < 4.0 * rate; ++k) {
    const Motion motion = signal.motion(k / rate);
    const auto count = static_cast<std::int32_t>(std::floor(motion.position / quantum));
    sampled.steps.push_back(k > 0.0 ? count - last : 0);
    sampled.velocity.push_back(motion.velocity / (quantum * rate));
    last = count;
  }
  return sampled;
}

void for_each_case(const std::function<void(const Signal&, double, double, const Sampled&)>& call) {
  for (const Signal& signal : motions)
    for (const double quantum : quanta)
      for (const double rate : rates) call(signal, quantum, rate, sample(signal, quantum, rate));
}

/// A damper by itself: inside only, and together with the spring it never pulls the handle in.
experiment::AddedForce damper(const TouchSetup& setup, double damping, Update update) {
  const double length = setup.wall.count_length, rate = setup.wall.tick_rate;
  const double stiffness = static_cast<double>(setup.wall.wall.stiffness);
  return [=, last = std::int64_t{0}, begun = false](std::int64_t count, const auto&) mutable {
    const auto steps = static_cast<std::int32_t>(begun ? count - last : 0);
    begun = true;
    last = count;
    const double velocity = static_cast<double>(update(steps)) * length * rate;
    const double position = static_cast<double>(count) * length;
    return position < 0.0 ? std::max(-damping * velocity, stiffness * position) : 0.0;
  };
}

}  // namespace

std::vector<VelocityCase> measure_velocity_errors() {
  std::vector<VelocityCase> cases;
  for_each_case([&](const Signal& signal, double quantum, double rate, const Sampled& sampled) {
    VelocityCase found{signal.name, quantum, rate, {}};
    for (std::size_t i = 0; i < makers.size(); ++i) {
      Update update = makers[i]();
      double sum = 0.0;
      const auto settled = static_cast<std::size_t>(0.2 * rate);
      for (std::size_t k = 0; k < sampled.steps.size(); ++k) {
        const double error =
            (static_cast<double>(update(sampled.steps[k])) - sampled.velocity[k]) * quantum * rate;
        if (k < settled) continue;
        sum += error * error;
        found.errors[i].worst = std::max(found.errors[i].worst, std::abs(error));
      }
      found.errors[i].rms = std::sqrt(sum / static_cast<double>(sampled.steps.size() - settled));
    }
    cases.push_back(found);
  });
  return cases;
}

std::vector<VelocityCase> at_rate(const std::vector<VelocityCase>& cases, double rate) {
  std::vector<VelocityCase> found;
  for (const VelocityCase& one : cases)
    if (one.rate == rate) found.push_back(one);
  return found;
}

ByCandidate<AgainstFoaw> against_foaw(const std::vector<VelocityCase>& cases) {
  ByCandidate<AgainstFoaw> found;
  for (std::size_t i = 0; i < found.size(); ++i) {
    double sum = 0.0;
    found[i].largest = 0.0;
    for (const VelocityCase& one : cases) {
      const double ratio = one.errors[i].rms / one.errors[0].rms;
      sum += std::log(ratio);
      found[i].largest = std::max(found[i].largest, ratio);
    }
    found[i].mean = std::exp(sum / static_cast<double>(cases.size()));
  }
  return found;
}

double share_of_leaps() {
  double leaps = 0.0, samples = 0.0;
  for_each_case([&](const Signal&, double, double, const Sampled& sampled) {
    control::FoawVelocity<float> foaw;
    const auto coefficients = control::FoawVelocity<float>::prepare(16, 1.0F, 1.0F, 1);
    std::int32_t window = 16;
    for (const std::int32_t steps : sampled.steps) {
      foaw.estimate<control::FoawFit::end>(coefficients, foaw.push(steps));
      leaps += foaw.window() > window + 1 ? 1.0 : 0.0;
      window = foaw.window();
      samples += 1.0;
    }
  });
  return leaps / samples;
}

std::vector<DampedWall> run_damped_walls(const simulation::DeviceModel& device, const StiffnessRun& run) {
  std::vector<DampedWall> walls;
  for (const double quantum : {55e-6, 5.5e-6})
    for (const double rate : rates)
      for (const double damping : {2.0, 8.0}) walls.push_back({quantum, rate, damping, {}});
  constexpr std::size_t each = makers.size();
  const auto found = experiment::collect_jobs<double>(
      walls.size() * each, run.threads,
      [&](std::size_t job) {
        const DampedWall& wall = walls[job / each];
        TouchSetup setup;
        setup.device = device;
        setup.device.force_limit = 0.0;
        setup.wall = experiment::touched_wall(wall.rate, wall.quantum, 0.0);
        setup.wall.wall.kind = control::WallKind::plain;
        setup.added_force = [&](const TouchSetup& touch) {
          return damper(touch, wall.damping, makers[job % each]());
        };
        std::vector<TouchProtocol> protocols = by_both(run);
        protocols.front().threshold = 3.0 * wall.quantum;
        const auto largest = experiment::search_max_stiffness_by_each(
            setup, protocols, {.first = 100.0, .step = 10.0, .growth = 0.03, .last = 1e6});
        return std::min(largest[0].stiffness, largest[1].stiffness);
      },
      run.progress);
  for (std::size_t job = 0; job < found.size(); ++job) walls[job / each].stiffness[job % each] = found[job];
  return walls;
}

report::Page velocity_page(const std::vector<VelocityCase>& cases, const std::vector<DampedWall>& walls,
                           const std::string& counts) {
  std::vector<std::string> names;
  for (const VelocityCandidate& candidate : velocity_candidates) names.push_back(candidate.name);
  const auto columns = [&](std::vector<std::string> first) {
    first.insert(first.end(), names.begin(), names.end());
    return first;
  };
  const auto ratios = against_foaw(cases);
  report::Table summary{
      "", {"estimator", "instructions, mean", "worst", "RMS error over FOAW's, mean", "largest"}, {}};
  const auto worst_of = [&](std::size_t i) {
    return benchmark::instructions_of(counts, velocity_candidates[i].counted, true);
  };
  const auto as_good = std::count_if(cases.begin(), cases.end(), [](const VelocityCase& one) {
    return one.errors[edge_period].rms <= 1.1 * one.errors[0].rms;
  });
  const auto of = [&cases](std::size_t candidate, double rate) {
    return against_foaw(at_rate(cases, rate))[candidate];
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    const int mean = benchmark::instructions_of(counts, velocity_candidates[i].counted);
    const int worst = worst_of(i);
    if (worst == 0)
      throw std::invalid_argument("the instruction budget has no line '" + velocity_candidates[i].counted +
                                  "'");
    summary.rows.push_back({names[i], std::to_string(mean), std::to_string(worst),
                            fmt::format("{:.2f}", ratios[i].mean), fmt::format("{:.2f}", ratios[i].largest)});
  }
  report::Table errors{"Error, mm/s: RMS (worst)", columns({"motion", "quantum, um", "rate, Hz"}), {}};
  for (const VelocityCase& one : cases) {
    errors.rows.push_back(
        {one.motion, fmt::format("{:g}", one.quantum * 1e6), fmt::format("{:g}", one.rate)});
    for (const VelocityError& error : one.errors)
      errors.rows.back().push_back(fmt::format("{:.3g} ({:.3g})", error.rms * 1e3, error.worst * 1e3));
  }
  report::Table stiffness{
      "Largest stable stiffness, N/mm", columns({"quantum, um", "rate, Hz", "damping, N s/m"}), {}};
  for (const DampedWall& wall : walls) {
    stiffness.rows.push_back({fmt::format("{:g}", wall.quantum * 1e6), fmt::format("{:g}", wall.rate),
                              fmt::format("{:g}", wall.damping)});
    for (const double largest : wall.stiffness)
      stiffness.rows.back().push_back(fmt::format("{:.3g}", largest / 1e3));
  }
  return {
      "Velocity estimators: error against cost",
      {{"Cheaper than FOAW",
        {"Tried against FOAW with the best fit and 16 intervals; tests/studies/velocity_candidates.hpp "
         "says how each works. Instructions of one sample on the Cortex-M4, history included, counted over "
         "motions of every kind; a division is one of them and takes 14 cycles. Means over the " +
             std::to_string(cases.size()) + " cases below are geometric.",
         fmt::format(
             "No incremental form of FOAW gives its results: all its lines begin at the newest sample, so "
             "none of what was known of the last window holds for the next, and in {:.2f} % of the samples "
             "the window grows by more than one interval. With lines from the oldest sample it is "
             "incremental: two cones.",
             100.0 * share_of_leaps()),
         fmt::format(
             "The winner is the edge period over 16 samples: {} instructions at worst where FOAW takes {}, "
             "and {:.2f} of its error at 20 kHz, {:.2f} at 2 kHz and {:.2f} at 500 Hz. In {} of {} cases it "
             "has less error, or at most a tenth more. Coarse counts at high rates gain most; a slow ramp on "
             "fine counts at a low rate loses most. It reads 0 below one step in 4096 samples, and where the "
             "count goes to and fro by one. It is in the image: velocity.estimator edge_period. FOAW stays "
             "the default and the reference.",
             worst_of(edge_period), worst_of(0), of(edge_period, 20e3).mean, of(edge_period, 2e3).mean,
             of(edge_period, 500.0).mean, as_good, cases.size()),
         fmt::format("FOAW of every 2nd sample looks back twice as far. At 20 kHz that is {:.2f} of FOAW's "
                     "error in the mean and at most {:.2f}; at 2 kHz {:.2f} and at most {:.2f}, at 500 Hz "
                     "{:.2f} and at most {:.2f}, since it lags in impacts. So where samples come faster than "
                     "10 kHz, at 20 kHz alone, foaw and foaw_end_fit take every second one.",
                     of(foaw_of_every_second, 20e3).mean, of(foaw_of_every_second, 20e3).largest,
                     of(foaw_of_every_second, 2e3).mean, of(foaw_of_every_second, 2e3).largest,
                     of(foaw_of_every_second, 500.0).mean, of(foaw_of_every_second, 500.0).largest)},
        {summary, errors},
        {}},
       {"How stiff a damped wall may be",
        {"One simulated person, the plain wall with a damper by each estimator, force not clipped, in "
         "steps of 3 %; unstable is what moves by more than three counts or swings by more than 1 N. One "
         "count is 1 N at 18.2 N/mm with 55 um and at 182 with 5.5 um, so 17.9 and 179 are the most that can "
         "be found, and equal ones do not say which estimator is better."},
        {stiffness},
        {}}}};
}

}  // namespace kmax::studies
