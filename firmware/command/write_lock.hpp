#pragma once

#include <cstdint>

#include "firmware/board_interface/retained_count.hpp"
#include "firmware/command/store_commands.hpp"

namespace kmax::firmware {

/// The write lock: while it is locked, hosts change nothing of the device but what acts at once
/// (ParameterAccess::lock_refusal). docs/write_lock.md says what that protects from, and what not.
///
/// The owner sets a code, a number of 32 bits, which is kept in the parameter store at once, beside the set
/// that is kept there; a loss of power leaves the old code or the new one. The device is locked when the new
/// code is kept, and after every start. Its code opens it until the next start, or until it is locked again.
/// All of this only while no axis is armed.
///
/// A wrong code, whoever sent it, makes all wait: no code is taken for 1 s, twice as long after each further
/// wrong one, at most 256 s. To try all numbers of 4 digits takes 27 days, of 9 digits 7300 years. The number
/// of wrong codes survives a reset, which begins the wait anew; it does not survive power-off: whoever can
/// switch the supply can reach the flash, too.
///
/// The code is in no value of the dictionary, so that nothing that reads values can come upon it. In the
/// flash it is kept as it is: a digest of so short a number is undone within seconds, and would only look
/// like more.
///
/// Main loop only.
class WriteLock {
 public:
  static constexpr std::uint32_t first_wait_us = 1'000'000, longest_wait_us = 256'000'000;

  /// `attempts`: where wrong codes are counted; null: they are counted from the start on.
  WriteLock(ParameterAccess& parameters, StoreCommands& store, RetainedCount* attempts);
  WriteLock(const WriteLock&) = delete;
  WriteLock& operator=(const WriteLock&) = delete;

  /// lock.code. It is in force when it is kept.
  ParameterAccess::Result set_code(std::uint32_t code, bool armed);
  /// lock.key. Also while it is open: a wrong code counts, the right one changes nothing.
  ParameterAccess::Result turn_key(std::uint32_t key, bool armed);

  /// At least once a second, before hosts write. `now_us` wraps at 2^32.
  void poll(std::uint32_t now_us);
  /// Another code may be kept now.
  void follow_store() { parameters_.set_locked(store_.keeper().lock_code() != 0 && !open_); }

  /// Writes the readings lock.* into `values`.
  void publish(ParameterValues& values) const;

 private:
  ParameterAccess& parameters_;
  StoreCommands& store_;
  RetainedCount since_start_{};
  RetainedCount& attempts_;
  std::uint32_t wait_us_, polled_us_{};
  bool polled_ = false, open_ = false, setting_ = false;
};

}  // namespace kmax::firmware
