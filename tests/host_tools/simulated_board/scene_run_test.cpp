#include "host_tools/simulated_board/scene_run.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

namespace kmax::simulated_board::scene_run_test {
namespace {
using firmware::DriveState;

simulation::Scene touch(double duration) {
  simulation::Scene scene = open_scene("touch");
  scene.duration = duration;
  return scene;
}

void set(simulation::Scene& scene, const std::string& name, simulation::ParameterValue value) {
  for (auto& parameter : scene.parameters) {
    if (parameter.name == name) {
      parameter.value = value;
      return;
    }
  }
  scene.parameters.push_back({name, value, ""});
}

std::vector<std::uint64_t> bits_of(const RunResult& result) {
  std::vector<std::uint64_t> bits;
  auto all = result.samples;
  all.insert(all.end(), result.second_samples.begin(), result.second_samples.end());
  for (const RunSample& s : all) {
    for (const double value :
         {s.time, s.true_position, s.tip_position, s.true_velocity, s.hand_position, s.intended_position,
          s.position, s.velocity, s.force, s.applied_force, s.magnetic_coefficient})
      bits.push_back(std::bit_cast<std::uint64_t>(value));
  }
  return bits;
}

TEST(SceneRun, TheSameSceneGivesTheSameBits) {
  for (const char* name : {"touch", "two_axes", "free_handle", "noisy_encoder", "compliant_structure"}) {
    simulation::Scene scene = open_scene(name);
    scene.duration = 0.8;
    const RunResult first = run_scene(scene), second = run_scene(scene);
    ASSERT_GT(first.samples.size(), 300u) << name;
    EXPECT_EQ(bits_of(first), bits_of(second)) << name;
  }
  simulation::Scene changed = touch(0.8);
  set(changed, "wall.stiffness", 5499.0);
  EXPECT_NE(bits_of(run_scene(touch(0.8))), bits_of(run_scene(changed)))
      << "a test that must be able to fail";
}

// The whole way: counts, firmware, currents, motor, handle, and a person who presses 1 N against 2 N/mm.
TEST(SceneRun, PersonsPressAgainstWallsThatMotorsMake) {
  for (const char* name : {"motor_axes", "single_motor"}) {
    const simulation::Scene scene = open_scene(name);
    const RunResult result = run_scene(scene);
    EXPECT_EQ(result.end_state, DriveState::operation_enabled) << name << firmware::to_string(result.refusal);
    EXPECT_EQ(result.fault, firmware::Fault::none) << name;
    ASSERT_TRUE(result.contact) << name;
    EXPECT_LT(result.contact->peak_to_peak, 0.1e-3) << name;
    EXPECT_NEAR(result.contact->deepest, 0.5e-3, 0.15e-3) << name;
    EXPECT_EQ(result.clipped_share, 0.0) << "a motor has no clip of its own";
    double asked = 0, made = 0, held = 0;
    for (const RunSample& sample : result.samples) {
      if (sample.time < result.judged_from || sample.time > result.judged_to) continue;
      asked += sample.force;
      made += sample.applied_force;
      held += 1;
    }
    ASSERT_GT(held, 1000);
    EXPECT_GT(asked / held, 0.7) << name;
    // Without noise a steady current may stay half a code off: 10 mA are 0.05 N.
    EXPECT_NEAR(made / held, asked / held, 0.06) << name;
  }
}

TEST(SceneRun, HasEverySampleOfTheDurationAndTheFirmwaresNumbers) {
  const RunResult result = run_scene(touch(1.0));
  EXPECT_EQ(result.samples.size(), 500u);
  EXPECT_EQ(result.end_state, DriveState::operation_enabled);
  EXPECT_EQ(result.fault, firmware::Fault::none);
  EXPECT_FALSE(result.contact) << "the hold is not over";
  EXPECT_GE(result.simulated_s, 1.0);
  EXPECT_GT(result.real_s, 0.0);
  for (std::size_t i = 1; i < result.samples.size(); ++i)
    ASSERT_NEAR(result.samples[i].time - result.samples[i - 1].time, 0.002, 1e-12);
  for (const RunSample& sample : result.samples) {
    ASSERT_NEAR(sample.position, sample.true_position, 0.2e-3);
    ASSERT_LE(std::abs(sample.applied_force), 3.3 + 1e-6);
  }
}

TEST(SceneRun, AWholeHoldIsJudged) {
  const RunResult result = run_scene(touch(5.0));
  ASSERT_TRUE(result.contact);
  EXPECT_EQ(result.contact->verdict, simulation::ContactVerdict::unstable);
  EXPECT_DOUBLE_EQ(result.judged_to - result.judged_from, 1.0);
  EXPECT_GT(result.contact->deepest, 0.0);
  EXPECT_GE(result.limited_share, 0.0);
  EXPECT_LE(result.limited_share, 1.0);
}

TEST(SceneRun, AHandleNobodyHoldsIsNotJudged) {
  simulation::Scene scene = open_scene("free_handle");
  scene.duration = 0.5;
  const RunResult result = run_scene(scene);
  EXPECT_FALSE(result.contact);
  EXPECT_FALSE(result.samples.empty());
}

TEST(SceneRun, WhatKeepsItFromBeingArmedIsSaid) {
  simulation::Scene scene = open_scene("free_handle");
  scene.axes[0].start.position = -0.001;
  scene.axes[0].start.velocity = 0;
  const RunResult result = run_scene(scene);
  EXPECT_TRUE(result.samples.empty());
  EXPECT_EQ(result.refusal, firmware::Refusal::handle_inside_wall);
  EXPECT_NE(result.end_state, DriveState::operation_enabled);
  EXPECT_FALSE(result.contact);
}

TEST(SceneRun, BothAxesAreArmedAndSampledTogether) {
  simulation::Scene scene = open_scene("two_axes");
  scene.duration = 0.5;
  scene.axes[1].start.velocity = -0.3;
  const RunResult result = run_scene(scene);
  ASSERT_EQ(result.samples.size(), 250u);
  ASSERT_EQ(result.second_samples.size(), 250u);
  EXPECT_EQ(result.samples[100].time, result.second_samples[100].time);
  double deepest = 0.0, strongest = 0.0;
  for (const RunSample& sample : result.second_samples) {
    deepest = std::min(deepest, sample.true_position);
    strongest = std::max(strongest, sample.force);
  }
  EXPECT_LT(deepest, 0.0) << "axis 1 flies into its own wall";
  EXPECT_GT(strongest, 0.05);
  scene.duration = 0.05;
  set(scene, "axis1.haptic.rate", 20000.0);
  const RunResult quick = run_scene(scene);
  EXPECT_EQ(quick.samples.size(), 25u);
  EXPECT_EQ(quick.second_samples.size(), 1000u);
}

TEST(SceneRun, TheSecondAxisIsToldOfToo) {
  simulation::Scene scene = open_scene("two_axes");
  scene.duration = 0.5;
  scene.axes[1].start.position = -0.001;
  const RunResult refused = run_scene(scene);
  EXPECT_EQ(refused.axis, 1u);
  EXPECT_EQ(refused.refusal, firmware::Refusal::handle_inside_wall);
  EXPECT_TRUE(refused.samples.empty());
  scene.axes[1].start = {0.005, -1.0};
  set(scene, "axis1.velocity.limit", 0.5);
  const RunResult fast = run_scene(scene);
  EXPECT_EQ(fast.axis, 1u);
  EXPECT_EQ(fast.fault, firmware::Fault::over_speed);
  EXPECT_EQ(fast.end_state, DriveState::fault);
}

TEST(SceneRun, AnotherIntegratorIsAnotherTrace) {
  simulation::Scene scene = touch(1.0);
  const RunResult exact = run_scene(scene);
  const auto furthest = [&] {
    const RunResult other = run_scene(scene);
    double largest = 0.0;
    for (std::size_t n = 0; n < exact.samples.size(); ++n)
      largest = std::max(largest, std::abs(other.samples[n].true_position - exact.samples[n].true_position));
    return largest;
  };
  EXPECT_EQ(furthest(), 0.0);
  scene.duration = 0.1;  // the approach, still outside
  scene.integrator.kind = simulation::IntegratorKind::rk4;
  const RunResult stepped = run_scene(scene);
  EXPECT_NE(bits_of(stepped), bits_of(exact));
  EXPECT_NEAR(stepped.samples.back().true_position, exact.samples[stepped.samples.size() - 1].true_position,
              1e-6);
}

TEST(SceneRun, AFaultEndsTheForceAndIsReported) {
  simulation::Scene scene = touch(2.0);
  set(scene, "velocity.limit", 0.05);  // m/s; the approach is four times as fast
  const RunResult result = run_scene(scene);
  EXPECT_EQ(result.fault, firmware::Fault::over_speed);
  EXPECT_EQ(result.end_state, DriveState::fault);
  ASSERT_FALSE(result.samples.empty());
  EXPECT_EQ(result.samples.back().applied_force, 0.0);
}

}  // namespace
}  // namespace kmax::simulated_board::scene_run_test
