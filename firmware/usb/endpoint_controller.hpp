#pragma once

#include <concepts>
#include <cstdint>
#include <span>

#include "firmware/usb/protocol.hpp"

namespace kmax::firmware::usb {

/// A USB device controller as the device above it uses it, a packet at a time, in the controller's interrupt.
///
/// The device calls
///   ISR_open(endpoint)      the endpoint answers NAK from now on; its next data packet is DATA0
///   ISR_close(address)      it does not answer any more; a packet that waits in it is thrown away
///   ISR_take_address(a)     before the status stage of SET_ADDRESS, in force behind it (9.4.6); where that
///                           stage does not come, the address in force again
///   ISR_send(number, data)  one packet, up to the endpoint's size, 0 bytes too; the controller has a copy
///                           when it returns. Not again before ISR_sent()
///   ISR_take_back(number)   a packet that waits in it is thrown away, and is not reported as sent; its data
///                           toggle stays. Without one nothing happens
///   ISR_receive(number)     one packet may come; until then, and behind it, the endpoint answers NAK
///   ISR_stall(address)      it answers STALL; a packet that waits in it is thrown away
///   ISR_clear_stall(address)   it answers NAK again, and its next data packet is DATA0; a packet that waits
///                           is thrown away here too
///   ISR_stall_control()     endpoint 0 answers STALL in both directions up to the next set-up packet
/// and is called, by ISR_serve(device) of the controller,
///   ISR_reset()             the bus was reset: address 0, all endpoints but 0 closed, nothing under way
///   ISR_set_up(bytes)       on endpoint 0; what was under way there is thrown away
///   ISR_received(number, data)   a packet, valid during the call
///   ISR_sent(number)        the host has acknowledged the packet
///   ISR_suspend(), ISR_resume()   the host has been silent for 3 ms, which is all that is seen of a cable
///                           that was pulled where VBUS is not watched; it speaks again
///
/// Endpoint 0 is always open, with packets of full_packet.
template <typename Controller>
concept EndpointController = requires(Controller& controller, const Endpoint& endpoint, std::uint8_t number,
                                      std::span<const std::uint8_t> data) {
  controller.ISR_open(endpoint);
  controller.ISR_close(number);
  controller.ISR_take_address(number);
  controller.ISR_send(number, data);
  controller.ISR_take_back(number);
  controller.ISR_receive(number);
  controller.ISR_stall(number);
  controller.ISR_clear_stall(number);
  controller.ISR_stall_control();
};

}  // namespace kmax::firmware::usb
