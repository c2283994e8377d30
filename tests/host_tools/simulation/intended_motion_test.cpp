#include "host_tools/simulation/intended_motion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <stdexcept>

namespace kmax::simulation::intended_motion_test {

IntendedMotionConfig example() {
  return IntendedMotionConfig{
      .start_position = 0.02, .approach_speed = 0.2, .push_force = 1.0, .hold_time = 0.5};
}

// The short cut says the same as advance() wherever it applies, and applies to nearly all pieces.
TEST(IntendedMotion, WithoutACornerTheShortCutGivesTheSamePath) {
  for (const double piece : {50e-6, 0.002, 0.0123}) {
    IntendedMotion quick(example());
    IntendedMotion plain(example());
    int short_cuts = 0;
    int pieces = 0;
    for (double time = 0.0; time < 2.0; time += piece, ++pieces) {
      if (pieces == 10) {
        quick.begin();
        plain.begin();
      }
      const double target =
          -0.01 + (time > 0.3 && time < 0.4 ? 0.05 * (time - 0.3) : 0.0) + (time > 0.5 ? -0.003 : 0.0);
      IntendedMotion::Segment segment;
      const IntendedMotion::Path path = plain.advance(piece, target);
      if (quick.advance_without_corner(piece, target, segment)) {
        ++short_cuts;
        ASSERT_EQ(path.count, 1);
        ASSERT_EQ(segment.duration, path.segments[0].duration);
        ASSERT_EQ(segment.start, path.segments[0].start);
        ASSERT_EQ(segment.rate, path.segments[0].rate);
      } else {
        quick.advance(piece, target);
      }
      ASSERT_EQ(quick.position(), plain.position());
      ASSERT_EQ(quick.elapsed(), plain.elapsed());
      ASSERT_EQ(quick.phase(), plain.phase());
      ASSERT_EQ(quick.hold_end(), plain.hold_end());
    }
    EXPECT_GT(short_cuts, pieces / 2);
    EXPECT_EQ(quick.phase(), MotionPhase::done);
  }
}

TEST(IntendedMotion, TargetPressesWithThePushOnTheSurface) {
  IntendedMotionConfig config = example();
  config.wall_position = 0.003;
  EXPECT_DOUBLE_EQ(IntendedMotion(config).target_for(1.5, 100.0), 0.003 - 0.015);
  config.wall_side = -1.0;
  config.start_position = -0.02;
  EXPECT_DOUBLE_EQ(IntendedMotion(config).target_for(1.5, 100.0), 0.003 + 0.015);
}

TEST(IntendedMotion, PhasesBeginAndEndWhereTheyMustForAnyDivisionOfTime) {
  const double target = -0.01;
  for (const double piece : {50e-6, 0.002, 0.0123, 0.7, 5.0}) {
    IntendedMotion motion(example());
    EXPECT_EQ(motion.phase(), MotionPhase::rest);
    motion.advance(piece, target);
    EXPECT_EQ(motion.position(), 0.02);
    EXPECT_EQ(motion.elapsed(), 0.0);
    EXPECT_FALSE(motion.hold_begin());
    motion.begin();
    EXPECT_EQ(motion.phase(), MotionPhase::approach);
    for (int n = 0; n * piece < 1.5; ++n) {
      motion.advance(piece, target);
      // 30 mm at 0.2 m/s, 0.5 s, and back.
      const double now = (n + 1) * piece;
      const double expected = now < 0.15   ? 0.02 - 0.2 * now
                              : now < 0.65 ? target
                              : now < 0.80 ? target + 0.2 * (now - 0.65)
                                           : 0.02;
      ASSERT_NEAR(motion.position(), expected, 1e-12) << "piece " << piece << " at " << now;
    }
    ASSERT_TRUE(motion.hold_begin());
    EXPECT_NEAR(*motion.hold_begin(), 0.15, 1e-11);
    EXPECT_NEAR(*motion.hold_end(), 0.65, 1e-11);
    EXPECT_EQ(motion.phase(), MotionPhase::done);
    EXPECT_EQ(motion.position(), 0.02);
  }
}

TEST(IntendedMotion, OnePieceCanHoldAllPhases) {
  IntendedMotion motion(example());
  motion.advance(1e-3, -0.01);
  motion.begin();
  const IntendedMotion::Path path = motion.advance(2.0, -0.01);
  ASSERT_EQ(path.count, 4);
  EXPECT_NEAR(path.segments[0].rate, -0.2, 1e-15);
  EXPECT_NEAR(path.segments[1].rate, 0.0, 1e-15);
  EXPECT_NEAR(path.segments[2].rate, 0.2, 1e-15);
  EXPECT_NEAR(path.segments[3].duration, 1.2, 1e-12);
}

TEST(IntendedMotion, HoldFollowsTheTargetButNotFasterThanTheApproach) {
  IntendedMotionConfig config = example();
  config.start_position = 0.0;
  config.hold_time = 100.0;
  IntendedMotion motion(config);
  motion.advance(1e-3, 0.0);
  motion.begin();
  motion.advance(0.1, -0.01);  // slower than 0.2 m/s: kept up with
  EXPECT_EQ(motion.position(), -0.01);
  motion.advance(0.1, -0.05);  // 0.4 m/s: falls behind
  EXPECT_NEAR(motion.position(), -0.03, 1e-15);
  const IntendedMotion::Path path = motion.advance(0.2, -0.05);  // catches up after 0.1 s
  EXPECT_EQ(motion.position(), -0.05);
  ASSERT_EQ(path.count, 2);
  EXPECT_NEAR(path.segments[0].duration, 0.1, 1e-12);
}

TEST(IntendedMotion, CanBeStartedAgain) {
  IntendedMotion motion(example());
  motion.advance(1e-3, -0.01);
  motion.begin();
  motion.advance(2.0, -0.01);
  ASSERT_EQ(motion.phase(), MotionPhase::done);
  motion.begin();
  EXPECT_EQ(motion.elapsed(), 0.0);
  EXPECT_FALSE(motion.hold_begin());
  motion.advance(0.15 + 1e-9, -0.01);
  EXPECT_EQ(motion.phase(), MotionPhase::hold);
  EXPECT_NEAR(*motion.hold_begin(), 0.15, 1e-12);
}

TEST(IntendedMotion, NoHoldAndNoDistanceStillPassThroughAllPhases) {
  IntendedMotionConfig config = example();
  config.start_position = 0.0;
  config.hold_time = 0.0;
  IntendedMotion motion(config);
  motion.begin();
  const IntendedMotion::Path path = motion.advance(0.01, 0.0);
  EXPECT_EQ(motion.phase(), MotionPhase::done);
  ASSERT_EQ(path.count, 1);
  EXPECT_EQ(path.segments[0].duration, 0.01);
}

TEST(IntendedMotion, RefusesWhatMakesNoSense) {
  const auto refused = [](auto change) {
    IntendedMotionConfig config = example();
    change(config);
    EXPECT_THROW(IntendedMotion{config}, std::invalid_argument);
  };
  refused([](IntendedMotionConfig& c) { c.wall_side = 0.5; });
  refused([](IntendedMotionConfig& c) { c.wall_side = 0.0; });
  refused([](IntendedMotionConfig& c) { c.start_position = -0.001; });
  refused([](IntendedMotionConfig& c) { c.wall_side = -1.0; });
  refused([](IntendedMotionConfig& c) { c.approach_speed = 0.0; });
  refused([](IntendedMotionConfig& c) { c.hold_time = -1.0; });
  refused([](IntendedMotionConfig& c) { c.push_force = std::numeric_limits<double>::quiet_NaN(); });
}

RC_GTEST_PROP(IntendedMotion, IsContinuousNeverTooFastAndCoversTheTime, ()) {
  IntendedMotionConfig config = example();
  config.hold_time = *rc::gen::inRange(0, 100) / 1000.0;
  config.start_position = *rc::gen::inRange(0, 30) / 1000.0;
  IntendedMotion motion(config);
  double position = motion.position();
  double elapsed = 0.0;
  const int begin_at = *rc::gen::inRange(0, 3);
  for (int n = 0; n < 40; ++n) {
    if (n == begin_at) motion.begin();
    const double duration = *rc::gen::inRange(1, 20000) * 1e-6;
    const double target = -*rc::gen::inRange(0, 20000) * 1e-6;
    const IntendedMotion::Path path = motion.advance(duration, target);
    double covered = 0.0;
    for (int s = 0; s < path.count; ++s) {
      const IntendedMotion::Segment& segment = path.segments[static_cast<std::size_t>(s)];
      RC_ASSERT(segment.duration > 0.0);
      RC_ASSERT(std::abs(segment.start - position) < 1e-12);
      RC_ASSERT(std::abs(segment.rate) <= config.approach_speed);
      position = segment.start + segment.rate * segment.duration;
      covered += segment.duration;
    }
    RC_ASSERT(path.count < IntendedMotion::max_segments);
    RC_ASSERT(std::abs(covered - duration) < 1e-15);
    RC_ASSERT(std::abs(position - motion.position()) < 1e-12);
    position = motion.position();
    if (n >= begin_at) elapsed += duration;
    RC_ASSERT(std::abs(motion.elapsed() - elapsed) < 1e-12);
  }
}

}  // namespace kmax::simulation::intended_motion_test
