#pragma once

#include <cstdint>

namespace kmax::firmware {

/// What a board says of its USB device, while a host is there. All of them count since the start, and wrap.
struct UsbReadings {
  std::uint32_t resets = 0;            ///< of the bus, by the host
  std::uint32_t suspensions = 0;       ///< the host was silent for 3 ms
  std::uint32_t refused_requests = 0;  ///< on endpoint 0, answered with STALL
  std::uint32_t frames_lost = 0;       ///< of the CAN adapter, to the host
  std::uint32_t frames_not_sent = 0;   ///< to the bus while the CAN adapter is open
  std::uint32_t frames_refused = 0;    ///< of the CAN adapter, from the host: none, or for a closed channel
};

}  // namespace kmax::firmware
