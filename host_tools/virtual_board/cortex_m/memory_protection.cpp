#include "host_tools/virtual_board/cortex_m/memory_protection.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace kmax::virtual_board {
namespace {

using namespace drivers::cortex_m;

constexpr const char* name = "MPU";
constexpr std::uint32_t alias_begin = offsetof(MpuRegisters, alias);

/// RBAR and RASR appear four times, eight bytes apart.
std::uint32_t without_alias(std::uint32_t offset) {
  return offset < alias_begin ? offset : offsetof(MpuRegisters, rbar) + (offset - alias_begin) % 8;
}

}  // namespace

void MemoryProtection::reset(BoardTime /*now*/) {
  regions_ = {};
  ctrl_ = 0;
  selected_ = 0;
}

bool MemoryProtection::enabled() const {
  return mpu_ctrl::Enable::of(ctrl_) != 0;
}

std::uint32_t MemoryProtection::read(const Access& access) {
  require_word(access, name);
  switch (without_alias(access.offset)) {
    case offsetof(MpuRegisters, type):
      return mpu_type::RegionCount::bits(mpu_region_count);
    case offsetof(MpuRegisters, ctrl):
      return ctrl_;
    case offsetof(MpuRegisters, rnr):
      return selected_;
    case offsetof(MpuRegisters, rbar):
      return regions_[selected_].address | mpu_rbar::Region::bits(selected_);
    default:
      return regions_[selected_].attributes;
  }
}

void MemoryProtection::write(const Access& access, std::uint32_t value) {
  require_word(access, name);
  switch (without_alias(access.offset)) {
    case offsetof(MpuRegisters, type):
      refuse(access, name, "TYPE is read-only");
    case offsetof(MpuRegisters, ctrl): {
      const std::uint32_t known =
          mpu_ctrl::Enable::mask | mpu_ctrl::InFaultHandlers::mask | mpu_ctrl::PrivilegedDefault::mask;
      if ((value & ~known) != 0) refuse(access, name, fmt::format("CTRL = 0x{:X}: unknown bit", value));
      if (mpu_ctrl::Enable::of(value) == 0 && mpu_ctrl::InFaultHandlers::of(value) != 0) {
        refuse(access, name, "HFNMIENA without ENABLE is unpredictable");
      }
      ctrl_ = value;
      return;
    }
    case offsetof(MpuRegisters, rnr):
      if (value >= mpu_region_count) refuse(access, name, fmt::format("region {} of eight", value));
      selected_ = value;
      return;
    case offsetof(MpuRegisters, rbar):
      return write_address(access, value);
    default:
      return write_attributes(access, value);
  }
}

void MemoryProtection::write_address(const Access& access, std::uint32_t value) {
  if (mpu_rbar::Valid::of(value) != 0) {
    const std::uint32_t number = mpu_rbar::Region::of(value);
    if (number >= mpu_region_count) refuse(access, name, fmt::format("region {} of eight", number));
    selected_ = number;
  }
  regions_[selected_].address = value & mpu_rbar::Address::mask;
}

void MemoryProtection::write_attributes(const Access& access, std::uint32_t value) {
  if (mpu_rasr::Enable::of(value) != 0) {
    constexpr std::uint32_t smallest = 4;  // 32 bytes
    const std::uint32_t size_code = mpu_rasr::Size::of(value);
    if (size_code < smallest) {
      refuse(access, name, fmt::format("SIZE = {}: a region has at least 32 bytes", size_code));
    }
    const std::uint32_t below = 0xFFFF'FFFFU >> (31 - size_code);
    const std::uint32_t address = regions_[selected_].address;
    if ((address & below) != 0) {
      refuse(access, name,
             fmt::format("region {} at 0x{:08X} is not aligned to its size", selected_, address));
    }
  }
  regions_[selected_].attributes = value;
}

}  // namespace kmax::virtual_board
