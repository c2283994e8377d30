#include "control/word_transfer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

namespace kmax::control::word_transfer_test {

TEST(WordTransfer, PairsAreReadAndWrittenWhereTheIndexSays) {
  std::array<std::uint32_t, 8> words = {10, 11, 12, 13, 14, 15, 16, 17};
  const auto [first, second] = load_two<5>(words.data());
  EXPECT_EQ(first, 15U);
  EXPECT_EQ(second, 16U);
  store_two<2>(words.data(), {100U, 200U});
  EXPECT_EQ(words, (std::array<std::uint32_t, 8>{10, 11, 100, 200, 14, 15, 16, 17}));
}

TEST(WordTransfer, FoursMoveOn) {
  const std::array<std::uint32_t, 8> words = {0, 1, 2, 3, 4, 5, 6, 7};
  const std::uint32_t* at = words.data();
  for (std::uint32_t start = 0; start < 8; start += 4) {
    const FourWords four = load_next_four(at);
    EXPECT_EQ(four.first, start);
    EXPECT_EQ(four.second, start + 1);
    EXPECT_EQ(four.third, start + 2);
    EXPECT_EQ(four.fourth, start + 3);
  }
  EXPECT_EQ(at, words.data() + 8);
}

}  // namespace kmax::control::word_transfer_test
