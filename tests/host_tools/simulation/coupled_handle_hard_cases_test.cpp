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

using Real = PreciseChain::Real;

struct Scene {
  DeviceModel device{};
  OperatorModel person{};
  bool held = true;
  IntendedMotionConfig motion{};
  double position = 0.002;  // m, where handle and motion start
  double velocity = 0.0;    // m/s, of the handle
  double interval = 0.002;
  bool table = false;

  CoupledHandle handle() const {
    const HandleStart start{position, velocity};
    CoupledHandle handle =
        held ? CoupledHandle(device, person, intended(), start) : CoupledHandle(device, start);
    if (table) handle.share(std::make_shared<PropagatorTable>(device, person));
    if (held) handle.begin_motion();
    return handle;
  }
  IntendedMotionConfig intended() const {
    IntendedMotionConfig config = motion;
    config.start_position = position;
    return config;
  }
};

struct Command {
  double force;
  double background = 0.0;
};

// Of all masses and samples.
struct Agreement {
  double position = 1e-12;  // m, largest difference
  double velocity = 1e-10;  // m/s
  int stops = 0;            // number of, at least
  int break_aways = 0;
  int stuck = 0;  // samples
};

// The commands in effect during one interval, oldest first, split where a delayed one takes effect: in exact
// times.
struct Held {
  Real duration;
  double force;
};

std::vector<Held> in_effect(const std::vector<Command>& commands, std::size_t n, double interval,
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
    pieces.push_back({until - now, index < 0 ? 0.0 : commands[static_cast<std::size_t>(index)].force});
    now = until;
  }
  return pieces;
}

// What operator_model.hpp says of the background force: how much stiffer and by how much harder the arm is.
struct Response {
  OperatorModel person;
  double activation = 0.0, push = 0.0;

  // Over a piece of time; returns the gain in its middle.
  double to(double background, double duration) {
    const double excess = activation - background;
    activation = background + excess * std::exp(-duration / person.activation_time);
    push = background + (push - background) * std::exp(-duration / person.push_lag);
    return 1.0 + person.activation_gain *
                     (background + excess * std::exp(-0.5 * duration / person.activation_time));
  }
  double target(const IntendedMotionConfig& motion) const {
    const double springs = 1.0 / person.grip_stiffness + 1.0 / person.arm_stiffness;
    return motion.wall_position - motion.wall_side * (motion.push_force + push) * springs /
                                      (1.0 + person.activation_gain * activation);
  }
};

Agreement compare(const Scene& scene, const std::vector<Command>& commands) {
  const OperatorModel* person = scene.held ? &scene.person : nullptr;
  const IntendedMotionConfig intended = scene.intended();
  CoupledHandle handle = scene.handle();
  const std::size_t tip = scene.device.structure ? 1 : 0;
  PreciseChain precise(held_chain(scene.device, person, 1.0), scene.position, scene.velocity, tip + 1);
  Response response{scene.person};
  IntendedMotion motion(intended);
  if (scene.held) motion.begin();
  Agreement worst{.position = 0.0, .velocity = 0.0};
  for (std::size_t n = 0; n < commands.size(); ++n) {
    handle.advance(commands[n].force, commands[n].background, scene.interval);
    for (const Held& piece : in_effect(commands, n, scene.interval, scene.device.delay)) {
      const auto duration = static_cast<double>(piece.duration);
      const double limit = scene.device.force_limit;
      const double force = limit > 0.0 ? std::clamp(piece.force, -limit, limit) : piece.force;
      if (scene.held)
        precise.change(held_chain(scene.device, person, response.to(commands[n].background, duration)));
      const IntendedMotion::Path path = motion.advance(duration, response.target(intended));
      Real left = piece.duration;
      for (int s = 0; s < path.count; ++s) {
        const auto& straight = path.segments[static_cast<std::size_t>(s)];
        const Real part = s + 1 == path.count ? left : Real(straight.duration);
        precise.advance(force, scene.held ? Real(straight.start) : Real(0),
                        scene.held ? Real(straight.rate) : Real(0), part);
        left -= part;
      }
    }
    const auto differ = [&](double position, double velocity, std::size_t mass) {
      const auto apart = [](double a, const Real& b) { return std::abs(static_cast<double>(Real(a) - b)); };
      worst.position = std::max(worst.position, apart(position, precise.position(mass)));
      worst.velocity = std::max(worst.velocity, apart(velocity, precise.velocity(mass)));
    };
    differ(handle.position(), handle.velocity(), 0);
    differ(handle.tip_position(), handle.tip_velocity(), tip);
    if (scene.held) differ(handle.hand_position(), handle.hand_velocity(), tip + 1);
    worst.stuck += handle.sticking() ? 1 : 0;
  }
  EXPECT_EQ(handle.event_limit_hits(), 0u);
  worst.stops = precise.stops();
  worst.break_aways = precise.break_aways();
  return worst;
}

void expect_agreement(const Scene& scene, const std::vector<Command>& commands, const Agreement& wanted) {
  const Agreement found = compare(scene, commands);
  EXPECT_LT(found.position, wanted.position);
  EXPECT_LT(found.velocity, wanted.velocity);
  EXPECT_GE(found.stops, wanted.stops);
  EXPECT_GE(found.break_aways, wanted.break_aways);
  EXPECT_GE(found.stuck, wanted.stuck);
}

// Commands of a wall of `stiffness` with a field of `field` newtons in closed loop, to be given to both open
// loop: the loop itself is chaotic.
std::vector<Command> wall_commands(const Scene& scene, double stiffness, int samples, double field = 0.0) {
  CoupledHandle handle = scene.handle();
  std::vector<Command> commands;
  for (int n = 0; n < samples; ++n) {
    const double depth = -handle.position();
    const double background = depth >= 0.0 ? field : field / std::pow(1.0 - depth / 1e-3, 2);
    commands.push_back({background + std::max(0.0, stiffness * depth), background});
    handle.advance(commands.back().force, background, scene.interval);
  }
  return commands;
}

double largest_force(const std::vector<Command>& commands) {
  return std::ranges::max(commands, {}, &Command::force).force;
}

TEST(CoupledHandleHardCases, StickSlipAtNearlyNoSpeed) {
  for (const double speed : {1e-4, 1e-3}) {
    SCOPED_TRACE(speed);
    const Scene scene{.device = {0.045, 0.05, 0.06, 0.0},
                      .person = {.grip_damping = 0.0, .arm_stiffness = 2000.0},
                      .motion = {.approach_speed = speed},
                      .position = 0.02,
                      .interval = speed < 5e-4 ? 0.01 : 0.002};
    expect_agreement(scene, std::vector<Command>(400, {0.02}), {.break_aways = 1, .stuck = 51});
  }
}

// Little damping: the handle is dragged in jerks.
TEST(CoupledHandleHardCases, StickSlipUnderASwingingForce) {
  std::vector<Command> commands;
  for (int n = 0; n < 250; ++n) commands.push_back({0.3 * std::sin(n * 0.11)});
  expect_agreement({.device = {.mass = 0.02, .friction = 0.6},
                    .person = {.grip_stiffness = 2000.0, .grip_damping = 0.1},
                    .motion = {.approach_speed = 0.02},
                    .position = 0.02},
                   commands, {.stops = 4, .stuck = 11});
}

TEST(CoupledHandleHardCases, AContactThatOscillatesInAField) {
  const Scene scene{.position = 0.004};
  expect_agreement(scene, wall_commands(scene, 5500.0, 200, 1.0), {.stops = 11});
}

TEST(CoupledHandleHardCases, AGramInAGripOfAMegaNewtonPerMetre) {
  std::vector<Command> commands;
  for (int n = 0; n < 10; ++n) commands.push_back({n % 3 == 0 ? 3.0 : -2.0, 0.5});
  expect_agreement(
      {.device = {.mass = 1e-3}, .person = {.grip_stiffness = 1e6, .grip_damping = 3.0}, .position = 0.02},
      commands, {.velocity = 1e-8, .stops = 11});
}

TEST(CoupledHandleHardCases, AWallOfAMegaNewtonPerMetreAndAGram) {
  for (const double mass : {1e-3, 0.045}) {
    for (const double limit : {0.0, 3.3}) {
      SCOPED_TRACE(testing::Message() << mass << " " << limit);
      const Scene scene{.device = {mass, 0.05, 0.093, limit}, .position = 0.001};
      // Without a limit the light handle is thrown about by kilonewtons: errors are relative to that.
      const std::vector<Command> commands = wall_commands(scene, 1e6, 40);
      const double scale = std::max(1.0, limit > 0.0 ? limit : largest_force(commands));
      expect_agreement(scene, commands, {.position = 1e-12 * scale, .velocity = 1e-10 * scale, .stops = 4});
    }
  }
}

TEST(CoupledHandleHardCases, DelaysOfPartsAndOfSeveralSamples) {
  for (const double delay : {1e-6, 0.0007, 0.001, 0.002, 0.00474, 0.006, 0.0199}) {
    SCOPED_TRACE(delay);
    const Scene scene{.device = {.delay = delay}};
    expect_agreement(scene, wall_commands(scene, 5500.0, 60), {.stops = 2});
  }
}

TEST(CoupledHandleHardCases, DeepSaturation) {
  const Scene scene{.position = 0.001};
  const std::vector<Command> commands = wall_commands(scene, 1e8, 60);
  EXPECT_GT(largest_force(commands), 1e4);
  expect_agreement(scene, commands, {.stops = 6});
}

TEST(CoupledHandleHardCases, AStiffStructureHeldAndAlone) {
  for (const double stiffness : {2e4, 1e6}) {
    for (const bool held : {false, true}) {
      SCOPED_TRACE(testing::Message() << stiffness << " " << held);
      const Scene scene{
          .device = {.structure = StructureModel{stiffness, 0.5, stiffness > 1e5 ? 1e-3 : 0.02}},
          .held = held};
      std::vector<Command> commands = wall_commands(scene, 5500.0, stiffness > 1e5 ? 24 : 50);
      for (std::size_t n = 0; n < commands.size() && !held; ++n) commands[n] = {(n + 2) % 8 < 4 ? -1.5 : 1.5};
      expect_agreement(scene, commands, {.velocity = 1e-9, .stops = 2});
    }
  }
}

TEST(CoupledHandleHardCases, AllPartsTogetherWithATable) {
  const Scene scene{.device = {.delay = 0.00033, .structure = StructureModel{}}, .table = true};
  expect_agreement(scene, wall_commands(scene, 5500.0, 80), {.stops = 6});
}

// A stop, the change of a delayed command, the end of an interval and the corner of the motion, all at one
// instant: numbers that binary arithmetic holds exactly.
TEST(CoupledHandleHardCases, CoincidingEvents) {
  for (const double delay : {0.0, 0x1p-10}) {
    const Scene scene{
        .device = {.mass = 0.0625, .damping = 0.0, .friction = 0.125, .force_limit = 0.0, .delay = delay},
        .held = false,
        .position = 0.0,
        .interval = 0x1p-9};
    std::vector<Command> commands;
    for (int n = 0; n < 1000; ++n) commands.push_back({n % 2 == 0 ? 0.375 : -0.125});
    expect_agreement(scene, commands, {1e-13, delay == 0.0 ? 1e-15 : 1e-13});

    // The net force equals the friction exactly: it sticks, and a hair more makes it slide.
    CoupledHandle exact = scene.handle();
    for (int n = 0; n < 100; ++n) exact.advance(0.125, 0.0, scene.interval);
    EXPECT_EQ(exact.position(), 0.0);
    for (int n = 0; n < 2; ++n) exact.advance(std::nextafter(0.125, 1.0) + 1e-12, 0.0, scene.interval);
    EXPECT_GT(exact.position(), 0.0);
  }
}

// Random scenes: forces that change in every third sample, all parts, light and heavy.
TEST(CoupledHandleHardCases, RandomScenes) {
  std::mt19937_64 random(20);
  const auto between = [&random](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>(0.0, 1.0)(random));
  };
  int stops = 0;
  int stuck = 0;
  for (int n = 0; n < 60; ++n) {
    SCOPED_TRACE(n);
    Scene scene{.device = {between(1e-3, 0.5), between(1e-3, 2.0), between(1e-3, 1.0), 3.3},
                .person = {.grip_stiffness = between(50.0, 5e4),
                           .grip_damping = between(1e-2, 10.0),
                           .hand_mass = between(0.02, 1.0),
                           .arm_stiffness = between(20.0, 1000.0),
                           .arm_damping = between(0.1, 30.0)},
                .held = n % 5 != 4,
                .motion = {.approach_speed = between(0.001, 1.0)},
                .position = 0.001,
                .velocity = n % 4 == 0 ? 0.1 : 0.0};
    if (n % 2 == 1)
      scene.device.structure = StructureModel{between(1e3, 1e5), between(0.01, 2.0), between(0.005, 0.1)};
    if (n % 3 == 1) scene.device.delay = between(1e-4, 0.01);
    scene.table = scene.held && n % 7 < 3;
    std::vector<Command> commands;
    const double size = between(0.1, 4.0), field = scene.table ? 0.0 : between(0.01, 2.0);
    for (int k = 0; k < 24; ++k) {
      commands.push_back(k % 3 != 0 ? commands.back()
                                    : Command{std::uniform_real_distribution<double>(-size, size)(random),
                                              std::uniform_real_distribution<double>(0.0, field)(random)});
    }
    const Agreement found = compare(scene, commands);
    EXPECT_LT(found.position, 1e-12);
    EXPECT_LT(found.velocity, 1e-9);
    stops += found.stops;
    stuck += found.stuck;
  }
  EXPECT_GT(stops, 200);
  EXPECT_GT(stuck, 100);
}

// Without friction or damping.
TEST(CoupledHandleHardCases, NoEnergyIsGainedOrLostInTenMillionIntervals) {
  struct Case {
    bool structure, held;
    double interval;
    int intervals;
    double drift;
  };
  for (const auto& [structure, held, interval, intervals, drift] :
       {Case{false, true, 50e-6, 10'000'000, 1e-6}, Case{false, true, 0.002, 10'000'000, 1e-6},
        Case{true, true, 50e-6, 10'000'000, 1e-6}, Case{true, false, 0.002, 1'000'000, 1e-6},
        Case{false, true, 50e-6, 100'000, 1e-9}, Case{false, true, 0.002, 100'000, 1e-9},
        Case{false, true, 0.0137, 100'000, 1e-9}}) {
    SCOPED_TRACE(testing::Message() << structure << held << interval);
    DeviceModel device{.damping = 0.0, .friction = 0.0};
    if (structure) device.structure = StructureModel{.damping = 0.0};
    const OperatorModel person{.grip_damping = 0.0, .arm_damping = 0.0};
    const HandleStart start{.position = 0.02, .velocity = 0.5};
    CoupledHandle handle =
        held ? CoupledHandle(device, person, IntendedMotionConfig{}, start) : CoupledHandle(device, start);
    EXPECT_DOUBLE_EQ(handle.energy(), 0.5 * (structure ? 0.065 : 0.045) * 0.25);
    if (!held) handle.advance(10.0, 0.0, 0.001);  // sets the structure swinging
    const double energy = handle.energy();
    double worst = 0.0, farthest = 0.0;
    for (int n = 1; n <= intervals; ++n) {
      handle.advance(0.0, 0.0, interval);
      if (n % 1'000 != 0) continue;
      worst = std::max(worst, std::abs(handle.energy() / energy - 1.0));
      farthest = std::max(farthest, std::abs(handle.hand_position() - start.position));
    }
    EXPECT_LT(worst, drift);
    EXPECT_TRUE(farthest > 1e-3 || !held) << farthest;
  }
}

}  // namespace kmax::simulation::coupled_handle_hard_cases_test
