#include "drivers/stm32f4/can_filter.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::stm32f4::can_filter_test {
namespace {

bool accepts(const CanFilter& filter, const CanFrame& frame) {
  const std::uint32_t word = can_identifier_word(frame);
  if (filter.list) return word == filter.first || word == filter.second;
  return ((word ^ filter.first) & filter.second) == 0;
}

TEST(CanFilter, WordsHaveTheLayoutOfTheMailbox) {
  EXPECT_EQ(can_identifier_word({.identifier = 0x7FF}), 0xFFE0'0000U);
  EXPECT_EQ(can_identifier_word({.identifier = 1, .extended = true, .remote = true}), 0x0000'000EU);
  EXPECT_EQ(can_filter_standard(0x600, 0x780).first, 0xC000'0000U);
  EXPECT_EQ(can_filter_standard(0x600, 0x780).second, 0xF000'0006U);
}

TEST(CanFilter, AcceptWhatTheySay) {
  for (std::uint32_t identifier = 0; identifier < 0x800; ++identifier) {
    const CanFrame frame{.identifier = identifier};
    EXPECT_EQ(accepts(can_filter_standard(0x601, 0x67F), frame), (identifier & 0x67F) == 0x601);
    EXPECT_EQ(accepts(can_filter_standard_list(0x000, 0x080), frame), identifier == 0 || identifier == 0x80);
    EXPECT_TRUE(accepts(can_filter_accept_all(), frame));
    EXPECT_FALSE(accepts(can_filter_extended(0, 0), frame)) << "any extended one, but no standard one";
    EXPECT_FALSE(accepts(can_filter_standard(identifier, 0x7FF), {.identifier = identifier, .remote = true}));
    EXPECT_FALSE(accepts(can_filter_standard(0, 0), {.identifier = identifier << 18, .extended = true}));
  }
  EXPECT_TRUE(
      accepts(can_filter_extended(0x1234567, 0x1FFFFFFF), {.identifier = 0x1234567, .extended = true}));
  EXPECT_FALSE(
      accepts(can_filter_extended(0x1234567, 0x1FFFFFFF), {.identifier = 0x1234566, .extended = true}));
}

}  // namespace
}  // namespace kmax::drivers::stm32f4::can_filter_test
