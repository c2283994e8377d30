#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/drive/armed_axes.hpp"
#include "firmware/parameters/parameter_rules.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Where a value is in its table.
struct RegisterPlace {
  std::uint16_t address;
  std::uint16_t words;
  std::size_t slot;
};

/// The Modbus view of the dictionary, made when compiled: the entries of one table in the order of their
/// registers, of axis 0 or of the device.
template <bool writable>
inline constexpr auto entries_by_register = [] {
  constexpr auto count = std::count_if(descriptors.begin(), descriptors.end(),
                                       [](const SlotDescriptor& d) { return d.writable == writable; });
  std::array<std::uint16_t, count> entries{};
  std::size_t next = 0;
  for (std::size_t entry = 0; entry < entry_count; ++entry) {
    if (descriptors[entry].writable == writable) entries[next++] = static_cast<std::uint16_t>(entry);
  }
  std::sort(entries.begin(), entries.end(),
            [](std::size_t a, std::size_t b) { return descriptors[a].address < descriptors[b].address; });
  return entries;
}();

/// Parameters as registers: reading, checked writing, and transactions.
///
/// A write is whole or nothing: every value in the range is checked, then the rules between parameters and,
/// for an axis that is armed, the stability guard's, and only then anything changes. Outside a transaction it
/// takes effect at once; inside (transaction.control = 1) values are kept aside and take effect together with
/// transaction.control = 2, which checks the rules over the whole set. A transaction in which nothing is
/// written for 2 s is dropped, so a host that dies half way leaves nothing behind; for 30 s, or until
/// transaction.control is written, no value is taken outside a transaction then, lest a message of that host
/// that was held up takes effect by itself. A transaction changes what was written in it and nothing else: a
/// value that others change meanwhile keeps theirs. Reading always gives the values in force, not those put
/// aside. Why a write was refused stays in refusal.reason and refusal.register.
///
/// Commands (drive.controlword) and setpoints (profile.target_torque, profile.max_torque) are no part of a
/// set: they act when they are written, in a transaction too, and are no change of parameters. So a setpoint
/// may come with every message: it costs a search and a comparison.
///
/// Of two parameters that are one thing in two standards' numbers (linked_parameters.hpp), writing either
/// sets both; the last one written wins.
///
/// CANopen's own settings (Access::communication) are read here like readings; write_communication() sets
/// them one by one, at once.
class DeviceRegisters {
 public:
  static constexpr std::uint32_t transaction_timeout_us = 2'000'000;
  static constexpr std::uint32_t stragglers_us = 30'000'000;

  ParameterValues& values() { return values_; }
  const ParameterValues& values() const { return values_; }

  /// Rises with every change of a parameter; restarting_changes() only with those that restart the axes.
  std::uint32_t changes() const { return changes_; }
  std::uint32_t restarting_changes() const { return restarting_changes_; }
  /// Rises with every change of CANopen's own settings, which count nowhere else.
  std::uint32_t communication_changes() const { return communication_changes_; }

  struct WriteResult {
    Refusal refusal = Refusal::none;
    std::uint16_t address = 0;
  };

  bool readable(bool holding, std::uint32_t address, std::size_t count) const {
    for (std::uint32_t a = address; a < address + count;) {
      const std::optional<RegisterPlace> place = find(holding, a);
      if (!place) return false;
      a = place->address + std::uint32_t{place->words};
    }
    return true;
  }

  /// The range must be readable(). Reading may start or end within a value.
  void read(bool holding, std::uint16_t address, std::span<std::uint16_t> out) const {
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto a = static_cast<std::uint16_t>(address + i);
      const std::optional<RegisterPlace> place = find(holding, a);
      const std::uint32_t raw = values_.raw(place->slot);
      out[i] = static_cast<std::uint16_t>(place->words == 2 && a == place->address ? raw >> 16 : raw);
    }
  }

  /// `now_us` drives the transaction's time-out.
  WriteResult write(std::uint16_t address, std::span<const std::uint16_t> in, const ArmedAxes& armed,
                    std::uint32_t now_us);

  /// Call at least every 2^31 us.
  void poll(std::uint32_t now_us) {
    if (staging_ && now_us - last_staged_us_ > transaction_timeout_us) {
      staging_ = false;
      dropped_ = true;
      dropped_us_ = now_us;
    }
    if (dropped_ && now_us - dropped_us_ > stragglers_us) dropped_ = false;
  }

  bool transaction_open() const { return staging_; }

  /// Takes every setting of `wanted` at once, outside any transaction: a stored set, the defaults. Commands
  /// and setpoints stay. Of two linked parameters the one that differs from now wins; if both differ, the one
  /// that save keeps. Refused while a transaction is open.
  WriteResult set_all(const ParameterValues& wanted, const ArmedAxes& armed);

  /// One of CANopen's own settings, at once; read_only for any other slot. Rules of CANopen between them are
  /// the caller's.
  WriteResult write_communication(std::size_t slot, std::uint32_t raw);

  /// What a request that others carry out came to; last_refusal() tells it from now on.
  WriteResult refuse(Refusal refusal, std::uint16_t address) { return last_ = {refusal, address}; }

  WriteResult last_refusal() const { return last_; }

  bool controlword_waits() const {
    return std::find(commanded_.begin(), commanded_.end(), true) != commanded_.end();
  }
  /// Controlwords written since they were last fetched, per axis.
  bool fetch_controlword(std::size_t axis, std::uint16_t& word) {
    if (!commanded_[axis]) return false;
    commanded_[axis] = false;
    word = static_cast<std::uint16_t>(values_.whole<"drive.controlword">(axis));
    return true;
  }

 private:
  static std::optional<RegisterPlace> find(bool holding, std::uint32_t address) {
    const std::span<const std::uint16_t> entries =
        holding ? std::span<const std::uint16_t>(entries_by_register<true>) : entries_by_register<false>;
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      const std::size_t offset = axis * axis_modbus_offset;
      if (address < offset) break;
      const auto after =
          std::upper_bound(entries.begin(), entries.end(), address - offset,
                           [](std::uint32_t a, std::size_t entry) { return a < descriptors[entry].address; });
      if (after == entries.begin()) continue;
      const std::size_t entry = *(after - 1);
      const SlotDescriptor& d = descriptors[entry];
      const std::uint16_t words = register_count(d.type);
      if (address - offset < std::uint32_t{d.address} + words && (axis == 0 || d.per_axis))
        return {{static_cast<std::uint16_t>(d.address + offset), words, slot_of(entry, axis)}};
    }
    return std::nullopt;
  }

  struct Staged {
    ParameterValues values;
    std::bitset<slot_count> written;
  };

  WriteResult check_and_set(Staged& target, std::uint16_t address, std::span<const std::uint16_t> in,
                            bool armed) const;
  bool only_setpoints(std::uint16_t address, std::size_t count) const;
  WriteResult take_setpoints(std::uint16_t address, std::span<const std::uint16_t> in);
  WriteResult control_transaction(std::uint16_t address, std::uint32_t request, const ArmedAxes& armed,
                                  std::uint32_t now_us);
  WriteResult apply(const ParameterValues& wanted, const ArmedAxes& armed);

  ParameterValues values_;
  Staged staged_;
  WriteResult last_;
  std::uint32_t changes_ = 0, restarting_changes_ = 0, communication_changes_ = 0;
  std::uint32_t last_staged_us_ = 0, dropped_us_ = 0;
  bool staging_ = false, dropped_ = false;
  std::array<bool, axis_count> commanded_{};
};

}  // namespace kmax::firmware
