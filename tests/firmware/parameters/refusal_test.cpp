#include "firmware/parameters/refusal.hpp"

#include <gtest/gtest.h>

#include <set>

namespace kmax::firmware::refusal_test {
namespace {

TEST(Refusal, NumbersAreTheProtocolsAndEveryOneHasItsOwnWords) {
  std::set<std::string_view> words;
  for (std::uint16_t number = 0; number < refusal_texts.size(); ++number) {
    const auto refusal = static_cast<Refusal>(number);
    EXPECT_TRUE(words.insert(to_string(refusal)).second) << number << ": " << to_string(refusal);
    EXPECT_EQ(refusal_texts[number].refusal, refusal);
  }
  EXPECT_EQ(static_cast<int>(Refusal::encoder_invalid), 15);
  EXPECT_EQ(static_cast<int>(Refusal::emergency_stop), 16);
  EXPECT_EQ(static_cast<int>(Refusal::current_sense_invalid), 20);
  EXPECT_EQ(static_cast<int>(Refusal::while_armed), 7);
  EXPECT_EQ(static_cast<int>(Refusal::handle_inside_wall), 13);
}

TEST(Refusal, NumberOfALaterFirmwareIsSaidToBeUnknown) {
  EXPECT_FALSE(to_string(static_cast<Refusal>(999)).empty());
  EXPECT_NE(to_string(static_cast<Refusal>(999)), to_string(Refusal::none));
}

}  // namespace
}  // namespace kmax::firmware::refusal_test
