#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

#include "firmware/object_dictionary/register_windows.hpp"

namespace kmax::firmware {

/// One line of the running trace: four 32-bit values, eight registers.
struct TraceRecord {
  std::uint32_t tick = 0;
  std::int32_t count = 0;             ///< re-sampled position, low 32 bits
  float force = 0.0f;                 ///< N
  float magnetic_coefficient = 0.0f;  ///< N
};

/// The last 512 trace records of one axis, written by the tick and read through a window of input
/// registers (register_windows.hpp).
///
/// A host reads `trace.next`, then the records it has not had. What it reads too late has been overwritten:
/// the ticks of the records then do not follow each other, and the host counts the loss. At 500 Hz the
/// window holds one second.
class Trace {
 public:
  /// Interrupt.
  void ISR_push(const TraceRecord& record) {
    const std::uint32_t next = next_.load(std::memory_order_relaxed);
    records_[next % trace_capacity] = record;
    next_.store(next + 1, std::memory_order_release);
  }

  /// Main loop: records since start.
  std::uint32_t next() const { return next_.load(std::memory_order_acquire); }

  static constexpr bool contains(std::uint32_t address) {
    return address >= trace_window && address < trace_window + trace_capacity * trace_words_per_record;
  }

  /// Main loop: one register of the window.
  std::uint16_t word_at(std::uint16_t address) const {
    const auto offset = static_cast<std::uint16_t>(address - trace_window);
    const TraceRecord& record = records_[offset / trace_words_per_record];
    const std::uint32_t fields[4] = {record.tick, static_cast<std::uint32_t>(record.count),
                                     std::bit_cast<std::uint32_t>(record.force),
                                     std::bit_cast<std::uint32_t>(record.magnetic_coefficient)};
    const std::uint32_t field = fields[(offset % trace_words_per_record) / 2];
    return static_cast<std::uint16_t>(offset % 2 == 0 ? field >> 16 : field);
  }

 private:
  std::array<TraceRecord, trace_capacity> records_{};
  std::atomic<std::uint32_t> next_{0};
};

}  // namespace kmax::firmware
