#pragma once

#include <array>
#include <cstdint>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// Memory protection unit, PM0214: eight regions, kept and checked for being well-formed. Enabling it is
// accepted, but NOTHING IS PROTECTED: an access that a region forbids goes through. What the memory map
// itself forbids (no code from CCM, no store to flash, nothing where there is nothing) holds with and without
// it.

namespace kmax::virtual_board {

class MemoryProtection final : public Peripheral {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::MpuRegisters);

  struct Region {
    std::uint32_t address = 0;
    std::uint32_t attributes = 0;
  };

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

  bool enabled() const;
  const Region& region(unsigned number) const { return regions_[number]; }

 private:
  void write_address(const Access& access, std::uint32_t value);
  void write_attributes(const Access& access, std::uint32_t value);

  std::array<Region, drivers::cortex_m::mpu_region_count> regions_{};
  std::uint32_t ctrl_ = 0;
  std::uint32_t selected_ = 0;
};

}  // namespace kmax::virtual_board
