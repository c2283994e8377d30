// The contact conditions of paper 1, section 4.4 (figs. 9 to 12), with the default device and subject 1: K
// = 5.5 N/mm, 500 Hz, position quantum 0.055 mm, force clipped at 3.3 N, for a constant F_MC of 0, 1 and 2 N
// and the adaptive wall in its three modes. The wall law is written here, in double and from the paper's
// equations 5 to 7, so that the person's numbers are tied to the paper and not to the firmware.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "host_tools/simulation/contact_measure.hpp"
#include "host_tools/simulation/coupled_handle.hpp"

namespace kmax::simulation::contact_study_test {

enum class Field { constant, instant, latched, peak_hold };

struct Condition {
  Field field = Field::constant;
  double coefficient = 0.0;  // N, F_MC of the constant field
  double stiffness = 5500.0;
  // Details that no paper gives; the verdicts must not hang on them.
  bool round_to_nearest = false;
  double encoder_offset = 0.0;  // m
  double delay = 0.0;           // s, from the sample to the force
};

class LocalWall {
 public:
  static constexpr double period = 0.002;
  static constexpr double quantum = 0.055e-3;

  explicit LocalWall(const Condition& condition) : condition_(condition) {}

  struct Force {
    double total;
    double background;
  };

  Force sample(double true_position) {
    const double counts = (true_position + condition_.encoder_offset) / quantum;
    const double position =
        quantum * (condition_.round_to_nearest ? std::nearbyint(counts) : std::floor(counts));
    const double approach = first_ ? 0.0 : std::max(0.0, (previous_ - position) / period);
    first_ = false;
    previous_ = position;
    const bool inside = position <= 0.0;
    const double coefficient = coefficient_for(approach, inside);
    was_inside_ = inside;
    if (inside) return {coefficient - condition_.stiffness * position, coefficient};
    const double field = coefficient / std::pow(position / 1e-3 + 1.0, 2);
    return {field, field};
  }

 private:
  // Eq. 7 over the interval [0.8, 2.0] N that the paper found best.
  static double adaptive(double approach) { return std::min(2.0, 0.8 + 2.4 * std::min(1.0, approach / 2.4)); }

  double coefficient_for(double approach, bool inside) {
    switch (condition_.field) {
      case Field::constant:
        return condition_.coefficient;
      case Field::instant:
        return adaptive(approach);
      case Field::latched:  // follows outside, keeps the value of the first sample inside
        if (!inside || !was_inside_) held_ = adaptive(approach);
        return held_;
      case Field::peak_hold:  // decays to the resting value with 1.2 s
        held_ = std::max(adaptive(approach), 0.8 + (held_ - 0.8) * std::exp(-period / 1.2));
        return held_;
    }
    return 0.0;
  }

  Condition condition_;
  bool first_ = true;
  bool was_inside_ = false;
  double previous_ = 0.0;
  double held_ = 0.8;
};

struct Trial {
  ContactMeasure measure;
  double clipped_share;
};

Trial run(const Condition& condition, const IntendedMotionConfig& motion = {},
          const OperatorModel& person = {}, const DeviceModel& device = {}) {
  CoupledHandle handle(device, person, motion);
  handle.begin_motion();
  LocalWall wall(condition);
  LocalWall::Force previous{0.0, 0.0};
  std::vector<ContactSample> recording;
  while (!handle.motion().hold_end() || handle.motion().elapsed() < *handle.motion().hold_end() - 1e-9) {
    const LocalWall::Force force = wall.sample(handle.position());
    double left = LocalWall::period;
    if (condition.delay > 0.0) {
      handle.advance(previous.total, previous.background, condition.delay);
      left -= condition.delay;
    }
    for (int part = 0; part < 4; ++part) {
      handle.advance(force.total, force.background, left / 4);
      recording.push_back({handle.motion().elapsed(), handle.position()});
    }
    previous = force;
  }
  EXPECT_EQ(handle.event_limit_hits(), 0u);
  ContactCriterion criterion;
  criterion.window_end = *handle.motion().hold_end();
  criterion.window_begin = criterion.window_end - 1.0;
  return {measure_contact(recording, criterion), handle.clipped_share()};
}

double millimetres(const Trial& trial) {
  return trial.measure.peak_to_peak * 1e3;
}

TEST(ContactStudy, ConstantFieldsGiveTheVerdictsOfFigures9To11) {
  const Trial plain = run({.coefficient = 0.0});
  EXPECT_EQ(plain.measure.verdict, ContactVerdict::unstable);
  EXPECT_NEAR(millimetres(plain), 1.605, 0.02);

  const Trial one = run({.coefficient = 1.0});
  EXPECT_EQ(one.measure.verdict, ContactVerdict::unstable);
  EXPECT_LT(millimetres(one), 0.65 * millimetres(plain));
  EXPECT_NEAR(millimetres(one), 0.93, 0.05);

  const Trial two = run({.coefficient = 2.0});
  EXPECT_EQ(two.measure.verdict, ContactVerdict::stable);
  EXPECT_LT(millimetres(two), 0.01);
  EXPECT_LT(two.clipped_share, 0.02);
}

// Figure 12 of the paper shows a stable adaptive wall. This model does not reproduce it, in any mode: at 0.2
// m/s eq. 7 commands about 1 N, and 1 N is unstable (fig. 10). Written down as it is.
TEST(ContactStudy, AdaptiveFieldsOscillateUnlikeFigure12) {
  for (const Field field : {Field::instant, Field::latched, Field::peak_hold}) {
    const Trial trial = run({.field = field});
    EXPECT_EQ(trial.measure.verdict, ContactVerdict::unstable) << static_cast<int>(field);
    EXPECT_GT(millimetres(trial), 0.8);
    EXPECT_LT(millimetres(trial), 1.0);
  }
}

TEST(ContactStudy, VerdictsDoNotHangOnDetailsThatNobodyKnows) {
  for (const double speed : {0.17, 0.186, 0.2, 0.216, 0.23}) {
    for (const bool nearest : {false, true}) {
      for (const double offset : {0.0, 2e-5}) {
        for (const double delay : {0.0, 50e-6, 200e-6, 500e-6}) {
          IntendedMotionConfig motion{.approach_speed = speed};
          const auto trial = [&](double coefficient) {
            return run({.coefficient = coefficient,
                        .round_to_nearest = nearest,
                        .encoder_offset = offset,
                        .delay = delay},
                       motion);
          };
          const std::string what = "speed " + std::to_string(speed) + " nearest " + std::to_string(nearest) +
                                   " offset " + std::to_string(offset) + " delay " + std::to_string(delay);
          const Trial plain = trial(0.0);
          const Trial one = trial(1.0);
          const Trial two = trial(2.0);
          EXPECT_EQ(plain.measure.verdict, ContactVerdict::unstable) << what;
          EXPECT_GT(millimetres(plain), 1.5) << what;
          EXPECT_EQ(one.measure.verdict, ContactVerdict::unstable) << what;
          EXPECT_LT(millimetres(one), millimetres(plain)) << what;
          EXPECT_EQ(two.measure.verdict, ContactVerdict::stable) << what;
        }
      }
    }
  }
}

// Where the stability of 2 N comes from. The person who pushes through the field stands near the limit of 3.3
// N, and a clipped force cannot swing upwards: even a hand that does not stiffen is still at 2 N. Without
// clipping it swings by more than the plain wall, so figure 11 alone is no evidence for a stiffening hand.
TEST(ContactStudy, ClippingAloneMakesTwoNewtonsStable) {
  OperatorModel unchanged{.activation_gain = 0.0};
  DeviceModel unclipped{.force_limit = 0.0};
  EXPECT_EQ(run({.coefficient = 2.0}, {}, unchanged).measure.verdict, ContactVerdict::stable);
  const Trial free = run({.coefficient = 2.0}, {}, unchanged, unclipped);
  EXPECT_EQ(free.measure.verdict, ContactVerdict::unstable);
  EXPECT_GT(millimetres(free), millimetres(run({.coefficient = 0.0}, {}, unchanged, unclipped)));
  // At 1 N the stiffening itself shows, clipped or not.
  EXPECT_GT(millimetres(run({.coefficient = 1.0}, {}, unchanged)),
            1.2 * millimetres(run({.coefficient = 1.0})));
}

// A slow approach does not start the oscillation of 1 N and of the adaptive wall at all; that of the plain
// wall starts at any speed.
TEST(ContactStudy, ASlowApproachHidesTheInstabilityOfAWeakField) {
  IntendedMotionConfig slow{.approach_speed = 0.1};
  EXPECT_EQ(run({.coefficient = 0.0}, slow).measure.verdict, ContactVerdict::unstable);
  EXPECT_EQ(run({.coefficient = 1.0}, slow).measure.verdict, ContactVerdict::stable);
  EXPECT_EQ(run({.field = Field::instant}, slow).measure.verdict, ContactVerdict::stable);
}

double largest_stable_stiffness(Condition condition) {
  for (double stiffness = 1000.0; stiffness < 20000.0; stiffness += 100.0) {
    condition.stiffness = stiffness;
    if (run(condition).measure.verdict == ContactVerdict::unstable) return stiffness - 100.0;
  }
  return std::numeric_limits<double>::infinity();
}

TEST(ContactStudy, LargestStableStiffnessRisesWithTheField) {
  // One person, one speed, one push; the group means of the paper are 3580 and 8410 N/m.
  EXPECT_NEAR(largest_stable_stiffness({.coefficient = 0.0}), 3300.0, 200.0);
  EXPECT_NEAR(largest_stable_stiffness({.coefficient = 1.0}), 4400.0, 200.0);
  EXPECT_NEAR(largest_stable_stiffness({.coefficient = 2.0}), 10800.0, 500.0);
}

}  // namespace kmax::simulation::contact_study_test
