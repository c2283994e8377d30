// PM0214, system timer; and the driver drivers/cortex_m/system_tick.hpp on the model.

#include "host_tools/virtual_board/cortex_m/system_tick.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::system_tick_test {

using namespace drivers::cortex_m;
constexpr unsigned tick = exception_number::system_tick;
constexpr BoardTime cycle = 2;

constexpr std::size_t ctrl = offsetof(SystemTickRegisters, ctrl);
constexpr std::size_t load = offsetof(SystemTickRegisters, load);
constexpr std::size_t val = offsetof(SystemTickRegisters, val);
constexpr std::uint32_t running = 7;

struct Timer : testing::ModelBench {
  Timer() : ModelBench({&timer}) {
    exceptions.reset();
    clocks.core = cycle;
  }
  void start(std::uint32_t reload) {
    write(load, reload);
    write(val, 0);
    write(ctrl, running);
  }
  void pass(BoardTime cycles) { run(cycles * cycle); }
  bool take() {
    const bool pending = exceptions.pending(tick);
    exceptions.clear_pending(tick);
    return pending;
  }

  ExceptionTable exceptions{82};
  SystemTick timer{clocks, exceptions};
};

TEST(SystemTickModel, StandsWhileTheCoreIsHalted) {
  Timer timer;
  timer.start(999);
  timer.pass(400);
  const std::uint32_t value = timer.read(val);
  timer.timer.halt(timer.now);
  timer.pass(1'000'000);
  EXPECT_FALSE(timer.take());
  timer.timer.resume(timer.now);
  EXPECT_EQ(timer.read(val), value);
  timer.pass(value);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, CountsDownFromTheReloadValueAndTicksAtTheStepToZero) {
  Timer timer;
  timer.start(9);
  EXPECT_EQ(timer.read(val), 0U);
  for (int round = 0; round < 3; ++round) {
    for (std::uint32_t expected = 9; expected > 0; --expected) {
      timer.pass(1);
      EXPECT_EQ(timer.read(val), expected);
      EXPECT_FALSE(timer.take());
    }
    timer.pass(1);
    EXPECT_EQ(timer.read(val), 0U);
    EXPECT_TRUE(timer.take());
  }
}

TEST(SystemTickModel, ShowsTheEventExactly) {
  Timer timer;
  timer.start(167'999);
  EXPECT_EQ(timer.timer.next_event(), 1000 + 168'000 * cycle);
  timer.pass(168'000 * 5 + 1);
  EXPECT_EQ(timer.timer.next_event(), 1000 + 6 * 168'000 * cycle);
}

TEST(SystemTickModel, ClearsCountFlagByReadingIt_CountFlag) {
  Timer timer;
  timer.start(3);
  EXPECT_EQ(timer.read(ctrl), running);
  timer.pass(4);
  EXPECT_EQ(timer.read(ctrl), running | system_tick_ctrl::CountFlag::mask);
  EXPECT_EQ(timer.read(ctrl), running);
  timer.pass(4);
  timer.write(val, 123);
  EXPECT_EQ(timer.read(ctrl), running) << "writing VAL clears it";
  EXPECT_EQ(timer.read(val), 0U) << "whatever is written";
}

TEST(SystemTickModel, IsUpToDateWhenAskedAfterItsEvent) {
  Timer timer;
  timer.start(9);
  timer.now += 25 * cycle;
  EXPECT_EQ(timer.read(val), 5U);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, RaisesNoInterruptUnlessAsked_Tickint) {
  Timer timer;
  timer.write(load, 9);
  timer.write(ctrl, system_tick_ctrl::Enable::mask | system_tick_ctrl::ProcessorClock::mask);
  timer.pass(100);
  EXPECT_FALSE(timer.take());
  EXPECT_NE(timer.read(ctrl) & system_tick_ctrl::CountFlag::mask, 0U);
  timer.pass(3);
  timer.write(ctrl, running);
  EXPECT_EQ(timer.read(val), 7U) << "the count goes on";
  timer.pass(7);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, CountsEveryEighthCycleOfTheReferenceClock_Clksource) {
  Timer timer;
  timer.write(load, 4);
  timer.write(val, 0);
  timer.write(ctrl, system_tick_ctrl::Enable::mask | system_tick_ctrl::TickInterrupt::mask);
  timer.pass(39);
  EXPECT_FALSE(timer.take());
  timer.pass(1);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, HoldsItsValueWhileDisabled) {
  Timer timer;
  timer.start(9);
  timer.pass(4);
  timer.write(ctrl, running & ~system_tick_ctrl::Enable::mask);
  EXPECT_EQ(timer.timer.next_event(), never);
  timer.pass(100);
  EXPECT_EQ(timer.read(val), 6U);
  timer.write(ctrl, running);
  timer.pass(5);
  EXPECT_FALSE(timer.take());
  timer.pass(1);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, NeverTicksWithAReloadOfZero_Load) {
  Timer timer;
  timer.start(0);
  timer.pass(1000);
  EXPECT_FALSE(timer.take());
  EXPECT_EQ(timer.timer.next_event(), never);
  timer.write(load, 9);
  timer.pass(10);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, TakesANewReloadWithTheNextPeriod_Load) {
  Timer timer;
  timer.start(9);
  timer.pass(5);
  timer.write(load, 99);
  timer.pass(5);
  EXPECT_TRUE(timer.take());
  timer.pass(99);
  EXPECT_FALSE(timer.take());
  timer.pass(1);
  EXPECT_TRUE(timer.take());
}

TEST(SystemTickModel, ForgetsEverythingOnReset) {
  Timer timer;
  timer.start(9);
  timer.pass(15);
  timer.timer.reset(timer.now);
  EXPECT_EQ(timer.read(ctrl), 0U);
  EXPECT_EQ(timer.read(load), 0U);
  EXPECT_EQ(timer.read(val), 0U);
  EXPECT_EQ(timer.timer.next_event(), never);
}

TEST(SystemTickModel, RefusesWhatDoesNotExist) {
  Timer timer;
  EXPECT_EQ(timer.read(offsetof(SystemTickRegisters, calib)), 0x4000'493EU);
  EXPECT_THROW(timer.write(offsetof(SystemTickRegisters, calib), 0), RefusedAccess);
  EXPECT_THROW(timer.write(load, 0x0100'0000), RefusedAccess);
  EXPECT_THROW(timer.write(ctrl, 8), RefusedAccess);
  EXPECT_THROW(timer.read(0, 1), RefusedAccess);
}

}  // namespace kmax::virtual_board::system_tick_test
