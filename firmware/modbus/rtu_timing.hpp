// The three durations that frame Modbus RTU (MODBUS over Serial Line V1.02, 2.5.1.1), in whole microseconds,
// rounded up so that a silence is never taken for longer than it was.
//
// A character has 11 bits: start, 8 data, parity (or a second stop bit), stop. t1.5 and t3.5 are 1.5 and 3.5
// characters up to 19200 baud; above that the standard fixes them at 750 us and 1750 us, because at high
// rates the limits would be shorter than what an interrupt or a host's serial adapter can keep.
//
//   baud     character  t1.5  t3.5   (us, 11 bits)
//   9600          1146  1719  4011
//   19200          573   860  2006
//   115200          96   750  1750
//   921600          12   750  1750
#pragma once

#include <cstdint>

namespace kmax::firmware::modbus {

enum class Parity : std::uint8_t { none, even, odd };

// Defaults to 8E1. The standard asks for two stop bits without parity, so that a character keeps its 11 bits;
// 8N1 (10 bits) is common in the field and works too.
struct CharacterFormat {
  Parity parity = Parity::even;
  std::uint8_t stop_bits = 1;  // 1 or 2

  [[nodiscard]] constexpr std::uint32_t bits() const {
    return 1U + 8U + (parity == Parity::none ? 0U : 1U) + stop_bits;
  }

  friend constexpr bool operator==(const CharacterFormat&, const CharacterFormat&) = default;
};

struct RtuTiming {
  std::uint32_t character_us;  // from the start bit to the end of the last stop bit
  std::uint32_t t1_5_us;       // the longest silence inside a frame
  std::uint32_t t3_5_us;       // the shortest silence between two frames

  friend constexpr bool operator==(const RtuTiming&, const RtuTiming&) = default;
};

inline constexpr std::uint32_t baud_rate_min = 1'200;
inline constexpr std::uint32_t baud_rate_max = 4'000'000;

// `baud_rate` must lie in baud_rate_min .. baud_rate_max (all products then fit in 32 bits).
[[nodiscard]] constexpr RtuTiming rtu_timing(std::uint32_t baud_rate, CharacterFormat format = {}) {
  constexpr std::uint32_t highest_proportional_baud_rate = 19'200;
  const std::uint32_t character_bit_us = format.bits() * 1'000'000U;
  const auto half_characters_us = [&](std::uint32_t halves) {
    const std::uint32_t divisor = 2U * baud_rate;
    return (halves * character_bit_us + divisor - 1U) / divisor;
  };
  if (baud_rate > highest_proportional_baud_rate) return {half_characters_us(2), 750, 1'750};
  return {half_characters_us(2), half_characters_us(3), half_characters_us(7)};
}

// From `since` to `time` on a clock that wraps at 2^32 us; 0 when `time` lies before `since` (the two came
// from different readings of the clock). Good for distances below 2^31 us, 35 minutes: whoever keeps a
// `since` must drop it before that.
[[nodiscard]] constexpr std::uint32_t elapsed_us(std::uint32_t time, std::uint32_t since) {
  const std::uint32_t difference = time - since;
  return difference < 0x8000'0000U ? difference : 0U;
}

}  // namespace kmax::firmware::modbus
