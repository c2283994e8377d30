#include "firmware/canopen/sync.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace kmax::firmware::canopen::sync_test {
namespace {

TEST(Sync, IsTakenWithAndWithoutACounterAndWithNoOtherLength) {
  for (std::uint8_t length = 0; length <= 8; ++length)
    EXPECT_EQ(Sync().receive({.identifier = 0x080, .length = length}), length <= 1) << int{length};
}

TEST(Sync, OtherFramesAreNotForIt) {
  Sync sync;
  EXPECT_FALSE(sync.receive({.identifier = 0x081}));
  EXPECT_FALSE(sync.receive({.identifier = 0x080, .extended = true}));
  EXPECT_FALSE(sync.receive({.identifier = 0x080, .remote = true}));
  sync.configure(0x8000'0085);
  EXPECT_EQ(sync.identifier(), 0x085U);
  EXPECT_FALSE(sync.receive({.identifier = 0x080}));
  EXPECT_TRUE(sync.receive({.identifier = 0x085}));
}

TEST(Sync, ChecksWhatIsWritten) {
  for (const std::uint32_t good : {0x080U, 0x8000'0080U, 0x0FFU, 0x100U, 0x181U, 0x6DFU})
    EXPECT_EQ(Sync::check(good), Abort::none) << good;
  for (const std::uint32_t bad : {0x4000'0080U, 0x2000'0080U, 0x880U, 0x000U, 0x001U, 0x07FU, 0x180U, 0x581U,
                                  0x601U, 0x701U, 0x7E5U, 0x7FFU, 0xFFFF'FFFFU})
    EXPECT_EQ(Sync::check(bad), Abort::value_range) << bad;
}

}  // namespace
}  // namespace kmax::firmware::canopen::sync_test
