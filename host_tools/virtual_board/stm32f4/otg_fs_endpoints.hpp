#pragma once

#include <algorithm>
#include <cstdint>

#include "drivers/stm32f4/registers/otg_fs.hpp"

namespace kmax::virtual_board {

/// Bytes of the largest packet of an endpoint. Endpoint 0 has a code instead (DIEPCTL0, MPSIZ).
constexpr std::uint32_t otg_fs_packet_size(unsigned endpoint, std::uint32_t control) {
  const std::uint32_t field = drivers::stm32f4::otg_fs_diepctl::MaximumPacket::of(control);
  return endpoint == 0 ? 64U >> (field & 3U) : field;
}

/// What stays in DIEPCTL and DOEPCTL as it was stored; the rest acts, or is shown from elsewhere.
inline constexpr std::uint32_t otg_fs_kept_in =
    drivers::stm32f4::otg_fs_diepctl::MaximumPacket::mask | drivers::stm32f4::otg_fs_diepctl::Active::mask |
    drivers::stm32f4::otg_fs_diepctl::Type::mask | drivers::stm32f4::otg_fs_diepctl::Stall::mask |
    drivers::stm32f4::otg_fs_diepctl::TransmitFifoNumber::mask;
inline constexpr std::uint32_t otg_fs_kept_out =
    drivers::stm32f4::otg_fs_doepctl::MaximumPacket::mask | drivers::stm32f4::otg_fs_doepctl::Active::mask |
    drivers::stm32f4::otg_fs_doepctl::Type::mask | drivers::stm32f4::otg_fs_doepctl::Stall::mask;

/// The IN side of an endpoint: RM0090, chapter OTG_FS, section OTG_FS device IN endpoint x control register
/// and those behind it.
struct OtgFsInEndpoint {
  std::uint32_t control = 0;     ///< the bits that keep what was stored: MPSIZ, USBAEP, EPTYP, STALL, TXFNUM
  std::uint32_t interrupts = 0;  ///< DIEPINT without TXFE
  bool enabled = false, nak = false, data1 = false;
  bool nak_asked = false;       ///< SNAK has been written, and has not taken effect
  bool disable_asked = false;   ///< likewise EPDIS
  std::uint32_t unwritten = 0;  ///< bytes that the program has still to put into the FIFO: XFRSIZ
  std::uint32_t unsent = 0;     ///< bytes that the host has not got
  std::uint32_t packets = 0;    ///< PKTCNT

  std::uint32_t next_packet(unsigned endpoint) const {
    return std::min(unsent, otg_fs_packet_size(endpoint, control));
  }
};

/// The OUT side, section OTG_FS device OUT endpoint x control register and those behind it.
struct OtgFsOutEndpoint {
  std::uint32_t control = 0;
  std::uint32_t interrupts = 0;  ///< DOEPINT
  bool enabled = false, nak = false, data1 = false;
  bool disable_asked = false;
  std::uint32_t size = 0;     ///< XFRSIZ: falls as packets are taken from the FIFO
  std::uint32_t packets = 0;  ///< PKTCNT: falls as packets arrive
  std::uint32_t setups = 0;   ///< STUPCNT
  unsigned setups_in_a_row = 0;
  bool setup_under_way = false;    ///< "setup done" has still to come
  bool control_under_way = false;  ///< a SETUP has come, the status stage not yet
};

}  // namespace kmax::virtual_board
