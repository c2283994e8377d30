#pragma once

#include <cstdint>

namespace kmax::virtual_board {

/// Error counters of one node: ISO 11898-1, fault confinement. The additions of 8 for dominant bits after an
/// error flag and the exception for stuff errors in the arbitration field are left out: no node here sends a
/// longer flag than it should.
class CanFaultConfinement {
 public:
  unsigned transmit_errors() const { return transmit_; }
  unsigned receive_errors() const { return receive_; }
  bool warning() const { return transmit_ >= 96 || receive_ >= 96; }
  bool passive() const { return transmit_ > 127 || receive_ > 127; }
  bool bus_off() const { return transmit_ > 255; }

  void sent() { transmit_ -= transmit_ != 0 ? 1 : 0; }
  void received() {
    if (receive_ > 127) {
      receive_ = 127;
    } else if (receive_ != 0) {
      --receive_;
    }
  }
  /// `unacknowledged`: nobody has set the acknowledge bit; a node that is error passive does not count that,
  /// so one alone on a bus never becomes bus-off.
  void transmit_error(bool unacknowledged) {
    if (unacknowledged && passive()) return;
    transmit_ += 8;
  }
  void receive_error() {
    if (receive_ < 255) ++receive_;
  }
  void reset() { transmit_ = receive_ = 0; }

 private:
  unsigned transmit_ = 0;
  unsigned receive_ = 0;
};

}  // namespace kmax::virtual_board
