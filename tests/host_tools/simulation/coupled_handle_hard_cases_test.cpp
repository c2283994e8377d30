// CoupledHandle in the cases that are hard to get right, each against the same equations in numbers of 50
// digits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/propagator_table.hpp"
#include "tests/host_tools/simulation/precise_chain.hpp"

namespace kmax::simulation::coupled_handle_hard_cases_test {
namespace {

using Real = PreciseChain::Real;

struct Scene {
  DeviceModel device{};
  OperatorModel person{};
  bool held = true;
  IntendedMotionConfig motion{};
  HandleStart start{};
  double interval = 0.002;
  bool table = false;
};

struct Difference {
  double position = 0.0;  // m, largest of all masses and samples
  double velocity = 0.0;  // m/s
  int stops = 0;
  int break_aways = 0;
  int stuck = 0;
};

// The commands in effect during one interval, oldest first, split where a delayed one takes effect: in exact
// times.
struct Held {
  Real duration;
  double force;
};

std::vector<Held> in_effect(const std::vector<double>& commands, std::size_t n, double interval,
                            double delay) {
  const Real begin = Real(interval) * static_cast<unsigned>(n);
  const Real end = begin + Real(interval);
  std::vector<Held> pieces;
  Real now = begin;
  while (end - now > Real(1e-25)) {
    const Real age = (now + Real(1e-25) - Real(delay)) / Real(interval);
    const int index = age < 0 ? -1 : static_cast<int>(age);
    const Real change = Real(delay) + Real(interval) * (index + 1);
    const Real until = change < end ? change : end;
    pieces.push_back({until - now, index < 0 ? 0.0 : commands[static_cast<std::size_t>(index)]});
    now = until;
  }
  return pieces;
}

Difference compare(const Scene& scene, const std::vector<double>& commands) {
  const OperatorModel* person = scene.held ? &scene.person : nullptr;
  CoupledHandle handle = scene.held ? CoupledHandle(scene.device, scene.person, scene.motion, scene.start)
                                    : CoupledHandle(scene.device, scene.start);
  if (scene.table) handle.share(std::make_shared<PropagatorTable>(scene.device, scene.person));
  const std::size_t tip = scene.device.structure ? 1 : 0;
  PreciseChain precise(held_chain(scene.device, person, 1.0), scene.start.position, scene.start.velocity,
                       tip + 1);
  IntendedMotion motion(scene.motion);
  if (scene.held) {
    handle.begin_motion();
    motion.begin();
  }
  const double target = motion.target_for(scene.motion.push_force, series_stiffness(scene.person));
  Difference worst;
  for (std::size_t n = 0; n < commands.size(); ++n) {
    handle.advance(commands[n], 0.0, scene.interval);
    std::vector<Held> pieces = in_effect(commands, n, scene.interval, scene.device.delay);
    for (const Held& piece : pieces) {
      const double limit = scene.device.force_limit;
      const double force = limit > 0.0 ? std::clamp(piece.force, -limit, limit) : piece.force;
      const IntendedMotion::Path path = motion.advance(static_cast<double>(piece.duration), target);
      Real left = piece.duration;
      for (int s = 0; s < path.count; ++s) {
        const auto& straight = path.segments[static_cast<std::size_t>(s)];
        const Real duration = s + 1 == path.count ? left : Real(straight.duration);
        precise.advance(force, scene.held ? Real(straight.start) : Real(0),
                        scene.held ? Real(straight.rate) : Real(0), duration);
        left -= duration;
      }
    }
    const auto apart = [](double a, const Real& b) { return std::abs(static_cast<double>(Real(a) - b)); };
    worst.position = std::max(worst.position, apart(handle.position(), precise.position(0)));
    worst.velocity = std::max(worst.velocity, apart(handle.velocity(), precise.velocity(0)));
    worst.position = std::max(worst.position, apart(handle.tip_position(), precise.position(tip)));
    worst.velocity = std::max(worst.velocity, apart(handle.tip_velocity(), precise.velocity(tip)));
    if (scene.held) {
      worst.position = std::max(worst.position, apart(handle.hand_position(), precise.position(tip + 1)));
      worst.velocity = std::max(worst.velocity, apart(handle.hand_velocity(), precise.velocity(tip + 1)));
    }
    worst.stuck += handle.sticking() ? 1 : 0;
  }
  EXPECT_EQ(handle.event_limit_hits(), 0u);
  worst.stops = precise.stops();
  worst.break_aways = precise.break_aways();
  return worst;
}

// Commands of a wall of `stiffness` in closed loop, to be given to both open loop: the loop itself is
// chaotic.
std::vector<double> wall_commands(const Scene& scene, double stiffness, int samples) {
  CoupledHandle handle = scene.held ? CoupledHandle(scene.device, scene.person, scene.motion, scene.start)
                                    : CoupledHandle(scene.device, scene.start);
  if (scene.held) handle.begin_motion();
  std::vector<double> commands;
  for (int n = 0; n < samples; ++n) {
    commands.push_back(std::max(0.0, -stiffness * handle.position()));
    handle.advance(commands.back(), 0.0, scene.interval);
  }
  return commands;
}

TEST(CoupledHandleHardCases, StickSlipAtNearlyNoSpeed) {
  for (const double speed : {1e-4, 1e-3}) {
    Scene scene;
    scene.device = {0.045, 0.05, 0.06, 0.0};
    scene.motion.approach_speed = speed;
    scene.motion.start_position = scene.start.position = 0.02;
    scene.person.grip_damping = 0.0;
    scene.person.arm_stiffness = 2000.0;
    scene.interval = speed < 5e-4 ? 0.01 : 0.002;
    const Difference worst = compare(scene, std::vector<double>(400, 0.02));
    EXPECT_LT(worst.position, 1e-12) << speed;
    EXPECT_LT(worst.velocity, 1e-10) << speed;
    EXPECT_GT(worst.stuck, 50) << speed;
    EXPECT_GT(worst.break_aways, 0) << speed;
  }
}

TEST(CoupledHandleHardCases, AWallOfAMegaNewtonPerMetreAndAGram) {
  for (const double mass : {1e-3, 0.045}) {
    for (const double limit : {0.0, 3.3}) {
      Scene scene;
      scene.device = {mass, 0.05, 0.093, limit};
      scene.motion.start_position = scene.start.position = 0.001;
      // Without a limit the light handle is thrown about by kilonewtons: errors are relative to that.
      const std::vector<double> commands = wall_commands(scene, 1e6, 40);
      const double scale =
          std::max(1.0, limit > 0.0 ? limit : *std::max_element(commands.begin(), commands.end()));
      const Difference worst = compare(scene, commands);
      EXPECT_LT(worst.position, 1e-12 * scale) << mass << " " << limit;
      EXPECT_LT(worst.velocity, 1e-10 * scale) << mass << " " << limit;
      EXPECT_GT(worst.stops, 3) << mass << " " << limit;
    }
  }
}

TEST(CoupledHandleHardCases, DelaysOfPartsAndOfSeveralSamples) {
  for (const double delay : {1e-6, 0.0007, 0.001, 0.002, 0.00474, 0.006, 0.0199}) {
    Scene scene;
    scene.device.delay = delay;
    scene.motion.start_position = scene.start.position = 0.002;
    const Difference worst = compare(scene, wall_commands(scene, 5500.0, 60));
    EXPECT_LT(worst.position, 1e-12) << delay;
    EXPECT_LT(worst.velocity, 1e-10) << delay;
    EXPECT_GT(worst.stops, 1) << delay;
  }
}

TEST(CoupledHandleHardCases, DeepSaturation) {
  Scene scene;
  scene.motion.start_position = scene.start.position = 0.001;
  std::vector<double> commands = wall_commands(scene, 1e8, 60);
  EXPECT_GT(*std::max_element(commands.begin(), commands.end()), 1e4);
  const Difference worst = compare(scene, commands);
  EXPECT_LT(worst.position, 1e-12);
  EXPECT_LT(worst.velocity, 1e-10);
  EXPECT_GT(worst.stops, 5);
}

TEST(CoupledHandleHardCases, AStiffStructureHeldAndAlone) {
  for (const double stiffness : {2e4, 1e6}) {
    for (const bool held : {false, true}) {
      Scene scene;
      scene.held = held;
      scene.device.structure = StructureModel{stiffness, 0.5, stiffness > 1e5 ? 1e-3 : 0.02};
      scene.motion.start_position = scene.start.position = 0.002;
      const int samples = stiffness > 1e5 ? 24 : 50;
      std::vector<double> commands = wall_commands(scene, 5500.0, samples);
      if (!held) {
        for (std::size_t n = 0; n < commands.size(); ++n) commands[n] = (n + 2) % 8 < 4 ? -1.5 : 1.5;
      }
      const Difference worst = compare(scene, commands);
      EXPECT_LT(worst.position, 1e-12) << stiffness << " " << held;
      EXPECT_LT(worst.velocity, 1e-9) << stiffness << " " << held;
      EXPECT_GT(worst.stops, 1) << stiffness << " " << held;
    }
  }
}

TEST(CoupledHandleHardCases, AllPartsTogetherWithATable) {
  Scene scene;
  scene.device.structure = StructureModel{};
  scene.device.delay = 0.00033;
  scene.table = true;
  scene.motion.start_position = scene.start.position = 0.002;
  const Difference worst = compare(scene, wall_commands(scene, 5500.0, 80));
  EXPECT_LT(worst.position, 1e-12);
  EXPECT_LT(worst.velocity, 1e-10);
  EXPECT_GT(worst.stops, 5);
}

// A stop, the change of a delayed command, the end of an interval and the corner of the motion, all at one
// instant: numbers that binary arithmetic holds exactly.
TEST(CoupledHandleHardCases, CoincidingEvents) {
  Scene scene;
  scene.held = false;
  scene.device = {0.0625, 0.0, 0.125, 0.0};
  scene.device.delay = 0x1p-10;
  scene.interval = 0x1p-9;
  std::vector<double> commands;
  for (int n = 0; n < 200; ++n) commands.push_back(n % 2 == 0 ? 0.375 : -0.125);
  const Difference alone = compare(scene, commands);
  EXPECT_LT(alone.position, 1e-13);
  EXPECT_LT(alone.velocity, 1e-13);

  // The net force equals the friction exactly: it sticks, and a hair more makes it slide.
  CoupledHandle exact(scene.device, HandleStart{});
  for (int n = 0; n < 100; ++n) exact.advance(0.125, 0.0, scene.interval);
  EXPECT_EQ(exact.position(), 0.0);
  for (int n = 0; n < 2; ++n) exact.advance(std::nextafter(0.125, 1.0) + 1e-12, 0.0, scene.interval);
  EXPECT_GT(exact.position(), 0.0);
}

// Random scenes: forces that change in every sample, all parts, light and heavy.
TEST(CoupledHandleHardCases, RandomScenes) {
  std::mt19937_64 random(20);
  const auto between = [&random](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>(0.0, 1.0)(random));
  };
  int stops = 0;
  int stuck = 0;
  for (int n = 0; n < 30; ++n) {
    Scene scene;
    scene.device = {between(1e-3, 0.5), between(1e-3, 2.0), between(1e-3, 1.0), 3.3};
    if (n % 2 == 1)
      scene.device.structure = StructureModel{between(1e3, 1e5), between(0.01, 2.0), between(0.005, 0.1)};
    if (n % 3 == 1) scene.device.delay = between(1e-4, 0.01);
    scene.held = n % 5 != 4;
    scene.person.grip_stiffness = between(50.0, 5e3);
    scene.person.grip_damping = between(1e-2, 10.0);
    scene.motion.approach_speed = between(0.001, 1.0);
    scene.motion.start_position = scene.start.position = 0.001;
    scene.start.velocity = n % 4 == 0 ? 0.1 : 0.0;
    scene.table = scene.held && n % 7 < 3;
    std::vector<double> commands;
    const double size = between(0.1, 4.0);
    for (int k = 0; k < 24; ++k) {
      if (k % 3 != 0) {
        commands.push_back(commands.back());
        continue;
      }
      commands.push_back(std::uniform_real_distribution<double>(-size, size)(random));
    }
    const Difference worst = compare(scene, commands);
    EXPECT_LT(worst.position, 1e-12) << n;
    EXPECT_LT(worst.velocity, 1e-9) << n;
    stops += worst.stops;
    stuck += worst.stuck;
  }
  EXPECT_GT(stops, 100);
  EXPECT_GT(stuck, 50);
}

// Ten million intervals without friction or damping.
double energy_drift(DeviceModel device, double interval, bool held, long intervals) {
  device.damping = device.friction = 0.0;
  if (device.structure) device.structure->damping = 0.0;
  OperatorModel person;
  person.grip_damping = person.arm_damping = 0.0;
  IntendedMotionConfig motion;
  CoupledHandle handle = held ? CoupledHandle(device, person, motion, HandleStart{motion.start_position, 0.5})
                              : CoupledHandle(device, HandleStart{0.0, 0.5});
  if (!held) handle.advance(10.0, 0.0, 0.001);  // sets the structure swinging
  const double energy = handle.energy();
  double worst = 0.0;
  for (long n = 0; n < intervals; ++n) {
    handle.advance(0.0, 0.0, interval);
    if (n % 100'000 == 0) worst = std::max(worst, std::abs(handle.energy() / energy - 1.0));
  }
  return std::max(worst, std::abs(handle.energy() / energy - 1.0));
}

TEST(CoupledHandleHardCases, NoEnergyIsGainedOrLostInTenMillionIntervals) {
  DeviceModel plain;
  DeviceModel bending;
  bending.structure = StructureModel{};
  constexpr long ten_million = 10'000'000;
  EXPECT_LT(energy_drift(plain, 0.002, true, ten_million), 1e-6);
  EXPECT_LT(energy_drift(plain, 50e-6, true, ten_million), 1e-6);
  EXPECT_LT(energy_drift(bending, 50e-6, true, ten_million), 1e-6);
  EXPECT_LT(energy_drift(bending, 0.002, false, 1'000'000), 1e-6);
}

}  // namespace
}  // namespace kmax::simulation::coupled_handle_hard_cases_test
