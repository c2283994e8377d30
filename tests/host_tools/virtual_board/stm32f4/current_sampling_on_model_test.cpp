// drivers/stm32f4/current_sampling.hpp on the model of the converters, with TIM1's update event every 25 us.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "board/odrive_v3/description.hpp"
#include "drivers/stm32f4/current_sampling.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/stm32f4/adc.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::current_sampling_on_model_test {

using drivers::stm32f4::adc_stride;
using drivers::stm32f4::CurrentSample;
using drivers::stm32f4::Interrupt;
using testing::RegisterOnModel;

constexpr BoardTime period = 25 * units_per_microsecond;

struct AdcOnModel {
  RegisterOnModel sr, cr1, cr2, smpr1, smpr2, jofr[4], htr, ltr, sqr[3], jsqr, jdr[4];
};
struct CommonOnModel {
  RegisterOnModel csr, ccr;
};

/// The codes that the world shows at a channel: what it is, and in which trigger period it was held.
std::uint32_t code_at(unsigned channel, BoardTime instant, BoardTime first_trigger) {
  return channel * 256 + static_cast<std::uint32_t>((instant - first_trigger) / period % 256);
}

struct Board : testing::ModelBench {
  Board() : ModelBench({&model}) {
    clocks.apb2 = units_per_period(84'000'000);
    EXPECT_TRUE(sampling.configure(84'000'000));
    now += drivers::stm32f4::adc_stabilization_us * units_per_microsecond;
    sampling.start(0);
    first_trigger = now + period;
  }

  /// Trigger number `n` (even: axis 0).
  void trigger(unsigned n) {
    run_until(first_trigger + n * period);
    model.trigger_injected(now);
  }
  std::uint32_t expected(unsigned channel, unsigned n) const {
    return code_at(channel, first_trigger + n * period, first_trigger);
  }
  static constexpr unsigned phase_b[] = {10, 13}, phase_c[] = {11, 12};

  BoardTime first_trigger = 0;
  AdcModel model{clocks, interrupts, [this](unsigned channel, BoardTime instant) {
                   return code_at(channel, instant, first_trigger) * 3.3 / 4096;
                 }};
  AdcOnModel adc1 = block_on_model<AdcOnModel>(*this, model);
  AdcOnModel adc2 = block_on_model<AdcOnModel>(*this, model, adc_stride);
  AdcOnModel adc3 = block_on_model<AdcOnModel>(*this, model, 2 * adc_stride);
  CommonOnModel common = block_on_model<CommonOnModel>(*this, model, 3 * adc_stride);
  drivers::stm32f4::CurrentSampling<AdcOnModel, CommonOnModel> sampling{adc1, adc2, adc3, common,
                                                                        board::odrive_v3::sampling_config};
};

void expect_sample_of(const Board& board, const CurrentSample& sample, unsigned n) {
  ASSERT_TRUE(sample.valid) << n;
  ASSERT_EQ(sample.phase_b, board.expected(Board::phase_b[n % 2], n)) << n;
  ASSERT_EQ(sample.phase_c, board.expected(Board::phase_c[n % 2], n)) << n;
}

TEST(CurrentSamplingOnModel, ThousandsOfTriggersNeverSwapTheAxes) {
  Board board;
  for (unsigned n = 0; n < 10'000; ++n) {
    board.trigger(n);
    board.run(30 * 16 - 1);
    ASSERT_FALSE(board.interrupts.level(Interrupt::adc)) << n;
    board.run(1);
    ASSERT_TRUE(board.interrupts.level(Interrupt::adc)) << "1.43 us after the trigger";
    board.run(168);  // entry of the handler
    const CurrentSample sample = board.sampling.ISR_read(n % 2);
    ASSERT_NO_FATAL_FAILURE(expect_sample_of(board, sample, n));
    const unsigned other = (n + 1) % 2;
    ASSERT_EQ(board.sampling.zero_current(other).phase_b, board.expected(Board::phase_b[other], n));
    ASSERT_EQ(board.sampling.zero_current(other).phase_c, board.expected(Board::phase_c[other], n));
    ASSERT_FALSE(board.interrupts.level(Interrupt::adc));
    if (n == 0) continue;
    // The slow ones are those of the trigger before; the first has just been converted again.
    ASSERT_EQ(sample.slow_age, 0U);
    ASSERT_EQ(sample.supply, board.expected(6, n));
    ASSERT_EQ(board.sampling.temperature(0), board.expected(15, n - 1));
    ASSERT_EQ(board.sampling.temperature(1), board.expected(4, n - 1));
  }
  const auto& counters = board.sampling.counters();
  EXPECT_EQ(counters.axis_mismatches + counters.overruns + counters.missing_phase_c + counters.spurious, 0U);
  EXPECT_EQ(board.interrupts.rises(Interrupt::adc), 10'000U);
  for (const unsigned adc : {1U, 2U, 3U}) {
    EXPECT_EQ(board.model.ignored_triggers(adc), 0U);
    EXPECT_EQ(board.model.restarted_groups(adc), 0U);
  }
  EXPECT_LE(board.events, 3U * 10'000U) << "events per trigger";
}

TEST(CurrentSamplingOnModel, InterruptThatIsLateButInTimeLosesNothing) {
  Board board;
  for (unsigned n = 0; n < 1000; ++n) {
    board.trigger(n);
    board.run((n % 3 == 0 ? 24 * units_per_microsecond : 2 * units_per_microsecond));
    const CurrentSample sample = board.sampling.ISR_read(n % 2);
    ASSERT_NO_FATAL_FAILURE(expect_sample_of(board, sample, n));
    ASSERT_LE(sample.slow_age, 1U);
  }
  EXPECT_EQ(board.sampling.counters().overruns + board.sampling.counters().axis_mismatches, 0U);
}

// The handler of trigger 4 comes only after trigger 5, at any distance from it.
TEST(CurrentSamplingOnModel, InterruptAfterTheNextTriggerIsCountedAndNothingWrongIsCalledValid) {
  for (BoardTime late = 1; late < 20 * units_per_microsecond; late += 37) {
    Board board;
    for (unsigned n = 0; n < 4; ++n) {
      board.trigger(n);
      board.run(2 * units_per_microsecond);
      board.sampling.ISR_read(n % 2);
    }
    board.trigger(4);
    board.trigger(5);
    board.run(late);
    EXPECT_FALSE(board.sampling.ISR_read(1).valid) << late;
    EXPECT_GE(board.sampling.counters().overruns, 1U) << late;
    EXPECT_EQ(board.sampling.counters().axis_mismatches, 1U) << late;
    // Where the late handler ran into the conversion, that one ends now and asks again.
    board.run_until(board.first_trigger + 6 * period - 1);
    if (board.interrupts.level(Interrupt::adc)) {
      EXPECT_FALSE(board.sampling.ISR_read(1).valid) << late;
    }
    for (unsigned n = 6; n < 12; ++n) {
      board.trigger(n);
      board.run(2 * units_per_microsecond);
      const CurrentSample sample = board.sampling.ISR_read(n % 2);
      ASSERT_NO_FATAL_FAILURE(expect_sample_of(board, sample, n)) << late;
    }
  }
}

// Interrupts dropped at random: a sample that is called valid is the right one, and each odd gap is counted.
RC_GTEST_PROP(CurrentSamplingOnModel, ValidMeansRight, ()) {
  Board board;
  const auto served =
      *rc::gen::container<std::vector<bool>>(200, rc::gen::weightedElement<bool>({{4, true}, {1, false}}));
  unsigned odd_gaps = 0;
  int last = -1;
  for (unsigned n = 0; n < served.size(); ++n) {
    board.trigger(n);
    board.run(2 * units_per_microsecond);
    if (!served[n]) continue;
    const CurrentSample sample = board.sampling.ISR_read(n % 2);
    if (sample.valid) {
      RC_ASSERT(sample.phase_b == board.expected(Board::phase_b[n % 2], n));
      RC_ASSERT(sample.phase_c == board.expected(Board::phase_c[n % 2], n));
    }
    if (last >= 0 && (static_cast<int>(n) - last) % 2 == 0) ++odd_gaps;
    last = static_cast<int>(n);
  }
  RC_ASSERT(board.sampling.counters().overruns == odd_gaps);
}

TEST(CurrentSamplingOnModel, StartedAtTheWrongPhaseHealsWithTheSecondSample) {
  Board board;
  board.trigger(1);  // axis 1 comes first, the list of axis 0 is in force
  board.run(2 * units_per_microsecond);
  EXPECT_FALSE(board.sampling.ISR_read(1).valid);
  EXPECT_EQ(board.sampling.counters().axis_mismatches, 1U);
  EXPECT_EQ(board.sampling.counters().overruns, 0U);
  board.trigger(2);
  board.run(2 * units_per_microsecond);
  expect_sample_of(board, board.sampling.ISR_read(0), 2);
}

TEST(CurrentSamplingOnModel, StopIsQuietAndStartComesBack) {
  Board board;
  board.sampling.stop();
  board.trigger(0);
  board.run(10 * units_per_microsecond);
  EXPECT_FALSE(board.interrupts.level(Interrupt::adc));
  board.sampling.start(1);
  board.trigger(1);
  board.run(2 * units_per_microsecond);
  expect_sample_of(board, board.sampling.ISR_read(1), 1);
}

TEST(CurrentSamplingOnModel, StartTooSoonAfterConfigureIsRefusedByTheConverter) {
  Board board;
  board.sampling.stop();
  board.adc2.cr2 = 0;
  ASSERT_TRUE(board.sampling.configure(84'000'000));
  board.sampling.start(0);
  board.now += units_per_microsecond;
  EXPECT_THROW(board.model.trigger_injected(board.now), RefusedAccess);
}

}  // namespace kmax::virtual_board::current_sampling_on_model_test
