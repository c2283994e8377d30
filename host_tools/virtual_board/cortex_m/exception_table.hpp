#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

// The state of all exceptions and the decision which of them runs: PM0214, exception model (states,
// priorities, pre-emption) and NVIC (level-sensitive and pulse interrupts). NVIC, SCB and SysTick are faces
// of this table; the processor asks it what to enter.
//
// Cost: `preempting()` is one comparison; a change of state that may alter the decision goes once through the
// pending ones, 32 exceptions a word.

namespace kmax::virtual_board {

/// Numbers of the exceptions as in IPSR and the vector table; interrupt n is 16 + n.
namespace exception_number {
inline constexpr unsigned thread = 0;
inline constexpr unsigned reset = 1;
inline constexpr unsigned non_maskable = 2;
inline constexpr unsigned hard_fault = 3;
inline constexpr unsigned memory_fault = 4;
inline constexpr unsigned bus_fault = 5;
inline constexpr unsigned usage_fault = 6;
inline constexpr unsigned supervisor_call = 11;
inline constexpr unsigned debug_monitor = 12;
inline constexpr unsigned pend_supervisor = 14;
inline constexpr unsigned system_tick = 15;
inline constexpr unsigned first_interrupt = 16;
}  // namespace exception_number

/// The architecture's most; how many a chip has is said where its board is made.
inline constexpr std::size_t most_interrupts = 240;

/// What the special registers of the core keep back.
struct ExceptionMasks {
  bool primask = false;
  bool faultmask = false;
  std::uint8_t basepri = 0;  ///< 0: masks nothing
};

class ExceptionTable {
 public:
  /// Less urgent than every settable priority: nothing is active.
  static constexpr int base_level = 256;

  /// A core with interrupts 0 to `interrupts` - 1, 1 to 240.
  explicit ExceptionTable(std::size_t interrupts)
      : interrupts_(static_cast<unsigned>(interrupts)),
        words_((exception_number::first_interrupt + interrupts_ + 31) / 32) {}

  /// As after a reset: nothing pending, active or enabled, priorities 0. Levels of interrupt lines stay, they
  /// belong to the peripherals.
  void reset();

  void pend(unsigned exception);
  /// An interrupt line that is still high makes it pending again at once (PM0214, level-sensitive
  /// interrupts).
  void clear_pending(unsigned exception);
  void set_enabled(unsigned exception, bool enabled);
  /// Only the upper four bits exist; the others are dropped.
  void set_priority(unsigned exception, std::uint8_t priority);
  void set_line(unsigned exception, bool level);
  /// PRIGROUP of AIRCR, 0 to 7.
  void set_priority_group(unsigned group);

  void activate(unsigned exception);    ///< pending -> active
  void deactivate(unsigned exception);  ///< active -> inactive, or pending again when its line is still high

  unsigned interrupts() const { return interrupts_; }

  bool pending(unsigned exception) const { return get(pending_, exception); }
  bool active(unsigned exception) const { return get(active_, exception); }
  bool enabled(unsigned exception) const { return get(enabled_, exception); }
  std::uint8_t priority(unsigned exception) const { return priority_[exception]; }
  unsigned priority_group() const { return group_; }
  unsigned active_count() const { return active_count_; }

  /// The most urgent exception that is pending and enabled, 0 if there is none.
  unsigned candidate() const { return candidate_; }
  /// The candidate would pre-empt what runs now if no special register masked it.
  bool preempting() const { return candidate_level_ < active_level_; }
  /// The candidate pre-empts what runs now; the processor enters it.
  bool deliverable(const ExceptionMasks& masks) const {
    return candidate_level_ < active_level_ && candidate_level_ < masked_level(masks);
  }
  /// The candidate ends a WFI: as deliverable, but PRIMASK does not count (PM0214, WFI).
  bool wakes(ExceptionMasks masks) const {
    masks.primask = false;
    return deliverable(masks);
  }
  /// Level at which an exception would run: its group priority, negative for reset, NMI and HardFault.
  int level(unsigned exception) const;
  /// Level of the code that runs now, masks included. An exception pre-empts only when its own is lower.
  int execution_level(const ExceptionMasks& masks) const {
    const int masked = masked_level(masks);
    return masked < active_level_ ? masked : active_level_;
  }

 private:
  static constexpr std::size_t capacity = exception_number::first_interrupt + most_interrupts;
  using Bits = std::array<std::uint32_t, capacity / 32>;

  static bool get(const Bits& bits, unsigned exception) {
    return (bits[exception / 32] >> (exception % 32) & 1U) != 0;
  }
  static void set(Bits& bits, unsigned exception, bool value);
  int masked_level(const ExceptionMasks& masks) const;
  int group_level(std::uint8_t priority) const;
  void find_candidate();
  void find_active_level();

  unsigned interrupts_;
  unsigned words_;  ///< of the bits that exist
  Bits pending_{};
  Bits active_{};
  Bits enabled_{};
  Bits line_{};
  std::array<std::uint8_t, capacity> priority_{};
  unsigned group_ = 0;
  unsigned active_count_ = 0;
  unsigned candidate_ = 0;
  int candidate_level_ = base_level;
  int active_level_ = base_level;
};

}  // namespace kmax::virtual_board
