// PM0214, floating-point unit: FPCCR, FPCAR, FPDSCR and the feature registers.

#include "host_tools/virtual_board/cortex_m/floating_point_control.hpp"

#include <gtest/gtest.h>

#include <cstddef>

namespace kmax::virtual_board::floating_point_control_test {
namespace {

using namespace drivers::cortex_m;

constexpr std::uint32_t fpccr = offsetof(FloatingPointRegisters, fpccr);
constexpr std::uint32_t fpcar = offsetof(FloatingPointRegisters, fpcar);

TEST(FloatingPointControl, PreservesLazilyAfterReset_Fpccr) {
  FloatingPointControl control;
  EXPECT_EQ(control.read({fpccr, 4, 0}), 0xC000'0000U);
  EXPECT_TRUE(control.lazy());
  control.write({fpccr, 4, 0}, 0x8000'0000);
  EXPECT_FALSE(control.lazy());
  control.reset(0);
  EXPECT_TRUE(control.lazy());
}

TEST(FloatingPointControl, ShowsThePendingFrame_Fpcar) {
  FloatingPointControl control;
  control.begin_lazy_frame(0x2000'0F38);
  EXPECT_EQ(control.read({fpccr, 4, 0}), 0xC000'0001U);
  EXPECT_EQ(control.read({fpcar, 4, 0}), 0x2000'0F38U);
  control.end_lazy_frame();
  EXPECT_EQ(control.read({fpccr, 4, 0}), 0xC000'0000U);
}

TEST(FloatingPointControl, RefusesOtherModes) {
  FloatingPointControl control;
  EXPECT_THROW(control.write({fpccr, 4, 0}, 0), RefusedAccess);
  EXPECT_THROW(control.write({fpccr, 4, 0}, 0x4000'0000), RefusedAccess);
  EXPECT_THROW(control.write({fpcar, 4, 0}, 0), RefusedAccess);
  EXPECT_NO_THROW(control.write({offsetof(FloatingPointRegisters, fpdscr), 4, 0}, 0));
  EXPECT_THROW(control.write({offsetof(FloatingPointRegisters, fpdscr), 4, 0}, 1U << 24), RefusedAccess);
  EXPECT_THROW(control.read({fpccr, 1, 0}), RefusedAccess);
  EXPECT_EQ(control.read({offsetof(FloatingPointRegisters, mvfr0), 4, 0}), 0x1011'0021U);
  EXPECT_EQ(control.read({offsetof(FloatingPointRegisters, mvfr1), 4, 0}), 0x1100'0011U);
}

}  // namespace
}  // namespace kmax::virtual_board::floating_point_control_test
