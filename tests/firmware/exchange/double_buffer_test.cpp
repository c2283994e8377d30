#include "firmware/exchange/double_buffer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <functional>

namespace kmax::firmware::double_buffer_test {
namespace {

// A value whose copy is interrupted: between any two of its pieces `interrupt` may run. On one core an
// interrupt always runs to its end, so calling it there is exactly what the hardware can do; between the
// atomic stores of offer() nothing else is touched, so these points and those before and after offer() are
// all that an interrupt can tell apart.
struct Interrupted {
  static constexpr std::size_t pieces = 4;
  static inline std::function<void()> interrupt;
  static inline int interrupt_at = -1;  // piece; `pieces`: after the last
  std::array<int, pieces> piece{};

  explicit Interrupted(int value = 0) { piece.fill(value); }
  Interrupted(const Interrupted&) = default;
  Interrupted& operator=(const Interrupted& other) {
    for (std::size_t i = 0; i <= pieces; ++i) {
      if (static_cast<int>(i) == interrupt_at && interrupt) {
        interrupt_at = -1;
        interrupt();
      }
      if (i < pieces) piece[i] = other.piece[i];
    }
    return *this;
  }
  bool whole() const {
    for (const int p : piece) {
      if (p != piece[0]) return false;
    }
    return true;
  }
};

class DoubleBufferTest : public testing::Test {
 protected:
  void TearDown() override {
    Interrupted::interrupt = nullptr;
    Interrupted::interrupt_at = -1;
  }
};

TEST_F(DoubleBufferTest, StartsWithTheInitialValueTaken) {
  DoubleBuffer<int> handover(7);
  EXPECT_TRUE(handover.taken());
  EXPECT_EQ(handover.ISR_take(), 7);
  handover.offer(8);
  EXPECT_FALSE(handover.taken());
  EXPECT_EQ(handover.ISR_take(), 8);
  EXPECT_TRUE(handover.taken());
  EXPECT_EQ(handover.ISR_take(), 8);
}

TEST_F(DoubleBufferTest, LastOfSeveralOffersWins) {
  DoubleBuffer<int> handover(0);
  for (int i = 1; i <= 5; ++i) handover.offer(i);
  EXPECT_FALSE(handover.taken());
  EXPECT_EQ(handover.ISR_take(), 5);
  handover.offer(6);
  handover.offer(7);
  EXPECT_EQ(handover.ISR_take(), 7);
}

TEST_F(DoubleBufferTest, InterruptAtEveryPointOfEveryOfferSeesAWholeValueOldOrNew) {
  // Also with an offer that still waits: it may be withdrawn, never torn.
  for (int point = 0; point <= static_cast<int>(Interrupted::pieces); ++point) {
    for (const bool one_waits : {false, true}) {
      for (const bool odd : {false, true}) {  // both places get their turn
        DoubleBuffer<Interrupted> handover(Interrupted(1));
        if (odd) {
          handover.offer(Interrupted(1));
          (void)handover.ISR_take();
        }
        if (one_waits) handover.offer(Interrupted(2));
        int seen = 0;
        Interrupted::interrupt = [&] {
          const Interrupted& value = handover.ISR_take();
          ASSERT_TRUE(value.whole());
          seen = value.piece[0];
        };
        Interrupted::interrupt_at = point;
        handover.offer(Interrupted(3));
        EXPECT_EQ(seen, 1) << "an offer under way or withdrawn must not be taken; point " << point;
        EXPECT_FALSE(handover.taken());
        const Interrupted& after = handover.ISR_take();
        EXPECT_TRUE(after.whole());
        EXPECT_EQ(after.piece[0], 3);
        EXPECT_TRUE(handover.taken());
      }
    }
  }
}

RC_GTEST_PROP(DoubleBuffer, TheInterruptNeverGoesBackAndAlwaysEndsWithTheLastOffer, ()) {
  DoubleBuffer<Interrupted> handover(Interrupted(0));
  int offered = 0, seen = 0;
  const auto look = [&] {
    const Interrupted& value = handover.ISR_take();
    RC_ASSERT(value.whole());
    RC_ASSERT(value.piece[0] >= seen);
    RC_ASSERT(value.piece[0] <= offered);
    seen = value.piece[0];
  };
  Interrupted::interrupt = look;
  const auto steps = *rc::gen::inRange(1, 40);
  for (int i = 0; i < steps; ++i) {
    if (*rc::gen::arbitrary<bool>()) look();
    Interrupted::interrupt_at = *rc::gen::inRange(-1, 5);
    handover.offer(Interrupted(++offered));
    RC_ASSERT(!handover.taken());
  }
  Interrupted::interrupt = nullptr;
  Interrupted::interrupt_at = -1;
  RC_ASSERT(handover.ISR_take().piece[0] == offered);
}

}  // namespace
}  // namespace kmax::firmware::double_buffer_test
