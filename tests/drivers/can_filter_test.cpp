#include "drivers/stm32f4/can_filter.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::stm32f4::can_filter_test {

bool accepts(const CanFilter& filter, const CanFrame& frame) {
  const std::uint32_t word = can_identifier_word(frame);
  if (filter.list) return word == filter.first || word == filter.second;
  return ((word ^ filter.first) & filter.second) == 0;
}

TEST(CanFilter, WordsHaveTheLayoutOfTheMailbox) {
  EXPECT_EQ(can_identifier_word({.identifier = 0x7FF}), 0xFFE0'0000U);
  EXPECT_EQ(can_identifier_word({.identifier = 1, .extended = true, .remote = true}), 0x0000'000EU);
}

TEST(CanFilter, AcceptWhatTheySay) {
  const CanFilter two = can_filter_standard_list(0x000, 0x080);
  for (std::uint32_t identifier = 0; identifier < 0x800; ++identifier) {
    const CanFrame frame{.identifier = identifier};
    EXPECT_EQ(accepts(two, frame), identifier == 0 || identifier == 0x80);
    EXPECT_FALSE(accepts(two, {.identifier = identifier, .remote = true}));
    EXPECT_FALSE(accepts(two, {.identifier = identifier << 18, .extended = true}));
    EXPECT_TRUE(accepts({}, frame));
  }
  EXPECT_EQ(two.fifo, 0);
  EXPECT_EQ(can_filter_standard_list(1, 2, 1).fifo, 1);
  EXPECT_EQ(CanFilter{}.fifo, 0);
}

TEST(CanFilter, TakesEverythingIntoTheFirstFifo) {
  const CanFilter defaults{};
  EXPECT_EQ(defaults.first, 0u);
  EXPECT_EQ(defaults.second, 0u);
  EXPECT_FALSE(defaults.list);
  EXPECT_EQ(defaults.fifo, 0);
}

}  // namespace kmax::drivers::stm32f4::can_filter_test
