#include "host_tools/virtual_board/bus.hpp"

#include <bit>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

namespace kmax::virtual_board {
namespace {

static_assert(std::endian::native == std::endian::little, "memory is shared with a little-endian processor");

/// Neither zeros nor ones: a program that relies on cleared memory shows it.
constexpr std::uint8_t power_up_pattern = 0xA5;
constexpr std::uint32_t waits_of(std::uint32_t address) {
  switch (address >> 16) {
    case 0x4000:
      return 10;
    case 0x4001:
      return 5;
    case 0x4002:
      return 1;
    default:
      return 0;
  }
}
constexpr AddressRange flash_at_zero{0, memory_map::flash.size};

}  // namespace

Bus::Bus()
    : flash_(memory_map::flash.size, 0xFF),
      sram_(memory_map::sram.size, power_up_pattern),
      ccm_(memory_map::ccm.size, power_up_pattern) {
  for (std::size_t area = 0; area < pages_.size(); ++area) {
    pages_[area].resize(memory_map::register_areas[area].size >> page_shift);
  }
}

void Bus::attach(std::uint32_t base, std::uint32_t size, std::string name, Peripheral& block,
                 std::function<bool()> clocked) {
  const auto complain = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("{} at 0x{:08X}, {} bytes: {}", name, base, size, why));
  };
  if (size == 0 || size % 4 != 0 || base % 4 != 0)
    complain("base and size must be multiples of 4, size not 0");
  for (std::size_t area = 0; area < pages_.size(); ++area) {
    const AddressRange range = memory_map::register_areas[area];
    if (!range.contains(base) || size > range.size - (base - range.base)) continue;
    for (const auto& other : blocks_) {
      if (other->range.contains(base) || AddressRange{base, size}.contains(other->range.base)) {
        complain("overlaps " + other->name);
      }
    }
    blocks_.push_back(std::make_unique<Block>(
        Block{AddressRange{base, size}, std::move(name), &block, std::move(clocked)}));
    const std::uint32_t first = (base - range.base) >> page_shift;
    const std::uint32_t last = (base - range.base + size - 1) >> page_shift;
    for (std::uint32_t page = first; page <= last; ++page) pages_[area][page].push_back(blocks_.back().get());
    return;
  }
  complain("not inside a register area of the part");
}

const Bus::Block* Bus::find(std::uint32_t address) const {
  if (last_found_ != nullptr && last_found_->range.contains(address)) return last_found_;
  for (std::size_t area = 0; area < pages_.size(); ++area) {
    const AddressRange range = memory_map::register_areas[area];
    if (!range.contains(address)) continue;
    for (const Block* block : pages_[area][(address - range.base) >> page_shift]) {
      if (block->range.contains(address)) return last_found_ = block;
    }
    return nullptr;
  }
  return nullptr;
}

const Bus::Block& Bus::block_for(std::uint32_t address, unsigned bytes) const {
  const Block* block = find(address);
  if (block == nullptr) throw RefusedAccess("there is nothing at this address");
  if (address % bytes != 0) throw RefusedAccess(block->name + ": the access is not aligned to its width");
  if (block->clocked && !block->clocked())
    throw RefusedAccess(block->name + ": its clock is off (RCC enable bit)");
  return *block;
}

std::uint32_t Bus::read(std::uint32_t address, unsigned bytes, BoardTime now) {
  if (memory_map::parameters.contains(address)) {
    std::uint32_t value = 0;
    std::memcpy(&value, flash_.data() + (address - memory_map::flash.base), bytes);
    return value;
  }
  const Block& block = block_for(address, bytes);
  register_waits_ += waits_of(address);
  return block.peripheral->read({address - block.range.base, bytes, now});
}

void Bus::write(std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now) {
  if (memory_map::parameters.contains(address)) {
    if (!parameter_store_)
      throw RefusedAccess("store to the parameter sectors, but no flash controller is there");
    parameter_store_(address, bytes, value, now);
    return;
  }
  const Block& block = block_for(address, bytes);
  register_waits_ += waits_of(address);
  block.peripheral->write({address - block.range.base, bytes, now}, value);
}

std::span<std::uint8_t> Bus::memory(std::uint32_t address, std::size_t size) {
  if (sram_at_zero_ && memory_map::sram1_at_zero.contains(address)) address += memory_map::sram1.base;
  const auto within = [&](AddressRange range, std::vector<std::uint8_t>& bytes) -> std::span<std::uint8_t> {
    if (!range.contains(address) || size > range.size - (address - range.base)) return {};
    return std::span(bytes).subspan(address - range.base, size);
  };
  if (auto found = within(memory_map::sram, sram_); !found.empty()) return found;
  if (auto found = within(memory_map::flash, flash_); !found.empty()) return found;
  return within(memory_map::ccm, ccm_);
}

std::optional<std::uint32_t> Bus::load(std::uint32_t address) const {
  if (!sram_at_zero_ && flash_at_zero.contains(address)) address += memory_map::flash.base;
  const auto bytes = const_cast<Bus*>(this)->memory(address, 4);
  if (bytes.empty()) return std::nullopt;
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

bool Bus::store(std::uint32_t address, std::uint32_t value) {
  if (memory_map::flash.contains(address) || memory_map::sram1_at_zero.contains(address)) return false;
  const auto bytes = memory(address, 4);
  if (bytes.empty()) return false;
  std::memcpy(bytes.data(), &value, sizeof value);
  return true;
}

std::string Bus::block_name(std::uint32_t address) const {
  if (memory_map::parameters.contains(address)) return "flash parameter sectors";
  const Block* block = find(address);
  return block == nullptr ? "" : block->name;
}

}  // namespace kmax::virtual_board
