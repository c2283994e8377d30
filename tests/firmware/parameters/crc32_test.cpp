#include "firmware/parameters/crc32.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <random>
#include <vector>

namespace kmax::firmware::crc32_test {
namespace {

std::uint32_t crc_of(const std::vector<std::uint32_t>& words) {
  Crc32 crc;
  for (const std::uint32_t word : words) crc.add(word);
  return crc.value();
}

/// Bit by bit, from the polynomial as the standard writes it, without reflection.
std::uint32_t by_long_division(const std::vector<std::uint32_t>& words) {
  std::uint32_t rest = 0xFFFF'FFFFU;
  for (const std::uint32_t word : words) {
    for (unsigned bit = 0; bit < 32; ++bit) {
      const std::uint32_t next = (rest >> 31U) ^ ((word >> bit) & 1U);
      rest = (rest << 1U) ^ (next != 0 ? 0x04C1'1DB7U : 0U);
    }
  }
  std::uint32_t reversed = 0;
  for (unsigned bit = 0; bit < 32; ++bit) reversed |= ((rest >> bit) & 1U) << (31U - bit);
  return ~reversed;
}

TEST(Crc32, KnownValues) {
  EXPECT_EQ(crc_of({}), 0x0000'0000U);
  EXPECT_EQ(crc_of({0x0000'0000U}), 0x2144'DF1CU);  // of four bytes 00
  EXPECT_EQ(crc_of({0xFFFF'FFFFU}), 0xFFFF'FFFFU);  // of four bytes FF
  // "12345678", whose CRC-32 is 0x9AE0DAAF.
  EXPECT_EQ(crc_of({0x3433'3231U, 0x3837'3635U}), 0x9AE0'DAAFU);
}

TEST(Crc32, AgreesWithLongDivision) {
  std::mt19937 random(1);
  for (int length = 0; length < 40; ++length) {
    std::vector<std::uint32_t> words;
    for (int i = 0; i < length; ++i) words.push_back(static_cast<std::uint32_t>(random()));
    EXPECT_EQ(crc_of(words), by_long_division(words));
  }
}

TEST(Crc32, OrderMatters) {
  EXPECT_NE(crc_of({1, 2}), crc_of({2, 1}));
  EXPECT_NE(crc_of({0}), crc_of({0, 0}));
}

}  // namespace
}  // namespace kmax::firmware::crc32_test
