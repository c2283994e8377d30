#include "control/chord_window.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>

namespace kmax::control::chord_window_test {

// The definition in whole numbers: the chord to sample n passes within 1 of sample j when n D_j - j D_n is
// within n.
int defined(const std::array<std::int64_t, 17>& newest_first) {
  for (int n = 1; n <= 16; ++n) {
    const std::int64_t whole = newest_first[0] - newest_first[static_cast<std::size_t>(n)];
    for (int j = 1; j < n; ++j) {
      const std::int64_t error =
          n * (newest_first[0] - newest_first[static_cast<std::size_t>(j)]) - j * whole;
      if (error > n || error < -n) return n - 1;
    }
  }
  return 16;
}

int found(const std::array<std::int64_t, 17>& newest_first) {
  std::array<std::uint32_t, 17> words{};
  for (std::size_t j = 0; j < 17; ++j) words[j] = static_cast<std::uint32_t>(newest_first[j]);
  return ChordWindow::find(words.data(), words[0] - words[1]);
}

// The series with these second differences, newest first, around a common slope.
std::array<std::int64_t, 17> series(std::int64_t start, std::int64_t slope,
                                    const std::array<int, 15>& bends) {
  std::array<std::int64_t, 17> positions{};
  positions[0] = start;
  std::int64_t interval = slope;
  for (std::size_t j = 1; j < 17; ++j) {
    positions[j] = positions[j - 1] - interval;
    if (j < 16) interval -= bends[j - 1];
  }
  return positions;
}

TEST(ChordWindow, HalvesAreCutAtZeroEachOnItsOwn) {
  EXPECT_EQ(halves_beyond(0x00050003U, 0x00020001U), 0x00030002U);
  EXPECT_EQ(halves_beyond(0x00010003U, 0x00020001U), 0x00000002U);
  EXPECT_EQ(halves_beyond(0x00050000U, 0x00020001U), 0x00030000U);
  EXPECT_EQ(halves_beyond(0x00000000U, 0xFFFFFFFFU), 0U);
  EXPECT_EQ(halves_beyond(0xFFFFFFFFU, 0x00010000U), 0xFFFEFFFFU);
  EXPECT_EQ(halves_beyond(0x80007FFFU, 0x7FFF8000U), 0x00010000U);
}

// All sequences of eight second differences from -2 to 2, from every second place on: ties of the band
// included.
TEST(ChordWindow, SmallBendsAreTheDefinitionExhaustively) {
  std::array<long, 17> histogram{};
  for (std::size_t first = 0; first < 8; ++first) {
    for (int code = 0; code < 390625; ++code) {
      std::array<int, 15> bends{};
      for (int digit = 0, rest = code; digit < 8 && first + static_cast<std::size_t>(digit) < 15;
           ++digit, rest /= 5)
        bends[first + static_cast<std::size_t>(digit)] = rest % 5 - 2;
      const auto positions = series(0, 0, bends);
      const int expected = defined(positions);
      ASSERT_EQ(found(positions), expected) << first << " " << code;
      ++histogram[static_cast<std::size_t>(expected)];
    }
  }
  for (std::size_t n = 2; n <= 16; ++n) EXPECT_GT(histogram[n], 0) << n;
}

// Digitised lines of every slope and phase hold over the whole window; one sample of them moved by a step or
// two makes the ties and near misses. Around any common slope and anywhere on the ring of 2^32.
TEST(ChordWindow, DisturbedLinesAreTheDefinition) {
  std::mt19937_64 random(11);
  std::array<long, 17> histogram{};
  for (int trial = 0; trial < 2'000'000; ++trial) {
    const auto denominator = static_cast<std::int64_t>(1 + random() % 40);
    const auto numerator = static_cast<std::int64_t>(random() % 81) - 40;
    const auto phase = static_cast<std::int64_t>(random() % 40);
    const std::int64_t slope = static_cast<std::int64_t>(random() % 4000000000ULL) - 2000000000LL;
    const auto start = static_cast<std::int64_t>(random() >> 20);
    std::array<std::int64_t, 17> positions{};
    for (std::size_t j = 0; j < 17; ++j) {
      const auto back = static_cast<std::int64_t>(j);
      const std::int64_t line = numerator * back + phase;
      positions[j] =
          start - slope * back - (line - ((line % denominator) + denominator) % denominator) / denominator;
    }
    for (int moved = static_cast<int>(random() % 4); moved > 0; --moved)
      positions[random() % 17] += static_cast<std::int64_t>(random() % 3) - 1;
    const int expected = defined(positions);
    ASSERT_EQ(found(positions), expected) << trial;
    ++histogram[static_cast<std::size_t>(expected)];
  }
  for (std::size_t n = 2; n <= 16; ++n) EXPECT_GT(histogram[n], 0) << n;
}

// The largest second differences allowed, after windows of every length that held: nothing may wrap around.
TEST(ChordWindow, TheLargestBendsEndTheWindow) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 1'000'000; ++trial) {
    std::array<int, 15> bends{};
    const int kind = static_cast<int>(random() % 3);
    for (int& bend : bends) {
      bend = kind == 0 ? static_cast<int>(random() % 16) - 8 : static_cast<int>(random() % 3) - 1;
      if (kind == 2) bend = random() % 4 == 0 ? bend : 0;
    }
    if (kind != 0) bends[random() % 15] = random() % 2 == 0 ? 7 : -8;
    const auto positions = series(1000, static_cast<std::int64_t>(random()), bends);
    ASSERT_EQ(found(positions), defined(positions)) << trial;
  }
  for (const int bend : {7, -8}) {
    std::array<int, 15> bends{};
    bends.fill(bend);
    EXPECT_EQ(found(series(0, 0, bends)), 1);
    for (std::size_t place = 0; place < 15; ++place) {
      bends.fill(0);
      bends[place] = bend;
      EXPECT_EQ(found(series(0, 0, bends)), static_cast<int>(place) + 1);
    }
  }
}

}  // namespace kmax::control::chord_window_test
