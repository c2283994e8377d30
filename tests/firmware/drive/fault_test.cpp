#include "firmware/drive/fault.hpp"

#include <gtest/gtest.h>

#include <set>

namespace kmax::firmware::fault_test {
namespace {

TEST(Fault, EveryFaultHasItsOwnCodeAndWords) {
  std::set<std::uint16_t> codes;
  std::set<std::string_view> names;
  for (const FaultText& text : fault_texts) {
    EXPECT_TRUE(codes.insert(text.error_code).second) << text.error_code;
    EXPECT_TRUE(names.insert(text.name).second) << text.name;
    EXPECT_FALSE(text.what.empty());
    EXPECT_EQ(text.check.empty(), text.fault == Fault::none);
    EXPECT_EQ(&text_of(text.fault), &text);
    EXPECT_EQ(fault_by_error_code(text.error_code), &text);
  }
  EXPECT_EQ(text_of(Fault::none).error_code, 0);
}

TEST(Fault, CodesOfTheFieldArePinned) {
  EXPECT_EQ(text_of(Fault::over_speed).error_code, 0x8480);  // CiA 402: velocity speed controller, over-speed
  EXPECT_EQ(text_of(Fault::encoder).error_code, 0x7305);     // CiA 402: incremental encoder 1
  EXPECT_EQ(text_of(Fault::link_silent).error_code, 0x8130);  // CiA 301: life guard or heartbeat error
  EXPECT_EQ(text_of(Fault::not_finite).error_code, 0xFF01);   // manufacturer's
}

TEST(Fault, UnknownCodeIsNoFault) {
  EXPECT_EQ(fault_by_error_code(0x1234), nullptr);
}

}  // namespace
}  // namespace kmax::firmware::fault_test
