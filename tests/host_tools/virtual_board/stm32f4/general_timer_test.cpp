// Against RM0090, chapter General-purpose timers (TIM2 to TIM5); section titles stand with the tests. And the
// encoders' driver on the models.
#include "host_tools/virtual_board/stm32f4/general_timer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <vector>

#include "control/count_extender.hpp"
#include "drivers/stm32f4/quadrature_timer.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::general_timer_test {

using testing::TimerOnModel;

constexpr std::uint32_t cen = 1U << 0, urs = 1U << 2, dir = 1U << 4, arpe = 1U << 7;
constexpr std::uint32_t cc1p = 1U << 1, cc2p = 1U << 5;

struct Bench : testing::ModelBench {
  explicit Bench(GeneralTimer unit = GeneralTimer::tim3) : ModelBench({&model}, 500), model(unit, clocks) {}
  void encoder(std::uint32_t polarity = 0) {
    timer.ccmr[0] = 0x4141;
    timer.ccer = polarity;
    timer.smcr = 3;
    timer.cr1 = cen;
  }
  std::uint32_t cnt() { return static_cast<std::uint32_t>(timer.cnt); }
  std::uint32_t sr() { return static_cast<std::uint32_t>(timer.sr); }
  bool down() { return (static_cast<std::uint32_t>(timer.cr1) & dir) != 0; }

  GeneralTimerModel model;
  TimerOnModel timer = block_on_model<TimerOnModel>(*this, model);
};

// "Encoder interface mode": between 0 and ARR, both ways round.
TEST(GeneralTimerModel, EncoderWrapsBothWays) {
  Bench bench;
  bench.encoder();
  bench.model.set_encoder_count(65535);
  EXPECT_EQ(bench.cnt(), 65535U);
  EXPECT_EQ(bench.sr() & 1U, 0U);
  EXPECT_FALSE(bench.down());
  bench.model.set_encoder_count(65536);
  EXPECT_EQ(bench.cnt(), 0U);
  EXPECT_EQ(bench.sr() & 1U, 1U) << "overflow is an update event";
  bench.timer.sr = 0;
  bench.model.set_encoder_count(65535);
  EXPECT_EQ(bench.cnt(), 65535U);
  EXPECT_EQ(bench.sr() & 1U, 1U) << "underflow";
  EXPECT_TRUE(bench.down());
  bench.timer.sr = 0;
  bench.model.set_encoder_count(65531);
  bench.model.set_encoder_count(0);
  bench.model.set_encoder_count(65535);
  EXPECT_EQ(bench.sr() & 1U, 0U) << "reaching 0 or ARR is no wrap";
}

RC_GTEST_PROP(GeneralTimerModel, EncoderIsModuloItsRange, (std::int64_t first, std::int64_t second)) {
  Bench bench;
  const auto arr = *rc::gen::inRange<std::uint32_t>(1, 65536);
  bench.timer.arr = arr;
  bench.encoder();
  bench.model.set_encoder_count(first);
  bench.model.set_encoder_count(second);
  const auto range = static_cast<std::int64_t>(arr) + 1;
  RC_PRE(first / 2 > -(std::int64_t{1} << 61) && first / 2 < (std::int64_t{1} << 61));
  RC_PRE(second / 2 > -(std::int64_t{1} << 61) && second / 2 < (std::int64_t{1} << 61));
  RC_ASSERT(bench.cnt() == static_cast<std::uint32_t>((second % range + range) % range));
}

TEST(GeneralTimerModel, EncoderJumpOverTheWholeInt64IsSurvived) {
  Bench bench(GeneralTimer::tim2);
  bench.encoder();
  bench.model.set_encoder_count(std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(bench.cnt(), 0U) << "2^63 is a multiple of 2^32";
  bench.model.set_encoder_count(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(bench.cnt(), 0xFFFF'FFFFU);
}

// Table "Counting direction versus encoder signals"; TIMx_CCER, CC1P and CC2P.
TEST(GeneralTimerModel, EachInvertedInputReversesTheDirection) {
  struct Row {
    std::uint32_t polarity, count;
    bool down;
  };
  for (const Row& row :
       {Row{0, 10, false}, Row{cc1p, 65526, true}, Row{cc2p, 65526, true}, Row{cc1p | cc2p, 10, false}}) {
    Bench bench;
    bench.encoder(row.polarity);
    bench.model.set_encoder_count(10);
    EXPECT_EQ(bench.cnt(), row.count);
    EXPECT_EQ(bench.down(), row.down);
  }
}

TEST(GeneralTimerModel, EncoderCountsOnlyWhileEnabled) {
  Bench bench;
  bench.model.set_encoder_count(1000);
  bench.encoder();
  EXPECT_EQ(bench.cnt(), 0U) << "only changes count";
  bench.model.set_encoder_count(1003);
  EXPECT_EQ(bench.cnt(), 3U);
  bench.timer.cnt = 100;
  bench.model.set_encoder_count(1002);
  EXPECT_EQ(bench.cnt(), 99U);
  bench.timer.cr1 = 0;
  bench.model.set_encoder_count(5000);
  bench.timer.cr1 = cen;
  bench.model.set_encoder_count(5001);
  EXPECT_EQ(bench.cnt(), 100U);
}

// TIMx_EGR UG: 0, or ARR when the direction is down.
TEST(GeneralTimerModel, SoftwareUpdateFollowsTheDirection) {
  Bench bench;
  bench.encoder();
  bench.model.set_encoder_count(-5);
  bench.timer.egr = 1;
  EXPECT_EQ(bench.cnt(), 65535U);
  EXPECT_EQ(bench.sr() & 1U, 1U);
  bench.timer.sr = 0;
  bench.model.set_encoder_count(0);
  bench.timer.sr = 0;
  bench.timer.cr1 = cen | urs;
  bench.timer.egr = 1;
  EXPECT_EQ(bench.cnt(), 0U);
  EXPECT_EQ(bench.sr() & 1U, 0U) << "URS = 1";
}

TEST(GeneralTimerModel, RefusesWhatIsNotModelled) {
  const auto refused = [](auto&& action) {
    Bench bench;
    EXPECT_THROW(action(bench), RefusedAccess);
  };
  refused([](Bench& b) { b.timer.cr1 = cen; });      // no slave mode
  refused([](Bench& b) { b.timer.cr1 = 1U << 1; });  // UDIS
  refused([](Bench& b) { b.timer.cr1 = 1U << 5; });  // CMS
  refused([](Bench& b) { b.timer.cr1 = arpe; });
  refused([](Bench& b) { b.timer.cr2 = 2U << 4; });
  refused([](Bench& b) { b.timer.smcr = 1; });  // encoder mode 1
  refused([](Bench& b) { b.timer.dier = 1; });  // UIE
  refused([](Bench& b) { b.timer.psc = 1; });
  refused([](Bench& b) { b.timer.ccmr[1] = 0x0060; });  // PWM
  refused([](Bench& b) { b.timer.ccmr[0] = 0x0002; });  // crossed input
  refused([](Bench& b) { b.timer.ccmr[0] = 0x0005; });  // prescaled capture
  refused([](Bench& b) { b.timer.ccer = 1; });          // compare output
  refused([](Bench& b) { b.timer.ccer = 1U << 3; });    // both edges
  refused([](Bench& b) { b.timer.ccr[0] = 1; });
  refused([](Bench& b) { b.timer.arr = 0x10000; });
  refused([](Bench& b) { b.timer.bdtr = 1; });
  refused([](Bench& b) { b.timer.rcr = 1; });
  refused([](Bench& b) {
    b.timer.smcr = 3;
    b.timer.cr1 = cen;  // CC1S, CC2S are 0
  });
  refused([](Bench& b) {
    b.encoder();
    b.timer.smcr = 0;
  });
  refused([](Bench& b) {
    b.encoder();
    b.timer.ccmr[0] = 0;
  });
  refused([](Bench& b) {
    b.timer.arr = 10;
    b.timer.cnt = 11;
  });
  refused([](Bench& b) { b.read(0x24, 2); });
  refused([](Bench& b) { b.read(0x50); });  // OR
}

TEST(GeneralTimerModel, ResetStopsAndForgets) {
  Bench bench(GeneralTimer::tim4);
  bench.timer.arr = 9;
  bench.encoder();
  bench.model.set_encoder_count(5);
  bench.model.reset(bench.now);
  EXPECT_EQ(bench.cnt(), 0U);
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.arr), 0xFFFFU);
  bench.model.set_encoder_count(7);
  EXPECT_EQ(bench.cnt(), 0U);
}

// drivers/stm32f4/quadrature_timer.hpp on the models of TIM3 and TIM2.
template <typename Counter = std::uint16_t>
struct Encoder : Bench {
  Encoder() : Bench(sizeof(Counter) == 2 ? GeneralTimer::tim3 : GeneralTimer::tim2) {}
  drivers::stm32f4::QuadratureTimer<TimerOnModel, Counter> encoder{timer};
};

TEST(QuadratureTimerOnModel, WrapsBothWays) {
  Encoder bench;
  ASSERT_TRUE(bench.encoder.configure({}));
  bench.model.set_encoder_count(-1);
  EXPECT_EQ(bench.encoder.count(), 65535);
  bench.model.set_encoder_count(0);
  EXPECT_EQ(bench.encoder.count(), 0);
  bench.model.set_encoder_count(65537);
  EXPECT_EQ(bench.encoder.count(), 1);
}

TEST(QuadratureTimerOnModel, ThirtyTwoBits) {
  Encoder<std::uint32_t> bench;
  ASSERT_TRUE(bench.encoder.configure({}));
  bench.model.set_encoder_count(-1);
  EXPECT_EQ(bench.encoder.count(), 0xFFFF'FFFFU);
  bench.model.set_encoder_count(70'000);
  EXPECT_EQ(bench.encoder.count(), 70'000U);
}

RC_GTEST_PROP(QuadratureTimerOnModel, ExtendedCountFollowsAnyMotion, (bool reversed)) {
  const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-32767, 32768));
  Encoder bench;
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
  Encoder bench;
  ASSERT_TRUE(bench.encoder.configure({}));
  bench.model.set_encoder_count(-300);
  ASSERT_TRUE(bench.encoder.configure({}));
  EXPECT_EQ(bench.encoder.count(), 0);
  bench.model.set_encoder_count(-299);
  EXPECT_EQ(bench.encoder.count(), 1);
}

}  // namespace kmax::virtual_board::general_timer_test
