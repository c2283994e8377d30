#pragma once

#include <cstdint>
#include <optional>

// What the virtual board must know about a Thumb instruction: its length, how long a Cortex-M4F takes for it,
// whether it needs the FPU, and which memory it accesses. ARMv7-M architecture reference manual, A5
// (encodings) and A7; cycles from the Cortex-M4 technical reference manual, 3.3.1, and from its section on
// the FPU.
//
// The cycles are an estimate that no board has confirmed: code and data arrive without wait states, P
// (pipeline refill after a branch) is 2, a division takes 7 (the manual: 2 to 12), a load directly behind
// another takes what cycles_saved_behind() leaves. An instruction that an IT block skips costs as if
// executed.

namespace kmax::virtual_board {

/// Address of a load or store: base + (index << shift) + offset, `span` bytes from there.
struct MemoryOperand {
  static constexpr std::uint8_t no_register = 0xFF;

  bool store = false;
  std::uint8_t base = no_register;  ///< no_register: `offset` is the address itself (literals)
  std::uint8_t index = no_register;
  std::uint8_t shift = 0;
  std::uint8_t span = 4;
  std::uint32_t offset = 0;  ///< two's complement
};

struct Instruction {
  std::uint8_t bytes = 2;
  std::uint8_t cycles = 1;           ///< alone
  std::uint8_t cycles_if_taken = 0;  ///< more, when a conditional branch is taken
  bool floating_point = false;
  std::optional<MemoryOperand> memory{};
  std::uint8_t loaded = MemoryOperand::no_register;  ///< by a load of one core register that is not the PC
};

/// Cycles that an instruction takes less directly behind `previous`, after which the core goes on in a
/// straight line. The address phase of a load overlaps the data phase of the load before it, unless it needs
/// that one's result (Cortex-M4 technical reference manual, load and store timings). Loads and stores of two
/// registers do not overlap; of those of the FPU the manual does not say. Left out: a store with a register
/// as its offset behind a load, which takes one cycle less, and addresses computed by the instruction before,
/// which may cost one more.
constexpr std::uint8_t cycles_saved_behind(const Instruction& previous, const Instruction& instruction) {
  constexpr std::uint8_t none = MemoryOperand::no_register;
  if (previous.loaded == none || instruction.loaded == none) return 0;
  const bool needs_result =
      instruction.memory->base == previous.loaded || instruction.memory->index == previous.loaded;
  return needs_result ? 0 : 1;
}

/// True when the half word is the first of two.
constexpr bool is_wide(std::uint16_t first) {
  return (first >> 11) >= 0x1D;
}

/// `second` matters for wide instructions only; `address` is the instruction's own (literals).
Instruction decode(std::uint16_t first, std::uint16_t second, std::uint32_t address);

}  // namespace kmax::virtual_board
