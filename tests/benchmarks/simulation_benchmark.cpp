// Simulated seconds per second of one axis. Prints two tables; decides nothing.
//
//   parts    what each part of a scene adds to an interval of a 500 Hz controller and of a 20 kHz one: the
//            device alone, then a structure, a hand, a delay, and all of them; sliding to and fro with
//            friction, and sticking
//   contact  whole touches of a wall with the firmware's haptic loop in float, from the approach to the end
//            of a hold of 3 s: walls that hold still and walls that oscillate, with and without a field, for
//            a table of matrices shared between touches and for none

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "control/haptic_loop.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"

namespace {

using namespace kmax;
using benchmark::processor_time;
using simulation::CoupledHandle;
using simulation::DeviceModel;
using simulation::IntendedMotionConfig;
using simulation::OperatorModel;
using simulation::PropagatorTable;
using simulation::StructureModel;

struct Parts {
  const char* name;
  bool structure, hand;
  double delay;
};

// Best of several runs, ns per interval; `moving`: share of intervals that did not end in stick.
double interval_cost(const Parts& parts, double interval, bool sticking, double& moving) {
  DeviceModel device;
  device.delay = parts.delay;
  if (sticking) device.friction = 100.0;
  if (parts.structure) device.structure = StructureModel{};
  IntendedMotionConfig motion;
  motion.hold_time = 1e5;
  const long intervals = interval > 1e-3 ? 100'000 : 200'000;
  const long half_swing = std::lround(0.128 / interval);
  double best = 1e9;
  for (int repeat = 0; repeat < 7; ++repeat) {
    CoupledHandle handle =
        parts.hand ? CoupledHandle(device, OperatorModel{}, motion) : CoupledHandle(device);
    if (parts.hand) handle.begin_motion();
    const auto swing = [half_swing](long n) { return (n / half_swing) % 2 == 0 ? 1.0 : -1.0; };
    for (long n = 0; n < 2 * half_swing; ++n) handle.advance(swing(n), 0.0, interval);
    long slides = 0;
    const double begin = processor_time();
    for (long n = 0; n < intervals; ++n) {
      handle.advance(swing(n), 0.0, interval);
      slides += handle.sticking() ? 0 : 1;
    }
    best = std::min(best, processor_time() - begin);
    moving = static_cast<double>(slides) / static_cast<double>(intervals);
  }
  return best / static_cast<double>(intervals) * 1e9;
}

void print_parts() {
  fmt::print("{:<36}{:>10}{:>12}{:>14}{:>12}{:>14}\n", "parts", "interval", "sliding ns", "simulated s/s",
             "sticking ns", "simulated s/s");
  for (const double interval : {0.002, 50e-6}) {
    for (const Parts& parts :
         {Parts{"device", false, false, 0.0}, Parts{"device + structure", true, false, 0.0},
          Parts{"device + hand", false, true, 0.0}, Parts{"device + structure + hand", true, true, 0.0},
          Parts{"device + hand + delay", false, true, 0.7e-3},
          Parts{"device + structure + hand + delay", true, true, 0.7e-3}}) {
      double moving = 0.0;
      const double sticking = interval_cost(parts, interval, true, moving);
      const double sliding = interval_cost(parts, interval, false, moving);
      fmt::print("{:<36}{:>7.0f} us{:>12.1f}{:>14.0f}{:>12.1f}{:>14.0f}\n", parts.name, interval * 1e6,
                 sliding, interval * 1e9 / sliding, sticking, interval * 1e9 / sticking);
    }
  }
}

struct Wall {
  const char* name;
  double stiffness;  // N/m
  double coefficient;
};

struct Touches {
  double simulated = 0.0;  // s
  double taken = 0.0;      // s
  long samples = 0;
  double low = 1.0, high = -1.0;
};

// 20 touches one after the other, the speed of approach a little different in each. `positions`: those of a
// run with the simulated device are kept there; given a full one, the controller runs on them alone.
Touches touch(const Wall& wall, double period, const std::shared_ptr<PropagatorTable>& table,
              std::vector<double>& positions) {
  using Loop = control::HapticLoop<float>;
  control::HapticLoopConfig<float> config;
  config.count_length = 0.055e-3;
  config.tick_rate = 1.0 / period;
  config.wall.kind = wall.coefficient > 0.0 ? control::WallKind::magnetic : control::WallKind::plain;
  config.wall.stiffness = static_cast<float>(wall.stiffness);
  config.wall.magnetic_coefficient = static_cast<float>(wall.coefficient);
  config.force.ramp_time = 0.0F;
  config.velocity.kind = control::VelocityEstimatorKind::difference;  // these walls do not look at it
  const Loop::Coefficients coefficients = Loop::prepare(config, 0);
  const double per_count = 1.0 / config.count_length;
  const auto samples = static_cast<std::size_t>(3.1 / period);
  constexpr std::size_t touches = 20;
  const bool replay = positions.size() == touches * samples;
  positions.resize(touches * samples);
  const auto force_at = [&](Loop& loop, double position) -> const Loop::Output& {
    const double exact = position * per_count;
    auto count = static_cast<std::int64_t>(exact);
    if (static_cast<double>(count) > exact) --count;
    return loop.tick(coefficients, count, true);
  };
  Touches result;
  float sum = 0.0F;
  const double begin = processor_time();
  for (std::size_t n = 0; n < touches; ++n) {
    double* position = positions.data() + n * samples;
    Loop loop;
    if (replay) {
      for (std::size_t k = 0; k < samples; ++k) sum += force_at(loop, position[k]).force;
      continue;
    }
    IntendedMotionConfig motion;
    motion.approach_speed = 0.19 + 0.001 * static_cast<double>(n);
    CoupledHandle handle(DeviceModel{}, OperatorModel{}, motion);
    if (table) handle.share(table);
    handle.begin_motion();
    for (std::size_t k = 0; k < samples; ++k) {
      position[k] = handle.position();
      const Loop::Output& out = force_at(loop, position[k]);
      handle.advance(static_cast<double>(out.force), static_cast<double>(out.magnetic_force), period);
    }
  }
  result.taken = processor_time() - begin;
  if (sum == 0.5F) fmt::print(" ");  // the compiler must not drop the replay
  result.samples = static_cast<long>(touches * samples);
  result.simulated = static_cast<double>(touches) * 3.1;
  for (std::size_t k = samples / 2; k < samples; ++k) {
    result.low = std::min(result.low, positions[k]);
    result.high = std::max(result.high, positions[k]);
  }
  return result;
}

void print_contacts() {
  fmt::print("\n{:<32}{:>9}{:>8}{:>24}{:>16}{:>16}{:>16}\n", "contact", "interval", "p-p mm",
             "ns/sample (controller)", "simulated s/s", "10 bits s/s", "no table s/s");
  for (const double period : {0.002, 50e-6}) {
    for (const Wall& wall :
         {Wall{"plain, 2.5 N/mm, still", 2500.0, 0.0}, Wall{"plain, 5.5 N/mm, oscillates", 5500.0, 0.0},
          Wall{"field 1 N, 5.5 N/mm, oscillates", 5500.0, 1.0},
          Wall{"field 2 N, 5.5 N/mm, still", 5500.0, 2.0},
          Wall{"field 2 N, 12 N/mm, oscillates", 12000.0, 2.0}}) {
      const auto fine = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{});
      const auto coarse = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{}, 10);
      const int repeats = period > 1e-3 ? 15 : 2;
      Touches with_fine, with_coarse, without, controller;
      with_fine.taken = with_coarse.taken = without.taken = controller.taken = 1e9;
      for (int n = 0; n <= repeats; ++n) {
        std::vector<double> positions;
        const auto keep = [n](Touches& kept, const Touches& one) {
          if (n > 0 && one.taken < kept.taken) kept = one;  // the first builds the table
        };
        keep(with_fine, touch(wall, period, fine, positions));
        keep(controller, touch(wall, period, nullptr, positions));
        positions.clear();
        keep(with_coarse, touch(wall, period, coarse, positions));
        positions.clear();
        keep(without, touch(wall, period, nullptr, positions));
      }
      const double per_sample = 1e9 / static_cast<double>(with_fine.samples);
      const auto speed = [](const Touches& touches) { return touches.simulated / touches.taken; };
      fmt::print("{:<32}{:>6.0f} us{:>8.3f}{:>16.1f} ({:>5.1f}){:>16.0f}{:>16.0f}{:>16.0f}\n", wall.name,
                 period * 1e6, (with_fine.high - with_fine.low) * 1e3, with_fine.taken * per_sample,
                 controller.taken * per_sample, speed(with_fine), speed(with_coarse), speed(without));
    }
  }
  fmt::print(
      "ns/sample: with a table that interpolates; 10 bits: one that rounds; controller: its share, on the "
      "positions of the same touches\n");
}

}  // namespace

int main() {
  print_parts();
  print_contacts();
}
