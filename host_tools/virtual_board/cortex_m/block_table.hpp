#pragma once

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

}  // namespace kmax::virtual_board
