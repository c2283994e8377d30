// ARMv7-M architecture reference manual, C1.6: DHCSR and DEMCR.

#include "host_tools/virtual_board/cortex_m/core_debug.hpp"

#include <gtest/gtest.h>

#include <cstddef>

namespace kmax::virtual_board::core_debug_test {
namespace {

using namespace drivers::cortex_m;

constexpr std::uint32_t demcr = offsetof(CoreDebugRegisters, demcr);

TEST(CoreDebug, SwitchesTraceOnAndKeepsItOverAReset_Demcr) {
  CoreDebug debug;
  EXPECT_FALSE(debug.trace_enabled());
  debug.write({demcr, 4, 0}, core_debug_demcr::TraceEnable::mask);
  EXPECT_TRUE(debug.trace_enabled());
  EXPECT_EQ(debug.read({demcr, 4, 0}), 1U << 24);
  debug.reset(0);
  EXPECT_TRUE(debug.trace_enabled());
}

TEST(CoreDebug, HasNoDebugger_Dhcsr) {
  CoreDebug debug;
  EXPECT_EQ(debug.read({offsetof(CoreDebugRegisters, dhcsr), 4, 0}), 0U);
  EXPECT_THROW(debug.write({offsetof(CoreDebugRegisters, dhcsr), 4, 0}, 1), RefusedAccess);
  EXPECT_THROW(debug.write({demcr, 4, 0}, 1), RefusedAccess);
  EXPECT_THROW(debug.read({offsetof(CoreDebugRegisters, dcrdr), 4, 0}), RefusedAccess);
}

}  // namespace
}  // namespace kmax::virtual_board::core_debug_test
