#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace kmax::link {

/// No conversation is possible: the port cannot be opened, vanished, or nobody answers. The message says
/// what happened, on which port, and what to look at.
class LinkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The device answered with a Modbus exception, or what stands for one on another link: it understood the
/// request and did not carry it out.
class RefusedError : public std::runtime_error {
 public:
  RefusedError(std::uint8_t exception, std::uint8_t function, std::uint16_t address);
  /// For a link that knows more than the exception.
  RefusedError(std::uint8_t exception, std::uint8_t function, std::uint16_t address, const std::string& words)
      : std::runtime_error(words), exception_(exception), function_(function), address_(address) {}

  std::uint8_t exception() const { return exception_; }  ///< Modbus exception code, 1..
  std::uint8_t function() const { return function_; }    ///< Modbus function of the request
  std::uint16_t address() const { return address_; }     ///< first register of the request

 private:
  std::uint8_t exception_;
  std::uint8_t function_;
  std::uint16_t address_;
};

/// Something the user should know while waiting, one line without a newline.
using Notice = std::function<void(const std::string&)>;

/// A conversation with one device in terms of Modbus registers, whatever carries it.
///
/// Every call is one request and its reply: when it returns, the device has answered. Errors: LinkError and
/// RefusedError, nothing else. A link belongs to one thread.
class Link {
 public:
  static constexpr std::uint16_t read_count_max = 125;   ///< registers in one read request
  static constexpr std::uint16_t write_count_max = 123;  ///< registers in one write request

  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Exactly `count` registers, 1..read_count_max.
  virtual std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) = 0;
  virtual std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) = 0;

  /// How many of the registers asked for have been read; rises up to all of them. What it throws ends the
  /// reading and comes through.
  using Progress = std::function<void(std::size_t done)>;

  /// Any number of input registers, in as many requests as that takes: the values may come from different
  /// moments.
  virtual std::vector<std::uint16_t> read_input_window(std::uint16_t address, std::size_t registers,
                                                       const Progress& tell);

  /// 1..write_count_max registers; whole or not at all. Never sent twice: after a LinkError it is unknown
  /// whether the device carried it out.
  virtual void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) = 0;

  /// The same for a write that does no harm when the device carries it out twice, because it states a value
  /// rather than asks for a step. A link that can lose a message may repeat it.
  virtual void write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) {
    write_holding(address, values);
  }

  /// Texts of the device identification (Modbus function 43/14) by their standard names in snake case:
  /// vendor_name, product_code, revision, product_name, model_name, ... Empty if the device offers none.
  virtual std::map<std::string, std::string> identify() { return {}; }

  /// The device has just been told to use another unit or baud rate (what is not given stays): follow it.
  virtual void follow_line_settings([[maybe_unused]] std::optional<std::uint8_t> unit,
                                    [[maybe_unused]] std::optional<std::uint32_t> baud_rate) {}

  /// The device's idea of passing time: the real clock, unless the device is simulated in this process.
  virtual std::chrono::microseconds now() const {
    return std::chrono::duration_cast<std::chrono::microseconds>(
        std::chrono::steady_clock::now().time_since_epoch());
  }
  virtual void wait(std::chrono::microseconds duration) { std::this_thread::sleep_for(duration); }

  /// The address a user would type, for messages.
  virtual std::string description() const = 0;
};

}  // namespace kmax::link
