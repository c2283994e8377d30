#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "firmware/drive/armed_axes.hpp"
#include "firmware/parameters/parameter_rules.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Whether what is written there acts at once, as a command does, and is no part of a set of parameters.
bool acts_at_once(std::size_t slot);

/// The one way to write a parameter, whichever link a host uses: checks, rules, and transactions. Modbus
/// registers (links/modbus_registers.hpp) and CANopen objects (links/canopen_objects.hpp) are edges of it.
///
/// A write is whole or nothing: every value is checked, then the rules between parameters and, for an axis
/// that is armed, that its bounds are only tightened, that what its commander asks of it is changed by nobody
/// else (armed_change.hpp), and the stability guard's, and only if all hold it stays. Outside a transaction
/// it is in force at once; inside (transaction.control = 1) values are kept aside and take effect together
/// with transaction.control = 2, which checks the rules over the whole set. A transaction changes what was
/// written in it and nothing else: a value that the device changes meanwhile keeps that. Reading always gives
/// the values in force, not those put aside. Why a write was refused stays in refusal.reason and
/// refusal.register.
///
/// A transaction belongs to the link that began it. Until it ends, every other link's settings, and its
/// transaction.control whatever it asks for, are refused with transaction_open. It ends when its owner
/// applies or drops it, when its owner has written nothing in it for 2 s, and by drop() (NMT reset
/// communication): an owner that dies leaves nothing behind and locks nobody out for longer. When it ends
/// without its owner's doing, that link can set nothing for 30 s, or until it writes transaction.control,
/// lest a message that was held up takes effect by itself; the other links can at once.
///
/// Commands (drive.controlword), setpoints (profile.target_torque, .max_torque, .target_force),
/// drive.commander and link.sign_of_life are no settings and so no part of a transaction: they act when they
/// are written, in anybody's transaction too, and are no change of parameters. So are CANopen's own settings
/// (Access::communication), which only CANopen writes, one by one, with write_communication().
///
/// While the write lock is locked (write_lock.hpp) no link changes anything else than those commands and what
/// only measures (trace.*, capture.*). A value that is written as it is, is no change.
///
/// Of two parameters that are one thing in two standards' numbers (linked_parameters.hpp), writing either
/// sets both; the last one written wins.
///
/// Main loop only. Cost of a write: its values and the rules between parameters; nothing is copied.
class ParameterAccess {
 public:
  static constexpr std::uint32_t transaction_timeout_us = 2'000'000;
  static constexpr std::uint32_t stragglers_us = 30'000'000;

  struct Result {
    Refusal refusal = Refusal::none;
    std::uint16_t address = 0;  ///< register that it is about, as refusal.register
  };

  ParameterValues& values() { return values_; }
  const ParameterValues& values() const { return values_; }
  std::uint32_t read(std::size_t slot) const { return values_.raw(slot); }

  /// Rises with every change of a parameter; restarting_changes() only with those that restart the axes.
  std::uint32_t changes() const { return changes_; }
  std::uint32_t restarting_changes() const { return restarting_changes_; }
  /// Rises with every change of CANopen's own settings, which count nowhere else.
  std::uint32_t communication_changes() const { return communication_changes_; }

  /// transaction.control and store.command come alone. `now_us` drives the transaction's time-out.
  Result write(std::span<const SlotValue> wanted, Link by, const ArmedAxes& armed, std::uint32_t now_us);

  /// Call at least every 2^31 us.
  void poll(std::uint32_t now_us);

  bool transaction_open() const { return owner_.has_value(); }
  /// The owner's communication begins afresh: its transaction, if it has one, ends without effect.
  void drop(Link owner, std::uint32_t now_us);

  /// Takes every setting of `wanted` at once, outside any transaction: a stored set, the defaults. Commands
  /// and setpoints stay. Of two linked parameters the one that differs from now wins; if both differ, the one
  /// that save keeps. Refused while a transaction is open.
  Result set_all(const ParameterValues& wanted, const ArmedAxes& armed);

  /// One of CANopen's own settings, at once; read_only for any other slot. Rules of CANopen between them are
  /// the caller's.
  Result write_communication(std::size_t slot, std::uint32_t raw, const ArmedAxes& armed);

  /// The board's own writes, Link::local, are no host's and pass.
  void set_locked(bool locked) { locked_ = locked; }
  bool locked() const { return locked_; }

  /// What a request that others carry out came to; last_refusal() says so from now on.
  Result refuse(Refusal refusal, std::uint16_t address) { return last_ = {refusal, address}; }
  Result refuse_slot(Refusal refusal, std::size_t slot);

  Result last_refusal() const { return last_; }

  bool controlword_waits() const {
    bool some = false;
    for (const auto& one : commanded_by_) some = some || one;
    return some;
  }
  /// The axis' controlword, if one was written since it was last fetched.
  std::optional<Controlword> fetch_controlword(std::size_t axis) {
    if (!commanded_by_[axis]) return std::nullopt;
    const auto word = static_cast<std::uint16_t>(values_.whole<"drive.controlword">(axis));
    return Controlword{word, *std::exchange(commanded_by_[axis], std::nullopt)};
  }

 private:
  static constexpr std::size_t words_of_slots = (slot_count + 31) / 32;

  Refusal lock_refusal(const SlotValue& wanted, Link by) const;
  Result check(const SlotValue& one, Link by, const ArmedAxes& armed);
  void put_aside(const SlotValue& one);
  Result control_transaction(std::uint32_t request, Link by, const ArmedAxes& armed, std::uint32_t now_us);
  Result apply(Link by, const ArmedAxes& armed);
  void exchange();

  void mark(std::size_t slot) { written_[slot / 32] |= 1U << slot % 32; }
  /// Calls `act` for every slot that was put aside.
  template <typename Act>
  void for_each_written(Act act) const {
    for (std::size_t word = 0; word < words_of_slots; ++word) {
      for (std::uint32_t left = written_[word]; left != 0; left &= left - 1)
        act(32 * word + static_cast<std::size_t>(std::countr_zero(left)));
    }
  }

  ParameterValues values_;
  // What was put aside: of the written slots only.
  ParameterValues staged_;
  std::array<std::uint32_t, words_of_slots> written_{};
  Result last_;
  std::uint32_t changes_ = 0, restarting_changes_ = 0, communication_changes_ = 0;
  bool locked_ = false;
  std::optional<Link> owner_;
  std::uint32_t last_staged_us_ = 0;
  std::array<std::optional<std::uint32_t>, link_count> dropped_us_;  ///< by link: without its doing
  std::array<std::optional<Link>, axis_count> commanded_by_;
};

}  // namespace kmax::firmware
