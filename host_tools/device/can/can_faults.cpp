#include "host_tools/device/can/can_faults.hpp"

#include <fmt/format.h>
#include <linux/can/error.h>

namespace kmax::device {

namespace {
const char* controller_text(std::uint8_t state) {
  if ((state & (CAN_ERR_CRTL_TX_PASSIVE | CAN_ERR_CRTL_RX_PASSIVE)) != 0)
    return "the controller is error passive (more than 127 errors)";
  if ((state & (CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_RX_WARNING)) != 0)
    return "the controller warns of errors (more than 95)";
  if ((state & CAN_ERR_CRTL_RX_OVERFLOW) != 0) return "the controller lost frames (receive overflow)";
  if ((state & CAN_ERR_CRTL_TX_OVERFLOW) != 0) return "the controller lost frames (transmit overflow)";
  return "the controller changed its error state";
}

const char* violation_text(std::uint8_t kind) {
  if ((kind & CAN_ERR_PROT_STUFF) != 0) return "bit stuffing is violated";
  if ((kind & CAN_ERR_PROT_FORM) != 0) return "frames have a wrong form";
  if ((kind & (CAN_ERR_PROT_BIT | CAN_ERR_PROT_BIT0 | CAN_ERR_PROT_BIT1)) != 0)
    return "bits read back differ from those sent";
  return "frames violate the protocol";
}

constexpr const char* check_wires =
    "check that all nodes have the same bit rate, the wiring, and 120 ohm at both ends of the bus";
}  // namespace

void CanFaults::take(const can_frame& frame) {
  if ((frame.can_id & CAN_ERR_RESTARTED) != 0) {
    *this = CanFaults();
    return;
  }
  ++reports_;
  classes_ |= frame.can_id & CAN_ERR_MASK;
  if ((frame.can_id & CAN_ERR_BUSOFF) != 0) bus_off_ = true;
  if ((frame.can_id & CAN_ERR_CRTL) != 0) {
    // CAN_ERR_CRTL_ACTIVE: back to normal.
    controller_ = frame.data[1];
    if ((frame.data[1] & CAN_ERR_CRTL_ACTIVE) != 0) {
      controller_ = 0;
      classes_ &= ~static_cast<canid_t>(CAN_ERR_CRTL);
    }
  }
  if ((frame.can_id & CAN_ERR_PROT) != 0) violation_ = frame.data[2];
  if ((frame.can_id & CAN_ERR_CNT) != 0) {
    transmit_errors_ = frame.data[6];
    receive_errors_ = frame.data[7];
  }
}

void CanFaults::frame_received() {
  const bool off = bus_off_;
  if (reports_ != 0) *this = CanFaults();
  if (off) {
    bus_off_ = true;
    classes_ = CAN_ERR_BUSOFF;
    reports_ = 1;
  }
}

std::string CanFaults::words(const std::string& interface) const {
  if (bus_off_)
    return fmt::format(
        "{0} is bus-off: its controller has left the bus after too many errors; {1}, then 'sudo ip link set "
        "{0} type can restart', or let it restart by itself: 'sudo ip link set {0} type can restart-ms 100'",
        interface, check_wires);
  if (classes_ == 0) return {};
  const std::string counted =
      fmt::format("{} report{} of {}{}", reports_, reports_ == 1 ? "" : "s", interface,
                  transmit_errors_ != 0 || receive_errors_ != 0
                      ? fmt::format(", error counters {} transmitting and {} receiving", transmit_errors_,
                                    receive_errors_)
                      : "");
  // A frame nobody acknowledges makes the transmitter passive too: the cause before its effect.
  if ((classes_ & CAN_ERR_ACK) != 0)
    return fmt::format("nobody on the bus acknowledges frames ({}); check that the device is powered; {}",
                       counted, check_wires);
  if ((classes_ & CAN_ERR_TRX) != 0)
    return fmt::format("the transceiver reports a fault of its lines ({}); check the wiring", counted);
  if ((classes_ & CAN_ERR_PROT) != 0)
    return fmt::format("{} ({}); {}", violation_text(violation_), counted, check_wires);
  if ((classes_ & CAN_ERR_CRTL) != 0)
    return fmt::format("{} ({}); {}", controller_text(controller_), counted, check_wires);
  if ((classes_ & CAN_ERR_TX_TIMEOUT) != 0)
    return fmt::format("the driver could not send in time ({}); {}", counted, check_wires);
  if ((classes_ & (CAN_ERR_BUSERROR)) != 0)
    return fmt::format("there are errors on the bus ({}); {}", counted, check_wires);
  return {};  // lost arbitration and counters: no trouble
}

}  // namespace kmax::device
