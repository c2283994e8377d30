#include "drivers/cortex_m/cycle_counter.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::cortex_m::cycle_counter_test {

struct FakeDwt {
  FakeRegister ctrl, cyccnt;
};
struct FakeCoreDebug {
  FakeRegister demcr;
};

TEST(CycleCounter, TraceIsEnabledBeforeTheCounterIsTouched) {
  FakeDwt dwt;
  FakeCoreDebug core_debug;
  dwt.ctrl.value = 0x4000'0000;
  dwt.cyccnt.value = 77;
  core_debug.demcr.value = 1;
  dwt.ctrl.on_write =
      dwt.cyccnt.on_write = [&](std::uint32_t) { EXPECT_EQ(core_debug.demcr.value, 0x0100'0001U); };
  CycleCounter<FakeDwt, FakeCoreDebug> counter{dwt, core_debug};
  EXPECT_TRUE(counter.start());
  EXPECT_EQ(dwt.ctrl.value, 0x4000'0001U);
  EXPECT_EQ(counter.now(), 0U);
}

TEST(CycleCounter, DifferencesOutliveTheWrap) {
  FakeDwt dwt;
  FakeCoreDebug core_debug;
  const CycleCounter<FakeDwt, FakeCoreDebug> counter{dwt, core_debug};
  dwt.cyccnt.value = 5;
  EXPECT_EQ(counter.since(0xFFFF'FFF0), 21U);
}

TEST(CycleCounter, MissingCounterIsReported) {
  FakeDwt without;
  FakeCoreDebug core_debug;
  without.ctrl.value = 1U << 25;
  EXPECT_FALSE((CycleCounter<FakeDwt, FakeCoreDebug>{without, core_debug}.start()));
  FakeDwt dead;
  dead.ctrl.on_read = [](std::uint32_t) { return 0U; };
  EXPECT_FALSE((CycleCounter<FakeDwt, FakeCoreDebug>{dead, core_debug}.start()));
}

}  // namespace kmax::drivers::cortex_m::cycle_counter_test
