#include "host_tools/virtual_board/cortex_m/block_table.hpp"

#include <bit>

namespace kmax::virtual_board {

namespace {

/// How many instructions an IT governs, 1 to 4 (ARMv7-M, A7.7.38: by the lowest set bit of its mask); 0: it
/// is none.
unsigned if_then_length(std::uint16_t half_word) {
  const unsigned mask = half_word & 0xFU;
  if ((half_word & 0xFF00U) != 0xBF00U || mask == 0) return 0;
  return 4U - static_cast<unsigned>(std::countr_zero(mask));
}

}  // namespace

const Block& BlockTable::add(std::uint32_t address, std::span<const std::uint8_t> code) {
  auto block = std::make_unique<Block>();
  block->address = address;
  block->size = static_cast<std::uint32_t>(code.size());
  const auto half_word = [&](std::size_t at) {
    if (at + 2 > code.size()) return std::uint16_t{0};
    return static_cast<std::uint16_t>(code[at] | code[at + 1] << 8);
  };
  Instruction previous;
  unsigned governed = 0;  // instructions that an IT still makes conditional
  for (std::uint32_t at = 0; at < block->size;) {
    const Instruction instruction = decode(half_word(at), half_word(at + 2), address + at);
    ++block->instructions;
    block->cycles += instruction.cycles - cycles_saved_behind(previous, instruction);
    previous = instruction;
    block->cycles_if_taken = instruction.cycles_if_taken;  // only the last one can branch
    if (instruction.floating_point && !block->floating_point) {
      block->floating_point = true;
      block->first_floating_point = address + at;
    }
    if (instruction.memory) {
      block->memory.push_back({static_cast<std::uint16_t>(at),
                               static_cast<std::uint16_t>(block->instructions), block->cycles,
                               *instruction.memory});
    }
    if (const unsigned length = if_then_length(half_word(at)); length != 0) {
      governed = length;
    } else if (governed != 0) {
      --governed;
    }
    at += instruction.bytes;
  }
  block->ends_inside_if_then = governed != 0;
  block->endless = block->size == 2 && half_word(0) == 0xE7FE;
  const Block& added = *block;
  blocks_[key(address, added.size)] = std::move(block);
  slots_[address / 2 % slot_count] = &added;
  return added;
}

}  // namespace kmax::virtual_board
