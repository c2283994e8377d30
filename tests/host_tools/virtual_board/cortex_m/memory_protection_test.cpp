// PM0214, memory protection unit.

#include "host_tools/virtual_board/cortex_m/memory_protection.hpp"

#include <gtest/gtest.h>

#include <cstddef>

namespace kmax::virtual_board::memory_protection_test {
namespace {

using namespace drivers::cortex_m;

constexpr std::uint32_t ctrl = offsetof(MpuRegisters, ctrl);
constexpr std::uint32_t rnr = offsetof(MpuRegisters, rnr);
constexpr std::uint32_t rbar = offsetof(MpuRegisters, rbar);
constexpr std::uint32_t rasr = offsetof(MpuRegisters, rasr);

struct Unit {
  std::uint32_t read(std::uint32_t offset) { return mpu.read({offset, 4, 0}); }
  void write(std::uint32_t offset, std::uint32_t value) { mpu.write({offset, 4, 0}, value); }
  MemoryProtection mpu;
};

std::uint32_t attributes(std::uint32_t size) {
  return mpu_rasr::Enable::mask | mpu_rasr::Size::bits(size);
}

TEST(MemoryProtection, KeepsEightRegions_RbarRasr) {
  Unit unit;
  EXPECT_EQ(unit.read(0), 8U << 8);
  for (std::uint32_t region = 0; region < 8; ++region) {
    unit.write(rnr, region);
    unit.write(rbar, 0x2000'0000 + 0x100 * region);
    unit.write(rasr, attributes(7));
  }
  for (std::uint32_t region = 0; region < 8; ++region) {
    unit.write(rnr, region);
    EXPECT_EQ(unit.read(rbar), 0x2000'0000 + 0x100 * region + region);
    EXPECT_EQ(unit.read(rasr), attributes(7));
  }
}

TEST(MemoryProtection, SelectsTheRegionThroughRbar_Valid) {
  Unit unit;
  unit.write(rbar, 0x1000'0000 | mpu_rbar::Valid::mask | 5);
  unit.write(rasr, attributes(15));
  EXPECT_EQ(unit.read(rnr), 5U);
  EXPECT_EQ(unit.mpu.region(5).address, 0x1000'0000U);
  unit.write(rbar + 8, 0x2000'0000 | mpu_rbar::Valid::mask | 6);  // RBAR_A1, RASR_A1
  unit.write(rasr + 8, attributes(4));
  EXPECT_EQ(unit.mpu.region(6).address, 0x2000'0000U);
  EXPECT_EQ(unit.mpu.region(6).attributes, attributes(4));
  EXPECT_EQ(unit.mpu.region(5).attributes, attributes(15));
}

TEST(MemoryProtection, AcceptsBeingEnabled_Ctrl) {
  Unit unit;
  EXPECT_FALSE(unit.mpu.enabled());
  unit.write(ctrl, mpu_ctrl::Enable::mask | mpu_ctrl::PrivilegedDefault::mask);
  EXPECT_TRUE(unit.mpu.enabled());
  EXPECT_THROW(unit.write(ctrl, mpu_ctrl::InFaultHandlers::mask), RefusedAccess);
  EXPECT_THROW(unit.write(ctrl, 8), RefusedAccess);
  unit.mpu.reset(0);
  EXPECT_FALSE(unit.mpu.enabled());
}

TEST(MemoryProtection, RefusesRegionsThatTheUnitCannotHave) {
  Unit unit;
  EXPECT_THROW(unit.write(rnr, 8), RefusedAccess);
  EXPECT_THROW(unit.write(rbar, mpu_rbar::Valid::mask | 9), RefusedAccess);
  EXPECT_THROW(unit.write(0, 0), RefusedAccess);
  unit.write(rbar, 0x2000'0020);
  EXPECT_NO_THROW(unit.write(rasr, attributes(4)));
  EXPECT_THROW(unit.write(rasr, attributes(3)), RefusedAccess) << "16 bytes";
  EXPECT_THROW(unit.write(rasr, attributes(5)), RefusedAccess) << "not aligned to 64 bytes";
  unit.write(rbar, 0);
  EXPECT_NO_THROW(unit.write(rasr, attributes(31))) << "all of the address space";
  EXPECT_THROW(unit.mpu.read({0, 2, 0}), RefusedAccess);
}

}  // namespace
}  // namespace kmax::virtual_board::memory_protection_test
