#pragma once

#include <array>
#include <cstdint>

namespace kmax::firmware {

/// Condition of a CAN controller; the numbers are those of can.state.
enum class CanState : std::uint8_t {
  absent = 0,         ///< this board has none, or it does not answer
  stopped = 1,        ///< not set up
  joining = 2,        ///< waits for eleven recessive bits: the bus is busy, stuck or not connected
  active = 3,         ///< on the bus
  error_passive = 4,  ///< on the bus, and most of what it sends or hears is wrong
  bus_off = 5,        ///< off the bus for its errors, or on the way back
};

/// What a board says of its CAN controller, once a millisecond.
struct CanReadings {
  CanState state = CanState::absent;
  std::uint8_t transmit_errors = 0, receive_errors = 0;
  std::uint32_t received = 0, sent = 0;
  std::uint32_t overruns = 0;   ///< times that frames were lost because the controller was full
  std::uint32_t bus_offs = 0;   ///< times that it went off the bus
  std::uint32_t discarded = 0;  ///< frames thrown away unsent
};

/// What the application wants of the controller.
struct CanSettings {
  static constexpr std::size_t identifiers_max = 24;

  std::uint32_t bit_rate = 1'000'000;
  /// 11-bit identifiers of data frames that are to be received; all others may be dropped.
  std::array<std::uint16_t, identifiers_max> identifiers{};
  std::uint8_t identifier_count = 0;
  friend constexpr bool operator==(const CanSettings&, const CanSettings&) = default;
};

}  // namespace kmax::firmware
