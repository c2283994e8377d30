#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/can_frame.hpp"

namespace kmax::firmware::usb::gs {

/// The protocol of gs_usb adapters as Linux' driver speaks it (drivers/net/can/usb/gs_usb.c): numbers and
/// layouts, little-endian.

enum class Request : std::uint8_t {  // GS_USB_BREQ_
  host_format = 0,
  bit_timing = 1,
  mode = 2,
  bus_errors = 3,
  bit_timing_constants = 4,
  device_configuration = 5,
  timestamp = 6,
  identify = 7,
};

inline constexpr std::uint32_t little_endian_host = 0x0000'BEEF;

/// Features, and the flags of a mode that ask for them: GS_CAN_FEATURE_, GS_CAN_MODE_. This adapter has none.
inline constexpr std::uint32_t features = 0;

inline constexpr std::size_t host_format_bytes = 4, bit_timing_bytes = 20, mode_bytes = 8,
                             constants_bytes = 40, configuration_bytes = 12, frame_bytes = 20;

/// GS_CAN_FLAG_OVERFLOW, in a frame to the host: frames before it were lost.
inline constexpr std::uint8_t flag_overflow = 1;
/// Of frames that the host did not send.
inline constexpr std::uint32_t no_echo = 0xFFFF'FFFF;

inline constexpr std::uint32_t id_extended = 1U << 31, id_remote = 1U << 30, id_error = 1U << 29;

/// What bit timings may be, in time quanta of a prescaled clock; of the bxCAN (RM0090, CAN_BTR).
struct TimingLimits {
  std::uint32_t segment_1_min = 1, segment_1_max = 16;
  std::uint32_t segment_2_min = 1, segment_2_max = 8;
  std::uint32_t jump_max = 4;
  std::uint32_t prescaler_min = 1, prescaler_max = 1024, prescaler_step = 1;
};

constexpr std::uint32_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] | std::uint32_t{bytes[at + 1]} << 8 | std::uint32_t{bytes[at + 2]} << 16 |
         std::uint32_t{bytes[at + 3]} << 24;
}
constexpr void put_word(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t word) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(word >> 8 * i);
}

/// What an open channel asks for: prop_seg, phase_seg1, phase_seg2, sjw, brp.
constexpr bool within(const TimingLimits& limits, std::span<const std::uint8_t> timing) {
  // Each by itself first: what the host sends may be any number.
  constexpr std::uint32_t some = 1U << 16;
  for (std::size_t at = 0; at < bit_timing_bytes; at += 4) {
    if (word_at(timing, at) > some) return false;
  }
  const std::uint32_t segment_1 = word_at(timing, 0) + word_at(timing, 4), segment_2 = word_at(timing, 8),
                      jump = word_at(timing, 12), prescaler = word_at(timing, 16);
  return segment_1 >= limits.segment_1_min && segment_1 <= limits.segment_1_max &&
         segment_2 >= limits.segment_2_min && segment_2 <= limits.segment_2_max && jump >= 1 &&
         jump <= limits.jump_max && prescaler >= limits.prescaler_min && prescaler <= limits.prescaler_max;
}

/// A frame either way. `echo` is a number of the host's own, by which it knows its frame again.
struct HostFrame {
  std::uint32_t echo = no_echo;
  std::uint8_t channel = 0, flags = 0;
  std::uint8_t session = 0;  ///< not on the wire: of which opening of the channel it is
  drivers::CanFrame frame{};
};

constexpr std::array<std::uint8_t, frame_bytes> encoded(const HostFrame& of) {
  std::array<std::uint8_t, frame_bytes> bytes{};
  put_word(bytes, 0, of.echo);
  put_word(bytes, 4,
           of.frame.identifier | (of.frame.extended ? id_extended : 0) | (of.frame.remote ? id_remote : 0));
  bytes[8] = of.frame.length;
  bytes[9] = of.channel;
  bytes[10] = of.flags;
  for (std::size_t i = 0; i < of.frame.data.size(); ++i) bytes[12 + i] = of.frame.data[i];
  return bytes;
}

/// frame_bytes at least. Whether it is a frame: its frame.valid().
constexpr HostFrame decoded(std::span<const std::uint8_t> bytes) {
  HostFrame of;
  const std::uint32_t identifier = word_at(bytes, 4);
  of.echo = word_at(bytes, 0);
  of.channel = bytes[9];
  of.flags = bytes[10];
  of.frame.extended = (identifier & id_extended) != 0;
  of.frame.remote = (identifier & id_remote) != 0;
  // An error frame is not for sending: its bit stays, and makes the identifier too large.
  of.frame.identifier = identifier & ~(id_extended | id_remote);
  of.frame.length = bytes[8];
  for (std::size_t i = 0; i < of.frame.data.size(); ++i) of.frame.data[i] = bytes[12 + i];
  return of;
}

}  // namespace kmax::firmware::usb::gs
