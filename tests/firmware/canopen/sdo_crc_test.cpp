#include "firmware/canopen/sdo_crc.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <vector>

#include "tests/firmware/canopen/sdo_bench.hpp"

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

TEST(SdoCrc, EveryByteAfterEveryByte) {
  for (unsigned two = 0; two < 0x10000; ++two) {
    const Bytes bytes{static_cast<std::uint8_t>(two >> 8), static_cast<std::uint8_t>(two)};
    ASSERT_EQ(sdo_crc(sdo_crc_start, bytes), SdoTestClient<SdoBench<>>::bitwise_crc(bytes)) << two;
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_crc_test
