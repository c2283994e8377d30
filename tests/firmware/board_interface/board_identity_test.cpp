#include "firmware/board_interface/board_identity.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::board_identity_test {
namespace {

// What info.* and supply.ceiling say of a board that does not know.
TEST(BoardIdentity, ItsDefaults) {
  const BoardIdentity unknown;
  EXPECT_EQ(unknown.board_name, "unnamed");
  EXPECT_EQ(unknown.serial_number, 0u);
  EXPECT_EQ(unknown.core_clock_hz, 0u);
  EXPECT_EQ(unknown.clock_source, 0);
  EXPECT_EQ(unknown.brown_out_level, 4) << "unknown";
  EXPECT_EQ(unknown.reset_cause, ResetCause::unknown);
  EXPECT_EQ(unknown.lock_attempts, nullptr);
  EXPECT_EQ(unknown.supply_ceiling, 0.0f);
}

}  // namespace
}  // namespace kmax::firmware::board_identity_test
