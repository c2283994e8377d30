#include "drivers/cortex_m/memory_protection.hpp"

#include <gtest/gtest.h>

#include <array>

namespace kmax::drivers::cortex_m::memory_protection_test {

// PM0214, MPU region attribute and size register.
TEST(ProtectedRegion, ItsAttributesAreThoseOfTheRegister_Rasr) {
  constexpr ProtectedRegion code{0x0800'0000, 20, MemoryRights::read_execute, MemoryKind::flash};
  EXPECT_EQ(code.attributes(), 0x0502'0027U);
  constexpr ProtectedRegion parameters{0x0800'0000, 16, MemoryRights::read_write, MemoryKind::flash, 0xC3};
  EXPECT_EQ(parameters.attributes(), 0x1102'C31FU);
  constexpr ProtectedRegion ram{0x2000'0000, 17, MemoryRights::read_write, MemoryKind::ram};
  EXPECT_EQ(ram.attributes(), 0x1106'0021U);
  constexpr ProtectedRegion peripherals{0x4000'0000, 29, MemoryRights::read_write, MemoryKind::peripherals};
  EXPECT_EQ(peripherals.attributes(), 0x1105'0039U);
  constexpr ProtectedRegion read_only{0x1FFF'0000, 15, MemoryRights::read, MemoryKind::flash};
  EXPECT_EQ(read_only.attributes(), 0x1502'001DU);
}

TEST(ProtectedRegion, IsAlignedToItsSizeAndHasEighthsFrom256Bytes_Rbar) {
  const auto region = [](std::uint32_t base, unsigned log2, std::uint8_t left_out) {
    return ProtectedRegion{base, log2, MemoryRights::read, MemoryKind::ram, left_out};
  };
  EXPECT_TRUE(region(0x2000'0020, 5, 0).valid());
  EXPECT_FALSE(region(0x2000'0010, 5, 0).valid());
  EXPECT_FALSE(region(0x2000'0000, 4, 0).valid());
  EXPECT_FALSE(region(0x2000'0000, 7, 1).valid());
  EXPECT_TRUE(region(0x2000'0000, 8, 1).valid());
  EXPECT_TRUE(region(0x8000'0000, 31, 0).valid());
  EXPECT_FALSE(region(0, 32, 0).valid());
}

TEST(ProtectMemory, EnablesTheUnitWithoutTheDefaultMap_Ctrl) {
  MpuRegisters unit{};
  unit.rasr = 1;  // what a boot loader may have left
  protect_memory(unit,
                 std::array{ProtectedRegion{0x2000'0000, 17, MemoryRights::read_write, MemoryKind::ram}});
  EXPECT_EQ(unit.ctrl, mpu_ctrl::Enable::mask);
  EXPECT_EQ(unit.rnr, mpu_region_count - 1) << "all regions are written";
  EXPECT_EQ(unit.rasr, 0U) << "those that are not used are switched off";
}

}  // namespace kmax::drivers::cortex_m::memory_protection_test
