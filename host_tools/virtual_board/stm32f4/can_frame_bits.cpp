#include "host_tools/virtual_board/stm32f4/can_frame_bits.hpp"

namespace kmax::virtual_board {
namespace {

void append(std::vector<bool>& bits, std::uint32_t value, unsigned width) {
  for (unsigned i = width; i-- > 0;) bits.push_back((value >> i & 1U) != 0);
}

}  // namespace

std::uint16_t can_crc(const std::vector<bool>& bits) {
  std::uint16_t crc = 0;
  for (const bool bit : bits) {
    const bool invert = bit != ((crc & 0x4000U) != 0);
    crc = static_cast<std::uint16_t>((crc << 1U) & 0x7FFFU);
    if (invert) crc ^= 0x4599U;
  }
  return crc;
}

CanFrameBits can_frame_bits(const drivers::CanFrame& frame) {
  std::vector<bool> plain;
  plain.push_back(false);  // start of frame
  if (frame.extended) {
    append(plain, frame.identifier >> 18, 11);
    append(plain, 0b11, 2);  // SRR, IDE
    append(plain, frame.identifier & 0x3FFFFU, 18);
  } else {
    append(plain, frame.identifier, 11);
  }
  plain.push_back(frame.remote);
  // IDE of a standard frame takes part: it is what wins against an extended one.
  append(plain, 0, 2);  // IDE and r0, or r1 and r0
  const std::size_t arbitration = frame.extended ? plain.size() - 2 : plain.size() - 1;
  append(plain, frame.length, 4);
  for (unsigned i = 0; !frame.remote && i < frame.length; ++i) append(plain, frame.data.at(i), 8);
  append(plain, can_crc(plain), 15);

  CanFrameBits result;
  unsigned equal = 0;
  bool last = true;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    equal = plain[i] == last ? equal + 1 : 1;
    last = plain[i];
    result.bits.push_back(last);
    if (equal == 5) {
      last = !last;
      equal = 1;
      result.bits.push_back(last);
    }
    if (i + 1 == arbitration) result.arbitration_end = static_cast<unsigned>(result.bits.size());
  }
  result.bits.push_back(true);  // CRC delimiter
  result.acknowledge_slot = static_cast<unsigned>(result.bits.size());
  append(result.bits, 0x1FF, 9);  // acknowledge slot as sent, its delimiter, seven bits end of frame
  return result;
}

}  // namespace kmax::virtual_board
