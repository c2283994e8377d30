#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/stm32f4/registers/usart.hpp"

// Asynchronous serial port, interrupt-driven in both directions. RM0090 chapter on USART.
//
// Frames are always 11 bits long, as Modbus RTU wants them: start, eight data bits, even parity and one stop
// bit, or no parity and two stop bits. With parity the hardware counts the parity bit as data, hence nine-bit
// frames (M = 1).
//
// Receiving: each interrupt hands out at most one byte with its error flags. A frame error, parity error or
// noise belongs to that byte; an overrun means that bytes after it are lost. A lost byte without a byte to go
// with it is reported as `line_error` without `received`, since a gap in a telegram must not go unnoticed.
//
// Sending: `transmit` takes a view of bytes that must stay unchanged until `transmission_complete`, which
// comes with TC: the last stop bit has left the pin, and not merely the data register (TXE).
//
// Contexts: `ISR_serve` in the USART interrupt; `transmit`, `transmitting` in one lower context. CR1 has two
// writers, but never at once: `transmit` touches it only while nothing is being sent, `ISR_serve` only while
// something is. `configure` needs the interrupt disabled in the NVIC.

namespace kmax::drivers::stm32f4 {

enum class UsartParity : std::uint8_t {
  even,  // 8E1
  none,  // 8N2
};

struct UsartConfig {
  std::uint32_t baud_rate = 115'200;
  UsartParity parity = UsartParity::even;
};

/// The value of BRR (mantissa and fraction together, 16-fold oversampling) and what comes of it.
struct UsartDivisor {
  std::uint32_t value;
  float error;  // (actual - wanted) / wanted
  bool usable;  // 16 <= value <= 65535 and |error| <= maximum_baud_error
};

/// In an 11-bit frame the last bit is sampled 10.5 bits after the edge that synchronised the receiver, so
/// half a bit of drift, both ends together, is 4.7 %. Less than half of that is ours.
inline constexpr float maximum_baud_error = 0.02F;

/// For `kernel_clock_hz` up to 84 MHz; not usable when `baud_rate` is 0. Call at configuration time (two
/// divisions).
constexpr UsartDivisor usart_divisor(std::uint32_t kernel_clock_hz, std::uint32_t baud_rate) {
  if (baud_rate == 0 || baud_rate > kernel_clock_hz) return {0, 0.0F, false};
  const std::uint32_t value = (kernel_clock_hz + baud_rate / 2) / baud_rate;
  const auto wanted = static_cast<float>(baud_rate);
  const float error = (static_cast<float>(kernel_clock_hz) / static_cast<float>(value) - wanted) / wanted;
  const bool usable =
      value >= 16 && value <= 0xFFFF && error <= maximum_baud_error && error >= -maximum_baud_error;
  return {value, error, usable};
}

struct UsartEvent {
  bool received = false;
  std::uint8_t byte = 0;
  bool line_error = false;
  bool transmission_complete = false;
};

template <typename Registers = UsartRegisters>
class Usart {
 public:
  explicit constexpr Usart(Registers& registers) : registers_(registers) {}

  /// Sets the line up and starts receiving; drops whatever was being sent. False, and nothing touched, when
  /// the baud rate cannot be had from this clock.
  [[nodiscard]] bool configure(const UsartConfig& config, std::uint32_t kernel_clock_hz) {
    const UsartDivisor divisor = usart_divisor(kernel_clock_hz, config.baud_rate);
    if (!divisor.usable) return false;

    registers_.cr1 = 0;
    remaining_ = 0;
    transmitting_.store(false, std::memory_order_relaxed);
    registers_.brr = divisor.value;
    registers_.cr2 = usart_cr2::StopBits::bits(config.parity == UsartParity::none ? 2 : 0);
    registers_.cr3 = 0;
    // Old error flags and an old byte: cleared by reading SR, then DR.
    static_cast<void>(static_cast<std::uint32_t>(registers_.sr));
    static_cast<void>(static_cast<std::uint32_t>(registers_.dr));
    const std::uint32_t parity =
        config.parity == UsartParity::even ? usart_cr1::NineBits::mask | usart_cr1::ParityEnable::mask : 0;
    registers_.cr1 = usart_cr1::Enable::mask | usart_cr1::TransmitterEnable::mask |
                     usart_cr1::ReceiverEnable::mask | usart_cr1::ReceiveInterrupt::mask | parity;
    return true;
  }

  /// Starts sending. False when something is being sent already or there is nothing to send.
  [[nodiscard]] bool transmit(std::span<const std::uint8_t> bytes) {
    if (bytes.empty() || transmitting()) return false;
    next_ = bytes.data();
    remaining_ = bytes.size();
    transmitting_.store(true, std::memory_order_release);
    usart_cr1::TransmitEmptyInterrupt::set(registers_.cr1);
    return true;
  }

  bool transmitting() const { return transmitting_.load(std::memory_order_acquire); }

  /// The whole interrupt handler. Safe to call without cause (when the interrupt was made pending by
  /// software).
  UsartEvent ISR_serve() {
    UsartEvent event;
    const auto status = static_cast<std::uint32_t>(registers_.sr);
    if ((status & (usart_sr::ReceiveNotEmpty::mask | usart_sr::Overrun::mask)) != 0) {
      // The read also clears the error flags, which belong to this byte.
      event.byte = static_cast<std::uint8_t>(static_cast<std::uint32_t>(registers_.dr) & 0xFFU);
      event.received = (status & usart_sr::ReceiveNotEmpty::mask) != 0;
      event.line_error = (status & line_errors) != 0;
      if (!event.received) event.byte = 0;
    }
    if (transmitting()) event.transmission_complete = send_next(status);
    return event;
  }

 private:
  static constexpr std::uint32_t line_errors = usart_sr::ParityError::mask | usart_sr::FramingError::mask |
                                               usart_sr::Noise::mask | usart_sr::Overrun::mask;

  bool send_next(std::uint32_t status) {
    if (remaining_ != 0) {
      if ((status & usart_sr::TransmitEmpty::mask) == 0) return false;
      // SR has been read before this write, which is what clears the TC of the byte before.
      registers_.dr = *next_++;
      --remaining_;
      if (remaining_ == 0) {
        registers_.cr1 =
            (static_cast<std::uint32_t>(registers_.cr1) & ~usart_cr1::TransmitEmptyInterrupt::mask) |
            usart_cr1::TransmissionCompleteInterrupt::mask;
      }
      return false;
    }
    if ((status & usart_sr::TransmissionComplete::mask) == 0) return false;
    usart_cr1::TransmissionCompleteInterrupt::clear(registers_.cr1);
    transmitting_.store(false, std::memory_order_release);
    return true;
  }

  Registers& registers_;
  const std::uint8_t* next_ = nullptr;
  std::size_t remaining_{};
  std::atomic<bool> transmitting_{false};
};

}  // namespace kmax::drivers::stm32f4
