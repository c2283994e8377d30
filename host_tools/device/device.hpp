#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/parameters/refusal.hpp"
#include "host_tools/device/link.hpp"
#include "host_tools/device/parameter.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::device {

/// What the device says about the last write it refused.
struct RefusalReport {
  firmware::Refusal reason = firmware::Refusal::none;
  std::uint16_t address = 0;  ///< of the holding register it is about
};

/// Why a write was refused: the device's reason; if it shows none, since another program has written
/// meanwhile, what the link said.
std::string refusal_words(firmware::Refusal reason, const device::RefusedError& error);

/// A Kmax device by the names of its object dictionary.
///
/// The constructor makes sure that device and program have the same dictionary. Values are 32-bit patterns
/// as firmware/object_dictionary defines them (value_text.hpp writes and reads them).
/// Errors: DeviceError, ValueError, and device::LinkError from every call that talks to the device.
class Device {
 public:
  explicit Device(std::unique_ptr<device::Link> link, device::Notice notice = {});

  /// In the order asked, in as few requests as the link allows. Over Modbus values of one group are read in
  /// one request and thus belong together.
  std::vector<std::uint32_t> read(std::span<const Parameter> parameters);
  std::uint32_t read(const Parameter& parameter) { return read(std::span(&parameter, 1)).front(); }

  /// By name, as a number: choices give their number, 32-bit counters all their bits.
  double read_number(std::string_view name);

  /// Handle travel per encoder count of an axis, m, from the parameters: the reading measured.count_length is
  /// rounded to float.
  double count_length(std::size_t axis);

  /// Writes one value by itself, at once: for commands. A refusal is a device::RefusedError. `idempotent`: as
  /// device::Repeat::if_lost.
  void write(const Parameter& parameter, std::uint32_t raw, bool idempotent);

  /// Sets all values in one tick of the device or none of them, and reads them back.
  ///
  /// The device keeps the values aside (transaction.control = 1), where nothing sees them, and applies them
  /// together (= 2). Whatever goes wrong before that leaves the old values: a refusal, a lost link (the
  /// device drops a transaction that falls silent), the end of this program. If the answer to the last step
  /// is lost, reading back decides which of the two happened. A message that is lost before is not repeated
  /// by itself: the transaction is begun again, up to three times. So it is if this program stood still.
  ///
  /// A transaction somebody else left open is waited for. Values that are applied but read back different
  /// have another writer: DeviceError naming both.
  void apply(std::span<const Assignment> assignments);

  RefusalReport last_refusal();

  /// Texts of the link's device identification; empty if there are none.
  std::map<std::string, std::string> identify() { return link_->identify(); }
  std::string description() const { return link_->description(); }
  device::Link& link() { return *link_; }

 private:
  class Transaction;
  struct Difference {
    Assignment wanted;
    std::uint32_t found;
  };

  void check_dictionary();
  /// One transaction. False: refused; `report` says why, and `words` in words.
  bool transact(std::span<const Assignment> assignments, RefusalReport& report, std::string& words);
  void settle_lost_commit(std::span<const Assignment> assignments, const std::string& what);
  std::optional<Difference> first_difference(std::span<const Assignment> assignments);
  void verify(std::span<const Assignment> assignments);
  void follow_serial_settings(std::span<const Assignment> assignments);
  [[noreturn]] void fail_refused(std::span<const Assignment> assignments, const RefusalReport& report,
                                 const std::string& words);

  std::unique_ptr<device::Link> link_;
  device::Notice notice_;
};

}  // namespace kmax::device
