#include "host_tools/virtual_board/cortex_m/exception_table.hpp"

#include <bit>

namespace kmax::virtual_board {
namespace {

constexpr std::uint8_t implemented_bits = 0xF0;

/// Always enabled: all that the SCB, not the NVIC, keeps. The configurable faults are enabled in SHCSR.
constexpr bool enabled_from_reset(unsigned exception) {
  using namespace exception_number;
  return exception == non_maskable || exception == hard_fault || exception == supervisor_call ||
         exception == pend_supervisor || exception == system_tick;
}

}  // namespace

void ExceptionTable::reset() {
  pending_ = {};
  active_ = {};
  enabled_ = {};
  priority_ = {};
  group_ = 0;
  active_count_ = 0;
  for (unsigned exception = 0; exception < exception_number::first_interrupt + interrupts_; ++exception) {
    if (enabled_from_reset(exception)) set(enabled_, exception, true);
  }
  pending_ = line_;
  active_level_ = base_level;
  find_candidate();
}

void ExceptionTable::set(Bits& bits, unsigned exception, bool value) {
  const std::uint32_t bit = 1U << (exception % 32);
  if (value) {
    bits[exception / 32] |= bit;
  } else {
    bits[exception / 32] &= ~bit;
  }
}

int ExceptionTable::group_level(std::uint8_t priority) const {
  return priority & (0xFF << (group_ + 1) & 0xFF);
}

int ExceptionTable::level(unsigned exception) const {
  if (exception == exception_number::reset) return -3;
  if (exception == exception_number::non_maskable) return -2;
  if (exception == exception_number::hard_fault) return -1;
  return group_level(priority_[exception]);
}

int ExceptionTable::masked_level(const ExceptionMasks& masks) const {
  if (masks.faultmask) return -1;
  if (masks.primask) return 0;
  const std::uint8_t base = masks.basepri & implemented_bits;
  return base == 0 ? base_level : group_level(base);
}

void ExceptionTable::pend(unsigned exception) {
  if (pending(exception)) return;
  set(pending_, exception, true);
  find_candidate();
}

void ExceptionTable::clear_pending(unsigned exception) {
  set(pending_, exception, get(line_, exception) && !active(exception));
  find_candidate();
}

void ExceptionTable::set_enabled(unsigned exception, bool enabled) {
  set(enabled_, exception, enabled);
  find_candidate();
}

void ExceptionTable::set_priority(unsigned exception, std::uint8_t priority) {
  priority_[exception] = priority & implemented_bits;
  find_candidate();
  find_active_level();
}

void ExceptionTable::set_line(unsigned exception, bool level) {
  const bool rising = level && !get(line_, exception);
  set(line_, exception, level);
  if (rising) pend(exception);
}

void ExceptionTable::set_priority_group(unsigned group) {
  group_ = group;
  find_candidate();
  find_active_level();
}

void ExceptionTable::activate(unsigned exception) {
  set(pending_, exception, false);
  set(active_, exception, true);
  ++active_count_;
  find_candidate();
  find_active_level();
}

void ExceptionTable::deactivate(unsigned exception) {
  set(active_, exception, false);
  --active_count_;
  if (get(line_, exception)) set(pending_, exception, true);
  find_candidate();
  find_active_level();
}

void ExceptionTable::find_candidate() {
  candidate_ = 0;
  candidate_level_ = base_level;
  int candidate_order = 0;
  for (unsigned word = 0; word < words_; ++word) {
    for (std::uint32_t left = pending_[word] & enabled_[word]; left != 0; left &= left - 1) {
      const unsigned exception = 32 * word + static_cast<unsigned>(std::countr_zero(left));
      // Group first, then sub-priority, then the lower number: going upwards, only a strictly smaller one
      // wins.
      const int exception_level = level(exception);
      const int order = exception_level < 0 ? exception_level : priority_[exception];
      if (candidate_ != 0 && order >= candidate_order) continue;
      candidate_ = exception;
      candidate_level_ = exception_level;
      candidate_order = order;
    }
  }
}

void ExceptionTable::find_active_level() {
  active_level_ = base_level;
  for (unsigned word = 0; word < words_; ++word) {
    for (std::uint32_t left = active_[word]; left != 0; left &= left - 1) {
      const unsigned exception = 32 * word + static_cast<unsigned>(std::countr_zero(left));
      if (level(exception) < active_level_) active_level_ = level(exception);
    }
  }
}

}  // namespace kmax::virtual_board
