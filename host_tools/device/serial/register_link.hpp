#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/device/link.hpp"
#include "host_tools/device/serial/identification_reply.hpp"

namespace kmax::device {

/// The device answered with a Modbus exception (MODBUS Application Protocol V1.1b3, section 7).
class RegisterRefused : public RefusedError {
 public:
  RegisterRefused(std::uint8_t exception, std::uint8_t function, std::uint16_t address);

  std::uint8_t exception() const { return exception_; }  ///< 1..
  std::uint8_t function() const { return function_; }    ///< of the request
  std::uint16_t address() const { return address_; }     ///< first register of the request

 private:
  std::uint8_t exception_;
  std::uint8_t function_;
  std::uint16_t address_;
};

/// One request: registers of one table that follow each other without a gap, and whose values they hold.
struct RegisterRange {
  bool holding;
  std::uint16_t address;
  std::uint16_t count;
  std::vector<std::size_t> members;  ///< positions in the slots that were planned, by rising address
};

/// Covers the slots with as few requests as possible: neighbours together, at most `count_max` registers, no
/// register that was not asked for (most gaps are unassigned, and touching one is refused as a whole), and
/// never half a value. A slot that is named twice is a member twice.
std::vector<RegisterRange> plan_registers(std::span<const std::size_t> slots, std::uint16_t count_max);

/// A device by its Modbus registers: the translation between them and slots. Values of one group of the
/// dictionary are read in one request and thus belong to one moment.
class RegisterLink : public Link {
 public:
  /// Registers in one request: as many as a tagged one can carry.
  static constexpr std::uint16_t read_count_max = 124, write_count_max = 122;

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override;
  void write(std::span<const SlotValue> values, Repeat repeat,
             const std::function<void()>& before_request = {}) override;
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override;
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override;
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override;
  std::map<std::string, std::string> identify() override;

  /// Exactly `count` registers, 1..read_count_max.
  virtual std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) = 0;
  virtual std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) = 0;

  /// 1..write_count_max registers; whole or not at all. Never sent twice.
  virtual void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) = 0;
  /// As Repeat::if_lost. A link that can lose a message may repeat it.
  virtual void write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) {
    write_holding(address, values);
  }

 protected:
  /// The objects of the device's identification from `first` on; nothing if the device does not answer that.
  virtual std::optional<identification::Page> read_identification([[maybe_unused]] std::uint8_t first) {
    return std::nullopt;
  }
};

/// A link that exchanges whole Modbus RTU frames.
class FrameLink : public RegisterLink {
 public:
  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override;
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override;
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override;
  void write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) override;
  void follow_serial_settings(std::optional<std::uint8_t> unit,
                              std::optional<std::uint32_t> /*baud_rate*/) override {
    unit_ = unit.value_or(unit_);
  }

 protected:
  explicit FrameLink(std::uint8_t unit) : unit_(unit) {}

  /// The frame that answers `frame`, both with their CRC. Errors: LinkError if none comes, or one that is
  /// none.
  virtual std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> frame, Repeat repeat) = 0;
  std::optional<identification::Page> read_identification(std::uint8_t first) override;

 private:
  /// The answer to a request that begins with `function`, `address` and `count`.
  std::vector<std::uint8_t> request(std::uint8_t function, std::uint16_t address, std::size_t count,
                                    Repeat repeat, std::span<const std::uint16_t> values = {});
  std::vector<std::uint16_t> read_registers(std::uint8_t function, std::uint16_t address,
                                            std::uint16_t count);

  std::uint8_t unit_;
};

}  // namespace kmax::device
