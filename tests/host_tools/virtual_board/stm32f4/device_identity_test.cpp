#include "host_tools/virtual_board/stm32f4/device_identity.hpp"

#include <gtest/gtest.h>

#include <cstddef>

// RM0090, chapters Embedded Flash memory interface (one-time programmable bytes), Device electronic signature
// and Debug support (DBG), section MCU debug component (DBGMCU).

namespace kmax::virtual_board::device_identity_test {

std::uint32_t get(DeviceIdentity& model, std::uint32_t address, unsigned bytes) {
  return model.read({address - DeviceIdentity::base, bytes, 0});
}

TEST(DeviceIdentity, WordsWhereTheManualSays) {
  Identity identity{.unique_id = {0x1122'3344, 0x5566'7788, 0x99AA'BBCC}};
  identity.one_time_programmable[5] = 24;
  DeviceIdentity model{identity};
  EXPECT_EQ(get(model, 0x1FFF'7A10, 4), 0x1122'3344U);
  EXPECT_EQ(get(model, 0x1FFF'7A18, 4), 0x99AA'BBCCU);
  EXPECT_EQ(get(model, 0x1FFF'7A13, 1), 0x11U);
  EXPECT_EQ(get(model, 0x1FFF'7A22, 2), 1024U);
  EXPECT_EQ(get(model, 0x1FFF'7805, 1), 24U);
  EXPECT_EQ(get(model, 0x1FFF'79FC, 4), 0xFFFF'FFFFU);
  EXPECT_EQ(get(model, 0x1FFF'7A0C, 4), 0xFFFF'FFFFU) << "lock bytes: open";
}

TEST(DeviceIdentity, NothingIsProgrammed) {
  DeviceIdentity model;
  EXPECT_EQ(get(model, 0x1FFF'7800, 4), 0xFFFF'FFFFU);
}

TEST(DeviceIdentity, HolesAndWritesAreRefused) {
  DeviceIdentity model;
  EXPECT_THROW(get(model, 0x1FFF'7A1C, 4), RefusedAccess);
  EXPECT_THROW(get(model, 0x1FFF'7A20, 4), RefusedAccess) << "only half of it is the flash size";
  EXPECT_THROW(get(model, 0x1FFF'7A24, 4), RefusedAccess);
  EXPECT_THROW(model.write({0, 4, 0}, 0), RefusedAccess);
}

using drivers::stm32f4::DbgmcuRegisters;

TEST(Dbgmcu, IdentityAndFreezeBits) {
  DbgmcuModel model;
  EXPECT_EQ(model.read({0, 4, 0}) & 0xFFFU, 0x413U);
  model.write({offsetof(DbgmcuRegisters, apb1_fz), 4, 0}, 1U << 12);
  model.write({offsetof(DbgmcuRegisters, apb2_fz), 4, 0}, 3);
  model.reset(0);
  EXPECT_EQ(model.read({offsetof(DbgmcuRegisters, apb1_fz), 4, 0}), 1U << 12) << "power-on reset only";
  EXPECT_EQ(model.read({offsetof(DbgmcuRegisters, apb2_fz), 4, 0}), 3U);
}

TEST(Dbgmcu, RefusesTheRest) {
  DbgmcuModel model;
  EXPECT_THROW(model.write({0, 4, 0}, 0), RefusedAccess) << "IDCODE";
  EXPECT_THROW(model.write({4, 4, 0}, 1), RefusedAccess) << "DBG_SLEEP";
  EXPECT_THROW(model.write({offsetof(DbgmcuRegisters, apb1_fz), 4, 0}, 1U << 11), RefusedAccess) << "WWDG";
  EXPECT_THROW(model.write({offsetof(DbgmcuRegisters, apb2_fz), 4, 0}, 1U << 16), RefusedAccess) << "TIM9";
  EXPECT_THROW(model.read({16, 4, 0}), RefusedAccess);
  EXPECT_THROW(model.read({0, 2, 0}), RefusedAccess);
}

}  // namespace kmax::virtual_board::device_identity_test
