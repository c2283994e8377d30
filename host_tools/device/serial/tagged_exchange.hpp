#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

namespace kmax::device {

void append_word(std::vector<std::uint8_t>& frame, std::uint16_t word);
/// A Modbus RTU frame out of unit and PDU.
std::vector<std::uint8_t> with_crc(std::vector<std::uint8_t> frame);

/// Bytes to and from a serial line, in the line's own time.
class ByteLine {
 public:
  using Time = std::chrono::microseconds;

  virtual ~ByteLine() = default;

  virtual Time now() const = 0;
  /// One whole frame, which carries its CRC.
  virtual void send(std::span<const std::uint8_t> frame) = 0;
  /// What has come, as soon as anything has; empty: nothing has, or `until` is over.
  virtual std::vector<std::uint8_t> receive(Time until) = 0;
};

/// Nothing that came back was the answer.
class Unanswered : public std::runtime_error {
 public:
  Unanswered(int requests, bool anything_received, bool untagged)
      : std::runtime_error("no answer"),
        requests_(requests),
        anything_received_(anything_received),
        knows_no_tags_(untagged) {}

  int requests() const { return requests_; }                     ///< how often it was asked
  bool anything_received() const { return anything_received_; }  ///< but no answer
  bool knows_no_tags() const { return knows_no_tags_; }          ///< the device refuses function 65 as such

 private:
  int requests_;
  bool anything_received_, knows_no_tags_;
};

/// Requests over a line that loses, tears, doubles, delays and reorders what is sent.
///
/// A Modbus RTU answer says neither which registers it is about nor which request it belongs to. So every
/// request travels in function 65 under a tag of its own (firmware/modbus/server.hpp), and an answer is taken
/// only under that tag, wherever among other bytes it begins, with a good CRC and of the shape that the
/// request asks for. Requests that are asked again keep their tag, by which the device knows a write that it
/// has carried out already.
///
/// A request without an answer may still be on its way. Before the next one an echo (function 8) of new bytes
/// goes round: on a line that keeps the order, what was sent before it has then arrived or is lost, so that
/// no late write undoes a later one.
///
/// Wrong answers get through if a tag comes round again, after 65,536 requests, while an answer from before
/// is still on its way.
class TaggedExchange {
 public:
  /// `patience`: how long an answer is waited for. `first_tag`: another one in every process.
  TaggedExchange(ByteLine& line, std::chrono::microseconds patience, std::uint16_t first_tag)
      : line_(line), patience_(patience), tag_(first_tag) {}

  /// `request`: unit and PDU. Returns unit and PDU of the answer, an exception included. Errors: Unanswered
  /// after `attempts`, and what the line throws.
  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> request, int attempts);

 private:
  void synchronize(std::uint8_t unit, int attempts);

  ByteLine& line_;
  std::chrono::microseconds patience_;
  std::uint16_t tag_;
  bool outstanding_ = false;  ///< a request or its answer may still be under way
};

}  // namespace kmax::device
