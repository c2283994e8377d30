#include "drivers/quadrature_index_watch.hpp"

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>

namespace kmax::drivers {
namespace {

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

TEST(QuadratureIndexWatch, ACableThatComesOffIsSeenAtTheFirstLook) {
  QuadratureIndexWatch watch = fresh();
  for (std::uint32_t count = 0; count < 10'000; ++count) {
    ASSERT_TRUE(watch.ISR_plausible(count, line_at(count, 500)));
  }
  ASSERT_TRUE(watch.learned());
  EXPECT_FALSE(watch.ISR_plausible(10'000, true));
  EXPECT_FALSE(watch.ISR_plausible(10'000, false)) << "position is lost: it must stay wrong";
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
  EXPECT_FALSE(watch.ISR_plausible(static_cast<std::uint32_t>(101 - 3 * 8192 + 5), true));
}

TEST(QuadratureIndexWatch, ALineThatWasHighFromTheStartIsBelievedUntilTheCountLeaves) {
  QuadratureIndexWatch watch = fresh();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(watch.ISR_plausible(50, true));
  EXPECT_TRUE(watch.ISR_plausible(54, true));
  EXPECT_FALSE(watch.ISR_plausible(55, true));
}

TEST(QuadratureIndexWatch, StartingOnTheIndexAndLeavingItIsFine) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(0xFFFF'FFFF, true));
  for (std::uint32_t count = 0; count < 8191; ++count) ASSERT_TRUE(watch.ISR_plausible(count, false));
  EXPECT_TRUE(watch.ISR_plausible(8191, true));
  EXPECT_TRUE(watch.learned());
}

// A handle that is switched on where its index is, moves away, and loses its cable there.
TEST(QuadratureIndexWatch, AnIndexThatWasHighFromTheStartIsLearnedWhenItFalls) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(0, true));
  for (std::uint32_t moved = 1; moved < 1000; ++moved) ASSERT_TRUE(watch.ISR_plausible(0 - moved, false));
  EXPECT_TRUE(watch.learned());
  EXPECT_FALSE(watch.ISR_plausible(0U - 1000U, true));
}

// A cable that comes off raises the line once and for all: its place must not be taken for the index.
TEST(QuadratureIndexWatch, ALineThatNeverFallsIsNoIndex) {
  QuadratureIndexWatch watch = fresh();
  ASSERT_TRUE(watch.ISR_plausible(300, false));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(watch.ISR_plausible(300, true));
  EXPECT_FALSE(watch.learned());
  // Plugged in again elsewhere, the line falls far from there.
  EXPECT_FALSE(watch.ISR_plausible(900, true));
}

TEST(QuadratureIndexWatch, ResetBelievesAgain) {
  QuadratureIndexWatch watch = fresh();
  (void)watch.ISR_plausible(0, false);
  (void)watch.ISR_plausible(1, true);
  (void)watch.ISR_plausible(2, false);
  ASSERT_FALSE(watch.ISR_plausible(1000, true));
  watch.reset(config);
  EXPECT_TRUE(watch.ISR_plausible(1000, false));
}

}  // namespace
}  // namespace kmax::drivers
