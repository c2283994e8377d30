#include "drivers/as5047p_angle.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <functional>

namespace kmax::drivers::as5047p_angle_test {

/// A chip by its data sheet, one frame late, and a line in between.
struct Encoder {
  explicit Encoder(const As5047pAngleConfig& config = {}) : driver(config) {}

  As5047pSample tick(std::int64_t position) {
    const std::uint16_t command = driver.ISR_command();
    EXPECT_TRUE(as5047p::parity_is_even(command));
    commands.push_back(command);
    const std::uint16_t reply = line(pending);
    pending = answer(command, position);
    return driver.ISR_decode(reply);
  }
  std::uint16_t answer(std::uint16_t command, std::int64_t position) {
    const bool bad = reject_next_command;
    reject_next_command = false;
    if (bad) {
      errors |= 4;
      return flagged(0);
    }
    switch (command & 0x3FFF) {
      case 0x0001: {
        const std::uint16_t found = errors;
        errors = 0;
        return flagged(found);
      }
      case 0x3FFC:
        return flagged(diagnostics);
      default:
        EXPECT_EQ(command, 0xFFFF);
        return flagged(static_cast<std::uint16_t>(position & 0x3FFF));
    }
  }
  std::uint16_t flagged(unsigned data) const {
    return as5047p::with_parity(static_cast<std::uint16_t>(data | (errors != 0 ? 0x4000U : 0U)));
  }
  /// Until valid; the count then belongs to the position before.
  void start(std::int64_t position) {
    for (int i = 0; i < 10; ++i) tick(position);
    ASSERT_EQ(driver.fault(), As5047pFault::none);
  }

  As5047pAngle driver;
  std::uint16_t pending = 0;
  std::uint16_t errors = 0;
  std::uint16_t diagnostics = 0x180;
  bool reject_next_command = false;
  std::function<std::uint16_t(std::uint16_t)> line = [](std::uint16_t word) { return word; };
  std::vector<std::uint16_t> commands;
};

// By the data sheet: DIAAGC, LF bit 8, COF 9, MAGH 10, MAGL 11, AGC below.
TEST(As5047pDiagnostics, EachBitIsItsOwn) {
  for (unsigned bit = 8; bit < 12; ++bit) {
    const As5047pDiagnostics found = as5047p_diagnostics(static_cast<std::uint16_t>(1U << bit | 0x5AU));
    EXPECT_EQ(found.ready, bit == 8);
    EXPECT_EQ(found.overflow, bit == 9);
    EXPECT_EQ(found.field_too_strong, bit == 10);
    EXPECT_EQ(found.field_too_weak, bit == 11);
    EXPECT_EQ(found.angle_valid(), bit == 8);
    EXPECT_EQ(found.gain, 0x5A);
  }
}

// By the data sheet: ERRFL.
TEST(As5047pErrors, EachBitIsItsOwn) {
  EXPECT_EQ(as5047p::framing_error, 1U);
  EXPECT_EQ(as5047p::invalid_command, 2U);
  EXPECT_EQ(as5047p::parity_error, 4U);
}

TEST(As5047pAngle, FollowsThroughManyTurnsBothWaysOneTickLate) {
  for (const int speed : {1, -1, 82, -82, 511, -511}) {
    Encoder encoder;
    std::int64_t position = 16'000;
    encoder.tick(position);
    encoder.tick(position + speed);
    encoder.tick(position + 2 * speed);
    As5047pSample sample = encoder.tick(position + 3 * speed);
    ASSERT_TRUE(sample.valid) << "three angles agree";
    const std::uint32_t begin = sample.count;
    for (int i = 4; i < 10'000; ++i) {
      sample = encoder.tick(position + i * speed);
      ASSERT_TRUE(sample.valid && !sample.held) << speed << " at " << i;
      ASSERT_EQ(sample.count - begin, static_cast<std::uint32_t>((i - 3) * speed)) << speed;
    }
  }
}

TEST(As5047pAngle, NothingIsValidBeforeThreeFramesAgree) {
  Encoder encoder;
  const As5047pSample first = encoder.tick(5000);
  EXPECT_FALSE(first.valid) << "the first reply belongs to nobody";
  EXPECT_EQ(first.count, 0U);
  EXPECT_FALSE(encoder.tick(5000).valid);
  EXPECT_FALSE(encoder.tick(9000).valid);
  EXPECT_FALSE(encoder.tick(9000).valid) << "9000 does not agree with 5000";
  EXPECT_FALSE(encoder.tick(9000).valid);
  EXPECT_TRUE(encoder.tick(9000).valid);
}

TEST(As5047pAngle, EverySingleFlippedBitIsHeldAndForgotten) {
  for (unsigned first = 0; first < 16; ++first) {
    for (unsigned second = first; second < 16; ++second) {
      Encoder encoder;
      encoder.start(8000);
      const auto flip = static_cast<std::uint16_t>(1U << first | 1U << second);
      encoder.line = [&](std::uint16_t word) { return static_cast<std::uint16_t>(word ^ flip); };
      const As5047pSample disturbed = encoder.tick(8000);
      EXPECT_TRUE(disturbed.valid);
      // Two bits leave the parity right; below the limit of a step they are just a noisy angle.
      EXPECT_NEAR(static_cast<double>(disturbed.count), 8000, 64) << first << " " << second;
      encoder.line = [](std::uint16_t word) { return word; };
      for (int i = 0; i < 5; ++i) encoder.tick(8000);
      const As5047pSample after = encoder.tick(8000);
      EXPECT_TRUE(after.valid && !after.held);
      EXPECT_EQ(after.count, 8000U);
    }
  }
}

TEST(As5047pAngle, HoldsAtMostAsLongAsItMayAndThenStaysInvalid) {
  for (const int bad : {1, 4, 5, 50}) {
    Encoder encoder;
    encoder.start(8000);
    encoder.line = [](std::uint16_t word) { return static_cast<std::uint16_t>(word ^ 1U); };
    for (int i = 0; i < bad; ++i) {
      const As5047pSample sample = encoder.tick(8000);
      EXPECT_EQ(sample.valid, i < 4) << i;
      EXPECT_TRUE(sample.held);
      EXPECT_EQ(sample.count, 8000U);
    }
    encoder.line = [](std::uint16_t word) { return word; };
    for (int i = 0; i < 100; ++i) encoder.tick(8000);
    const As5047pSample later = encoder.tick(8000);
    EXPECT_EQ(later.valid, bad <= 4) << "good frames do not bring a lost position back";
    EXPECT_EQ(later.held, bad > 4);
    EXPECT_EQ(encoder.driver.fault(), bad <= 4 ? As5047pFault::none : As5047pFault::parity);
    encoder.driver.restart();
    encoder.start(8000);
  }
}

TEST(As5047pAngle, PersistentJumpIsNeverAccepted) {
  Encoder encoder;
  encoder.start(8000);
  for (int i = 0; i < 20; ++i) {
    const As5047pSample sample = encoder.tick(11'000);
    ASSERT_EQ(sample.count, 8000U);
    ASSERT_EQ(sample.valid, i < 5) << i;  // one frame late, then four held
  }
  EXPECT_EQ(encoder.driver.fault(), As5047pFault::jump);
}

TEST(As5047pAngle, HeldFramesAreMadeUpForAtFullSpeed) {
  Encoder encoder;
  std::int64_t position = 0;
  for (int i = 0; i < 10; ++i) encoder.tick(position += 400);
  const std::uint32_t begin = encoder.tick(position += 400).count;
  for (int gap = 1; gap <= 4; ++gap) {
    encoder.line = [](std::uint16_t) { return std::uint16_t{0x8000}; };
    for (int i = 0; i < gap; ++i) ASSERT_TRUE(encoder.tick(position += 400).held);
    encoder.line = [](std::uint16_t word) { return word; };
    const As5047pSample sample = encoder.tick(position += 400);
    ASSERT_TRUE(sample.valid && !sample.held) << gap;
    ASSERT_EQ(sample.count % 16384, static_cast<std::uint32_t>(position - 400) % 16384);
  }
  EXPECT_EQ(encoder.tick(position + 400).count - begin, (1U + 2 + 3 + 4 + 4 + 1) * 400);
}

TEST(As5047pAngle, LineStuckHighAndLowAwayFromZero) {
  const auto fault_with = [](std::uint16_t word) {
    Encoder encoder;
    encoder.start(8000);
    encoder.line = [word](std::uint16_t) { return word; };
    for (int i = 0; i < 10; ++i) encoder.tick(8000);
    EXPECT_FALSE(encoder.tick(8000).valid);
    return encoder.driver.fault();
  };
  EXPECT_EQ(fault_with(0xFFFF), As5047pFault::stuck_high);
  EXPECT_EQ(fault_with(0x0000), As5047pFault::jump);
}

TEST(As5047pAngle, LineStuckLowWhileTheMagnetStandsAtZero) {
  Encoder encoder;
  encoder.start(2);
  encoder.line = [](std::uint16_t) { return std::uint16_t{0}; };
  int ticks = 0;
  while (encoder.tick(2).valid && ticks < 1000) ++ticks;
  EXPECT_LT(ticks, 36);
  EXPECT_EQ(encoder.driver.fault(), As5047pFault::stuck_low);
}

TEST(As5047pAngle, LineStuckLowFromTheStartNeverBecomesValid) {
  Encoder encoder;
  encoder.line = [](std::uint16_t) { return std::uint16_t{0}; };
  for (int i = 0; i < 1000; ++i) ASSERT_FALSE(encoder.tick(0).valid);
  Encoder high;
  high.line = [](std::uint16_t) { return std::uint16_t{0xFFFF}; };
  for (int i = 0; i < 1000; ++i) ASSERT_FALSE(high.tick(0).valid);
}

// The zeros before it belong to nobody then: three frames have to agree from there on.
TEST(As5047pAngle, AProbeThatFailsBeforeTheStartBeginsItAgain) {
  Encoder encoder;
  encoder.diagnostics = 0x80;  // LF = 0
  while (encoder.commands.empty() || (encoder.commands.back() & 0x3FFF) != 0x3FFC) {
    ASSERT_LT(encoder.commands.size(), 100U);
    EXPECT_FALSE(encoder.tick(0).valid);
  }
  for (const bool valid : {false, false, false, true}) EXPECT_EQ(encoder.tick(100).valid, valid);
}

TEST(As5047pAngle, MagnetThatReallyStandsAtZeroIsProbedAndStays) {
  Encoder encoder;
  for (int i = 0; i < 1000; ++i) encoder.tick(0);
  EXPECT_TRUE(encoder.tick(0).valid);
  EXPECT_EQ(encoder.driver.fault(), As5047pFault::none);
  EXPECT_GT(std::count(encoder.commands.begin(), encoder.commands.end(), 0xFFFC), 10) << "probes";
  encoder.diagnostics = 0x380;  // the magnet falls off
  for (int i = 0; i < 40; ++i) encoder.tick(0);
  EXPECT_EQ(encoder.driver.fault(), As5047pFault::no_field);
}

TEST(As5047pAngle, ErrorFlagIsReadBackOnceAndCostsNoMoreThanThreeFrames) {
  Encoder encoder;
  encoder.start(8000);
  encoder.reject_next_command = true;
  int held = 0;
  for (int i = 0; i < 10; ++i) {
    const As5047pSample sample = encoder.tick(8000);
    ASSERT_TRUE(sample.valid) << i;
    held += sample.held ? 1 : 0;
  }
  EXPECT_LE(held, 3);
  EXPECT_EQ(std::count(encoder.commands.begin(), encoder.commands.end(), 0x4001), 1);
}

TEST(As5047pAngle, MissedFramesAreHeldLikeBadOnes) {
  Encoder encoder;
  encoder.start(8000);
  for (int round = 0; round < 100; ++round) {
    EXPECT_TRUE(encoder.driver.ISR_missed().valid);
    EXPECT_TRUE(encoder.tick(8000).held) << "a reply of unknown age";
    EXPECT_FALSE(encoder.tick(8000).held);
  }
  for (int i = 0; i < 5; ++i) encoder.driver.ISR_missed();
  EXPECT_EQ(encoder.driver.fault(), As5047pFault::missed);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(encoder.tick(8000).valid);
}

/// Nobody reads the chip for as many ticks as the main loop has the bus.
As5047pSample after_unseen(Encoder& encoder, int ticks, std::int64_t position) {
  for (int i = 0; i < ticks; ++i) encoder.driver.ISR_missed();
  encoder.driver.restart();
  As5047pSample sample;
  for (int i = 0; i < 10; ++i) sample = encoder.tick(position);
  return sample;
}

Encoder at_twenty_thousand() {
  Encoder encoder;
  for (std::int64_t position = 16'000; position <= 20'000; position += 50) encoder.tick(position);
  EXPECT_EQ(encoder.tick(20'000).count, 20'000U);
  return encoder;
}

TEST(As5047pAngle, ARestartThatTakesMillisecondsKeepsTheTurns) {
  for (const std::int64_t moved : {0, 400, -400, 8000, -8000}) {
    for (const int ticks : {0, 10, 80}) {
      Encoder encoder = at_twenty_thousand();
      const As5047pSample sample = after_unseen(encoder, ticks, 20'000 + moved);
      ASSERT_TRUE(sample.valid);
      EXPECT_EQ(sample.count, static_cast<std::uint32_t>(20'000 + moved)) << ticks;
      EXPECT_EQ(sample.reference_generation, 0U);
      // And it goes on from there.
      EXPECT_TRUE(encoder.tick(20'000 + moved + 30).valid);
      EXPECT_EQ(encoder.tick(20'000 + moved + 60).count, static_cast<std::uint32_t>(20'000 + moved + 30));
    }
  }
}

TEST(As5047pAngle, ARestartAfterLongerBeginsWithinATurnAndSaysSo) {
  for (const int ticks : {101, 2000, 200'000}) {
    Encoder encoder = at_twenty_thousand();
    const As5047pSample sample = after_unseen(encoder, ticks, 20'000);
    ASSERT_TRUE(sample.valid);
    EXPECT_EQ(sample.count, 20'000U - 16'384U);
    EXPECT_EQ(sample.reference_generation, 1U);
    EXPECT_EQ(after_unseen(encoder, ticks, 20'000).reference_generation, 2U);
  }
}

// The count after which the turns are known still.
TEST(As5047pAngle, TheFramesThatAreNotBelievedCountAsUnseen) {
  Encoder encoder = at_twenty_thousand();
  for (int i = 0; i < 200; ++i) encoder.tick(25'000);
  ASSERT_EQ(encoder.driver.fault(), As5047pFault::jump);
  EXPECT_EQ(after_unseen(encoder, 0, 25'000).reference_generation, 1U);
}

TEST(As5047pAngle, TurnsThatNobodyCanKnowAreForgotten) {
  Encoder encoder = at_twenty_thousand();
  encoder.driver.forget_turns();
  const As5047pSample sample = after_unseen(encoder, 0, 20'000);
  EXPECT_EQ(sample.count, 3616U);
  EXPECT_EQ(sample.reference_generation, 1U);
}

TEST(As5047pAngle, TheFirstStartIsNoNewReference) {
  Encoder encoder;
  for (int i = 0; i < 1000; ++i) encoder.driver.ISR_missed();
  EXPECT_EQ(after_unseen(encoder, 1000, 20'000).reference_generation, 0U);
}

TEST(As5047pAngle, TheTurnsAreKnownForAHundredFramesAndNoLonger) {
  // Of the restart itself come a reply that belongs to nobody and three that agree.
  for (const int ticks : {96, 97}) {
    Encoder encoder = at_twenty_thousand();
    EXPECT_EQ(after_unseen(encoder, ticks, 20'000).reference_generation, ticks == 96 ? 0U : 1U);
  }
}

// A step may differ from the one before by 64 counts, and be 512.
TEST(As5047pAngle, ABoundOfAMovementIsWithinIt) {
  for (const int sign : {1, -1}) {
    for (const int change : {64, 65}) {
      Encoder encoder;
      encoder.start(8000);
      encoder.tick(8000 + sign * change);
      EXPECT_EQ(encoder.tick(8000 + sign * change).held, change == 65) << sign;
    }
    for (const int speed : {512, 513}) {
      Encoder encoder;
      encoder.start(8000);
      std::int64_t position = 8000;
      for (int step = 64; step <= 512; step += 64) encoder.tick(position += sign * step);
      for (int i = 0; i < 5; ++i) ASSERT_FALSE(encoder.tick(position += sign * 512).held);
      encoder.tick(position += sign * speed);
      EXPECT_EQ(encoder.tick(position).held, speed == 513) << sign;
      Encoder started;
      for (int i = 0; i < 10; ++i) started.tick(8000 + sign * i * speed);
      EXPECT_EQ(started.tick(8000 + sign * 10 * speed).valid, speed == 512) << sign;
    }
  }
}

TEST(As5047pAngle, NoBoundReachesBeyondAQuarterTurn) {
  for (const int step : {4096, 4097}) {
    Encoder encoder({.maximum_step = 4096, .maximum_step_change = 4096});
    encoder.start(8000);
    encoder.tick(8000 + step);
    EXPECT_TRUE(encoder.driver.ISR_missed().held);
    encoder.tick(8000 + step);
    EXPECT_EQ(encoder.tick(8000 + step).held, step == 4097);
  }
}

TEST(As5047pAngle, WithoutHoldingTheFirstBadFrameIsFinal) {
  Encoder encoder({.maximum_held = 0});
  encoder.start(8000);
  encoder.line = [](std::uint16_t word) { return static_cast<std::uint16_t>(word ^ 1U); };
  EXPECT_FALSE(encoder.tick(8000).valid);
  EXPECT_EQ(encoder.driver.fault(), As5047pFault::parity);
}

TEST(As5047pAngle, ProbesAfterThirtyTwoZerosOrNever) {
  Encoder encoder;
  for (int i = 0; i < 100; ++i) encoder.tick(0);
  // Behind the reply that belongs to nobody.
  EXPECT_EQ(std::find(encoder.commands.begin(), encoder.commands.end(), 0xFFFC) - encoder.commands.begin(),
            33);
  Encoder never({.zeros_until_probe = 0});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(never.tick(0).valid, i == 3);
  for (int i = 0; i < 1000; ++i) never.tick(0);
  EXPECT_EQ(std::count(never.commands.begin(), never.commands.end(), 0xFFFC), 0);
}

// A line that flips bits at random: no turn is ever lost, and when it is quiet again the count is the truth.
RC_GTEST_PROP(As5047pAngle, RandomNoiseNeverLosesATurn, ()) {
  Encoder encoder;
  const auto origin = *rc::gen::inRange<std::int64_t>(1, 16384);
  for (int i = 0; i < 10; ++i) encoder.tick(origin);
  RC_ASSERT(encoder.driver.fault() == As5047pFault::none);
  const auto noise = *rc::gen::container<std::vector<std::uint16_t>>(
      300, rc::gen::weightedOneOf<std::uint16_t>(
               {{9, rc::gen::just<std::uint16_t>(0)}, {1, rc::gen::arbitrary<std::uint16_t>()}}));
  const auto accelerations = *rc::gen::container<std::vector<int>>(300, rc::gen::inRange<int>(-8, 9));
  std::int64_t position = origin, speed = 0;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    encoder.line = [flips = noise[i]](std::uint16_t word) {
      return static_cast<std::uint16_t>(word ^ flips);
    };
    speed = std::clamp<std::int64_t>(speed + accelerations[i], -300, 300);
    position += speed;
    encoder.tick(position);
  }
  encoder.line = [](std::uint16_t word) { return word; };
  for (int i = 0; i < 10; ++i) encoder.tick(position += speed);
  const As5047pSample sample = encoder.tick(position + speed);
  if (sample.valid && !sample.held) RC_ASSERT(sample.count == static_cast<std::uint32_t>(position));
}

}  // namespace kmax::drivers::as5047p_angle_test
