#include "host_tools/virtual_board/stm32f4/dbgmcu.hpp"

#include <gtest/gtest.h>

#include <cstddef>

// RM0090, chapter Debug support (DBG), section MCU debug component (DBGMCU).

namespace kmax::virtual_board::dbgmcu_test {
namespace {

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

}  // namespace
}  // namespace kmax::virtual_board::dbgmcu_test
