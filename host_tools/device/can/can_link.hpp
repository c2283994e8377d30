#pragma once

#include <memory>

#include "host_tools/device/can/can_node_lock.hpp"
#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/can/sdo_client.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::link {

/// A device on a CAN bus: its registers by SDO, each value one object of the same dictionary.
///
/// Values that belong together on a serial line, because one request covers them, are read one after the
/// other here: they may be some milliseconds apart. Writing several values at once is not whole or nothing
/// either; an error says how many were written before it. Device::apply() makes it whole by a transaction.
///
/// The windows of the trace and of a capture are read in long pieces: 0x5820:k has 64 registers of the
/// former, 0x5821:1 all of the latter.
///
/// For the device only writing is a sign of life on CAN (link.timeout). From a controlword that enables an
/// axis on, until one that does not, reading through this link therefore writes link.sign_of_life ten times a
/// second.
///
/// The node's SDO server is this program's alone (CanNodeLock), except while it waits.
///
/// A refusal is a RefusedError whose exception() is the Modbus exception nearest to the SDO abort:
///   2 no such object or sub-index, or not accessible in this way    3 a value or length that is not allowed
///   4 not in the device's present state, or for a reason of its own 6 under control of somebody else
class CanLink final : public Link {
 public:
  /// `address` is of kind can. Errors: LinkError.
  explicit CanLink(const DeviceAddress& address, const Notice& notice = {}, const SdoSettings& settings = {});

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override;
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override;
  std::vector<std::uint16_t> read_input_window(std::uint16_t address, std::size_t registers,
                                               const Progress& tell) override;
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override;
  void write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) override;
  std::map<std::string, std::string> identify() override;
  std::string description() const override { return text_of(address_); }
  void wait(std::chrono::microseconds duration) override { lock_.lend(duration); }

  /// For objects that are not in the dictionary's tables.
  SdoClient& sdo() { return sdo_; }

 private:
  std::vector<std::uint16_t> read(std::uint8_t function, std::uint16_t address, std::size_t count);
  std::vector<std::uint16_t> read_object(std::uint16_t address, SdoClient::Object object, std::size_t bytes,
                                         const SdoClient::Tell& tell = {});
  std::vector<std::uint16_t> read_trace(std::uint16_t address, std::size_t count);
  void write(std::uint16_t address, std::span<const std::uint16_t> values, bool idempotent);

  void note_command(const SdoClient::Object& object, const SdoClient::Bytes& value);
  void keep_alive();

  using Clock = std::chrono::steady_clock;
  DeviceAddress address_;
  std::unique_ptr<CanPort> port_;
  CanNodeLock lock_;
  SdoClient sdo_;
  std::array<bool, firmware::axis_count> commands_{};  ///< axes that this program has enabled
  Clock::time_point last_write_{};
  std::uint16_t signs_of_life_ = 0;
};

/// The Modbus exception nearest to an SDO abort; see CanLink.
std::uint8_t exception_of(firmware::canopen::Abort code);

}  // namespace kmax::link
