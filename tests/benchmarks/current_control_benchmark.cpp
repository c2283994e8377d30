// The current controllers: what they promise against what they do, and what that costs. Prints
// docs/current_control.md.
//   current_control_benchmark --instructions FILE [--picture FILE.svg]
// FILE is what tests/benchmarks/instruction_budget/instruction_budget.sh printed. The picture is drawn by
// gnuplot. Exit code 1 when a file cannot be read or written or gnuplot fails, 2 on wrong usage.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "tests/benchmarks/current_control_cost.hpp"
#include "tests/benchmarks/current_control_picture.hpp"
#include "tests/benchmarks/current_control_precision.hpp"
#include "tests/benchmarks/gnuplot_pipe.hpp"
#include "tests/benchmarks/instruction_budget/sine_variants.hpp"
#include "tests/control/field_oriented_loop.hpp"
#include "tests/host_tools/simulation/sine_through_zero.hpp"

namespace {

using namespace kmax::control;
using kmax::benchmark::instructions_of;
using kmax::benchmark::nanoseconds;
using kmax::simulation::BrushedDcMotorConfig;
using kmax::simulation::SynchronousMotorConfig;
namespace through_zero = kmax::simulation::test;
using test::Belief;
using test::tick;

constexpr double requests[] = {200.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0};

struct Winding {
  const char* name;
  test::DcMotor motor;
};
constexpr Winding windings[] = {{"0.2", {.resistance = 10.0, .inductance = 0.1e-3}},
                                {"1", {.resistance = 8.0, .inductance = 0.4e-3}},
                                {"10", {.resistance = 1.0, .inductance = 0.5e-3}},
                                {"33", {.resistance = 1.2, .inductance = 2e-3}},
                                {"100", {.resistance = 0.4, .inductance = 2e-3}}};

// The gain that places the pole e^(-w T) as if there were no delay, for comparison.
test::DcLoop<double> with_pole_placement(test::DcLoop<double> loop, double asked) {
  const double turn = 2.0 * std::numbers::pi * asked * tick;
  const double kept = std::exp(-loop.motor.resistance * tick / 2 / loop.motor.inductance);
  loop.c.gains.proportional *= one_minus_exponential(turn) / CurrentLoopGains<double>::loop_gain(turn, kept);
  return loop;
}

std::vector<kmax::benchmark::BandwidthPoint> print_bandwidth() {
  std::printf(
      "## Bandwidth and overshoot\n\nDC motor at 20 kHz, solved exactly with the half tick of delay; swept. "
      "\"Before\": the gain 1 - e^(-w T), which\nplaces the closed loop's pole as if there were no delay. "
      "Overshoot: of a step, and the worst of all\ncombinations of R and L told wrong by 30 %%.\n\n```\n"
      "L/R, ticks  asked, Hz  -3 dB, Hz     off  before, Hz  overshoot  R, L +-30 %%\n");
  std::vector<kmax::benchmark::BandwidthPoint> points;
  for (const Winding& winding : windings) {
    for (const double asked : requests) {
      const test::DcLoop<double> loop(winding.motor, asked);
      const double measured = test::bandwidth_of(loop);
      const double before = test::bandwidth_of(with_pole_placement(loop, asked));
      double worst = 0.0;
      for (const double r : {0.7, 1.0, 1.3}) {
        for (const double l : {0.7, 1.0, 1.3})
          worst = std::max(worst,
                           test::overshoot_of(test::DcLoop<double>(winding.motor, asked, Belief{r, l}), 0.2));
      }
      std::printf("%10s %10.0f %10.0f %6.1f%% %11.0f %9.2f%% %11.1f%%\n", winding.name, asked, measured,
                  100.0 * (measured / asked - 1.0), before,
                  100.0 * std::max(0.0, test::overshoot_of(loop, 0.2)), 100.0 * worst);
      if (&winding == &windings[3]) points.push_back({asked, measured, before});
    }
    std::printf("\n");
  }
  std::printf(
      "```\n\nSynchronous motor, L/R 40 and 60 ticks in d and q, 48 V, at rest and at 700 rad/s "
      "electrical:\n\n```\n"
      "speed, rad/s  axis  asked, Hz  -3 dB, Hz     off  overshoot\n");
  for (const double speed : {0.0, 700.0}) {
    for (const bool on_q : {false, true}) {
      for (const double asked : {200.0, 1000.0, 2500.0}) {
        test::AxisLoop axis{{{.resistance = 0.5, .inductance_d = 1e-3, .inductance_q = 1.5e-3}, asked}, on_q};
        axis.loop.supply = 48.0;
        axis.loop.motor.electrical_speed = speed;
        for (int k = 0; k < 2000; ++k) axis.run(0.0);
        const double measured = test::bandwidth_of(axis, 0.7 * asked);
        std::printf("%12.0f %5s %10.0f %10.0f %6.1f%% %9.2f%%\n", speed, on_q ? "q" : "d", asked, measured,
                    100.0 * (measured / asked - 1.0), 100.0 * std::max(0.0, test::overshoot_of(axis, 0.5)));
      }
    }
  }
  std::printf("```\n\n");
  return points;
}

// Of the voltage vector in the rotor's frame, in the middle of the time in which it is active.
double voltage_error(double speed, bool advanced) {
  double worst = 0.0;
  for (double angle = 0.0; angle < 6.28; angle += 0.01) {
    test::FieldOrientedLoop<double> loop({.electrical_speed = speed, .angle = angle}, 1000.0);
    if (!advanced) loop.c.half_advance = 0.0;
    const auto out = FieldOrientedController<double>::voltage(loop.c, loop.input(0.0, 0.0), 2.0, 8.0);
    const double at = angle + speed * tick;
    const double alpha = (2 * out.duty_a - out.duty_b - out.duty_c) / 3 * loop.supply - 2.0 * std::cos(at) +
                         8.0 * std::sin(at);
    const double beta =
        (out.duty_b - out.duty_c) / std::sqrt(3.0) * loop.supply - 2.0 * std::sin(at) - 8.0 * std::cos(at);
    worst = std::max(worst, std::hypot(alpha, beta) / std::hypot(2.0, 8.0));
  }
  return worst;
}

void print_advance() {
  std::printf(
      "## Angle advance\n\nThe voltage's error, as a share of it, where the rotor is when it is "
      "active:\n\n```\n"
      "electrical rad/s   without      with\n");
  for (const double speed : {100.0, 350.0, 700.0, 1400.0, 2500.0, 3500.0})
    std::printf("%16.0f %8.3f%% %8.4f%%\n", speed, 100.0 * voltage_error(speed, false),
                100.0 * voltage_error(speed, true));
  std::printf("```\n\n");
}

template <typename Motor>
void print_distortion(const char* name, const Motor& motor) {
  using through_zero::DeadTimeShare;
  for (const double dead_time : {119e-9, 500e-9}) {
    for (const double amplitude : {0.1, 1.0}) {
      std::printf("%-22s %6.0f %8.1f", name, 1e9 * dead_time, amplitude);
      for (const DeadTimeShare share :
           {DeadTimeShare::off, DeadTimeShare::of_reference, DeadTimeShare::of_measured}) {
        for (const double assumed : {1.0, 2.0}) {
          if (share == DeadTimeShare::off && assumed > 1.0) continue;
          const auto result = through_zero::distortion_of({.amplitude = amplitude,
                                                           .dead_time = dead_time,
                                                           .assumed_dead_time = assumed * dead_time,
                                                           .share = share},
                                                          motor);
          std::printf("  %7.2f %4.1fx", 100.0 * result.harmonics, result.largest / amplitude);
        }
      }
      std::printf("\n");
    }
  }
}

void print_dead_time() {
  std::printf(
      "## Dead time\n\nA sine of 50 Hz through zero on the simulated inverter at 24 V, current loop 500 Hz: "
      "harmonics 2 to 40 as a share\nof the fundamental (THD, %%) and the largest current as a multiple of "
      "what was asked for. Band: the current that ends\nwithin the dead time. \"Twice\": the compensation is "
      "told twice the dead time there is. From the measured current it\nfeeds back on itself; from the "
      "reference it cannot. 119 ns: the board's.\n\n```\n"
      "motor                  dead, ns  A           none    reference         twice      measured         "
      "twice\n");
  print_distortion("DC 1 ohm 0.5 mH", BrushedDcMotorConfig{1.0, 0.5e-3, 0.03});
  print_distortion("DC 8 ohm 0.3 mH", BrushedDcMotorConfig{8.0, 0.3e-3, 0.03});
  print_distortion("DC 0.3 ohm 0.1 mH", BrushedDcMotorConfig{0.3, 0.1e-3, 0.03});
  print_distortion("PMSM 5 ohm 2.5 mH", SynchronousMotorConfig{5.0, 2.5e-3, 2.5e-3, 0.1, 7});
  print_distortion("PMSM 0.6 ohm 0.3 mH", SynchronousMotorConfig{0.6, 0.3e-3, 0.3e-3, 0.05, 7});
  print_distortion("PMSM 0.08 ohm 0.035 mH", SynchronousMotorConfig{0.08, 0.03e-3, 0.04e-3, 0.008, 7});
  std::printf("```\n\n");
}

SineCosine<float> by_libm(TurnFraction angle) {
  const float x = static_cast<float>(static_cast<std::int32_t>(angle)) * radians_per_turn_fraction<float>;
  return {std::sin(x), std::cos(x)};
}

struct SineVariant {
  const char* name;
  SineCosine<float> (*function)(TurnFraction);
  const char* step;  // in the instructions' file; null: not on the target
};

std::vector<kmax::benchmark::SinePoint> print_sines(const std::string& instructions) {
  const SineVariant variants[] = {
      {"table, nearest entry", &kmax::instruction_budget::sine_cosine_nearest, "sine and cosine: nearest"},
      {"table, first order", &sine_cosine_first_order<float>, "sine and cosine: first"},
      {"table, second order", &sine_cosine<float>, "sine and cosine: second"},
      {"polynomial", &kmax::instruction_budget::sine_cosine_polynomial, "sine and cosine: polynomial"},
      {"libm", &by_libm, nullptr}};
  std::printf(
      "## Sine and cosine\n\nBoth of one angle, float. Error: the largest absolute one over 430 000 angles; "
      "in units of the last place of numbers\nfrom 1/2 to 1 (2^-24). The table has 512 entries, 4 KiB; the "
      "polynomials are minimax, of degree 7 and 8. The\nfield-oriented controller takes the first order: the "
      "converter's steps are 2.4e-4 of its range. Instructions:\nCortex-M4F, counted, with the "
      "return.\n\n```\n"
      "                          error      ulp  instructions  ns, this computer\n");
  std::vector<kmax::benchmark::SinePoint> points;
  for (const SineVariant& variant : variants) {
    double error = 0.0;
    for (std::uint64_t angle = 0; angle < (1ULL << 32); angle += 9973) {
      const auto pair = variant.function(static_cast<TurnFraction>(angle));
      const double truth = static_cast<double>(angle) * radians_per_turn_fraction<double>;
      error = std::max({error, std::fabs(static_cast<double>(pair.sine) - std::sin(truth)),
                        std::fabs(static_cast<double>(pair.cosine) - std::cos(truth))});
    }
    volatile float sink = 0.0F;
    const double time = nanoseconds([&](int k) {
      const auto pair = variant.function(static_cast<TurnFraction>(k) * 2654435761U);
      sink = pair.sine + pair.cosine;
    });
    const int counted = variant.step != nullptr ? instructions_of(instructions, variant.step) : 0;
    if (counted > 0) points.push_back({variant.name, counted, error});
    std::printf("%-21s %10.2e %8.1f %13s %18.1f\n", variant.name, error, error * 16777216.0,
                counted > 0 ? std::to_string(counted).c_str() : "-", time);
  }
  std::printf("```\n\n");
  return points;
}

}  // namespace

int main(int argc, char** argv) {
  std::string counted;
  std::string picture;
  for (int i = 1; i < argc; ++i) {
    const bool has_value = i + 1 < argc;
    if (std::strcmp(argv[i], "--instructions") == 0 && has_value) {
      counted = argv[++i];
    } else if (std::strcmp(argv[i], "--picture") == 0 && has_value) {
      picture = argv[++i];
    } else {
      std::fprintf(
          stderr,
          "%s: not understood; usage: current_control_benchmark --instructions FILE [--picture FILE.svg]\n",
          argv[i]);
      return 2;
    }
  }
  std::ifstream stream(counted);
  std::stringstream instructions;
  instructions << stream.rdbuf();
  if (counted.empty() || !stream || instructions_of(instructions.str(), "PMSM current step, ") == 0) {
    std::fprintf(stderr,
                 "--instructions %s: no counts of the current steps in it; give a file with what "
                 "tests/benchmarks/instruction_budget/instruction_budget.sh prints\n",
                 counted.c_str());
    return counted.empty() ? 2 : 1;
  }
  std::printf(
      "# Current control: bandwidth, dead time, precision and cost\n\nMade by `scripts/docs`; all but the "
      "nanoseconds are exact, those are of the machine it ran on.\n\n![Bandwidth, a sine through zero, and "
      "the sine's error against its cost](pictures/current_control.svg)\n\n");
  const auto bandwidth = print_bandwidth();
  print_advance();
  print_dead_time();
  const auto sines = print_sines(instructions.str());
  kmax::benchmark::print_precision(instructions.str());
  if (picture.empty()) return 0;
  kmax::benchmark::CurrentTraces traces;
  const SynchronousMotorConfig motor{0.6, 0.3e-3, 0.3e-3, 0.05, 7};
  through_zero::SineThroughZero run{.amplitude = 0.25};
  traces.without = through_zero::currents_of(run, motor);
  run.share = through_zero::DeadTimeShare::of_reference;
  traces.with = through_zero::currents_of(run, motor);
  traces.amplitude = run.amplitude;
  traces.frequency = run.frequency;
  const std::string script = kmax::benchmark::current_control_script(bandwidth, traces, sines, picture);
  return kmax::benchmark::draw_by_gnuplot(script, picture) ? 0 : 1;
}
