#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host_tools/virtual_board/board_time.hpp"

// What passes over a full-speed USB cable, in whole transactions: Universal Serial Bus Specification 2.0,
// chapter 8 (Protocol layer). Bits, CRCs and bit stuffing are not looked at; their time is.

namespace kmax::virtual_board {

namespace usb_time {
/// 12 Mbit/s.
inline constexpr BoardTime byte = units_per_second / 12'000'000 * 8;
inline constexpr BoardTime frame = units_per_second / 1000;
/// Table 5-9: what a transaction takes beside its data (synchronization, PIDs, address, CRC, turn-around), so
/// that 19 with 64 bytes fit into a frame; one that is refused has no data and no second turn-around.
inline constexpr BoardTime overhead = 13 * byte, refused = 8 * byte, unanswered = 7 * byte;
inline constexpr BoardTime start_of_frame = 6 * byte;
/// A device that sees no activity for so long is suspended (section 7.1.7.6).
inline constexpr BoardTime idle_until_suspend = 3 * frame;
}  // namespace usb_time

/// What a device answers. `none`: it is not there, does not mean itself, or was disturbed.
enum class UsbHandshake : std::uint8_t { none, acknowledged, not_ready, stalled };

struct UsbToken {
  std::uint8_t address = 0;
  std::uint8_t endpoint = 0;
};

struct UsbInAnswer {
  UsbHandshake handshake = UsbHandshake::none;  ///< acknowledged: `bytes` are the answer
  bool data1 = false;
  std::vector<std::uint8_t> bytes{};
};

/// A device at the end of the cable. Times never run backwards.
class UsbDeviceSide {
 public:
  /// It holds D+ high: a host that looks now sees a full-speed device.
  virtual bool pulled_up(BoardTime now) = 0;
  /// The bus is held at SE0, or let go.
  virtual void on_reset(bool held, BoardTime now) = 0;
  virtual void on_start_of_frame(unsigned frame, BoardTime now) = 0;
  /// The host drives K.
  virtual void on_resume(BoardTime now) = 0;
  /// A SETUP packet of 8 bytes has arrived.
  virtual UsbHandshake on_setup(UsbToken token, std::span<const std::uint8_t, 8> bytes, BoardTime now) = 0;
  /// An OUT packet has arrived.
  virtual UsbHandshake on_out(UsbToken token, bool data1, std::span<const std::uint8_t> bytes,
                              BoardTime now) = 0;
  /// An IN token has arrived.
  virtual UsbInAnswer on_in(UsbToken token, BoardTime now) = 0;
  /// The host has acknowledged the packet that on_in() gave.
  virtual void on_acknowledged(UsbToken token, BoardTime now) = 0;

 protected:
  ~UsbDeviceSide() = default;
};

}  // namespace kmax::virtual_board
