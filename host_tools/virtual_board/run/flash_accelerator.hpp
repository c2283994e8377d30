#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace kmax::virtual_board {

/// For how many cycles the core waits for flash at 168 MHz: RM0090, Embedded Flash memory interface, Adaptive
/// real-time memory accelerator. Five wait states; lines of 128 bits; 64 of instructions and 8 of data are
/// kept, the least recently used goes; the line behind the present one is prefetched. The manual can be read
/// in two ways: of instructions only lines that were missed are kept, or prefetched ones as well. A model
/// that no board has confirmed.
///
/// A read under way is not given up for one that turns out to be needed sooner, and data go before prefetch.
class FlashAccelerator {
 public:
  enum class Kept : std::uint8_t { missed, all };

  explicit FlashAccelerator(Kept kept = Kept::missed) : kept_(kept) {}

  /// The waits before an instruction of `bytes` can begin that would begin at cycle `now`.
  std::uint32_t fetch(std::uint32_t address, std::uint32_t bytes, std::uint64_t now) {
    std::uint32_t waits = line(address / line_bytes, now);
    const std::uint32_t last = (address + bytes - 1) / line_bytes;
    if (last != address / line_bytes) waits += line(last, now + waits);
    return waits;
  }
  /// The waits of a load of data.
  std::uint32_t load(std::uint32_t address, std::uint64_t now) {
    return hit(data_, address / line_bytes, data_lines) ? 0 : read(now);
  }

 private:
  static constexpr std::uint32_t line_bytes = 16, wait_states = 5;
  static constexpr std::size_t instruction_lines = 64, data_lines = 8;

  std::uint32_t line(std::uint32_t wanted, std::uint64_t now) {
    if (wanted == present_) return 0;
    present_ = wanted;
    std::uint32_t waits = 0;
    if (wanted == prefetched_) {
      waits = static_cast<std::uint32_t>(std::max(prefetched_at_, now) - now);
      if (kept_ == Kept::all) (void)hit(instructions_, wanted, instruction_lines);
    } else if (!hit(instructions_, wanted, instruction_lines)) {
      waits = read(now);
    }
    if (std::ranges::find(instructions_, wanted + 1) != instructions_.end()) return waits;
    prefetched_ = wanted + 1;
    prefetched_at_ = std::max(now + waits, free_at_) + wait_states + 1;
    free_at_ = prefetched_at_;
    return waits;
  }
  /// Takes the line in where it is missing.
  static bool hit(std::vector<std::uint32_t>& lines, std::uint32_t wanted, std::size_t most) {
    const auto found = std::ranges::find(lines, wanted);
    const bool there = found != lines.end();
    if (there) lines.erase(found);
    lines.push_back(wanted);
    if (lines.size() > most) lines.erase(lines.begin());
    return there;
  }
  std::uint32_t read(std::uint64_t now) {
    const std::uint64_t begins = std::max(now, free_at_);
    free_at_ = begins + wait_states;
    return static_cast<std::uint32_t>(free_at_ - now);
  }

  Kept kept_;
  std::vector<std::uint32_t> instructions_, data_;  ///< the least recently used first
  std::uint32_t present_ = 0, prefetched_ = 0;
  std::uint64_t prefetched_at_ = 0, free_at_ = 0;
};

}  // namespace kmax::virtual_board
