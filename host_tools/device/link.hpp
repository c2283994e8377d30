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

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::device {

/// No conversation is possible: the port cannot be opened, vanished, or nobody answers. The message says
/// what happened, on which port, and what to look at.
class LinkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The device understood the request and did not carry it out; the message says what and why, in the terms of
/// the link (RegisterRefused, SdoRefused).
class RefusedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Something the user should know while waiting, one line without a newline.
using Notice = std::function<void(const std::string&)>;

using firmware::SlotValue;

/// What is to happen when it is unknown whether a write arrived: a write that states a value does no harm
/// when the device carries it out twice, one that asks for a step does.
enum class Repeat : std::uint8_t { never, if_lost };

/// A conversation with one device in slots of its object dictionary, whatever carries it.
///
/// When a call returns, the device has answered. Errors: LinkError and RefusedError, nothing else. A link
/// belongs to one thread.
class Link {
 public:
  /// Records of the trace that one request carries on every link.
  static constexpr std::size_t trace_records_at_once = 15;

  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// The values of these slots, in the order asked. How many of them belong to one moment depends on the
  /// link.
  virtual std::vector<std::uint32_t> read(std::span<const std::size_t> slots) = 0;

  /// Writes the values in as few requests as the link allows, each of which is carried out whole or not at
  /// all. `before_request` is called before each of them; what it throws ends the writing. With Repeat::never
  /// nothing is sent twice: after a LinkError it is unknown whether the device carried the last request out.
  virtual void write(std::span<const SlotValue> values, Repeat repeat,
                     const std::function<void()>& before_request = {}) = 0;

  /// `count` records of the trace's ring (firmware/capture/trace.hpp) from place `first` on, as their 32-bit
  /// words. Both are within the ring, and `count` is at most trace_records_at_once.
  virtual std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) = 0;

  /// How many of the words asked for have been read; rises up to all of them. What it throws ends the reading
  /// and comes through.
  using Progress = std::function<void(std::size_t done)>;

  /// The first `count` 32-bit words of the completed capture (firmware/capture/capture.hpp).
  virtual std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) = 0;

  /// The words of the fault log's entry at `place` (firmware/command/fault_log.hpp) and its CRC, all zeros if
  /// there is none.
  virtual std::vector<std::uint32_t> read_log_entry(std::size_t place) = 0;

  /// Texts of the device's identification by the standard names of Modbus (function 43/14) in snake case:
  /// vendor_name, product_code, revision, product_name, model_name, ... Empty if the device offers none.
  virtual std::map<std::string, std::string> identify() { return {}; }

  /// The device has just been set to another unit or baud rate (what is not given stays): follow it.
  virtual void follow_serial_settings([[maybe_unused]] std::optional<std::uint8_t> unit,
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

/// Lets other programs use a link (Link::wait) for 25 ms every 500 ms while this one talks without a pause,
/// since one that stops the device must not be kept out.
class PeriodicYield {
 public:
  static constexpr std::chrono::milliseconds own_time{500};
  /// Longer than from one attempt of a program that waits to the next (ExclusiveUse).
  static constexpr std::chrono::milliseconds others_time{25};

  /// `link` must outlive this.
  explicit PeriodicYield(Link& link) : link_(link), last_(link.now()) {}

  /// To be called between requests. Waits when it is time to. Errors: LinkError.
  void yield_if_due() {
    if (link_.now() - last_ < own_time) return;
    link_.wait(others_time);
    last_ = link_.now();
  }

 private:
  Link& link_;
  std::chrono::microseconds last_;
};

}  // namespace kmax::device
