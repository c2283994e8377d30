// ISO 11898-1: frame formats, CRC sequence, bit stuffing.
#include "host_tools/virtual_board/stm32f4/can_frame_bits.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string_view>

#include "tests/host_tools/virtual_board/stm32f4/random_can_frame.hpp"

namespace kmax::virtual_board::can_frame_bits_test {
namespace {

using drivers::CanFrame;

std::vector<bool> bits_of(std::string_view text) {
  std::vector<bool> bits;
  for (const char character : text) {
    for (int i = 7; i >= 0; --i) bits.push_back((character >> i & 1) != 0);
  }
  return bits;
}

// The check value that catalogues of CRCs give for CRC-15/CAN.
TEST(CanFrameBits, CrcOfTheCatalogue) {
  EXPECT_EQ(can_crc(bits_of("123456789")), 0x059E);
  EXPECT_EQ(can_crc({}), 0);
}

/// Without the stuff bits, up to the CRC delimiter.
std::vector<bool> unstuffed(const CanFrameBits& frame) {
  std::vector<bool> plain;
  unsigned equal = 0;
  bool last = true, skip = false;
  for (unsigned i = 0; i + 1 < frame.acknowledge_slot; ++i) {
    const bool bit = frame.bits[i];
    if (skip) {
      EXPECT_NE(bit, last) << "a stuff bit differs from the five before";
      skip = false;
      equal = 1;
      last = bit;
      continue;
    }
    plain.push_back(bit);
    equal = bit == last ? equal + 1 : 1;
    last = bit;
    if (equal == 5) skip = true;
  }
  return plain;
}

RC_GTEST_PROP(CanFrameBits, UnstuffsToAFrameWithAGoodCrc, ()) {
  const CanFrame frame = *testing::random_can_frame();
  const CanFrameBits bits = can_frame_bits(frame);
  const std::vector<bool> plain = unstuffed(bits);
  const unsigned data = frame.remote ? 0 : 8U * frame.length;
  RC_ASSERT(plain.size() == (frame.extended ? 54U : 34U) + data);
  // The remainder of a frame with its CRC is 0.
  RC_ASSERT(can_crc(plain) == 0);
  RC_ASSERT(bits.bits.size() == bits.acknowledge_slot + 9);
  for (unsigned i = bits.acknowledge_slot - 1; i < bits.bits.size(); ++i) RC_ASSERT(bits.bits[i]);
}

TEST(CanFrameBits, LengthsStayWithinTheKnownBounds) {
  // Worst case without intermission: 8 n + 44 + floor((34 + 8 n - 1) / 4) bits, extended 8 n + 64 + floor((54
  // + 8 n - 1) / 4).
  for (unsigned n = 0; n <= 8; ++n) {
    std::size_t longest = 0;
    for (unsigned pattern = 0; pattern < 256; ++pattern) {
      CanFrame frame{.identifier = 0x078, .length = static_cast<std::uint8_t>(n)};
      frame.data.fill(static_cast<std::uint8_t>(pattern));
      const std::size_t length = can_frame_bits(frame).bits.size();
      ASSERT_GE(length, 44 + 8 * n);
      ASSERT_LE(length, 44 + 8 * n + (33 + 8 * n) / 4);
      longest = std::max(longest, length);
    }
    EXPECT_GT(longest, 44 + 8 * n);
  }
}

// Identifier 0, no data: 00000 1 00000 1 0000 ... the very bits, written down by hand up to the data length
// code.
TEST(CanFrameBits, StuffBitsOfTheLowestIdentifier) {
  const std::vector<bool> bits = can_frame_bits({.identifier = 0}).bits;
  const std::string begin([&] {
    std::string text;
    for (unsigned i = 0; i < 22; ++i) text += bits[i] ? '1' : '0';
    return text;
  }());
  // 19 dominant bits (SOF, 11 of identifier, RTR, IDE, r0, 4 of DLC): a recessive one after each five.
  EXPECT_EQ(begin, "0000010000010000010000");
}

RC_GTEST_PROP(CanFrameBits, ArbitrationAgreesWithTheBits, ()) {
  const CanFrame a = *testing::random_can_frame(), b = *testing::random_can_frame();
  const std::uint32_t key_a = drivers::can_arbitration(a), key_b = drivers::can_arbitration(b);
  if (key_a == key_b) return;
  RC_ASSERT((key_a < key_b) == (can_frame_bits(a).bits < can_frame_bits(b).bits));
}

}  // namespace
}  // namespace kmax::virtual_board::can_frame_bits_test
