#pragma once

#include <concepts>
#include <cstdint>

// The alphabet of the register layer: what a register is, what a field in it is, where a block of them lives.
//
// A register block is a struct of `volatile std::uint32_t` whose offsets are checked by static_assert.
// Drivers take the block's type as a template argument and a reference to it in the constructor, so a test
// hands them plain memory or objects that act on reads and writes; nothing here knows whether the other side
// is silicon.
//
// Cost: `Field::write` is one load, a few register instructions and one store: not atomic. Two contexts may
// write fields of the same register only if the driver says why that is safe.

namespace kmax::drivers {

/// Anything that reads as a 32-bit word and takes one: `volatile std::uint32_t`, or a test's stand-in for it.
template <typename Candidate>
concept Register = requires(Candidate& candidate, const Candidate& constant, std::uint32_t word) {
  { static_cast<std::uint32_t>(constant) } -> std::same_as<std::uint32_t>;
  candidate = word;
};

/// `width` bits of a register from bit `position` upwards.
template <unsigned position, unsigned width = 1>
struct Field {
  static_assert(width >= 1 && width <= 32 && position <= 32 - width, "the field does not fit into 32 bits");

  static constexpr std::uint32_t maximum = 0xFFFF'FFFFU >> (32 - width);
  static constexpr std::uint32_t mask = maximum << position;

  /// `value` shifted into place; bits that do not fit are dropped so that neighbours are never touched.
  static constexpr std::uint32_t bits(std::uint32_t value) { return (value & maximum) << position; }

  /// The field's value inside a word read earlier.
  static constexpr std::uint32_t of(std::uint32_t word) { return (word & mask) >> position; }

  static std::uint32_t read(const Register auto& source) { return of(static_cast<std::uint32_t>(source)); }

  /// Replaces the field, leaves the other bits as they were read.
  static void write(Register auto& target, std::uint32_t value) {
    target = (static_cast<std::uint32_t>(target) & ~mask) | bits(value);
  }

  static void set(Register auto& target) { write(target, maximum); }
  static void clear(Register auto& target) { write(target, 0); }
};

/// The block that silicon keeps at `address`. Only a composition root (or start-up code) calls this.
template <typename Block>
Block& peripheral_at(std::uintptr_t address) {
  return *reinterpret_cast<Block*>(address);  // NOLINT(performance-no-int-to-ptr)
}

/// Reads `source` until the bits in `mask` equal `expected`; false when they did not within `polls` reads (at
/// least one). The bound is a number of reads because no clock can be trusted while the clocks themselves are
/// being set up.
[[nodiscard]] bool wait_until(const Register auto& source, std::uint32_t mask, std::uint32_t expected,
                              std::uint32_t polls) {
  do {
    if ((static_cast<std::uint32_t>(source) & mask) == expected) return true;
  } while (polls-- > 1);
  return false;
}

}  // namespace kmax::drivers
