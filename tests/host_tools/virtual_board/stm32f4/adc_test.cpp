// RM0090, chapter Analog-to-digital converter (ADC). Test names begin with the section they hold the model
// against.
#include "host_tools/virtual_board/stm32f4/adc.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/adc.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::adc_test {

using drivers::stm32f4::AdcRegisters;
using drivers::stm32f4::Interrupt;

constexpr std::uint32_t sr = offsetof(AdcRegisters, sr), cr1 = offsetof(AdcRegisters, cr1),
                        cr2 = offsetof(AdcRegisters, cr2), smpr1 = offsetof(AdcRegisters, smpr1),
                        smpr2 = offsetof(AdcRegisters, smpr2), jsqr = offsetof(AdcRegisters, jsqr),
                        jdr = offsetof(AdcRegisters, jdr);
constexpr std::uint32_t csr = 0x300, ccr = 0x304;
constexpr std::uint32_t jeoc = 1U << 2, jstrt = 1U << 3;
constexpr std::uint32_t adon = 1, triggered = adon | 1U << 16 | 1U << 20, jswstart = 1U << 22;
constexpr std::uint32_t jeocie = 1U << 7, scan = 1U << 8;
constexpr BoardTime cycle = 16;  // 336 MHz / 21 MHz

struct Asked {
  unsigned channel;
  BoardTime instant;
  friend bool operator==(const Asked&, const Asked&) = default;
};

struct Board : testing::ModelBench {
  Board() : ModelBench({&model}) {
    clocks.apb2 = units_per_period(84'000'000);
    set(0, ccr, 1U << 16);
  }
  std::uint32_t get(unsigned adc, std::uint32_t offset) {
    return read((adc == 0 ? 0 : 0x100 * (adc - 1)) + offset);
  }
  void set(unsigned adc, std::uint32_t offset, std::uint32_t value) {
    write((adc == 0 ? 0 : 0x100 * (adc - 1)) + offset, value);
  }
  void switch_on(unsigned adc, std::uint32_t bits = adon) {
    set(adc, cr2, bits);
    now += 3 * units_per_microsecond;
  }

  std::vector<Asked> asked;
  AdcModel model{clocks, interrupts, [this](unsigned channel, BoardTime instant) {
                   asked.push_back({channel, instant});
                   return 0.1 * channel + 3.3 / 8192;
                 }};
};

std::uint32_t code_of_channel(unsigned channel) {
  return AdcModel::code_of(0.1 * channel + 3.3 / 8192);
}

TEST(AdcModel, DataSheet_NearestCodeAndFullScale) {
  EXPECT_EQ(AdcModel::code_of(0), 0U);
  EXPECT_EQ(AdcModel::code_of(1.65), 2048U);
  EXPECT_EQ(AdcModel::code_of(0.49 * 3.3 / 4096), 0U);
  EXPECT_EQ(AdcModel::code_of(0.51 * 3.3 / 4096), 1U);
  EXPECT_EQ(AdcModel::code_of(3.3), 4095U);
  EXPECT_EQ(AdcModel::code_of(-5), 0U);
  EXPECT_EQ(AdcModel::code_of(1e30), 4095U);
  EXPECT_EQ(AdcModel::code_of(-std::numeric_limits<double>::infinity()), 0U);
  EXPECT_THROW(AdcModel::code_of(std::nan("")), RefusedAccess);
}

TEST(AdcModel, InjectedSequenceRegister_ListEndsAtJsq4AndResultsStartAtJdr1) {
  for (unsigned count = 1; count <= 4; ++count) {
    Board board;
    const unsigned channels[] = {3, 9, 14, 6};
    std::uint32_t list = (count - 1) << 20;
    for (unsigned i = 0; i < count; ++i) list |= channels[i] << (5 * (4 - count + i));
    if (count < 4) list |= 31U << 0;  // a channel that does not exist, in the place that must not matter
    board.set(1, jsqr, list);
    board.set(1, cr1, scan);
    board.switch_on(1);
    board.set(1, cr2, adon | jswstart);
    board.run(1000 * cycle);
    ASSERT_EQ(board.asked.size(), count);
    for (unsigned i = 0; i < 4; ++i) {
      EXPECT_EQ(board.get(1, jdr + 4 * i), i < count ? code_of_channel(channels[i]) : 0U)
          << count << " " << i;
    }
  }
}

TEST(AdcModel, ChannelwiseSamplingTime_HoldsAfterItAndEndsTwelveCyclesLater) {
  const unsigned times[] = {3, 15, 28, 56, 84, 112, 144, 480};
  for (std::uint32_t code = 0; code < 8; ++code) {
    for (const unsigned channel : {2U, 9U, 10U, 15U}) {
      Board board;
      board.set(1, channel < 10 ? smpr2 : smpr1, code << (3 * (channel % 10)));
      board.set(1, jsqr, channel << 15);
      board.switch_on(1, triggered);
      const BoardTime begin = board.now;
      board.model.trigger_injected(begin);
      EXPECT_EQ(board.model.next_event(), begin + times[code] * cycle);
      board.run_until(begin + (times[code] + 12) * cycle - 1);
      EXPECT_EQ(board.get(1, sr), jstrt);
      EXPECT_EQ(board.asked, (std::vector<Asked>{{channel, begin + times[code] * cycle}}));
      board.run_until(begin + (times[code] + 12) * cycle);
      EXPECT_EQ(board.get(1, sr), jstrt | jeoc);
      EXPECT_EQ(board.model.next_event(), never);
    }
  }
}

TEST(AdcModel, ChannelwiseSamplingTime_SequenceAddsUpAndAsksEachAtItsInstant) {
  Board board;
  board.set(1, cr1, scan);
  board.set(1, smpr2, 2U << 12 | 2U << 15 | 2U << 18);
  board.set(1, smpr1, 2U << 15);
  board.set(1, jsqr, 3U << 20 | 5U << 15 | 4U << 10 | 15U << 5 | 6U);
  board.switch_on(1, triggered);
  const BoardTime begin = board.now;
  board.model.trigger_injected(begin);
  board.run_until(begin + 160 * cycle - 1);
  EXPECT_EQ(board.events, 0U) << "a group of several is one event";
  EXPECT_EQ(board.get(1, jdr), code_of_channel(6)) << "looked at before the end: up to date";
  EXPECT_EQ(board.get(1, sr) & jeoc, 0U);
  board.run_until(begin + 160 * cycle);
  EXPECT_EQ(board.events, 1U);
  EXPECT_EQ(board.get(1, sr) & jeoc, jeoc);
  EXPECT_EQ(board.asked, (std::vector<Asked>{{6, begin + 28 * cycle},
                                             {15, begin + 68 * cycle},
                                             {4, begin + 108 * cycle},
                                             {5, begin + 148 * cycle}}));
}

TEST(AdcModel, ConversionOnExternalTrigger_AllThatListenStartTogether) {
  Board board;
  board.set(2, jsqr, 10U << 15);
  board.set(3, jsqr, 11U << 15);
  board.set(2, cr1, jeocie);
  board.switch_on(2, triggered);
  board.switch_on(3, triggered);
  board.switch_on(1);  // deaf
  const BoardTime begin = board.now;
  board.model.trigger_injected(begin);
  board.run_until(begin + 15 * cycle - 1);
  EXPECT_EQ(board.events, 1U) << "one event holds both";
  EXPECT_FALSE(board.interrupts.level(Interrupt::adc));
  board.run_until(begin + 15 * cycle);
  EXPECT_EQ(board.events, 2U);
  EXPECT_TRUE(board.interrupts.level(Interrupt::adc));
  EXPECT_EQ(board.asked, (std::vector<Asked>{{10, begin + 3 * cycle}, {11, begin + 3 * cycle}}));
  EXPECT_EQ(board.get(1, sr), 0U);
  EXPECT_EQ(board.get(0, csr), (jeoc | jstrt) << 8 | (jeoc | jstrt) << 16)
      << "section ADC common status register";
}

TEST(AdcModel, StatusRegister_WriteZeroClearsAndTheLevelFollows) {
  Board board;
  board.set(2, cr1, jeocie);
  board.set(2, jsqr, 10U << 15);
  board.switch_on(2, triggered);
  board.model.trigger_injected(board.now);
  board.run(15 * cycle);
  board.set(2, sr, 0x3FU & ~jstrt);
  EXPECT_EQ(board.get(2, sr), jeoc);
  EXPECT_TRUE(board.interrupts.level(Interrupt::adc));
  board.set(2, cr1, 0);
  EXPECT_FALSE(board.interrupts.level(Interrupt::adc));
  board.set(2, cr1, jeocie);
  EXPECT_TRUE(board.interrupts.level(Interrupt::adc));
  board.set(2, sr, 0x3FU & ~jeoc);
  EXPECT_FALSE(board.interrupts.level(Interrupt::adc));
  board.set(2, sr, 0x3FU);
  EXPECT_EQ(board.get(2, sr), 0U) << "1 sets nothing";
}

TEST(AdcModel, InjectedChannelManagement_TriggerDuringTheGroupIsCountedAndIgnored) {
  Board board;
  board.set(2, jsqr, 10U << 15);
  board.switch_on(2, triggered);
  const BoardTime begin = board.now;
  board.model.trigger_injected(begin);
  board.run_until(begin + 14 * cycle);
  board.model.trigger_injected(board.now);
  EXPECT_EQ(board.model.ignored_triggers(2), 1U);
  EXPECT_EQ(board.model.ignored_triggers(1) + board.model.ignored_triggers(3), 0U);
  board.run_until(begin + 15 * cycle);
  EXPECT_EQ(board.get(2, sr) & jeoc, jeoc) << "the first one ends in time";
  board.model.trigger_injected(board.now);
  EXPECT_EQ(board.model.ignored_triggers(2), 1U);
}

TEST(AdcModel, ChannelSelection_NewListDuringTheGroupStartsItAnew) {
  Board board;
  board.set(2, jsqr, 10U << 15);
  board.switch_on(2, triggered);
  const BoardTime begin = board.now;
  board.model.trigger_injected(begin);
  board.run_until(begin + 10 * cycle);
  board.set(2, jsqr, 13U << 15);
  EXPECT_EQ(board.model.restarted_groups(2), 1U);
  board.run_until(begin + 25 * cycle - 1);
  EXPECT_EQ(board.get(2, sr) & jeoc, 0U);
  board.run_until(begin + 25 * cycle);
  EXPECT_EQ(board.get(2, jdr), code_of_channel(13));
  board.set(2, jsqr, 10U << 15);
  EXPECT_EQ(board.model.restarted_groups(2), 1U) << "idle: nothing to start";
  EXPECT_EQ(board.model.next_event(), never);
}

TEST(AdcModel, OnOffControl_StabilizationTime) {
  Board board;
  board.set(1, cr2, adon);
  board.now += 3 * units_per_microsecond - 1;
  EXPECT_THROW(board.set(1, cr2, adon | jswstart), RefusedAccess);
  board.now += 1;
  EXPECT_NO_THROW(board.set(1, cr2, adon | jswstart));

  Board off;
  EXPECT_THROW(off.set(1, cr2, jswstart), RefusedAccess);
  off.set(2, cr2, triggered);
  EXPECT_THROW(off.model.trigger_injected(off.now + 100), RefusedAccess) << "listens, but is not awake";
}

TEST(AdcModel, OnOffControl_PowerDownStopsAndCountsAnew) {
  Board board;
  board.set(2, jsqr, 10U << 15);
  board.switch_on(2, triggered);
  board.model.trigger_injected(board.now);
  board.set(2, cr2, 0);
  EXPECT_EQ(board.model.next_event(), never);
  board.set(2, cr2, adon);
  EXPECT_THROW(board.set(2, cr2, adon | jswstart), RefusedAccess);
}

TEST(AdcModel, AdcClock_AboveThirtySixMegahertzIsRefused) {
  Board board;
  board.set(0, ccr, 0);  // 84 MHz / 2
  board.switch_on(1);
  EXPECT_THROW(board.set(1, cr2, adon | jswstart), RefusedAccess);
  board.clocks.apb2 = units_per_period(16'000'000);
  EXPECT_NO_THROW(board.set(1, cr2, adon | jswstart)) << "8 MHz";
}

TEST(AdcModel, ChannelsOfThePackage) {
  for (unsigned channel = 0; channel < 20; ++channel) {
    for (unsigned adc = 1; adc <= 3; ++adc) {
      Board board;
      // Fact of the 64-pin package: no port F, where ADC3 has its channels 4 to 9, 14 and 15.
      const bool reached = channel <= 3 || (channel >= 10 && channel <= 13) || (adc != 3 && channel <= 15);
      if (reached) {
        EXPECT_NO_THROW(board.set(adc, jsqr, channel << 15)) << adc << " " << channel;
      } else {
        EXPECT_THROW(board.set(adc, jsqr, channel << 15), RefusedAccess) << adc << " " << channel;
      }
    }
  }
}

TEST(AdcModel, ScanMode_NeededForSeveralConversions) {
  Board board;
  board.set(1, jsqr, 1U << 20 | 5U << 15 | 4U << 10);
  board.switch_on(1);
  EXPECT_THROW(board.set(1, cr2, adon | jswstart), RefusedAccess);
}

TEST(AdcModel, RefusesWhatIsNotModelled) {
  Board board;
  for (const unsigned bit : {0U, 5U, 6U, 9U, 10U, 11U, 12U, 13U, 22U, 23U, 24U, 25U, 26U}) {
    EXPECT_THROW(board.set(1, cr1, 1U << bit), RefusedAccess) << "CR1 " << bit;
  }
  for (const unsigned bit : {1U, 8U, 9U, 10U, 11U, 24U, 28U, 29U, 30U}) {
    EXPECT_THROW(board.set(1, cr2, 1U << bit), RefusedAccess) << "CR2 " << bit;
  }
  EXPECT_THROW(board.set(1, cr2, adon | 1U << 16 | 2U << 20), RefusedAccess) << "falling edge";
  EXPECT_THROW(board.set(1, cr2, adon | 0U << 16 | 1U << 20), RefusedAccess) << "T1_CC4";
  EXPECT_THROW(board.set(1, cr2, adon | 14U << 16 | 1U << 20), RefusedAccess) << "T8_CC4";
  EXPECT_THROW(board.set(0, ccr, 1U << 16 | 1U), RefusedAccess) << "MULTI";
  EXPECT_THROW(board.set(0, ccr, 1U << 23), RefusedAccess) << "TSVREFE";
  EXPECT_THROW(board.set(0, csr, 0), RefusedAccess);
  EXPECT_THROW(board.get(0, 0x308), RefusedAccess);
  EXPECT_THROW(board.set(1, offsetof(AdcRegisters, jofr), 1), RefusedAccess);
  EXPECT_THROW(board.set(1, offsetof(AdcRegisters, htr), 0), RefusedAccess);
  EXPECT_THROW(board.set(1, offsetof(AdcRegisters, sqr1), 1U << 20), RefusedAccess);
  EXPECT_THROW(board.get(1, offsetof(AdcRegisters, dr)), RefusedAccess);
  EXPECT_THROW(board.set(1, offsetof(AdcRegisters, sqr3), 7), RefusedAccess);
  EXPECT_THROW(board.set(1, smpr1, 1U << 27), RefusedAccess);
  EXPECT_THROW(board.set(1, smpr2, 1U << 30), RefusedAccess);
  EXPECT_THROW(board.set(1, jsqr, 1U << 22), RefusedAccess);
  EXPECT_THROW(board.set(1, sr, 1U << 6), RefusedAccess);
  EXPECT_THROW(board.get(1, 0x50), RefusedAccess);
  EXPECT_THROW(board.read(0x400), RefusedAccess);
  EXPECT_THROW(board.read(sr, 2), RefusedAccess);
  board.switch_on(1);
  board.set(1, cr2, adon | jswstart);
  EXPECT_THROW(board.set(1, smpr2, 1), RefusedAccess) << "a sampling time while it samples";
  EXPECT_THROW(board.set(0, ccr, 2U << 16), RefusedAccess);
}

TEST(AdcModel, ResetStopsAndClears) {
  Board board;
  board.set(2, cr1, jeocie);
  board.set(2, jsqr, 10U << 15);
  board.switch_on(2, triggered);
  board.model.trigger_injected(board.now);
  board.run(15 * cycle);
  board.model.trigger_injected(board.now);
  board.model.reset(board.now);
  EXPECT_FALSE(board.interrupts.level(Interrupt::adc));
  EXPECT_EQ(board.model.next_event(), never);
  for (const std::uint32_t offset : {sr, cr1, cr2, jsqr, jdr}) EXPECT_EQ(board.get(2, offset), 0U) << offset;
  EXPECT_EQ(board.get(0, ccr), 0U);
}

}  // namespace kmax::virtual_board::adc_test
