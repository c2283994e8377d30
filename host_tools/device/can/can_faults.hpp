#pragma once

#include <linux/can.h>

#include <cstdint>
#include <string>

namespace kmax::device {

/// What a CAN controller reports about the bus, in words: the kernel's error frames (linux/can/error.h).
class CanFaults {
 public:
  /// `frame` has CAN_ERR_FLAG.
  void take(const can_frame& frame);

  /// A frame came through: what was reported before is over, except bus-off, which only a restart ends.
  void frame_received();

  bool bus_off() const { return bus_off_; }

  /// The gravest report since the last good frame and how many there were; empty if none.
  std::string words(const std::string& interface) const;

 private:
  canid_t classes_ = 0;                                    ///< CAN_ERR_...
  std::uint8_t controller_ = 0;                            ///< CAN_ERR_CRTL_..., of CAN_ERR_CRTL
  std::uint8_t violation_ = 0;                             ///< CAN_ERR_PROT_..., of CAN_ERR_PROT
  std::uint8_t transmit_errors_ = 0, receive_errors_ = 0;  ///< the controller's counters, as last reported
  std::uint64_t reports_ = 0;
  bool bus_off_ = false;
};

}  // namespace kmax::device
