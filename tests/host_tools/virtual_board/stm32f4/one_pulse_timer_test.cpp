// Against RM0090, chapter General-purpose timers (TIM2 to TIM5), section One-pulse mode; and the driver on
// it.
#include "host_tools/virtual_board/stm32f4/one_pulse_timer.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "drivers/stm32f4/one_pulse_output.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::one_pulse_timer_test {

using drivers::stm32f4::OnePulseOutput;
using testing::TimerOnModel;

constexpr BoardTime tick = 4;  // 84 MHz

struct Bench : testing::ModelBench {
  Bench() : ModelBench({&model}) {
    clocks.apb1_timer = tick;
    model.on_output_change([this](BoardTime at) { changes.push_back(at); });
  }
  OnePulseTimerModel model{clocks};
  TimerOnModel timer = block_on_model<TimerOnModel>(*this, model);
  OnePulseOutput<TimerOnModel> output{timer};
  std::vector<BoardTime> changes;
};

TEST(OnePulseOutput, EndsByItselfAfterItsLength) {
  Bench bench;
  bench.output.configure(100);
  EXPECT_FALSE(bench.model.output());
  for (int pulse = 0; pulse < 3; ++pulse) {
    bench.changes.clear();
    const BoardTime began = bench.now;
    bench.output.start();
    bench.run(50 * tick);
    EXPECT_TRUE(bench.model.output());
    bench.output.start();
    bench.run(1000 * tick);
    EXPECT_FALSE(bench.model.output());
    EXPECT_EQ(bench.changes, (std::vector<BoardTime>{began + tick, began + 101 * tick}))
        << "not started again";
  }
}

TEST(OnePulseOutput, StopsAtOnceAndStartsWhole) {
  Bench bench;
  bench.output.configure(100);
  bench.output.start();
  bench.run(30 * tick);
  bench.output.stop();
  EXPECT_FALSE(bench.model.output());
  bench.run(1000 * tick);
  bench.changes.clear();
  const BoardTime began = bench.now;
  bench.output.start();
  bench.run(1000 * tick);
  EXPECT_EQ(bench.changes.back(), began + 101 * tick);
}

TEST(OnePulseTimerModel, RefusesWhatIsNotModelled) {
  const auto refused = [](auto&& action) {
    Bench bench;
    EXPECT_THROW(action(bench), RefusedAccess);
  };
  refused([](Bench& b) { b.timer.cr1 = 1; });  // for ever
  refused([](Bench& b) { b.timer.psc = 1; });
  refused([](Bench& b) { b.timer.ccmr[0] = 0x70; });
  refused([](Bench& b) { b.timer.ccmr[1] = 0x60 << 8; });
  refused([](Bench& b) { b.timer.arr = 0; });
  refused([](Bench& b) {
    b.output.configure(100);
    b.output.start();
    b.timer.arr = 50;
  });
}

TEST(OnePulseTimerModel, AResetEndsThePulse) {
  Bench bench;
  bench.output.configure(100);
  bench.output.start();
  bench.run(10 * tick);
  bench.model.reset(bench.now);
  EXPECT_FALSE(bench.model.output());
  EXPECT_EQ(bench.model.next_event(), never);
}

}  // namespace kmax::virtual_board::one_pulse_timer_test
