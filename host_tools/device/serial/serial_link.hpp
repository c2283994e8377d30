#pragma once

#include <chrono>
#include <memory>

#include "host_tools/device/device_address.hpp"
#include "host_tools/device/serial/register_link.hpp"
#include "host_tools/device/serial/serial_port_lock.hpp"
#include "host_tools/device/serial/tagged_exchange.hpp"

struct _modbus;

namespace kmax::device {

/// Modbus RTU on a serial port or pseudo-terminal, which libmodbus opens, sets up and sends on: 8 data bits,
/// even parity, 1 stop bit. Every request is tagged, so that no answer is taken for another one's
/// (TaggedExchange).
///
/// The port is this program's alone (SerialPortLock), except while it waits: then another kmax may use it,
/// to stop the drive for instance. A request that gets no answer within 500 ms (`patience`) is sent again up
/// to two times if it is a read or an idempotent write; other writes are sent once, since a device that takes
/// them late may have closed their transaction.
///
/// A port that vanishes (unplugged adapter, closed pseudo-terminal) ends in a LinkError at once.
class SerialLink final : public FrameLink, private ByteLine {
 public:
  static constexpr std::chrono::milliseconds response_timeout{500};
  static constexpr int attempts = 3;

  /// `address` is of kind serial; `patience` is how long an answer is waited for. Errors: LinkError.
  explicit SerialLink(const DeviceAddress& address, const Notice& notice = {},
                      std::chrono::milliseconds patience = response_timeout);
  ~SerialLink() override;

  void follow_serial_settings(std::optional<std::uint8_t> unit,
                              std::optional<std::uint32_t> baud_rate) override;
  std::string description() const override { return text_of(address_); }
  void wait(std::chrono::microseconds duration) override { lock_.yield(duration); }

 private:
  struct Deleter {
    void operator()(_modbus* context) const;
  };

  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> frame, Repeat repeat) override;
  std::chrono::microseconds now() const override { return RegisterLink::now(); }
  void send(std::span<const std::uint8_t> frame) override;
  std::vector<std::uint8_t> receive(Time until) override;
  void connect();
  [[noreturn]] void fail_vanished(int error) const;
  [[noreturn]] void fail_unanswered(std::span<const std::uint8_t> request, const Unanswered& what) const;

  DeviceAddress address_;
  std::chrono::milliseconds patience_;
  SerialPortLock lock_;
  std::unique_ptr<_modbus, Deleter> context_;
  TaggedExchange tagged_;
};

}  // namespace kmax::device
