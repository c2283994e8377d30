#pragma once

#include <cstdint>
#include <optional>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/abort_code.hpp"
#include "firmware/canopen/cob_id.hpp"

namespace kmax::firmware::canopen {

/// They wrap.
struct SyncCounters {
  std::uint32_t received = 0;
  std::uint32_t wrong_length = 0;   ///< neither 0 nor 1 byte: no SYNC
  std::uint32_t wrong_counter = 0;  ///< counter 0, above 240 or above its overflow value: a SYNC all the same
  std::uint32_t lost = 0;           ///< gaps in the counter: at least this many SYNC messages did not arrive
};

/// A SYNC message; `counter` 1..240, or 0 if it has none.
struct SyncTick {
  std::uint8_t counter = 0;
};

/// SYNC consumer of CiA 301 (7.2.5; objects 0x1005 and 0x1019). This device does not generate SYNC.
/// Main loop only. Cost: constant.
class Sync {
 public:
  static constexpr std::uint8_t highest_counter = 240;

  /// May `raw` be written to object 0x1005? Not if it asks for generating (bit 30), for a 29-bit identifier,
  /// or for a restricted identifier. Bit 31 has no meaning there and is left alone.
  static constexpr Abort check(std::uint32_t raw) {
    const std::uint32_t id = raw & ~cob_id::invalid;
    return id > cob_id::identifier || cob_id::restricted(id) ? Abort::value_range : Abort::none;
  }

  /// May `value` be written to object 0x1019, the counter's overflow value? 0 (no counter), 2..240.
  static constexpr Abort check_overflow(std::uint8_t value) {
    return value == 1 || value > highest_counter ? Abort::value_range : Abort::none;
  }

  /// Objects 0x1005 and 0x1019. With an overflow value the counter is watched for gaps; a SYNC with or
  /// without a counter is taken in any case. The watching begins anew.
  void configure(std::uint32_t raw, std::uint8_t overflow = 0) {
    identifier_ = raw & cob_id::identifier;
    overflow_ = check_overflow(overflow) == Abort::none ? overflow : std::uint8_t{0};
    last_counter_ = 0;
  }

  /// A SYNC, or nothing if it was another frame or a SYNC of a wrong length.
  std::optional<SyncTick> receive(const drivers::CanFrame& frame) {
    if (frame.identifier != identifier_ || frame.extended || frame.remote) return std::nullopt;
    if (frame.length > 1) {
      ++counters_.wrong_length;
      return std::nullopt;
    }
    ++counters_.received;
    if (frame.length == 0) {
      last_counter_ = 0;
      return SyncTick{};
    }
    const std::uint8_t counter = frame.data[0];
    if (counter == 0 || counter > (overflow_ != 0 ? overflow_ : highest_counter)) {
      ++counters_.wrong_counter;
      last_counter_ = 0;
      return SyncTick{};
    }
    if (overflow_ != 0 && last_counter_ != 0) counters_.lost += gap(counter);
    last_counter_ = counter;
    return SyncTick{counter};
  }

  std::uint32_t identifier() const { return identifier_; }
  const SyncCounters& counters() const { return counters_; }

 private:
  // SYNC messages that are missing between the latest one and this one; 1 follows the overflow value.
  std::uint32_t gap(std::uint8_t counter) const {
    const unsigned expected = last_counter_ + 1U;
    return counter >= expected ? counter - expected : counter + overflow_ - expected;
  }

  SyncCounters counters_;
  std::uint32_t identifier_ = cob_id::sync;
  std::uint8_t overflow_ = 0;
  std::uint8_t last_counter_ = 0;  // 0: none to compare with
};

}  // namespace kmax::firmware::canopen
