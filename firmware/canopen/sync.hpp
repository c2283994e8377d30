#pragma once

#include <cstdint>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/abort_code.hpp"
#include "firmware/canopen/pdo_settings.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::firmware::canopen {

/// SYNC of CiA 301 (7.2.5; objects 0x1005, 0x1006, 0x1019), as it is heard and, if bit 30 of 0x1005 is set
/// and 0x1006 is not 0, as this device makes it. What either sets off is the owner's.
///
/// A SYNC of another length than 0x1019 asks for (1 byte with a counter, 0 without) is an error, emergency
/// 0x8240; one of 0 or 1 byte is a SYNC all the same, whose counter means nothing here.
///
/// Own ones are on a fixed grid, the first of them one period after the start, which late calls do not shift.
/// One that finds the one before it still unsent is left out: on a bus that is gone nothing is set off. Their
/// counter begins with 1 after each start and with each new period.
///
/// `now_us`: of Node::poll_pdos(), wraps at 2^32. Main loop only. Cost: constant.
class Sync {
 public:
  static constexpr std::uint32_t least_us = 1000;

  struct Settings {
    std::uint32_t cob_id = cob_id::sync;  ///< object 0x1005
    std::uint32_t period_us = 0;          ///< object 0x1006; on a slow bus longer, see least_period_us()
    std::uint8_t counter_overflow = 0;    ///< object 0x1019
  };

  /// May `raw` be written to object 0x1005 while it is `present`? Never a 29-bit or a restricted identifier;
  /// another identifier not while bit 30 is set. Bit 31 has no meaning there and is left alone.
  static constexpr Abort check(std::uint32_t raw, std::uint32_t present) {
    const std::uint32_t id = raw & ~(cob_id::invalid | cob_id::generates);
    if (id > cob_id::identifier || cob_id::restricted(id)) return Abort::value_range;
    const bool changes = id != (present & cob_id::identifier);
    return changes && (present & cob_id::generates) != 0 ? Abort::device_state : Abort::none;
  }

  /// Another period begins anew; the same one goes on.
  void configure(const Settings& settings, std::uint32_t bit_rate, std::uint32_t now_us) {
    identifier_ = settings.cob_id & cob_id::identifier;
    counter_overflow_ = settings.counter_overflow >= 2 ? settings.counter_overflow : std::uint8_t{0};
    const bool makes = (settings.cob_id & cob_id::generates) != 0 && settings.period_us != 0;
    const std::uint32_t period_us = makes ? std::max(settings.period_us, least_period_us(bit_rate)) : 0;
    if (period_us == period_us_) return;
    period_us_ = period_us;
    start(now_us);
  }

  /// Communication starts, or goes on after NMT stop.
  void start(std::uint32_t now_us) {
    due_us_ = now_us + period_us_;
    counter_ = 0;
    waits_ = false;
  }

  /// A SYNC of whatever length.
  bool receives(const drivers::CanFrame& frame) const {
    return frame.identifier == identifier_ && !frame.extended && !frame.remote;
  }
  std::uint8_t length() const { return counter_overflow_ != 0 ? 1 : 0; }

  /// True: an own one is due now, and waits to be sent.
  bool poll(std::uint32_t now_us) {
    const std::uint32_t late_us = now_us - due_us_;
    if (period_us_ == 0 || late_us >> 31 != 0) return false;
    due_us_ += (late_us / period_us_ + 1) * period_us_;
    if (waits_) return false;
    return waits_ = true;
  }

  bool next_frame(drivers::CanFrame& out) {
    if (!waits_) return false;
    waits_ = false;
    if (counter_overflow_ != 0)
      counter_ = counter_ < counter_overflow_ ? static_cast<std::uint8_t>(counter_ + 1) : std::uint8_t{1};
    out = {.identifier = identifier_, .length = length(), .data = {counter_}};
    return true;
  }

  /// The first moment from `us` on, less than a millisecond later, that is whole milliseconds from the own
  /// SYNCs: PDOs whose event times are such, and begin there, are in step with them. `us` itself if none is
  /// made.
  std::uint32_t in_step(std::uint32_t us) const {
    return period_us_ == 0 ? us : us + (due_us_ + 2 * least_us - us) % least_us;
  }

  std::uint32_t identifier() const { return identifier_; }

 private:
  std::uint32_t identifier_ = cob_id::sync;
  std::uint32_t period_us_ = 0;  // 0: none is made
  std::uint32_t due_us_ = 0;
  std::uint8_t counter_overflow_ = 0;  // 0: without a counter
  std::uint8_t counter_ = 0;           // of the latest one sent
  bool waits_ = false;
};

}  // namespace kmax::firmware::canopen
