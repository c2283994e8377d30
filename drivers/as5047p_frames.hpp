#pragma once

#include <cstdint>

// ams AS5047P magnetic rotary encoder, 14 bits a turn: its SPI frames and registers. AS5047P data sheet,
// sections SPI interface, Volatile registers.
//
// A frame has 16 bits. To the chip: bit 15 even parity over the whole word, bit 14 read, 13 to 0 the address.
// From it, in the frame after: bit 15 even parity, bit 14 EF (a frame before was faulty; ERRFL says how), 13
// to 0 the data.
//
// A line that is stuck high reads 0xFFFF, which has EF set and is never a valid angle. One that is stuck low
// reads 0: even parity, no error, and the angle 0. That no single frame can tell from a magnet that stands at
// 0.

namespace kmax::drivers {

enum class As5047pRegister : std::uint16_t {
  no_operation = 0x0000,
  errors = 0x0001,               // ERRFL; cleared by reading
  diagnostics = 0x3FFC,          // DIAAGC
  magnitude = 0x3FFD,            // MAG
  uncompensated_angle = 0x3FFE,  // ANGLEUNC
  angle = 0x3FFF,                // ANGLECOM: with dynamic angle error compensation
};

namespace as5047p {

inline constexpr std::uint16_t data_mask = 0x3FFF;
inline constexpr std::uint16_t error_flag = 1U << 14;  // in replies
inline constexpr std::uint16_t read_bit = 1U << 14;    // in commands
inline constexpr std::uint16_t parity_bit = 1U << 15;
inline constexpr std::uint32_t counts_per_turn = 1U << 14;

/// An even number of ones.
constexpr bool parity_is_even(std::uint16_t word) {
  unsigned folded = word;
  folded ^= folded >> 8;
  folded ^= folded >> 4;
  folded ^= folded >> 2;
  folded ^= folded >> 1;
  return (folded & 1U) == 0;
}

constexpr std::uint16_t with_parity(std::uint16_t word) {
  return parity_is_even(word) ? word : static_cast<std::uint16_t>(word ^ parity_bit);
}

constexpr std::uint16_t read_word(As5047pRegister address) {
  return with_parity(static_cast<std::uint16_t>(read_bit | static_cast<std::uint16_t>(address)));
}
static_assert(read_word(As5047pRegister::angle) == 0xFFFF);
static_assert(read_word(As5047pRegister::diagnostics) == 0xFFFC);
static_assert(read_word(As5047pRegister::errors) == 0x4001);
static_assert(read_word(As5047pRegister::no_operation) == 0xC000);

// ERRFL.
inline constexpr std::uint16_t framing_error = 1U << 0;    // FRERR: not 16 clocks between select and release
inline constexpr std::uint16_t invalid_command = 1U << 1;  // INVCOMM
inline constexpr std::uint16_t parity_error = 1U << 2;     // PARERR

// DIAAGC.
inline constexpr std::uint16_t gain_mask = 0x00FF;           // AGC: 0 strong field, 255 weak field
inline constexpr std::uint16_t ready = 1U << 8;              // LF: offset compensation has finished
inline constexpr std::uint16_t overflow = 1U << 9;           // COF: the angle is not valid
inline constexpr std::uint16_t field_too_strong = 1U << 10;  // MAGH
inline constexpr std::uint16_t field_too_weak = 1U << 11;    // MAGL

}  // namespace as5047p

/// What a reply looks like by itself.
enum class As5047pFrame : std::uint8_t {
  plausible,
  stuck_high,  ///< all ones
  parity,
  error_flag,  ///< EF: the chip did not understand a frame before
};

constexpr As5047pFrame as5047p_check(std::uint16_t reply) {
  if (reply == 0xFFFF) return As5047pFrame::stuck_high;
  if (!as5047p::parity_is_even(reply)) return As5047pFrame::parity;
  if ((reply & as5047p::error_flag) != 0) return As5047pFrame::error_flag;
  return As5047pFrame::plausible;
}

/// Content of DIAAGC.
struct As5047pDiagnostics {
  std::uint8_t gain = 0;
  bool ready = false;
  bool overflow = false;
  bool field_too_strong = false;
  bool field_too_weak = false;

  /// The chip measures an angle that means something. A field out of range still gives an angle, a noisy one.
  constexpr bool angle_valid() const { return ready && !overflow; }
};

constexpr As5047pDiagnostics as5047p_diagnostics(std::uint16_t data) {
  return {static_cast<std::uint8_t>(data & as5047p::gain_mask), (data & as5047p::ready) != 0,
          (data & as5047p::overflow) != 0, (data & as5047p::field_too_strong) != 0,
          (data & as5047p::field_too_weak) != 0};
}

}  // namespace kmax::drivers
