#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string_view>

#include "firmware/usb/descriptors.hpp"
#include "firmware/usb/endpoint_controller.hpp"
#include "firmware/usb/protocol.hpp"

namespace kmax::firmware::usb {

/// What the device does beside being one: the class and vendor requests, and all endpoints but 0.
///
///   ISR_start()               the configuration was chosen, and its endpoints have just been opened
///   ISR_stop()                it is no more: bus reset, another choice. Nothing may be sent
///   ISR_answer(setup, room)   what a request that reads is answered with, in `room` or elsewhere, as long as
///                             the transfer takes; nothing: STALL
///   ISR_accepts(setup)        whether a request that writes is one that is known
///   ISR_take(setup, data)     carries it out, with the data that came, which is as much as it said; false:
///                             STALL
///   ISR_finished(setup)       the host has acknowledged that it was carried out
///   ISR_received(number, data), ISR_sent(number)   as EndpointController
///   ISR_reopened(address)     the host has cleared the endpoint's halt: what was under way there is lost
template <typename Functions>
concept DeviceFunctions = requires(Functions& functions, const SetupPacket& setup, std::uint8_t number,
                                   std::span<std::uint8_t, full_packet> room,
                                   std::span<const std::uint8_t> data) {
  functions.ISR_start();
  functions.ISR_stop();
  { functions.ISR_answer(setup, room) } -> std::same_as<std::optional<std::span<const std::uint8_t>>>;
  { functions.ISR_accepts(setup) } -> std::same_as<bool>;
  { functions.ISR_take(setup, data) } -> std::same_as<bool>;
  functions.ISR_finished(setup);
  functions.ISR_received(number, data);
  functions.ISR_sent(number);
  functions.ISR_reopened(number);
};

/// What a start gives the device for its descriptors.
struct DeviceIdentity {
  std::uint32_t serial_number = 0;
  std::uint16_t release = 0;  ///< binary-coded decimal, 0xJJMN
};

/// A USB device as chapter 9 of USB 2.0 wants it: the control endpoint, its states and its standard requests.
///
/// One configuration, number 1, whose interfaces have no alternate settings; no remote wake-up. A request
/// that is not known, or that does not fit the state, is answered with STALL, as are data stages of more than
/// 64 bytes towards the device. A set-up packet ends whatever was under way on endpoint 0.
///
/// Everything here runs in the controller's interrupt. Errors: there are none but STALL. Cost: bounded by a
/// packet. Memory: about 250 bytes.
template <EndpointController Controller, DeviceFunctions Functions>
class Device {
 public:
  Device(Controller& controller, Functions& functions, const DeviceIdentity& of)
      : controller_(controller),
        functions_(functions),
        descriptor_(device_descriptor(of.release)),
        serial_number_(serial_number_text(of.serial_number)) {}

  /// Main loop: since the start.
  struct Counters {
    std::uint32_t resets = 0, suspensions = 0;
    std::uint32_t refused_requests = 0;  ///< that were answered with STALL
  };
  Counters counters() const {
    return {resets_.load(std::memory_order_relaxed), suspensions_.load(std::memory_order_relaxed),
            refused_.load(std::memory_order_relaxed)};
  }

  void ISR_reset() {
    ISR_count(resets_);
    ISR_leave_configuration();
    stage_ = Stage::idle;
    address_ = next_address_ = 0;
    suspended_ = false;
  }

  void ISR_set_up(std::span<const std::uint8_t, setup_bytes> bytes) {
    ISR_give_up_address();
    setup_ = setup_packet(bytes);
    left_ = {};
    received_ = 0;
    if (setup_.to_host() && setup_.length != 0)
      ISR_begin_reading();
    else if (setup_.length != 0)
      ISR_begin_writing();
    else
      ISR_carry_out();
  }

  void ISR_received(std::uint8_t number, std::span<const std::uint8_t> data) {
    if (number != 0) {
      if (configured_) functions_.ISR_received(number, data);
      return;
    }
    if (stage_ == Stage::data_from_host) {
      ISR_take_data(data);
    } else if (stage_ == Stage::data_to_host || stage_ == Stage::status_from_host) {
      // The host may end a transfer before it has all that was offered.
      stage_ = Stage::idle;
      left_ = {};
    }
  }

  void ISR_sent(std::uint8_t number) {
    if (number != 0) {
      if (configured_) functions_.ISR_sent(number);
      return;
    }
    if (stage_ == Stage::data_to_host) {
      ISR_send_next();
    } else if (stage_ == Stage::status_to_host) {
      stage_ = Stage::idle;
      address_ = next_address_;
      if (setup_.kind() != RequestKind::standard) functions_.ISR_finished(setup_);
    }
  }

  /// Silence and its end change nothing in a device: what waits goes on behind it.
  void ISR_suspend() {
    ISR_count(suspensions_);
    suspended_ = true;
  }
  void ISR_resume() { suspended_ = false; }
  /// The host is there, and has chosen the configuration.
  bool ISR_attended() const { return configured_ && !suspended_; }

  bool ISR_configured() const { return configured_; }
  std::uint8_t ISR_address() const { return address_; }

 private:
  enum class Stage : std::uint8_t {
    idle,  ///< or stalled: a set-up packet ends both
    data_to_host,
    status_from_host,
    data_from_host,
    status_to_host,
  };
  using Answer = std::optional<std::span<const std::uint8_t>>;

  static void ISR_count(std::atomic<std::uint32_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  void ISR_refuse() {
    ISR_count(refused_);
    stage_ = Stage::idle;
    controller_.ISR_stall_control();
  }

  void ISR_begin_reading() {
    const Answer answer = setup_.kind() == RequestKind::standard ? ISR_standard_answer()
                          : ISR_reaches_functions()              ? functions_.ISR_answer(setup_, room_)
                                                                 : std::nullopt;
    if (!answer) return ISR_refuse();
    left_ = answer->first(std::min<std::size_t>(answer->size(), setup_.length));
    // Section 5.5.3: less than was asked for ends with a short packet, an empty one if need be.
    ends_empty_ = left_.size() < setup_.length && left_.size() % full_packet == 0;
    stage_ = Stage::data_to_host;
    controller_.ISR_receive(0);
    ISR_send_packet();
  }

  void ISR_send_packet() {
    const auto packet = left_.first(std::min(left_.size(), full_packet));
    left_ = left_.subspan(packet.size());
    if (packet.size() < full_packet) ends_empty_ = false;
    controller_.ISR_send(0, packet);
  }

  void ISR_send_next() {
    if (!left_.empty() || ends_empty_)
      ISR_send_packet();
    else
      stage_ = Stage::status_from_host;
  }

  void ISR_begin_writing() {
    // No standard request that is known brings data.
    const bool known = setup_.kind() != RequestKind::standard && ISR_reaches_functions() &&
                       setup_.length <= room_.size() && functions_.ISR_accepts(setup_);
    if (!known) return ISR_refuse();
    stage_ = Stage::data_from_host;
    controller_.ISR_receive(0);
  }

  void ISR_take_data(std::span<const std::uint8_t> data) {
    // One packet: it is as long as the host said, or the host does something else than it said.
    if (data.size() != setup_.length) return ISR_refuse();
    std::copy(data.begin(), data.end(), room_.begin());
    received_ = data.size();
    ISR_carry_out();
  }

  void ISR_carry_out() {
    const bool done =
        setup_.kind() == RequestKind::standard
            ? ISR_carry_out_standard()
            : ISR_reaches_functions() &&
                  functions_.ISR_take(setup_, std::span<const std::uint8_t>(room_).first(received_));
    if (!done) return ISR_refuse();
    stage_ = Stage::status_to_host;
    controller_.ISR_send(0, {});
  }

  Answer ISR_bytes(std::initializer_list<std::uint8_t> bytes) {
    std::copy(bytes.begin(), bytes.end(), room_.begin());
    return std::span<const std::uint8_t>(room_).first(bytes.size());
  }

  Answer ISR_standard_answer() {
    switch (static_cast<StandardRequest>(setup_.request)) {
      case StandardRequest::get_status:
        return ISR_status();
      case StandardRequest::get_descriptor:
        return setup_.is_for(Recipient::device) ? ISR_descriptor() : std::nullopt;
      case StandardRequest::get_configuration: {
        const bool known = setup_.is_for(Recipient::device) && setup_.value == 0 && setup_.index == 0;
        return known ? ISR_bytes({static_cast<std::uint8_t>(configured_ ? 1 : 0)}) : std::nullopt;
      }
      case StandardRequest::get_interface: {
        const bool known = setup_.is_for(Recipient::interface) && setup_.value == 0 && ISR_has_interface();
        return known ? ISR_bytes({0}) : std::nullopt;
      }
      default:
        return std::nullopt;
    }
  }

  Answer ISR_status() {
    if (setup_.value != 0) return std::nullopt;
    if (setup_.is_for(Recipient::device) && setup_.index == 0)
      return ISR_bytes({1, 0});  // supplied by itself
    if (setup_.is_for(Recipient::interface) && ISR_has_interface()) return ISR_bytes({0, 0});
    if (!setup_.is_for(Recipient::endpoint)) return std::nullopt;
    if ((setup_.index & ~std::uint16_t{direction_in}) == 0) return ISR_bytes({0, 0});
    const std::size_t place = ISR_place_of(setup_.index);
    if (place == endpoints.size()) return std::nullopt;
    return ISR_bytes({static_cast<std::uint8_t>(halted_[place] ? 1 : 0), 0});
  }

  Answer ISR_descriptor() {
    const auto index = static_cast<std::uint8_t>(setup_.value);
    switch (static_cast<DescriptorType>(setup_.value >> 8)) {
      case DescriptorType::device:
        return index == 0 && setup_.index == 0 ? Answer(descriptor_) : std::nullopt;
      case DescriptorType::configuration:
        return index == 0 && setup_.index == 0 ? Answer(configuration_descriptor) : std::nullopt;
      case DescriptorType::string:
        return ISR_text(static_cast<Text>(index));
      default:  // there is no high speed to qualify
        return std::nullopt;
    }
  }

  Answer ISR_text(Text text) {
    if (text == Text::languages)
      return ISR_bytes({4, detail::of(DescriptorType::string), detail::low(english), detail::high(english)});
    const std::string_view said = text == Text::serial_number
                                      ? std::string_view(serial_number_.data(), serial_number_.size())
                                      : text_of(text);
    if (said.empty() || setup_.index != english) return std::nullopt;
    return text_descriptor(said, room_);
  }

  bool ISR_carry_out_standard() {
    if (setup_.to_host()) return ISR_standard_answer().has_value();  // of which nothing is wanted
    switch (static_cast<StandardRequest>(setup_.request)) {
      case StandardRequest::set_address:
        return ISR_set_address();
      case StandardRequest::set_configuration:
        return ISR_set_configuration();
      case StandardRequest::set_interface:
        return ISR_set_interface();
      case StandardRequest::set_feature:
      case StandardRequest::clear_feature:
        return ISR_set_halt(setup_.request == static_cast<std::uint8_t>(StandardRequest::set_feature));
      default:
        return false;
    }
  }

  bool ISR_set_address() {
    constexpr std::uint16_t highest = 127;
    if (!setup_.is_for(Recipient::device) || setup_.value > highest || setup_.index != 0 || configured_)
      return false;
    next_address_ = static_cast<std::uint8_t>(setup_.value);
    controller_.ISR_take_address(next_address_);
    return true;
  }
  /// A host that gives SET_ADDRESS up before its status stage still knows the device by the old one (9.4.6).
  void ISR_give_up_address() {
    if (next_address_ == address_) return;
    next_address_ = address_;
    controller_.ISR_take_address(address_);
  }

  bool ISR_set_configuration() {
    if (!setup_.is_for(Recipient::device) || setup_.value > 1 || setup_.index != 0 || address_ == 0)
      return false;
    // The one in force chosen again begins anew too (9.1.1.5, 9.4.5: halts are cleared).
    if (configured_) {
      for (const auto& [interface, endpoint] : endpoints) controller_.ISR_close(endpoint.address);
    }
    ISR_leave_configuration();
    if (setup_.value == 0) return true;
    for (const auto& [interface, endpoint] : endpoints) controller_.ISR_open(endpoint);
    configured_ = true;
    functions_.ISR_start();
    return true;
  }

  void ISR_leave_configuration() {
    halted_.fill(false);
    if (!configured_) return;
    configured_ = false;
    functions_.ISR_stop();
  }

  /// The only setting there is, which begins anew with DATA0 (9.1.1.5).
  bool ISR_set_interface() {
    if (!setup_.is_for(Recipient::interface) || setup_.value != 0 || !ISR_has_interface()) return false;
    for (std::size_t place = 0; place < endpoints.size(); ++place) {
      if (endpoints[place].interface == setup_.index) ISR_reopen(place);
    }
    return true;
  }

  bool ISR_set_halt(bool halt) {
    // Neither remote wake-up nor a test mode; endpoint 0 is never halted (9.4.5).
    const std::size_t place = ISR_place_of(setup_.index);
    if (!setup_.is_for(Recipient::endpoint) || setup_.value != feature_endpoint_halt ||
        place == endpoints.size()) {
      return false;
    }
    if (halt) {
      halted_[place] = true;
      controller_.ISR_stall(endpoints[place].endpoint.address);
    } else {
      ISR_reopen(place);
    }
    return true;
  }

  void ISR_reopen(std::size_t place) {
    halted_[place] = false;
    controller_.ISR_clear_stall(endpoints[place].endpoint.address);
    functions_.ISR_reopened(endpoints[place].endpoint.address);
  }

  /// Interfaces are there with the configuration.
  bool ISR_reaches_functions() const { return configured_ || setup_.is_for(Recipient::device); }
  bool ISR_has_interface() const { return configured_ && setup_.index < interface_count; }
  /// endpoints.size(): there is no such endpoint in this state.
  std::size_t ISR_place_of(std::uint16_t address) const {
    const auto found = std::find_if(endpoints.begin(), endpoints.end(),
                                    [address](const auto& one) { return one.endpoint.address == address; });
    return configured_ ? static_cast<std::size_t>(found - endpoints.begin()) : endpoints.size();
  }

  Controller& controller_;
  Functions& functions_;
  std::array<std::uint8_t, 18> descriptor_;
  std::array<char, 8> serial_number_;
  SetupPacket setup_;
  std::span<const std::uint8_t> left_;  ///< of what is being read
  std::size_t received_ = 0;            ///< of what is being written
  std::array<std::uint8_t, full_packet> room_{};
  std::array<bool, endpoints.size()> halted_{};
  std::atomic<std::uint32_t> resets_{0}, suspensions_{0}, refused_{0};  ///< the interrupt writes them
  Stage stage_ = Stage::idle;
  std::uint8_t address_ = 0, next_address_ = 0;  ///< the next one counts behind the status stage
  bool ends_empty_ = false, configured_ = false, suspended_ = false;
};

}  // namespace kmax::firmware::usb
