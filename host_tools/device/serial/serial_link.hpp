#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "host_tools/device/device_address.hpp"
#include "host_tools/device/serial/register_link.hpp"
#include "host_tools/device/serial/serial_port_lock.hpp"

struct _modbus;

namespace kmax::link {

/// Modbus RTU on a serial port or pseudo-terminal, through libmodbus: 8 data bits, even parity, 1 stop bit.
///
/// The port is this program's alone (SerialPortLock), except while it waits: then another kmax may use it,
/// to stop the drive for instance. A request that gets no answer within 500 ms (`patience`), or an
/// answer that is not one (bad CRC, other unit, other length), is sent again up to two times if it is a
/// read or an idempotent write; other writes are sent once, since a lost answer does not tell whether the
/// device acted. Before anything is sent after such a failure the link listens until it is silent: an
/// answer that comes late must not be taken for the next one, and a Modbus RTU answer does not say which
/// request it belongs to.
///
/// A port that vanishes (unplugged adapter, closed pseudo-terminal) ends in a LinkError at once.
class SerialLink final : public RegisterLink {
 public:
  static constexpr std::chrono::milliseconds response_timeout{500};
  static constexpr int attempts = 3;

  /// `address` is of kind serial; `patience` is how long an answer is waited for. Errors: LinkError.
  explicit SerialLink(const DeviceAddress& address, const Notice& notice = {},
                      std::chrono::milliseconds patience = response_timeout);
  ~SerialLink() override;

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override;
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override;
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override;
  void write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) override;
  void follow_serial_settings(std::optional<std::uint8_t> unit,
                              std::optional<std::uint32_t> baud_rate) override;
  std::string description() const override { return text_of(address_); }
  void wait(std::chrono::microseconds duration) override { lock_.yield(duration); }

 private:
  std::optional<identification::Page> read_identification(std::uint8_t first) override;
  struct Deleter {
    void operator()(_modbus* context) const;
  };
  struct Request {
    std::uint8_t function;
    std::uint16_t address;
    std::size_t count;
  };

  void connect();
  void write_words(std::uint16_t address, std::span<const std::uint16_t> values, int attempts_allowed);
  /// `transact` returns what libmodbus returns and leaves errno.
  void exchange(const Request& request, int attempts_allowed, const std::function<int()>& transact);
  void listen_until_silent();
  std::vector<std::uint8_t> receive_identification();
  [[noreturn]] void fail_vanished(int error) const;
  [[noreturn]] void fail_unanswered(const Request& request, int attempts_made, int error) const;

  DeviceAddress address_;
  std::chrono::milliseconds patience_;
  SerialPortLock lock_;
  std::unique_ptr<_modbus, Deleter> context_;
  bool answer_outstanding_ = false;  ///< an answer may still be on its way
};

}  // namespace kmax::link
