#include "firmware/command/write_lock.hpp"

#include <algorithm>
#include <bit>

namespace kmax::firmware {

namespace {
constexpr std::uint32_t most_attempts = 0xFFFF;

std::uint32_t wait_after(std::uint32_t attempts) {
  std::uint32_t wait_us = attempts == 0 ? 0 : WriteLock::first_wait_us;
  for (std::uint32_t i = 1; i < attempts && wait_us < WriteLock::longest_wait_us; ++i) wait_us *= 2;
  return wait_us;
}
static_assert(std::has_single_bit(WriteLock::longest_wait_us / WriteLock::first_wait_us));
}  // namespace

WriteLock::WriteLock(ParameterAccess& parameters, StoreCommands& store, RetainedCount* attempts)
    : parameters_(parameters),
      store_(store),
      attempts_(attempts != nullptr ? *attempts : since_start_),
      wait_us_(wait_after(attempts_.value())) {}

ParameterAccess::Result WriteLock::set_code(std::uint32_t code, bool armed) {
  const Refusal refusal = armed                  ? Refusal::while_armed
                          : parameters_.locked() ? Refusal::locked
                                                 : store_.save_lock_code(code, armed);
  if (refusal == Refusal::none) setting_ = true;
  return parameters_.refuse_slot(refusal, slot_of(entry_of<"lock.code">(), 0));
}

ParameterAccess::Result WriteLock::turn_key(std::uint32_t key, bool armed) {
  const std::uint32_t code = store_.keeper().lock_code();
  Refusal refusal = armed ? Refusal::while_armed : code == 0 ? Refusal::no_code : Refusal::none;
  if (refusal == Refusal::none && key == 0) {
    open_ = false;
  } else if (refusal == Refusal::none && wait_us_ != 0) {
    refusal = Refusal::code_waits;
  } else if (refusal == Refusal::none) {
    open_ = open_ || key == code;
    attempts_.set(key == code ? 0 : std::min(attempts_.value() + 1, most_attempts));
    wait_us_ = wait_after(attempts_.value());
    if (key != code) refusal = Refusal::wrong_code;
  }
  follow_store();
  return parameters_.refuse_slot(refusal, slot_of(entry_of<"lock.key">(), 0));
}

void WriteLock::poll(std::uint32_t now_us) {
  if (polled_) wait_us_ -= std::min(wait_us_, now_us - polled_us_);
  polled_ = true;
  polled_us_ = now_us;
  if (setting_ && !store_.keeper().busy()) {
    setting_ = false;
    if (store_.keeper().state() == StoreState::saved) open_ = false;
  }
  follow_store();
}

void WriteLock::publish(ParameterValues& values) const {
  const bool has_code = store_.keeper().lock_code() != 0;
  values.set_whole<"lock.state">(!has_code ? 0U : open_ ? 1U : 2U);
  values.set_whole<"lock.attempts">(attempts_.value());
  values.set_whole<"lock.wait">((wait_us_ + 999'999) / 1'000'000);
}

}  // namespace kmax::firmware
