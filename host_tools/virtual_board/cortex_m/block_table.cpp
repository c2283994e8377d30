#include "host_tools/virtual_board/cortex_m/block_table.hpp"

#include <bit>
#include <stdexcept>

namespace kmax::virtual_board {

namespace {

/// How many instructions an IT governs, 1 to 4 (ARMv7-M, A7.7.38: by the lowest set bit of its mask); 0: it
/// is none.
unsigned if_then_length(std::uint16_t half_word) {
  const unsigned mask = half_word & 0xFU;
  if ((half_word & 0xFF00U) != 0xBF00U || mask == 0) return 0;
  return 4U - static_cast<unsigned>(std::countr_zero(mask));
}

std::uint16_t half_word(std::span<const std::uint8_t> code, std::size_t at) {
  if (at + 2 > code.size()) return 0;
  return static_cast<std::uint16_t>(code[at] | code[at + 1] << 8);
}

Instruction decoded(std::uint32_t address, std::span<const std::uint8_t> code, std::uint32_t at) {
  return decode(half_word(code, at), half_word(code, at + 2), address + at);
}

}  // namespace

std::uint32_t first_floating_point(std::uint32_t address, std::span<const std::uint8_t> code) {
  std::uint32_t at = 0;
  while (at < code.size() && !decoded(address, code, at).floating_point)
    at += decoded(address, code, at).bytes;
  return address + at;
}

const Block* BlockTable::find_elsewhere(std::uint32_t address, std::uint32_t size, std::uint32_t& slot) {
  const auto found = places_.find(key(address, size));
  if (found == places_.end()) return nullptr;
  slot = found->second;
  return &blocks_[slot];
}

const Block& BlockTable::add(std::uint32_t address, std::span<const std::uint8_t> code) {
  if (code.size() > longest_block) throw std::length_error("a block of instructions is longer than its page");
  Block block;
  block.address = address;
  block.size = static_cast<std::uint16_t>(code.size());
  block.first_memory_instruction = static_cast<std::uint32_t>(memory_.size());
  Instruction previous;
  unsigned governed = 0;  // instructions that an IT still makes conditional
  std::uint32_t cycles = 0, instructions = 0;
  for (std::uint32_t at = 0; at < code.size();) {
    const Instruction instruction = decoded(address, code, at);
    ++instructions;
    cycles += instruction.cycles - cycles_saved_behind(previous, instruction);
    previous = instruction;
    block.cycles_if_taken = instruction.cycles_if_taken & 0xF;  // only the last one can branch
    if (instruction.floating_point) block.floating_point = 1;
    if (instruction.memory) {
      memory_.push_back({static_cast<std::uint16_t>(at), static_cast<std::uint16_t>(instructions), cycles,
                         *instruction.memory});
    }
    if (const unsigned length = if_then_length(half_word(code, at)); length != 0) {
      governed = length;
    } else if (governed != 0) {
      --governed;
    }
    at += instruction.bytes;
  }
  block.cycles = static_cast<std::uint16_t>(cycles);
  block.instructions = instructions & 0x3FF;
  block.memory_instructions = (memory_.size() - block.first_memory_instruction) & 0x3FF;
  block.ends_inside_if_then = governed != 0 ? 1 : 0;
  block.endless = block.size == 2 && half_word(code, 0) == 0xE7FE ? 1 : 0;
  places_[key(address, block.size)] = slots_[address / 2 % slot_count] =
      static_cast<std::uint32_t>(blocks_.size());
  return blocks_.emplace_back(block);
}

}  // namespace kmax::virtual_board
