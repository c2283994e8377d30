#include "drivers/stm32f4/current_sampling.hpp"

#include <gtest/gtest.h>

#include <string>
#include <type_traits>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::current_sampling_test {

constexpr CurrentSamplingConfig wiring{.axes = {{{10, 11}, {13, 12}}},
                                       .supply = 6,
                                       .temperatures = {15, 4},
                                       .current_sampling_code = 0,
                                       .slow_sampling_code = 2};
template <typename Field>
CurrentSamplingConfig with(Field CurrentSamplingConfig::*field, std::type_identity_t<Field> value) {
  CurrentSamplingConfig config = wiring;
  config.*field = value;
  return config;
}
constexpr std::uint32_t apb2 = 84'000'000;
constexpr std::uint32_t jeoc = 1U << 2, jstrt = 1U << 3;

struct FakeAdc {
  FakeRegister sr, cr1, cr2, smpr1, smpr2, jsqr;
  FakeRegister jdr[4];

  FakeAdc() {
    // Writing 0 clears, 1 leaves alone: RM0090, ADC status register.
    sr.on_read = [this](std::uint32_t) { return flags; };
    sr.on_write = [this](std::uint32_t word) { flags &= word; };
  }
  void done(std::uint32_t result) {
    jdr[0].value = result;
    flags |= jeoc | jstrt;
  }
  std::uint32_t flags = 0;
};
struct FakeCommon {
  FakeRegister csr, ccr, cdr;
};

struct Board {
  explicit Board(const CurrentSamplingConfig& config = wiring) : sampling{adc1, adc2, adc3, common, config} {}
  FakeAdc adc1, adc2, adc3;
  FakeCommon common;
  CurrentSampling<FakeAdc, FakeCommon> sampling;

  void trigger(std::uint32_t b, std::uint32_t c) {
    adc2.done(b);
    adc3.done(c);
  }
};

struct Started : Board {
  Started() {
    EXPECT_TRUE(sampling.configure(apb2));
    sampling.start(0);
  }
};

TEST(CurrentSampling, ConfiguresAsTheManualWantsIt) {
  Board board;
  ASSERT_TRUE(board.sampling.configure(apb2));
  EXPECT_EQ(board.common.ccr.value, 1U << 16) << "84 MHz / 4";
  EXPECT_EQ(board.adc1.cr1.value, 1U << 8) << "SCAN for three conversions, no interrupt";
  EXPECT_EQ(board.adc2.cr1.value, 1U << 7 | 1U << 8) << "JEOCIE, SCAN for two";
  EXPECT_EQ(board.adc3.cr1.value, 1U << 8);
  // Three: JL = 2, JSQ2 = 6 (supply), JSQ3 = 15, JSQ4 = 4.
  EXPECT_EQ(board.adc1.jsqr.value, 2U << 20 | 4U << 15 | 15U << 10 | 6U << 5);
  // 28 cycles (2): channels 4 and 6 in SMPR2, channel 15 in SMPR1.
  EXPECT_EQ(board.adc1.smpr2.value, 2U << 12 | 2U << 18);
  EXPECT_EQ(board.adc1.smpr1.value, 2U << 15);
  EXPECT_EQ(board.adc2.smpr1.value | board.adc2.smpr2.value | board.adc3.smpr1.value | board.adc3.smpr2.value,
            0U);
  for (const FakeAdc* each : {&board.adc1, &board.adc2, &board.adc3})
    EXPECT_EQ(each->cr2.value, 1U) << "on, deaf";
}

TEST(CurrentSampling, StartArmsTheListOfTheFirstAxisAndThenTheTriggers) {
  for (const unsigned axis : {0U, 1U}) {
    Board board;
    ASSERT_TRUE(board.sampling.configure(apb2));
    std::string order;
    board.adc2.jsqr.on_write = [&](std::uint32_t) { order += 'l'; };
    board.adc3.jsqr.on_write = [&](std::uint32_t) { order += 'l'; };
    board.adc1.cr2.on_write = [&](std::uint32_t) { order += '1'; };
    board.adc2.cr2.on_write = [&](std::uint32_t) { order += '2'; };
    board.adc3.cr2.on_write = [&](std::uint32_t) { order += '3'; };
    board.adc2.flags = jeoc | jstrt;
    board.sampling.start(axis);
    EXPECT_EQ(order, "ll132");
    const auto list = [](unsigned own, unsigned other) { return 1U << 20 | other << 15 | own << 10; };
    EXPECT_EQ(board.adc2.jsqr.value, axis == 0 ? list(10, 13) : list(13, 10)) << "two are JSQ3 and JSQ4";
    EXPECT_EQ(board.adc3.jsqr.value, axis == 0 ? list(11, 12) : list(12, 11));
    EXPECT_EQ(board.adc2.flags, 0U) << "a conversion from before is forgotten";
    for (const FakeAdc* each : {&board.adc1, &board.adc2, &board.adc3}) {
      EXPECT_EQ(each->cr2.value, 1U | 1U << 16 | 1U << 20) << "ADON, JEXTSEL T1_TRGO, JEXTEN rising";
    }
    board.sampling.stop();
    for (const FakeAdc* each : {&board.adc1, &board.adc2, &board.adc3})
      EXPECT_EQ(each->cr2.value >> 20 & 3U, 0U);
  }
}

TEST(CurrentSampling, RefusesWhatCannotWorkAndTouchesNothing) {
  const auto refused = [](const CurrentSamplingConfig& config, std::uint32_t clock) {
    Board board{config};
    const bool configured = board.sampling.configure(clock);
    EXPECT_TRUE(configured || (board.common.ccr.writes.empty() && board.adc1.cr2.writes.empty()));
    return !configured;
  };
  EXPECT_FALSE(refused(wiring, 144'000'000));
  EXPECT_TRUE(refused(wiring, 144'000'001)) << "more than 36 MHz after /4";
  using Config = CurrentSamplingConfig;
  EXPECT_TRUE(refused(with(&Config::axes, {{{10, 4}, {13, 12}}}), apb2)) << "ADC3 has no channel 4 here";
  EXPECT_TRUE(refused(with(&Config::axes, {{{10, 11}, {13, 15}}}), apb2));
  EXPECT_FALSE(refused(with(&Config::axes, {{{4, 11}, {13, 12}}}), apb2)) << "ADC2 has";
  EXPECT_TRUE(refused(with(&Config::supply, 16), apb2));
  EXPECT_TRUE(refused(with(&Config::current_sampling_code, 8), apb2));
  EXPECT_TRUE(refused(with(&Config::slow_sampling_code, 8), apb2));
}

// Each converter has two results: the axis asked for, and the other one while no current passes its shunts.
TEST(CurrentSampling, EachAxisGetsItsOwnCodesAndTheOtherItsZeros) {
  Started board;
  EXPECT_EQ(board.sampling.supply(), 0U);
  const auto list = [](unsigned own, unsigned other) { return 1U << 20 | other << 15 | own << 10; };
  for (unsigned tick = 0; tick < 6; ++tick) {
    const unsigned axis = tick % 2, base = 100 * (tick + 1);
    board.trigger(base + 1, base + 2);
    board.adc2.jdr[1].value = base + 3;
    board.adc3.jdr[1].value = base + 4;
    const CurrentSample sample = board.sampling.ISR_read(axis + 2 * (tick % 3));  // the lowest bit counts
    EXPECT_TRUE(sample.valid);
    EXPECT_EQ(sample.phase_b, base + 1);
    EXPECT_EQ(sample.phase_c, base + 2);
    EXPECT_EQ(board.sampling.zero_current(axis ^ 1U).phase_b, base + 3);
    EXPECT_EQ(board.sampling.zero_current(axis ^ 1U).phase_c, base + 4);
    EXPECT_EQ(board.sampling.zero_current(axis).phase_b, tick == 0 ? 0 : base - 97);
    EXPECT_EQ(board.sampling.zero_current(axis).phase_c, tick == 0 ? 0 : base - 96);
    EXPECT_EQ(board.adc2.jsqr.value, axis == 1 ? list(10, 13) : list(13, 10)) << "the other axis is next";
    EXPECT_EQ(board.adc3.jsqr.value, axis == 1 ? list(11, 12) : list(12, 11));
    EXPECT_EQ(board.adc2.flags | board.adc3.flags, 0U);
  }
  const auto& counters = board.sampling.counters();
  EXPECT_EQ(counters.overruns + counters.axis_mismatches + counters.missing_phase_c + counters.spurious, 0U);
}

TEST(CurrentSampling, TheSameAxisTwiceIsALostTriggerAndOutOfStep) {
  Started board;
  board.trigger(1, 2);
  EXPECT_TRUE(board.sampling.ISR_read(0).valid);
  board.trigger(3, 4);
  EXPECT_FALSE(board.sampling.ISR_read(0).valid);
  EXPECT_EQ(board.sampling.counters().overruns, 1U);
  EXPECT_EQ(board.sampling.counters().axis_mismatches, 1U);
  board.trigger(5, 6);
  EXPECT_TRUE(board.sampling.ISR_read(1).valid) << "one good interrupt is enough to be in step again";
  EXPECT_EQ(board.sampling.counters().overruns, 1U);
  EXPECT_EQ(board.sampling.counters().axis_mismatches, 1U);
}

TEST(CurrentSampling, AStartForgetsWhatWasBefore) {
  Started board;
  board.trigger(1, 2);
  EXPECT_TRUE(board.sampling.ISR_read(0).valid);
  board.sampling.start(2);
  EXPECT_EQ(board.sampling.supply(), 0U);
  board.trigger(3, 4);
  EXPECT_TRUE(board.sampling.ISR_read(0).valid);
  EXPECT_EQ(board.sampling.counters().overruns, 0U);
}

TEST(CurrentSampling, ATriggerThatHasEndedBeforeArmingIsCountedToo) {
  Started board;
  board.trigger(1, 2);
  board.adc2.jsqr.on_write = [&](std::uint32_t) { board.adc2.flags |= jeoc; };
  EXPECT_FALSE(board.sampling.ISR_read(0).valid);
  EXPECT_EQ(board.sampling.counters().overruns, 1U);
}

TEST(CurrentSampling, SamplingTimesAreThoseOfEachConvertersChannels) {
  auto config = with(&CurrentSamplingConfig::axes, {{{9, 11}, {13, 12}}});
  config.current_sampling_code = 5;
  Board board{config};
  ASSERT_TRUE(board.sampling.configure(apb2));
  // RM0090: SMPR1 has channels 10 to 18, SMPR2 0 to 9, three bits each.
  EXPECT_EQ(board.adc2.smpr1.value, 5U << 9);
  EXPECT_EQ(board.adc2.smpr2.value, 5U << 27);
  EXPECT_EQ(board.adc3.smpr1.value, 5U << 3 | 5U << 6);
  EXPECT_EQ(board.adc3.smpr2.value, 0U);
}

TEST(CurrentSampling, TriggerBetweenReadingAndArmingIsCounted) {
  Started board;
  board.trigger(1, 2);
  // The next trigger starts its conversion just as the new list is written.
  board.adc2.jsqr.on_write = [&](std::uint32_t) { board.adc2.flags |= jstrt; };
  EXPECT_FALSE(board.sampling.ISR_read(0).valid);
  EXPECT_EQ(board.sampling.counters().overruns, 1U);
  EXPECT_EQ(board.sampling.counters().axis_mismatches, 0U);
  board.adc2.jsqr.on_write = nullptr;
  board.trigger(3, 4);
  EXPECT_FALSE(board.sampling.ISR_read(1).valid) << "nobody knows which list that one used";
  EXPECT_EQ(board.sampling.counters().overruns, 1U);
  EXPECT_EQ(board.sampling.counters().axis_mismatches, 1U);
  board.trigger(5, 6);
  EXPECT_TRUE(board.sampling.ISR_read(0).valid);
}

TEST(CurrentSampling, MissingPhaseC) {
  Started board;
  board.adc2.done(1);
  EXPECT_FALSE(board.sampling.ISR_read(0).valid);
  EXPECT_EQ(board.sampling.counters().missing_phase_c, 1U);
  EXPECT_EQ(board.sampling.counters().axis_mismatches, 0U);
}

TEST(CurrentSampling, SpuriousCallTouchesNothing) {
  Started board;
  board.trigger(1, 2);
  EXPECT_TRUE(board.sampling.ISR_read(0).valid);
  const auto lists = board.adc2.jsqr.writes.size();
  const auto cleared = board.adc2.sr.writes.size();
  EXPECT_FALSE(board.sampling.ISR_read(0).valid) << "an old sample must not count twice";
  EXPECT_EQ(board.sampling.counters().spurious, 1U);
  EXPECT_EQ(board.sampling.counters().overruns, 0U);
  EXPECT_EQ(board.adc2.jsqr.writes.size(), lists);
  EXPECT_EQ(board.adc2.sr.writes.size(), cleared);
  board.trigger(3, 4);
  EXPECT_TRUE(board.sampling.ISR_read(1).valid);
}

TEST(CurrentSampling, OnlyItsOwnFlagsAreCleared) {
  Started board;
  board.trigger(1, 2);
  board.adc2.flags |= 0x33;  // AWD, EOC, STRT, OVR
  board.sampling.ISR_read(0);
  EXPECT_EQ(board.adc2.flags, 0x33U);
}

TEST(CurrentSampling, SlowCodesAndTheirAge) {
  Started board;
  board.trigger(1, 2);
  EXPECT_EQ(board.sampling.ISR_read(0).slow_age, 1U);
  const std::uint16_t codes[] = {1111, 2222, 3333};
  for (unsigned i = 0; i < 3; ++i) board.adc1.jdr[i].value = codes[i];
  board.adc1.flags = jeoc | jstrt;
  board.trigger(1, 2);
  CurrentSample sample = board.sampling.ISR_read(1);
  EXPECT_EQ(sample.slow_age, 0U);
  EXPECT_EQ(sample.supply, 1111);
  EXPECT_EQ(board.sampling.temperature(0), 2222);
  EXPECT_EQ(board.sampling.temperature(1), 3333);
  EXPECT_EQ(board.sampling.supply(), 1111) << "for another context";
  board.adc1.jdr[0].value = 9;  // a new sequence is under way
  for (unsigned i = 0; i < 600; ++i) {
    board.trigger(1, 2);
    sample = board.sampling.ISR_read(i % 2);
  }
  EXPECT_EQ(sample.supply, 1111) << "the last complete sequence";
  EXPECT_EQ(sample.slow_age, 255U);
}

}  // namespace kmax::drivers::stm32f4::current_sampling_test
