#include "firmware/canopen/abort_code.hpp"

#include <gtest/gtest.h>

#include <set>
#include <utility>

namespace kmax::firmware::canopen::abort_code_test {
namespace {

// CiA 301's table of SDO abort codes, by hand.
TEST(AbortCode, NumbersAreTheStandards) {
  constexpr std::pair<Abort, std::uint32_t> table[] = {{Abort::none, 0},
                                                       {Abort::toggle, 0x05030000},
                                                       {Abort::timeout, 0x05040000},
                                                       {Abort::command, 0x05040001},
                                                       {Abort::block_size, 0x05040002},
                                                       {Abort::sequence, 0x05040003},
                                                       {Abort::crc, 0x05040004},
                                                       {Abort::memory, 0x05040005},
                                                       {Abort::unsupported_access, 0x06010000},
                                                       {Abort::write_only, 0x06010001},
                                                       {Abort::read_only, 0x06010002},
                                                       {Abort::no_object, 0x06020000},
                                                       {Abort::not_mappable, 0x06040041},
                                                       {Abort::pdo_length, 0x06040042},
                                                       {Abort::incompatible, 0x06040043},
                                                       {Abort::incompatible_inside, 0x06040047},
                                                       {Abort::hardware, 0x06060000},
                                                       {Abort::length, 0x06070010},
                                                       {Abort::too_long, 0x06070012},
                                                       {Abort::too_short, 0x06070013},
                                                       {Abort::no_subindex, 0x06090011},
                                                       {Abort::value_range, 0x06090030},
                                                       {Abort::value_too_high, 0x06090031},
                                                       {Abort::value_too_low, 0x06090032},
                                                       {Abort::maximum_below_minimum, 0x06090036},
                                                       {Abort::general, 0x08000000},
                                                       {Abort::not_transferred, 0x08000020},
                                                       {Abort::local_control, 0x08000021},
                                                       {Abort::device_state, 0x08000022}};
  EXPECT_EQ(std::size(table), abort_texts.size());
  std::set<std::string_view> all;
  for (const auto& [code, number] : table) {
    EXPECT_EQ(static_cast<std::uint32_t>(code), number);
    all.insert(to_string(code));
  }
  EXPECT_EQ(all.size(), abort_texts.size()) << "each has words of its own";
  EXPECT_EQ(to_string(Abort::crc), "the checksum is wrong");
  EXPECT_FALSE(all.contains(to_string(static_cast<Abort>(1)))) << "an unknown one too";
}

}  // namespace
}  // namespace kmax::firmware::canopen::abort_code_test
