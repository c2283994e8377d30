// CoupledHandle against an independent brute-force solution of the same equations.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host_tools/simulation/coupled_handle.hpp"
#include "tests/host_tools/simulation/drawn_models.hpp"
#include "tests/host_tools/simulation/reference_handle.hpp"

namespace kmax::simulation::coupled_handle_reference_test {
namespace {

constexpr double period = 0.002;

struct Difference {
  double position = 0.0;
  double velocity = 0.0;
  int stops = 0;
  int stuck = 0;
};

Difference compare(const DeviceModel& device, const OperatorModel& person, const IntendedMotionConfig& motion,
                   const std::vector<std::array<double, 2>>& forces, double interval, double longest_step) {
  CoupledHandle handle(device, person, motion);
  ReferenceHandle reference(device, &person, motion, motion.start_position, 0.0, longest_step);
  handle.begin_motion();
  reference.begin();
  Difference worst;
  for (const auto& [force, background] : forces) {
    handle.advance(force, background, interval);
    reference.advance(force, background, interval);
    const auto apart = [](double a, long double b) { return std::abs(static_cast<double>(a - b)); };
    worst.position = std::max({worst.position, apart(handle.position(), reference.position()),
                               apart(handle.hand_position(), reference.hand_position())});
    worst.velocity = std::max({worst.velocity, apart(handle.velocity(), reference.velocity()),
                               apart(handle.hand_velocity(), reference.hand_velocity())});
    worst.stuck += handle.sticking() ? 1 : 0;
  }
  worst.stops = reference.stops();
  EXPECT_EQ(handle.event_limit_hits(), 0u);
  return worst;
}

TEST(CoupledHandleReference, AgreesThroughAContactThatOscillates) {
  const DeviceModel device;
  const OperatorModel person;
  IntendedMotionConfig motion;
  motion.start_position = 0.004;
  // The forces of a wall of 5.5 N/mm with a field of 1 N, recorded in closed loop and then applied to both.
  CoupledHandle handle(device, person, motion);
  handle.begin_motion();
  std::vector<std::array<double, 2>> forces;
  for (int n = 0; n < 200; ++n) {
    const double depth = -handle.position();
    const double field = depth >= 0.0 ? 1.0 : 1.0 / std::pow(1.0 - depth / 1e-3, 2);
    forces.push_back({field + (depth > 0.0 ? 5500.0 * depth : 0.0), field});
    handle.advance(forces.back()[0], forces.back()[1], period);
  }
  const Difference worst = compare(device, person, motion, forces, period, 1e-6);
  EXPECT_LT(worst.position, 1e-12);
  EXPECT_LT(worst.velocity, 1e-10);
  EXPECT_GT(worst.stops, 10);
}

TEST(CoupledHandleReference, AgreesInStickSlip) {
  DeviceModel device;
  device.friction = 0.6;
  device.mass = 0.02;
  OperatorModel person;
  person.grip_damping = 0.1;  // little damping: the handle is dragged in jerks
  person.grip_stiffness = 2000.0;
  IntendedMotionConfig motion;
  motion.approach_speed = 0.02;
  std::vector<std::array<double, 2>> forces;
  for (int n = 0; n < 250; ++n) forces.push_back({0.3 * std::sin(n * 0.11), 0.0});
  const Difference worst = compare(device, person, motion, forces, period, 1e-6);
  EXPECT_LT(worst.position, 1e-12);
  EXPECT_LT(worst.velocity, 1e-10);
  EXPECT_GT(worst.stops, 3);
  EXPECT_GT(worst.stuck, 10);
}

TEST(CoupledHandleReference, AgreesForAGramAndAMegaNewtonPerMetre) {
  DeviceModel device;
  device.mass = 1e-3;
  OperatorModel person;
  person.grip_stiffness = 1e6;
  person.grip_damping = 3.0;
  IntendedMotionConfig motion;
  std::vector<std::array<double, 2>> forces;
  for (int n = 0; n < 10; ++n) forces.push_back({n % 3 == 0 ? 3.0 : -2.0, 0.5});
  const Difference worst = compare(device, person, motion, forces, period, 2e-7);
  EXPECT_LT(worst.position, 1e-12);
  EXPECT_LT(worst.velocity, 1e-8);
  EXPECT_GT(worst.stops, 10);
}

RC_GTEST_PROP(CoupledHandleReference, AgreesForAnyParameters, ()) {
  const DeviceModel device = drawn_device();
  const OperatorModel person = drawn_person();
  IntendedMotionConfig motion;
  motion.approach_speed = drawn_between(0.01, 1.0);
  motion.start_position = *rc::gen::inRange(0, 3) * 1e-3;
  std::vector<std::array<double, 2>> forces;
  for (int n = 0; n < 8; ++n) {
    forces.push_back({*rc::gen::inRange(-400, 401) * 0.01, *rc::gen::inRange(0, 20) * 0.1});
  }
  // The reference's own error, (w h)^4 / 120 per radian, must stay out of sight for a light handle in a stiff
  // grip.
  const double fastest = std::sqrt(3.0 * person.grip_stiffness / device.mass);
  const Difference worst = compare(device, person, motion, forces, period, std::min(1e-6, 4e-3 / fastest));
  RC_TAG(worst.stops > 0 ? "stops" : "never stops");
  RC_ASSERT(worst.position < 1e-11);
  RC_ASSERT(worst.velocity < 1e-8);
}

}  // namespace
}  // namespace kmax::simulation::coupled_handle_reference_test
