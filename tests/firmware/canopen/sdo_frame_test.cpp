#include "firmware/canopen/sdo_frame.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::canopen::sdo_frame_test {
namespace {

constexpr SdoBytes bytes{0xC6, 0x34, 0x12, 0x56, 0x78, 0x9A, 0xBC, 0xDE};

static_assert(sdo_request(bytes) == SdoRequest::block_download);
static_assert(sdo_address(bytes) == ObjectAddress{0x1234, 0x56});
static_assert(sdo_word(bytes) == 0xDEBC9A78);
static_assert(sdo_bytes(0xC6, {0x1234, 0x56}, 0xDEBC9A78) == bytes);

TEST(SdoFrame, EachCommandIsTheThreeHighestBits) {
  for (unsigned first = 0; first < 256; ++first) {
    const SdoBytes frame{static_cast<std::uint8_t>(first)};
    EXPECT_EQ(static_cast<unsigned>(sdo_request(frame)), first / 32);
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_frame_test
