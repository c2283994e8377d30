#pragma once

#include <memory>

#include "host_tools/device/can/can_node_lock.hpp"
#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/can/sdo_client.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

/// The node ended a transfer with an SDO abort; the message names the object and says why.
class SdoRefused : public RefusedError {
 public:
  SdoRefused(const SdoAborted& aborted, const std::string& message)
      : RefusedError(message), code_(aborted.code()) {}
  firmware::canopen::Abort code() const { return code_; }

 private:
  firmware::canopen::Abort code_;
};

/// A device on a CAN bus: each slot is one object of the same dictionary, read and written by SDO.
///
/// Values are read one after the other: they may be some milliseconds apart. Writing several of them is not
/// whole or nothing either; an error says how many were written before it. Device::apply() makes it whole by
/// a transaction.
///
/// An axis that this program enables is its own (drive.commander): from that controlword on, until one that
/// does not enable it, whatever is asked through this link also writes this program's link.sign_of_life
/// twenty times a second, and no other program's traffic keeps the axis armed. Nothing is written before a
/// controlword that takes the force, nor before the two values that are read next after a refused write:
/// refusal.reason and refusal.register are about the last write, and a sign of life is one.
///
/// The node's SDO server is this program's alone (CanNodeLock), except while it waits.
class CanLink final : public Link {
 public:
  /// `address` is of kind can. Errors: LinkError.
  explicit CanLink(const DeviceAddress& address, const Notice& notice = {}, const SdoSettings& settings = {});

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override;
  void write(std::span<const SlotValue> values, Repeat repeat,
             const std::function<void()>& before_request = {}) override;
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override;
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override;
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override;
  std::map<std::string, std::string> identify() override;
  std::string description() const override { return text_of(address_); }
  void wait(std::chrono::microseconds duration) override { lock_.yield(duration); }

  /// For objects that are not in the dictionary's tables.
  SdoClient& sdo() { return sdo_; }

 private:
  std::uint32_t read(std::size_t slot);
  std::vector<std::uint32_t> read_words(SdoClient::Object object, std::size_t bytes,
                                        const SdoClient::ReportProgress& progress = {});
  /// One that has exactly so many bytes.
  std::vector<std::uint32_t> read_object(SdoClient::Object object, std::size_t bytes);
  static bool gives_up(const SlotValue& next);
  /// What these ask is asked before something else, for which `before_next` is then called.
  void claim(const SlotValue& next, const std::function<void()>& before_next);
  void keep_alive(const std::function<void()>& before_next = {});

  using Clock = std::chrono::steady_clock;
  DeviceAddress address_;
  std::unique_ptr<CanPort> port_;
  CanNodeLock lock_;
  SdoClient sdo_;
  std::array<bool, firmware::axis_count> commands_{};  ///< axes that this program has enabled
  Clock::time_point last_sign_of_life_{};
  int undisturbed_reads_ = 0;  ///< that may ask why a write was refused
  std::uint16_t number_;       ///< as a commander; not 0
};

}  // namespace kmax::device
