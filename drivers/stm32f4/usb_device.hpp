#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/register_field.hpp"
#include "drivers/stm32f4/registers/otg_fs.hpp"

// USB device controller on OTG FS: RM0090 chapter USB on-the-go full-speed, sections Core initialization,
// Device initialization, Operational model. It is what firmware/usb calls an endpoint controller: one packet
// at a time, each with an interrupt at its end; nothing is polled but the core's own hand-shakes, which take
// a few periods of its clock, or a packet's time (50 us) where one is on the wire.
//
// The pin that senses VBUS is not used: the device has a session from start() on. A host that goes away looks
// like one that suspends the bus, one that comes resets it.
//
// Memory of the FIFOs, in words, of 320: 128 for what comes (set-up packets 10, two packets of 64 bytes with
// their status 36, and room), 32 for endpoint 0, 64, 64 and 16 for the others.
//
// An OUT endpoint is never disabled, which would need the NAK of all of them: it is kept from receiving by
// its own NAK, and its next transfer goes on where this one was armed.
//
// Contexts: start() before the interrupt is enabled; all else in the interrupt. Memory: about 300 bytes.

namespace kmax::drivers::stm32f4 {

/// The windows of the FIFOs, see otg_fs_fifo().
struct OtgFsFifos {
  volatile std::uint32_t& operator[](unsigned number) const { return otg_fs_fifo(number); }
};

template <typename Global = OtgFsGlobalRegisters, typename Device = OtgFsDeviceRegisters,
          typename Fifos = OtgFsFifos>
class UsbDevice {
 public:
  static constexpr std::size_t packet_bytes = 64;

  UsbDevice(Global& global, Device& device, Fifos fifos = {})
      : global_(global), device_(device), fifos_(fifos) {}

  /// Sets the core up and pulls D+ up: a host may come. After a reset of the peripheral, with its clock, 48
  /// MHz and the pins on. False, and no host sees anything, when the core does not answer or is no device
  /// within `polls` reads; forced, it is one after 25 ms at the latest.
  [[nodiscard]] bool start(std::uint32_t polls) {
    if (!wait_until(global_.grstctl, otg_fs_grstctl::AhbIdle::mask, otg_fs_grstctl::AhbIdle::mask, polls))
      return false;
    otg_fs_dctl::SoftDisconnect::set(device_.dctl);
    constexpr std::uint32_t turnaround = 6;  // with AHB at 32 MHz or more
    global_.gusbcfg = otg_fs_gusbcfg::FullSpeedPhy::mask | otg_fs_gusbcfg::Turnaround::bits(turnaround) |
                      otg_fs_gusbcfg::ForceDevice::mask;
    if (!wait_until(global_.gintsts, otg_fs_gint::HostMode::mask, 0, polls)) return false;
    otg_fs_dcfg::Speed::write(device_.dcfg, otg_fs_dcfg::full_speed);
    global_.gccfg = otg_fs_gccfg::PowerUp::mask | otg_fs_gccfg::NoVbusSensing::mask;
    divide_memory();
    if (!ISR_flush(otg_fs_grstctl::all_transmit_fifos)) return false;
    device_.diepmsk = otg_fs_diepint::TransferComplete::mask;
    device_.doepmsk = otg_fs_doepint::TransferComplete::mask | otg_fs_doepint::SetupDone::mask;
    device_.daintmsk = control_interrupts;
    global_.gintsts = 0xFFFF'FFFF;
    global_.gintmsk = otg_fs_gint::ReceiveNotEmpty::mask | otg_fs_gint::Suspend::mask |
                      otg_fs_gint::Reset::mask | otg_fs_gint::EnumerationDone::mask |
                      otg_fs_gint::InEndpoint::mask | otg_fs_gint::OutEndpoint::mask |
                      otg_fs_gint::WakeUp::mask;
    global_.gahbcfg = otg_fs_gahbcfg::InterruptEnable::mask;
    otg_fs_dctl::SoftDisconnect::clear(device_.dctl);
    return true;
  }
  /// Lets D+ go: the host sees the device leave.
  void disconnect() { otg_fs_dctl::SoftDisconnect::set(device_.dctl); }

  /// The whole interrupt handler; `handler` as firmware/usb/endpoint_controller.hpp says. Safe to call
  /// without cause: then false.
  template <typename Handler>
  bool ISR_serve(Handler& handler) {
    ISR_empty_receive_fifo();
    // Behind the packets: they came before it.
    const auto flags =
        static_cast<std::uint32_t>(global_.gintsts) & static_cast<std::uint32_t>(global_.gintmsk);
    if (otg_fs_gint::Reset::of(flags) != 0) {
      global_.gintsts = otg_fs_gint::Reset::mask;
      ISR_reset_bus();
      handler.ISR_reset();
      return true;
    }
    // There is no speed but one, and endpoint 0 has packets of 64 bytes after reset.
    if (otg_fs_gint::EnumerationDone::of(flags) != 0) global_.gintsts = otg_fs_gint::EnumerationDone::mask;
    // What was sent came before what was received behind it: see Device.
    if (otg_fs_gint::InEndpoint::of(flags) != 0) ISR_serve_in(handler);
    if (otg_fs_gint::OutEndpoint::of(flags) != 0) ISR_serve_out(handler);
    constexpr std::uint32_t activity = otg_fs_gint::Suspend::mask | otg_fs_gint::WakeUp::mask;
    if ((flags & activity) != 0) {
      global_.gintsts = flags & activity;
      // Both may have come since the last interrupt, in either order.
      if (otg_fs_dsts::Suspended::read(device_.dsts) != 0)
        handler.ISR_suspend();
      else
        handler.ISR_resume();
    }
    return flags != 0;
  }

  template <typename Endpoint>
  void ISR_open(const Endpoint& endpoint) {
    const unsigned number = number_of(endpoint.address);
    const auto type = static_cast<std::uint32_t>(endpoint.type);
    if (is_in(endpoint.address)) {
      ISR_stop_sending(number);
      device_.in[number].diepctl = otg_fs_diepctl::MaximumPacket::bits(endpoint.packet_bytes) |
                                   otg_fs_diepctl::Active::mask | otg_fs_diepctl::Type::bits(type) |
                                   otg_fs_diepctl::TransmitFifoNumber::bits(number) |
                                   otg_fs_diepctl::SetData0::mask | otg_fs_diepctl::SetNak::mask;
    } else {
      device_.out[number].doepctl = otg_fs_doepctl::MaximumPacket::bits(endpoint.packet_bytes) |
                                    otg_fs_doepctl::Active::mask | otg_fs_doepctl::Type::bits(type) |
                                    otg_fs_doepctl::SetData0::mask | otg_fs_doepctl::SetNak::mask;
    }
    device_.daintmsk = static_cast<std::uint32_t>(device_.daintmsk) | interrupt_of(endpoint.address);
  }

  void ISR_close(std::uint8_t address) {
    const unsigned number = number_of(address);
    device_.daintmsk = static_cast<std::uint32_t>(device_.daintmsk) & ~interrupt_of(address);
    if (is_in(address)) {
      ISR_stop_sending(number);
      device_.in[number].diepctl = kept(device_.in[number].diepctl) & ~otg_fs_diepctl::Active::mask;
    } else {
      device_.out[number].doepctl =
          (kept(device_.out[number].doepctl) & ~otg_fs_doepctl::Active::mask) | otg_fs_doepctl::SetNak::mask;
    }
  }

  /// The core changes over when it has sent the status stage (RM0090, Initialization on SetAddress command).
  void ISR_take_address(std::uint8_t address) { otg_fs_dcfg::Address::write(device_.dcfg, address); }

  void ISR_send(std::uint8_t number, std::span<const std::uint8_t> data) {
    auto& in = device_.in[number];
    in.dieptsiz = otg_fs_eptsiz::PacketCount::bits(1) |
                  otg_fs_eptsiz::TransferSize::bits(static_cast<std::uint32_t>(data.size()));
    in.diepctl = kept(in.diepctl) | otg_fs_diepctl::Enable::mask | otg_fs_diepctl::ClearNak::mask;
    // The FIFO has room for a packet, and the one before has left.
    for (std::size_t at = 0; at < data.size(); at += 4) {
      std::uint32_t word = 0;
      for (std::size_t i = 0; i < 4 && at + i < data.size(); ++i)
        word |= std::uint32_t{data[at + i]} << 8 * i;
      fifos_[number] = word;
    }
  }

  void ISR_take_back(std::uint8_t number) { ISR_stop_sending(number); }

  void ISR_receive(std::uint8_t number) {
    auto& out = device_.out[number];
    const bool armed = otg_fs_doepctl::Enable::read(out.doepctl) != 0;
    if (!armed) out.doeptsiz = one_packet(number);
    out.doepctl =
        kept(out.doepctl) | otg_fs_doepctl::ClearNak::mask | (armed ? 0 : otg_fs_doepctl::Enable::mask);
  }

  void ISR_stall(std::uint8_t address) {
    const unsigned number = number_of(address);
    if (is_in(address)) {
      ISR_stop_sending(number);
      device_.in[number].diepctl = kept(device_.in[number].diepctl) | otg_fs_diepctl::Stall::mask;
    } else {
      device_.out[number].doepctl =
          kept(device_.out[number].doepctl) | otg_fs_doepctl::Stall::mask | otg_fs_doepctl::SetNak::mask;
    }
  }
  void ISR_clear_stall(std::uint8_t address) {
    const unsigned number = number_of(address);
    if (is_in(address)) {
      ISR_stop_sending(number);
      device_.in[number].diepctl =
          (kept(device_.in[number].diepctl) & ~otg_fs_diepctl::Stall::mask) | otg_fs_diepctl::SetData0::mask;
    } else {
      device_.out[number].doepctl = (kept(device_.out[number].doepctl) & ~otg_fs_doepctl::Stall::mask) |
                                    otg_fs_doepctl::SetData0::mask | otg_fs_doepctl::SetNak::mask;
    }
  }
  /// The core takes both back with the next set-up packet.
  void ISR_stall_control() {
    device_.in[0].diepctl = kept(device_.in[0].diepctl) | otg_fs_diepctl::Stall::mask;
    device_.out[0].doepctl = kept(device_.out[0].doepctl) | otg_fs_doepctl::Stall::mask;
  }

 private:
  static constexpr unsigned receive_words = 128;
  static constexpr std::array<unsigned, otg_fs_endpoints> transmit_words{32, 64, 64, 16};
  static_assert(receive_words + transmit_words[0] + transmit_words[1] + transmit_words[2] +
                    transmit_words[3] <=
                otg_fs_fifo_words);
  static constexpr std::uint32_t control_interrupts = otg_fs_daint::In::bits(1) | otg_fs_daint::Out::bits(1);
  /// Reads that a hand-shake of the core is waited for: the time of a packet, and more.
  static constexpr std::uint32_t handshake_polls = 2'000;
  /// In a bus reset nothing is on the wire, and 10 clocks of the PHY are enough. No section says that
  /// endpoints which the reset has deactivated shake hands at all, and other interrupts wait behind this one.
  static constexpr std::uint32_t handshake_polls_in_reset = 64;
  /// Status words that the receive FIFO can hold.
  static constexpr unsigned receive_entries = receive_words;

  static constexpr bool is_in(std::uint8_t address) { return (address & 0x80U) != 0; }
  static constexpr unsigned number_of(std::uint8_t address) { return address & 0x0FU; }
  static constexpr std::uint32_t interrupt_of(std::uint8_t address) {
    const std::uint32_t bit = 1U << number_of(address);
    return is_in(address) ? otg_fs_daint::In::bits(bit) : otg_fs_daint::Out::bits(bit);
  }
  static constexpr std::uint32_t one_packet(unsigned number) {
    constexpr std::uint32_t set_ups = 3;
    return otg_fs_eptsiz::PacketCount::bits(1) | otg_fs_eptsiz::TransferSize::bits(packet_bytes) |
           (number == 0 ? otg_fs_eptsiz::SetupCount::bits(set_ups) : 0);
  }
  /// What of DIEPCTLx and DOEPCTLx is a state; the other bits do something.
  static std::uint32_t kept(const Register auto& control) {
    constexpr std::uint32_t deeds = otg_fs_diepctl::ClearNak::mask | otg_fs_diepctl::SetNak::mask |
                                    otg_fs_diepctl::SetData0::mask | otg_fs_diepctl::SetData1::mask |
                                    otg_fs_diepctl::Disable::mask | otg_fs_diepctl::Enable::mask;
    return static_cast<std::uint32_t>(control) & ~deeds;
  }

  void divide_memory() {
    global_.grxfsiz = otg_fs_grxfsiz::Depth::bits(receive_words);
    unsigned begin = receive_words;
    for (unsigned i = 0; i < otg_fs_endpoints; ++i) {
      const std::uint32_t place =
          otg_fs_dieptxf::Start::bits(begin) | otg_fs_dieptxf::Depth::bits(transmit_words[i]);
      if (i == 0)
        global_.dieptxf0 = place;
      else
        global_.dieptxf[i - 1] = place;
      begin += transmit_words[i];
    }
  }

  bool ISR_flush(std::uint32_t fifo) {
    global_.grstctl = otg_fs_grstctl::TransmitFlush::mask | otg_fs_grstctl::TransmitFifoNumber::bits(fifo);
    return wait_until(global_.grstctl, otg_fs_grstctl::TransmitFlush::mask, 0, handshake_polls);
  }

  /// What waits in the endpoint is thrown away, and is not reported as sent. `polls`: of each of two
  /// hand-shakes.
  void ISR_stop_sending(unsigned number, std::uint32_t polls = handshake_polls) {
    auto& in = device_.in[number];
    if (otg_fs_diepctl::Enable::read(in.diepctl) == 0) {
      // It has left since ISR_serve_in() looked, and what is sent next must not be taken for it.
      in.diepint = otg_fs_diepint::TransferComplete::mask;
      return;
    }
    in.diepctl = kept(in.diepctl) | otg_fs_diepctl::SetNak::mask;
    constexpr std::uint32_t nak = otg_fs_diepint::NakEffective::mask,
                            disabled = otg_fs_diepint::Disabled::mask;
    static_cast<void>(wait_until(in.diepint, nak, nak, polls));
    // It may have left meanwhile.
    if (otg_fs_diepctl::Enable::read(in.diepctl) != 0) {
      in.diepctl = kept(in.diepctl) | otg_fs_diepctl::Disable::mask;
      static_cast<void>(wait_until(in.diepint, disabled, disabled, polls));
    }
    in.diepint = nak | disabled | otg_fs_diepint::TransferComplete::mask;
    static_cast<void>(ISR_flush(number));
  }

  void ISR_reset_bus() {
    for (unsigned i = 0; i < otg_fs_endpoints; ++i) {
      device_.out[i].doepctl = kept(device_.out[i].doepctl) | otg_fs_doepctl::SetNak::mask;
      ISR_stop_sending(i, handshake_polls_in_reset);
      device_.in[i].diepint = 0xFFFF'FFFF;
      device_.out[i].doepint = 0xFFFF'FFFF;
    }
    device_.daintmsk = control_interrupts;
    otg_fs_dcfg::Address::write(device_.dcfg, 0);
    if (otg_fs_doepctl::Enable::read(device_.out[0].doepctl) == 0) device_.out[0].doeptsiz = one_packet(0);
  }

  void ISR_empty_receive_fifo() {
    for (unsigned i = 0; i < receive_entries; ++i) {
      if (otg_fs_gint::ReceiveNotEmpty::read(global_.gintsts) == 0) return;
      const auto status = static_cast<std::uint32_t>(global_.grxstsp);
      const std::size_t bytes = otg_fs_grxsts::ByteCount::of(status);
      const std::uint32_t kind = otg_fs_grxsts::PacketStatus::of(status);
      if (kind == otg_fs_grxsts::setup_data) {
        ISR_read(set_up_, bytes);
      } else {
        Received& received = received_[otg_fs_grxsts::Endpoint::of(status) % otg_fs_endpoints];
        if (kind == otg_fs_grxsts::out_data)
          received.length = static_cast<std::uint8_t>(std::min(bytes, packet_bytes));
        ISR_read(received.bytes, bytes);
      }
    }
  }
  /// All of `bytes`, whether there is room for them or not: the FIFO must be rid of them.
  void ISR_read(std::span<std::uint8_t> to, std::size_t bytes) {
    for (std::size_t at = 0; at < bytes; at += 4) {
      const auto word = static_cast<std::uint32_t>(fifos_[0]);
      for (std::size_t i = 0; i < 4 && at + i < bytes && at + i < to.size(); ++i)
        to[at + i] = static_cast<std::uint8_t>(word >> 8 * i);
    }
  }

  std::uint32_t ISR_asking() const {
    return static_cast<std::uint32_t>(device_.daint) & static_cast<std::uint32_t>(device_.daintmsk);
  }

  template <typename Handler>
  void ISR_serve_in(Handler& handler) {
    const std::uint32_t asking = otg_fs_daint::In::of(ISR_asking());
    for (std::uint8_t number = 0; number < otg_fs_endpoints; ++number) {
      if ((asking >> number & 1U) == 0) continue;
      auto& in = device_.in[number];
      const bool sent = otg_fs_diepint::TransferComplete::read(in.diepint) != 0;
      in.diepint = otg_fs_diepint::TransferComplete::mask;
      if (sent) handler.ISR_sent(number);
    }
  }

  template <typename Handler>
  void ISR_serve_out(Handler& handler) {
    const std::uint32_t asking = otg_fs_daint::Out::of(ISR_asking());
    // Endpoint 0 last: what came on the others came before a request that ends it.
    for (std::uint8_t number = otg_fs_endpoints; number-- > 0;) {
      if ((asking >> number & 1U) == 0) continue;
      auto& out = device_.out[number];
      const auto flags = static_cast<std::uint32_t>(out.doepint);
      out.doepint = flags;
      Received& received = received_[number];
      if (otg_fs_doepint::TransferComplete::of(flags) != 0) {
        const std::size_t length = received.length;
        received.length = 0;
        handler.ISR_received(number, std::span<const std::uint8_t>(received.bytes).first(length));
      }
      if (otg_fs_doepint::SetupDone::of(flags) != 0) {
        ISR_stop_sending(0);
        handler.ISR_set_up(std::span<const std::uint8_t, 8>(set_up_));
      }
    }
  }

  struct Received {
    std::array<std::uint8_t, packet_bytes> bytes{};
    std::uint8_t length = 0;
  };

  Global& global_;
  Device& device_;
  [[no_unique_address]] Fifos fifos_;
  std::array<std::uint8_t, 8> set_up_{};
  std::array<Received, otg_fs_endpoints> received_{};
};

}  // namespace kmax::drivers::stm32f4
