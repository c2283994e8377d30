#include "firmware/modbus/crc.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdint>

#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::crc_test {
namespace {

constexpr std::array<std::uint8_t, 9> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
static_assert(crc_of(digits) == 0x4B37, "the catalogue's check value");
static_assert(crc_of({}) == 0xFFFF);

// Published frames: the standard's guide (02 07 -> 41 12), the "123456789" check value of the CRC-16/MODBUS
// catalogue entry, and the request and response examples that every Modbus tutorial prints.
TEST(ModbusCrc, PublishedFrames) {
  const Bytes frames[] = {
      {0x02, 0x07, 0x41, 0x12},
      {0x01, 0x03, 0x00, 0x00, 0x00, 0x0A, 0xC5, 0xCD},
      {0x01, 0x04, 0x02, 0xFF, 0xFF, 0xB8, 0x80},
      {0x11, 0x03, 0x00, 0x6B, 0x00, 0x03, 0x76, 0x87},
      {0x11, 0x03, 0x06, 0xAE, 0x41, 0x56, 0x52, 0x43, 0x40, 0x49, 0xAD},
      {0x11, 0x04, 0x00, 0x08, 0x00, 0x01, 0xB2, 0x98},
      {0x11, 0x06, 0x00, 0x01, 0x00, 0x03, 0x9A, 0x9B},
      {0x11, 0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02, 0xC6, 0xF0},
      {0x11, 0x16, 0x00, 0x04, 0x00, 0xF2, 0x00, 0x25, 0x66, 0xE2},
  };
  for (const Bytes& frame : frames) {
    const Bytes body(frame.begin(), frame.end() - 2);
    const std::uint16_t crc = crc_of(body);
    EXPECT_EQ(crc & 0xFF, frame[frame.size() - 2]);
    EXPECT_EQ(crc >> 8, frame[frame.size() - 1]);
    EXPECT_EQ(crc_of(frame), 0);
  }
}

TEST(ModbusCrc, EveryRegisterAndByteMatchesTheBitwiseAlgorithm) {
  for (unsigned byte = 0; byte < 256; ++byte) {
    for (unsigned crc = 0; crc < 0x10000; crc += 251) {
      unsigned expected = crc ^ byte;
      for (int i = 0; i < 8; ++i) expected = expected % 2 == 1 ? (expected / 2) ^ 0xA001 : expected / 2;
      ASSERT_EQ(crc_update(static_cast<std::uint16_t>(crc), static_cast<std::uint8_t>(byte)), expected);
    }
  }
}

RC_GTEST_PROP(ModbusCrc, MatchesTheBitwiseAlgorithm, (const Bytes& bytes)) {
  RC_ASSERT(crc_of(bytes) == reference_crc(bytes));
}

}  // namespace
}  // namespace kmax::firmware::modbus::crc_test
