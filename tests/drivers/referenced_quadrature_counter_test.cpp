#include "drivers/referenced_quadrature_counter.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::referenced_quadrature_counter_test {

/// An encoder of 8192 counts a turn whose index is three counts wide, on a 16-bit timer.
struct Encoder {
  explicit Encoder(int index_at, const ReferencedQuadratureConfig& config = {true, true, 8192})
      : index(index_at) {
    counter.configure(config);
  }

  /// The disc is moved there, a count per tick.
  ReferencedQuadratureCounter<>::Reading move_to(int target, bool driving = false) {
    do {
      disc += target > disc ? 1 : target < disc ? -1 : 0;
      const bool line = ((disc - index) % 8192 + 8192 + 1) % 8192 < 3;
      reading = counter.ISR_read(
          static_cast<std::uint16_t>(disc),
          [&] {
            ++looks;
            return line || unplugged;
          },
          driving);
      jumps += reading.reference_generation != generation ? 1 : 0;
      generation = reading.reference_generation;
    } while (disc != target);
    return reading;
  }

  ReferencedQuadratureCounter<> counter;
  ReferencedQuadratureCounter<>::Reading reading;
  int index, disc = 0, jumps = 0, looks = 0;
  std::uint32_t generation = 0;
  bool unplugged = false;
};

std::uint32_t word(int count) {
  return static_cast<std::uint32_t>(count);
}

TEST(ReferencedQuadratureCounter, ExtendsSixteenBitsBothWays) {
  Encoder encoder(0, {});
  for (const int target : {70'000, -70'000, 32'768, -32'769, 0}) {
    EXPECT_EQ(encoder.move_to(target).count, word(target));
    EXPECT_TRUE(encoder.reading.valid);
  }
  EXPECT_EQ(encoder.looks, 0) << "no index line is connected";
  EXPECT_EQ(encoder.jumps, 0);
  EXPECT_FALSE(encoder.reading.referenced);
}

TEST(ReferencedQuadratureCounter, APeekSaysWhatAReadWouldAndChangesNothing) {
  ReferencedQuadratureCounter<> counter;
  EXPECT_EQ(counter.ISR_peek(5), 5u);
  EXPECT_EQ(counter.ISR_peek(0xFFFF), word(-1));
  const auto low = [] { return false; };
  EXPECT_EQ(counter.ISR_read(0x7000, low, false).count, 0x7000u);
  EXPECT_EQ(counter.ISR_peek(0xE000), 0xE000u);
  EXPECT_EQ(counter.ISR_peek(0x7000), 0x7000u);
}

TEST(ReferencedQuadratureCounter, TakesStepsOfUpToHalfTheCountersRange) {
  const auto low = [] { return false; };
  ReferencedQuadratureCounter<> counter;
  EXPECT_EQ(counter.ISR_read(0x7FFF, low, false).count, 0x7FFFu);
  EXPECT_EQ(counter.ISR_read(0xFFFE, low, false).count, 0xFFFEu);
  EXPECT_EQ(counter.ISR_read(0x7FFF, low, false).count, 0x7FFFu);
  EXPECT_EQ(counter.ISR_read(0x0000, low, false).count, 0u);
  EXPECT_EQ(counter.ISR_read(0x8001, low, false).count, word(-0x7FFF));
  ReferencedQuadratureCounter<std::uint32_t> wide;
  EXPECT_EQ(wide.ISR_read(0x7FFF'FFFF, low, false).count, 0x7FFF'FFFFu);
  EXPECT_EQ(wide.ISR_read(0xFFFF'FFFE, low, false).count, 0xFFFF'FFFEu);
}

// The index on either side of where 16 bits, and 32 bits, wrap.
TEST(ReferencedQuadratureCounter, IsReferredToTheIndexAcrossTheWrap) {
  for (const int index : {5, 4000, 32'760, 32'768, 32'777, 65'530, 65'541, -5, -4000, -32'768, -65'536}) {
    for (const int direction : {1, -1}) {
      Encoder encoder(index);
      // The first in that direction; one that it stands on at first is not crossed.
      const int within = ((index % 8192) + 8192) % 8192;
      const int nearest = within == 0 ? direction * 8192 : direction > 0 ? within : within - 8192;
      const int far = direction * 70'000;
      ASSERT_EQ(encoder.move_to(far).count, word(far - nearest)) << index;
      EXPECT_TRUE(encoder.reading.referenced);
      EXPECT_TRUE(encoder.reading.valid);
      EXPECT_EQ(encoder.jumps, 1);
      EXPECT_EQ(encoder.move_to(-far).count, word(-far - nearest)) << index;
      EXPECT_TRUE(encoder.reading.valid) << "every turn has its index, also after the shift";
      EXPECT_EQ(encoder.jumps, 1);
    }
  }
}

TEST(ReferencedQuadratureCounter, IsTheSameFromBothSidesAndNotReferredByADip) {
  Encoder below(300), above(300);
  EXPECT_EQ(below.move_to(400).count, 100u);
  above.move_to(300);
  EXPECT_FALSE(above.move_to(200).referenced);
  EXPECT_EQ(above.reading.count, 200u);
  above.move_to(400);
  EXPECT_EQ(above.move_to(100).count, word(-200));
}

TEST(ReferencedQuadratureCounter, NeverJumpsWhileDriven) {
  Encoder encoder(300);
  EXPECT_EQ(encoder.move_to(20'000, true).count, 20'000u);
  EXPECT_EQ(encoder.jumps, 0);
  EXPECT_FALSE(encoder.reading.referenced);
  encoder.move_to(20'001, false);
  EXPECT_TRUE(encoder.reading.referenced);
  EXPECT_EQ(encoder.reading.count, 19'701u);
  encoder.move_to(0, true);
  EXPECT_EQ(encoder.reading.count, word(-300));
  EXPECT_EQ(encoder.jumps, 1);
}

TEST(ReferencedQuadratureCounter, WatchesTheIndexWithoutReferringToIt) {
  Encoder encoder(300, {true, false, 8192});
  EXPECT_EQ(encoder.move_to(1000).count, 1000u);
  EXPECT_FALSE(encoder.reading.referenced);
  encoder.unplugged = true;
  EXPECT_TRUE(encoder.move_to(1000).valid && encoder.move_to(1000).valid) << "interference";
  EXPECT_FALSE(encoder.move_to(1000).valid);
}

// Of a handle that moves: one look would be a full crossing.
TEST(ReferencedQuadratureCounter, InterferenceTeachesNoIndex) {
  for (const int lasts : {1, 24, 25}) {
    ReferencedQuadratureCounter<> counter;
    counter.configure({true, true, 8192});
    int looks = 0;
    const auto read = [&](std::uint16_t count, int high_for) {
      looks = 0;
      return counter.ISR_read(
          count, [&] { return ++looks <= high_for; }, false);
    };
    read(998, 0);
    read(1000, lasts);
    EXPECT_EQ(read(1002, 0).referenced, lasts == 25) << lasts << ": 1 look and 24 that prove it";
  }
}

TEST(ReferencedQuadratureCounter, TheSameConfigurationChangesNothing) {
  Encoder encoder(300);
  encoder.move_to(1000);
  encoder.counter.configure({true, true, 8192});
  EXPECT_EQ(encoder.move_to(1001).count, 701u);
  EXPECT_TRUE(encoder.reading.referenced);
  EXPECT_EQ(encoder.reading.reference_generation, 1u);
}

TEST(ReferencedQuadratureCounter, AnotherConfigurationGivesTheOriginBackAndSaysSo) {
  for (const ReferencedQuadratureConfig& other :
       {ReferencedQuadratureConfig{true, false, 8192}, ReferencedQuadratureConfig{false, false, 8192},
        ReferencedQuadratureConfig{true, true, 4096}}) {
    Encoder encoder(300);
    encoder.move_to(1000);
    encoder.counter.configure(other);
    EXPECT_EQ(encoder.move_to(1001).count, 1001u) << "from where it was at first";
    EXPECT_FALSE(encoder.reading.referenced);
    EXPECT_EQ(encoder.reading.reference_generation, 2u);
    // And once more.
    encoder.counter.configure({true, true, 8192});
    EXPECT_EQ(encoder.move_to(0).count, word(-300));
    EXPECT_EQ(encoder.reading.reference_generation, 3u);
  }
}

TEST(ReferencedQuadratureCounter, AnotherConfigurationBeforeAReferenceLeavesTheCountsWhatTheyWere) {
  Encoder encoder(300, {true, false, 8192});
  encoder.move_to(1000);
  encoder.unplugged = true;
  encoder.move_to(1000);
  encoder.move_to(1000);
  ASSERT_FALSE(encoder.move_to(1000).valid);
  encoder.unplugged = false;
  encoder.counter.configure({true, true, 8192});
  EXPECT_EQ(encoder.move_to(1001).count, 1001u);
  EXPECT_TRUE(encoder.reading.valid);
  EXPECT_EQ(encoder.reading.reference_generation, 0u);
}

}  // namespace kmax::drivers::referenced_quadrature_counter_test
