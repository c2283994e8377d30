#include "drivers/quadrature_index_watch.hpp"

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>

#include <cstdlib>
#include <initializer_list>
#include <utility>

namespace kmax::drivers::quadrature_index_watch_test {

constexpr QuadratureIndexConfig config{8192, 4};

// One count wide, as a gated index is.
bool line_at(std::uint32_t count, std::uint32_t index) {
  const auto moved = static_cast<std::int64_t>(static_cast<std::int32_t>(count)) -
                     static_cast<std::int64_t>(static_cast<std::int32_t>(index));
  return moved % 8192 == 0;
}

QuadratureIndexWatch fresh() {
  QuadratureIndexWatch watch;
  watch.reset(config);
  return watch;
}

/// The line is high where no index is: two looks are interference, the third is a cable.
bool doubts(QuadratureIndexWatch& watch, std::uint32_t count) {
  for (unsigned look = 1; look < QuadratureIndexWatch::looks_to_doubt; ++look)
    EXPECT_TRUE(watch.ISR_plausible(count, true)) << look;
  return !watch.ISR_plausible(count, true);
}

RC_GTEST_PROP(QuadratureIndexWatch, NeverDoubtsAnEncoderThatCountsRight, ()) {
  QuadratureIndexWatch watch = fresh();
  const auto index = *rc::gen::arbitrary<std::int16_t>();
  auto count = static_cast<std::uint32_t>(static_cast<std::int32_t>(*rc::gen::arbitrary<std::int16_t>()));
  const auto steps = *rc::gen::container<std::vector<int>>(200, rc::gen::inRange(-300, 301));
  for (const int step : steps) {
    for (int i = 0; i < (step < 0 ? -step : step); ++i) {
      count += step < 0 ? 0xFFFF'FFFFu : 1u;
      RC_ASSERT(watch.ISR_plausible(count, line_at(count, static_cast<std::uint32_t>(index))));
    }
  }
}

TEST(QuadratureIndexWatch, ACableThatComesOffIsSeenAtTheThirdLook) {
  QuadratureIndexWatch watch = fresh();
  for (std::uint32_t count = 0; count < 10'000; ++count) {
    ASSERT_TRUE(watch.ISR_plausible(count, line_at(count, 500)));
  }
  ASSERT_TRUE(watch.learned());
  EXPECT_TRUE(doubts(watch, 10'000));
  EXPECT_FALSE(watch.ISR_plausible(10'000, false)) << "position is lost: it must stay wrong";
}

TEST(QuadratureIndexWatch, InterferenceOfTwoLooksIsForgottenHoweverOftenItComes) {
  QuadratureIndexWatch watch = fresh();
  for (std::uint32_t count = 0; count < 600; ++count)
    ASSERT_TRUE(watch.ISR_plausible(count, line_at(count, 500)));
  ASSERT_TRUE(watch.learned());
  for (std::uint32_t count = 600; count < 7999; ++count)
    ASSERT_TRUE(watch.ISR_plausible(count, count % 3 != 0)) << count;
  EXPECT_TRUE(doubts(watch, 8000));
}

TEST(QuadratureIndexWatch, EveryTurnHasItsIndexAlsoBelowZero) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(100, false));
  ASSERT_TRUE(watch.ISR_plausible(101, true));
  ASSERT_FALSE(watch.learned());
  ASSERT_TRUE(watch.ISR_plausible(102, false));
  ASSERT_TRUE(watch.learned());
  for (int turn = -5; turn <= 5; ++turn) {
    const auto at = static_cast<std::uint32_t>(101 + turn * 8192);
    EXPECT_TRUE(watch.ISR_plausible(at + 4, true)) << turn;
    EXPECT_TRUE(watch.ISR_plausible(at - 4, true)) << turn;
  }
  EXPECT_TRUE(doubts(watch, static_cast<std::uint32_t>(101 - 3 * 8192 + 5)));
}

// Up to `widest` counts it may be an index, however wide.
TEST(QuadratureIndexWatch, ALineThatWasHighFromTheStartIsBelievedUntilNoIndexIsThatWide) {
  for (const std::uint32_t step : {1U, 0U - 1U}) {
    QuadratureIndexWatch watch = fresh();
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(watch.ISR_plausible(50, true));
    std::uint32_t count = 50;
    for (int i = 1; i < config.widest; ++i) ASSERT_TRUE(watch.ISR_plausible(count += step, true)) << i;
    EXPECT_FALSE(watch.ISR_plausible(count + step, true));
  }
}

TEST(QuadratureIndexWatch, StartingOnTheIndexTeachesNothingUntilItIsCrossed) {
  QuadratureIndexWatch watch = fresh();
  for (std::uint32_t count = 1000; count < 1003; ++count) ASSERT_TRUE(watch.ISR_plausible(count, true));
  ASSERT_TRUE(watch.ISR_plausible(1003, false));
  EXPECT_FALSE(watch.learned());
  for (std::uint32_t count = 1004; count < 998 + 8192; ++count)
    ASSERT_TRUE(watch.ISR_plausible(count, false));
  for (std::uint32_t count = 998; count < 1003; ++count) ASSERT_TRUE(watch.ISR_plausible(count + 8192, true));
  EXPECT_FALSE(watch.learned());
  EXPECT_TRUE(watch.ISR_plausible(1003 + 8192, false));
  ASSERT_TRUE(watch.learned());
  EXPECT_EQ(watch.index(), 1000U + 8192U);
}

// A handle that is switched on where its index is, moves away, and loses its cable there.
TEST(QuadratureIndexWatch, OneEdgeIsEnoughToSeeThatTheCableComesOffElsewhere) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(0, true));
  for (std::uint32_t moved = 1; moved < 1000; ++moved) ASSERT_TRUE(watch.ISR_plausible(0 - moved, false));
  EXPECT_FALSE(watch.learned());
  EXPECT_TRUE(doubts(watch, 0U - 1000U));
}

// Index at 998 to 1002: one side's edge alone would put it at 998, the other's at 1002.
TEST(QuadratureIndexWatch, ADipTeachesNothingFromEitherSide) {
  for (const int depth : {1, 2, 5}) {
    for (const bool from_below : {true, false}) {
      QuadratureIndexWatch watch = fresh();
      const auto place = [from_below](int inside) {
        return static_cast<std::uint32_t>(from_below ? 997 + inside : 1003 - inside);
      };
      for (int dips = 0; dips < 3; ++dips) {
        for (int inside = -50; inside <= depth; ++inside)
          ASSERT_TRUE(watch.ISR_plausible(place(inside), inside >= 1));
        for (int inside = depth; inside >= -50; --inside)
          ASSERT_TRUE(watch.ISR_plausible(place(inside), inside >= 1));
        ASSERT_FALSE(watch.learned()) << depth << (from_below ? " from below" : " from above");
      }
      for (int inside = -50; inside <= 50; ++inside)
        ASSERT_TRUE(watch.ISR_plausible(place(inside), inside >= 1 && inside <= 5));
      ASSERT_TRUE(watch.learned());
      EXPECT_EQ(watch.index(), 1000U);
    }
  }
}

// The index line's edges need not coincide with the counts': a count is then seen low and high.
TEST(QuadratureIndexWatch, ADipIsToldFromACrossingAlsoWhenTheEdgesLieWithinACount) {
  const auto looks = [](std::initializer_list<std::pair<std::uint32_t, bool>> list) {
    QuadratureIndexWatch watch = fresh();
    for (const auto& [count, line] : list) EXPECT_TRUE(watch.ISR_plausible(count, line));
    return watch;
  };
  EXPECT_FALSE(looks({{997, false}, {998, false}, {998, true}, {998, false}, {997, false}}).learned());
  EXPECT_FALSE(looks({{998, false}, {998, true}, {997, false}}).learned());
  EXPECT_FALSE(looks({{997, false}, {998, true}, {998, false}, {997, false}}).learned());
  EXPECT_FALSE(looks({{998, false}, {998, true}, {1000, true}, {998, true}, {998, false}}).learned());
  EXPECT_FALSE(looks({{1002, false}, {1002, true}, {1001, true}, {1002, true}, {1003, false}}).learned());
  const auto up = looks({{998, false}, {998, true}, {1000, true}, {1002, true}, {1002, false}});
  const auto down = looks({{1002, false}, {1002, true}, {1000, true}, {998, true}, {998, false}});
  ASSERT_TRUE(up.learned() && down.learned());
  EXPECT_EQ(up.index(), 1000U);
  EXPECT_EQ(down.index(), 1000U);
}

TEST(QuadratureIndexWatch, ACableThatIsPluggedInAgainWhereItCameOffIsNoCrossing) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(299, false));
  ASSERT_TRUE(watch.ISR_plausible(300, false));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(watch.ISR_plausible(300, true));
  ASSERT_TRUE(watch.ISR_plausible(300, false));
  EXPECT_FALSE(watch.learned());
}

// A cable that comes off raises the line once and for all: its place must not be taken for the index.
TEST(QuadratureIndexWatch, ALineThatNeverFallsIsNoIndex) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(300, false));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(watch.ISR_plausible(300, true));
  EXPECT_FALSE(watch.learned());
  EXPECT_FALSE(watch.ISR_plausible(900, true)) << "no index is that wide";
}

// What commutation relies on: the same place from either side. The widest here, 996 to 1003, is wider than
// the tolerance.
TEST(QuadratureIndexWatch, TheIndexIsAtItsMiddleFromBothSidesWhateverItsWidth) {
  for (int width = 1; width <= 8; ++width) {
    const int first = 1000 - width / 2, last = first + width - 1;
    const auto at = [&](int count) { return count >= first && count <= last; };
    for (const bool upwards : {true, false}) {
      QuadratureIndexWatch watch = fresh();
      for (int pass = 0; pass < 4; ++pass) {
        for (int step = 0; step <= 200; ++step) {
          const int count = upwards == (pass % 2 == 0) ? 900 + step : 1100 - step;
          ASSERT_TRUE(watch.ISR_plausible(static_cast<std::uint32_t>(count), at(count)))
              << width << " at " << count;
        }
        ASSERT_TRUE(watch.learned()) << width;
        ASSERT_EQ(watch.index(), 1000U) << width << (upwards ? " upwards" : " downwards");
      }
      // The tolerance is what it may be beyond its width.
      QuadratureIndexWatch below = watch, above = watch;
      EXPECT_TRUE(below.ISR_plausible(static_cast<std::uint32_t>(first - 4), true)) << width;
      EXPECT_TRUE(doubts(below, static_cast<std::uint32_t>(first - 6))) << width;
      EXPECT_TRUE(above.ISR_plausible(static_cast<std::uint32_t>(last + 4), true)) << width;
      EXPECT_TRUE(doubts(above, static_cast<std::uint32_t>(last + 6))) << width;
    }
  }
}

// Several counts per look: known to half a step, and no good encoder is doubted for what was not seen.
TEST(QuadratureIndexWatch, AFastCrossingIsKnownToHalfAStep) {
  for (int step = 2; step <= 8; ++step) {
    for (int width = 1; width <= 8; ++width) {
      for (int phase = 0; phase < step; ++phase) {
        for (const int direction : {1, -1}) {
          QuadratureIndexWatch watch = fresh();
          const auto at = [&](int count) { return 2 * (count < 1000 ? 1000 - count : count - 1000) < width; };
          bool seen = false;
          for (int moved = phase; moved < 200; moved += step) {
            const int count = 1000 + direction * (moved - 100);
            seen = seen || at(count);
            ASSERT_TRUE(watch.ISR_plausible(static_cast<std::uint32_t>(count), at(count)));
          }
          ASSERT_EQ(watch.learned(), seen) << step << " " << width << " " << phase;
          if (seen) {
            EXPECT_LE(2 * std::abs(static_cast<int>(watch.index()) - 1000), step + 1) << step << " " << width;
          }
          for (int count = 900; count < 1100; ++count)
            ASSERT_TRUE(watch.ISR_plausible(static_cast<std::uint32_t>(count), at(count))) << step;
        }
      }
    }
  }
}

TEST(QuadratureIndexWatch, ACrossingThatIsTooFastToSayWhereIsNotUsed) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(980, false));
  ASSERT_TRUE(watch.ISR_plausible(1000, true));
  ASSERT_TRUE(watch.ISR_plausible(1020, false));
  EXPECT_FALSE(watch.learned());
}

TEST(QuadratureIndexWatch, CountsCanBeReferredToTheIndex) {
  QuadratureIndexWatch watch = fresh();
  for (std::uint32_t count = 0; count < 600; ++count)
    ASSERT_TRUE(watch.ISR_plausible(count, line_at(count, 500)));
  const std::uint32_t index = watch.index();
  ASSERT_EQ(index, 500U);
  watch.ISR_shift_counts(index);
  EXPECT_EQ(watch.index(), 0U);
  EXPECT_TRUE(watch.ISR_plausible(8191, false));
  EXPECT_TRUE(watch.ISR_plausible(8192, true));
  EXPECT_TRUE(doubts(watch, 500));
}

TEST(QuadratureIndexWatch, ResetBelievesAgain) {
  QuadratureIndexWatch watch = fresh();
  (void)watch.ISR_plausible(0, false);
  (void)watch.ISR_plausible(1, true);
  (void)watch.ISR_plausible(2, false);
  ASSERT_TRUE(doubts(watch, 1000));
  watch.reset(config);
  EXPECT_TRUE(watch.ISR_plausible(1000, false));
}

}  // namespace kmax::drivers::quadrature_index_watch_test
