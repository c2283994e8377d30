#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "host_tools/virtual_board/cortex_m/instruction.hpp"

// What each block of instructions costs, worked out when it is met for the first time and remembered by
// address and size.
//
// Cost of a look-up: one array access for blocks whose slot nobody else has taken, a hash table's otherwise.
// Code that is changed after it has run keeps its old costs.

namespace kmax::virtual_board {

/// A load or store of a block, with the counts from the block's beginning to this instruction's end.
struct MemoryInstruction {
  std::uint16_t position;  ///< bytes from the block's beginning
  std::uint16_t instructions;
  std::uint32_t cycles;
  MemoryOperand operand;
};

struct Block {
  std::uint32_t address = 0;
  std::uint32_t size = 0;
  std::uint32_t instructions = 0;
  std::uint32_t cycles = 0;
  std::uint32_t cycles_if_taken = 0;  ///< more, when the block does not go on to the one behind it
  bool floating_point = false;
  std::uint32_t first_floating_point = 0;  ///< address
  /// Cut by the end of a page (1 KiB) between an IT instruction and the last one that it governs.
  bool ends_inside_if_then = false;
  bool endless = false;  ///< a branch to itself, and nothing else
  std::vector<MemoryInstruction> memory;
};

class BlockTable {
 public:
  BlockTable() : slots_(slot_count, nullptr) {}

  /// None when the block was not met before.
  const Block* find(std::uint32_t address, std::uint32_t size) {
    const Block*& slot = slots_[address / 2 % slot_count];
    if (slot != nullptr && slot->address == address && slot->size == size) return slot;
    const auto found = blocks_.find(key(address, size));
    if (found == blocks_.end()) return nullptr;
    return slot = found->second.get();
  }

  /// Decodes the block from its bytes.
  const Block& add(std::uint32_t address, std::span<const std::uint8_t> code);

 private:
  static constexpr std::size_t slot_count = 1U << 16;
  static std::uint64_t key(std::uint32_t address, std::uint32_t size) {
    return std::uint64_t{size} << 32 | address;
  }

  std::vector<const Block*> slots_;
  std::unordered_map<std::uint64_t, std::unique_ptr<Block>> blocks_;
};

/// Finds out which instruction of a block makes an access. The emulator tells address and direction of an
/// access but not its program counter; it does have the core registers up to date. The effective address of
/// every load and store that may come next is therefore compared with the accessed one.
///
/// When two instructions qualify the earlier one is taken. It is wrong only if that one was executed already
/// on other memory (not on registers) with a base that has since changed, or was skipped by IT.
class AccessLocator {
 public:
  void begin_block(const Block& block) {
    block_ = &block;
    next_ = 0;
    words_left_ = 0;
  }

  /// `core_register(n)` gives r0 to r15. None when no instruction qualifies.
  template <typename CoreRegister>
  const MemoryInstruction* locate(std::uint32_t address, bool store, CoreRegister core_register) {
    // The base of a multiple access may have been loaded meanwhile; only the first of its words is looked
    // for.
    if (words_left_ != 0 && address == expected_) {
      --words_left_;
      expected_ += 4;
      offset_ += 4;
      return &block_->memory[next_ - 1];
    }
    for (std::size_t index = next_; index < block_->memory.size(); ++index) {
      const MemoryInstruction& candidate = block_->memory[index];
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
  const Block* block_ = nullptr;
  std::size_t next_ = 0;
  std::uint32_t words_left_ = 0;
  std::uint32_t expected_ = 0;
  std::uint32_t offset_ = 0;  // of the located access in its instruction's
  std::uint32_t span_ = 0;
};

}  // namespace kmax::virtual_board
