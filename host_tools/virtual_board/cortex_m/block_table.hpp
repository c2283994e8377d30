#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <unordered_map>
#include <vector>

#include "host_tools/virtual_board/cortex_m/instruction.hpp"

// What each block of instructions costs, worked out when it is met for the first time and remembered by
// address and size.
//
// Cost of a look-up: two accesses, to the slot and to the block, where nobody else has taken the slot, a
// hash table's otherwise. A tick of the firmware begins some hundred blocks, so that the cache lines that
// they take are what counts: slots and blocks are small, and blocks lie in the order in which they were met.
// Code that is changed after it has run keeps its old costs.

namespace kmax::virtual_board {

/// A load or store of a block, with the counts from the block's beginning to this instruction's end.
struct MemoryInstruction {
  std::uint16_t position;  ///< bytes from the block's beginning
  std::uint16_t instructions;
  std::uint32_t cycles;
  MemoryOperand operand;
};

/// Blocks end with their page, which is 1 KiB.
inline constexpr std::size_t longest_block = 1024;

struct Block {
  std::uint32_t address = 0;
  std::uint32_t first_memory_instruction = 0;  ///< BlockTable::memory_instructions()
  std::uint16_t size = 0;
  std::uint16_t cycles = 0;
  std::uint32_t instructions : 10 = 0;
  std::uint32_t memory_instructions : 10 = 0;
  std::uint32_t cycles_if_taken : 4 = 0;  ///< more, when the block does not go on to the one behind it
  std::uint32_t floating_point : 1 = 0;   ///< there is such an instruction in it
  /// Cut by the end of a page between an IT instruction and the last one that it governs.
  std::uint32_t ends_inside_if_then : 1 = 0;
  std::uint32_t endless : 1 = 0;  ///< a branch to itself, and nothing else

  std::uint32_t end() const { return address + size; }
};
static_assert(sizeof(Block) == 16, "four in a cache line");

/// Address of the first floating-point instruction of a block's bytes; their end where there is none.
std::uint32_t first_floating_point(std::uint32_t address, std::span<const std::uint8_t> code);

class BlockTable {
 public:
  BlockTable() : slots_(slot_count, 0), blocks_(1) {}

  /// None when the block was not met before. A block stays where it is.
  const Block* find(std::uint32_t address, std::uint32_t size) {
    std::uint32_t& slot = slots_[address / 2 % slot_count];
    const Block& block = blocks_[slot];
    if (block.address == address && block.size == size && slot != 0) return &block;
    return find_elsewhere(address, size, slot);
  }

  /// Decodes the block from its bytes. Throws std::length_error when they are more than `longest_block`.
  const Block& add(std::uint32_t address, std::span<const std::uint8_t> code);

  /// The loads and stores of one of its blocks, in their order.
  std::span<const MemoryInstruction> memory_instructions(const Block& block) const {
    return std::span(memory_).subspan(block.first_memory_instruction, block.memory_instructions);
  }

 private:
  static constexpr std::size_t slot_count = 1U << 16;
  static std::uint64_t key(std::uint32_t address, std::uint32_t size) {
    return std::uint64_t{size} << 32 | address;
  }
  const Block* find_elsewhere(std::uint32_t address, std::uint32_t size, std::uint32_t& slot);

  std::vector<std::uint32_t> slots_;       ///< places in blocks_; 0: none
  std::deque<Block> blocks_;               ///< behind one that stands for none
  std::vector<MemoryInstruction> memory_;  ///< of all blocks, one behind the other
  std::unordered_map<std::uint64_t, std::uint32_t> places_;
};

/// Finds out which instruction of a block makes an access. The emulator tells address and direction of an
/// access but not its program counter; it does have the core registers up to date. The effective address of
/// every load and store that may come next is therefore compared with the accessed one.
///
/// When two instructions qualify the earlier one is taken. It is wrong only if that one was executed already
/// on other memory (not on registers) with a base that has since changed, or was skipped by IT.
class AccessLocator {
 public:
  void begin_block() {
    next_ = 0;
    words_left_ = 0;
  }

  /// In `block`, its loads and stores. `core_register(n)` gives r0 to r15. None when no instruction
  /// qualifies.
  template <typename CoreRegister>
  const MemoryInstruction* locate(std::span<const MemoryInstruction> block, std::uint32_t address, bool store,
                                  CoreRegister core_register) {
    // The base of a multiple access may have been loaded meanwhile; only the first of its words is looked
    // for.
    if (words_left_ != 0 && address == expected_) {
      --words_left_;
      expected_ += 4;
      offset_ += 4;
      return &block[next_ - 1];
    }
    for (std::size_t index = next_; index < block.size(); ++index) {
      const MemoryInstruction& candidate = block[index];
      const MemoryOperand& operand = candidate.operand;
      if (operand.store != store) continue;
      std::uint32_t effective = operand.offset;
      if (operand.base != MemoryOperand::no_register) effective += core_register(operand.base);
      if (operand.index != MemoryOperand::no_register)
        effective += core_register(operand.index) << operand.shift;
      if (address - effective >= operand.span) continue;
      offset_ = address - effective;
      span_ = operand.span;
      next_ = index + 1;
      expected_ = address + 4;
      words_left_ = (operand.span - (address - effective) + 3) / 4 - 1;
      return &candidate;
    }
    return nullptr;
  }

  /// The located access, `bytes` wide, is a piece of one that is not aligned: the emulator takes such apart.
  bool is_piece(unsigned bytes) const { return offset_ % 4 != 0 || bytes < (span_ < 4 ? span_ : 4U); }

 private:
  std::size_t next_ = 0;
  std::uint32_t words_left_ = 0;
  std::uint32_t expected_ = 0;
  std::uint32_t offset_ = 0;  // of the located access in its instruction's
  std::uint32_t span_ = 0;
};

}  // namespace kmax::virtual_board
