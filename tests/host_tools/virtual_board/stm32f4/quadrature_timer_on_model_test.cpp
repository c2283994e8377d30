// drivers/stm32f4/quadrature_timer.hpp on the models of TIM3 and TIM2.
#include "drivers/stm32f4/quadrature_timer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "control/count_extender.hpp"
#include "host_tools/virtual_board/stm32f4/general_timer.hpp"
#include "tests/host_tools/virtual_board/stm32f4/timer_on_model.hpp"

namespace kmax::virtual_board::quadrature_timer_on_model_test {
namespace {

using drivers::stm32f4::QuadratureTimer;
using testing::RecordedInterrupts;
using testing::TimerOnModel;

template <typename Counter = std::uint16_t>
struct Bench {
  BoardTime now = 77;
  BoardClocks clocks;
  RecordedInterrupts interrupts;
  GeneralTimerModel model{sizeof(Counter) == 2 ? GeneralTimer::tim3 : GeneralTimer::tim2, clocks, interrupts};
  TimerOnModel timer{model, now};
  QuadratureTimer<TimerOnModel, Counter> encoder{timer};
};

TEST(QuadratureTimerOnModel, WrapsBothWays) {
  Bench bench;
  ASSERT_TRUE(bench.encoder.configure({}));
  bench.model.set_encoder_count(-1);
  EXPECT_EQ(bench.encoder.count(), 65535);
  bench.model.set_encoder_count(0);
  EXPECT_EQ(bench.encoder.count(), 0);
  bench.model.set_encoder_count(65537);
  EXPECT_EQ(bench.encoder.count(), 1);
}

TEST(QuadratureTimerOnModel, ThirtyTwoBits) {
  Bench<std::uint32_t> bench;
  ASSERT_TRUE(bench.encoder.configure({}));
  bench.model.set_encoder_count(-1);
  EXPECT_EQ(bench.encoder.count(), 0xFFFF'FFFFU);
  bench.model.set_encoder_count(70'000);
  EXPECT_EQ(bench.encoder.count(), 70'000U);
}

RC_GTEST_PROP(QuadratureTimerOnModel, ExtendedCountFollowsAnyMotion, (bool reversed)) {
  const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-32767, 32768));
  Bench bench;
  RC_ASSERT(bench.encoder.configure({.reversed = reversed}));
  control::CountExtender<std::uint16_t> extender;
  extender.reset(bench.encoder.count());
  std::int64_t position = 0;
  for (const int step : steps) {
    position += step;
    bench.model.set_encoder_count(position);
    RC_ASSERT(extender.update(bench.encoder.count()) == (reversed ? -position : position));
  }
}

// The counter starts at 0 even when the last movement was backwards (UG would load ARR then).
TEST(QuadratureTimerOnModel, ConfiguredAgainItStartsAtZero) {
  Bench bench;
  ASSERT_TRUE(bench.encoder.configure({}));
  bench.model.set_encoder_count(-300);
  ASSERT_TRUE(bench.encoder.configure({}));
  EXPECT_EQ(bench.encoder.count(), 0);
  bench.model.set_encoder_count(-299);
  EXPECT_EQ(bench.encoder.count(), 1);
}

}  // namespace
}  // namespace kmax::virtual_board::quadrature_timer_on_model_test
