#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// One load or store of the processor, as a register block sees it.
struct Access {
  std::uint32_t offset;  ///< from the block's base, multiple of `bytes`
  unsigned bytes;        ///< 1, 2 or 4
  BoardTime now;
};

/// What no firmware of ours may do: a register or field that is not modelled, a forbidden value or order. The
/// bus adds the address and the program counter, and the board stops.
class RefusedAccess : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A block of registers on the bus, and what stands behind it.
///
/// Time comes from outside and never runs backwards. Before any call with a later time the board calls
/// advance() for every event that is due, in order of time; a peripheral that is asked with a time beyond its
/// next_event() must bring itself up to date first. All times are absolute.
class Peripheral {
 public:
  Peripheral() = default;
  Peripheral(const Peripheral&) = delete;
  Peripheral& operator=(const Peripheral&) = delete;
  virtual ~Peripheral() = default;

  /// Throws RefusedAccess.
  virtual std::uint32_t read(const Access& access) = 0;
  /// Throws RefusedAccess.
  virtual void write(const Access& access, std::uint32_t value) = 0;

  /// Does all that is due at `now` or before.
  virtual void advance(BoardTime now) { static_cast<void>(now); }
  /// When advance() has something to do next; `never` if it depends on others alone.
  virtual BoardTime next_event() const { return never; }

  /// As after system reset (not power-up): registers to their reset values, outputs released.
  virtual void reset(BoardTime now) = 0;
};

/// Where peripherals raise interrupts. A level stays until the peripheral takes it back; the NVIC latches it,
/// and makes it pending again when the handler returns and it is still there.
class InterruptLines {
 public:
  /// `Interrupt`: the chip's enumeration of its interrupts by their numbers.
  template <typename Interrupt>
  requires std::is_enum_v<Interrupt>
  void set_level(Interrupt interrupt, bool level) { set_line(static_cast<unsigned>(interrupt), level); }
  virtual void set_line(unsigned interrupt, bool level) = 0;

 protected:
  ~InterruptLines() = default;
};

/// Refuses all accesses that are not 32 bits wide.
inline void require_word(const Access& access, const char* block) {
  if (access.bytes == 4) return;
  throw RefusedAccess(std::string(block) + ": access of " + std::to_string(access.bytes) +
                      " bytes at offset " + std::to_string(access.offset) +
                      ", only 32-bit words are allowed");
}

[[noreturn]] inline void refuse(const Access& access, const char* block, const std::string& why) {
  throw RefusedAccess(std::string(block) + ", offset " + std::to_string(access.offset) + ": " + why);
}

/// Something with events of its own in the board's order of time that is not on the bus.
class OffTheBus : public Peripheral {
 public:
  std::uint32_t read(const Access& access) override { refuse(access, "off the bus", "it has no registers"); }
  void write(const Access& access, std::uint32_t /*value*/) override {
    refuse(access, "off the bus", "it has no registers");
  }
};

}  // namespace kmax::virtual_board
