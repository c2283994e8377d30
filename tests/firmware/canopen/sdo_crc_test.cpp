#include "firmware/canopen/sdo_crc.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <vector>

#include "tests/firmware/canopen/sdo_test_client.hpp"

namespace kmax::firmware::canopen::sdo_crc_test {
namespace {

constexpr std::array<std::uint8_t, 9> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};

// The check value of this CRC (start 0, not reflected) that CiA 301 gives in 7.2.4.3.16.
static_assert(sdo_crc(sdo_crc_start, digits) == 0x31C3);
static_assert(sdo_crc(sdo_crc_start, {}) == 0);

RC_GTEST_PROP(SdoCrc, IsTheBitwiseDefinitionHoweverTheBytesAreCut, (const Bytes& bytes)) {
  const auto cut = *rc::gen::inRange<std::size_t>(0, bytes.size() + 1);
  const std::uint16_t first = sdo_crc(sdo_crc_start, std::span(bytes).first(cut));
  RC_ASSERT(sdo_crc(first, std::span(bytes).subspan(cut)) == SdoTestClient<SdoBench<>>::bitwise_crc(bytes));
}

TEST(SdoCrc, EverySingleByteAfterEveryHighByte) {
  for (unsigned crc = 0; crc < 0x10000; crc += 0x101) {
    for (unsigned byte = 0; byte < 256; ++byte) {
      unsigned expected = crc;
      for (int bit = 7; bit >= 0; --bit) {
        const bool out = ((expected >> 15 ^ byte >> bit) & 1U) != 0;
        expected = (expected << 1 & 0xFFFF) ^ (out ? 0x1021U : 0U);
      }
      const std::array one{static_cast<std::uint8_t>(byte)};
      ASSERT_EQ(sdo_crc(static_cast<std::uint16_t>(crc), one), expected) << crc << ' ' << byte;
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_crc_test
