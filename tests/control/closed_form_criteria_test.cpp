#include "control/closed_form_criteria.hpp"

#include <gtest/gtest.h>

#include "control/stability_criteria.hpp"

namespace kmax::control {
namespace {

// What the firmware judges with is what the host judges with: stability_criteria_test.cpp tests both, through
// judge().
TEST(ClosedFormCriteria, AreTheSameAsThoseOfTheWholeSet) {
  StabilityCase<float> c;
  c.stiffness = 1000.0f;
  c.magnetic_coefficient = 1.0f;
  c.magnetic_length = 1e-3f;
  c.period = 1e-3f;
  c.quantum = 50e-6f;
  c.mass = 0.05f;
  c.damping = 0.7f;
  c.friction = 0.05f;
  c.operator_force = 0.5f;
  c.operator_speed = 0.1f;
  c.force_limit = 3.0f;
  for (std::size_t i = 0; i < criterion_count; ++i) {
    const auto criterion = static_cast<Criterion>(i);
    const auto here = judge_closed_form(criterion, c), whole = judge(criterion, c);
    EXPECT_EQ(here.criterion, criterion);
    EXPECT_TRUE(whole.applies) << i;
    if (criterion == Criterion::sampled_eigenvalues) {
      EXPECT_TRUE(!here.applies && here.pass);
      continue;
    }
    EXPECT_EQ(here.applies, whole.applies) << i;
    EXPECT_EQ(here.pass, whole.pass) << i;
    EXPECT_EQ(here.at_least, whole.at_least) << i;
    EXPECT_EQ(here.value, whole.value) << i;
    EXPECT_EQ(here.bound, whole.bound) << i;
  }
}

}  // namespace
}  // namespace kmax::control
