#include "host_tools/experiment/rate_hardness.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

namespace kmax::experiment {
namespace rate_hardness_test {
namespace {

/// A handle at a constant speed into a spring, sampled every `period` seconds, the first time in the wall at
/// 0.
std::vector<ContactForce> pressed(double stiffness, double speed, double period) {
  std::vector<ContactForce> trace;
  for (int n = -5; n < 100; ++n) {
    const double time = n * period, depth = time > 0.0 ? time * speed : 0.0;
    trace.push_back({time, n < 0 ? 1e-6 : -depth, stiffness * depth});
  }
  return trace;
}

RC_GTEST_PROP(RateHardness, OfASpringIsItsStiffnessWhateverTheRateAndTheSpeed, ()) {
  const double rate = *rc::gen::elementOf(std::vector<double>{100.0, 500.0, 1000.0, 20000.0});
  const double stiffness = *rc::gen::inRange(1, 50000), speed = 1e-3 * *rc::gen::inRange(1, 1000);
  const auto found = rate_hardness(pressed(stiffness, speed, 1.0 / rate), speed);
  // The sample before the contact and the first in the wall both have no force.
  const double samples = std::max(1.0, std::round(rate * rate_hardness_time));
  RC_ASSERT(found.has_value());
  RC_ASSERT(std::abs(*found - stiffness * (samples - 1.0) / samples) <= 1e-6 * stiffness);
}

TEST(RateHardness, CountsAStepAtTheSurface) {
  std::vector<ContactForce> trace = pressed(0.0, 0.1, 1e-3);
  for (ContactForce& sample : trace) sample.force = sample.time >= 0.0 ? 2.0 : 0.0;
  EXPECT_NEAR(rate_hardness(trace, 0.1).value(), 2.0 / 0.004 / 0.1, 1e-9);
}

TEST(RateHardness, OfATouchThatShowsTooLittleIsNone) {
  const std::vector<ContactForce> whole = pressed(1000.0, 0.1, 1e-3);
  EXPECT_TRUE(rate_hardness(whole, 0.1));
  EXPECT_FALSE(rate_hardness(whole, 0.0));
  EXPECT_FALSE(rate_hardness(whole, -0.1));
  EXPECT_FALSE(rate_hardness({}, 0.1));
  const std::span<const ContactForce> span(whole);
  EXPECT_FALSE(rate_hardness(span.first(5), 0.1)) << "never in the wall";
  EXPECT_FALSE(rate_hardness(span.first(9), 0.1)) << "ends at 3 ms";
  EXPECT_TRUE(rate_hardness(span.first(10), 0.1));
  EXPECT_FALSE(rate_hardness(span.subspan(5), 0.1)) << "nothing outside";
  std::vector<ContactForce> bounced = whole;
  bounced[7].distance = 1e-5;
  EXPECT_FALSE(rate_hardness(bounced, 0.1)) << "left at 2 ms";
  bounced = whole;
  bounced[9].distance = 1e-5;
  EXPECT_TRUE(rate_hardness(bounced, 0.1)) << "left at 4 ms";
}

}  // namespace
}  // namespace rate_hardness_test
}  // namespace kmax::experiment
