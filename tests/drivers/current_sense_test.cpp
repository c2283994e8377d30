#include "drivers/current_sense.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace kmax::drivers::current_sense_test {

constexpr float shunt = 0.0005F;
constexpr CurrentSenseConfig at_40{.shunt_ohm = shunt, .gain = CurrentSenseGain::x40};

float amperes_per_code(const CurrentSense& sense) {
  return sense.ISR_amperes(2049) - sense.ISR_amperes(2048);
}

TEST(CurrentSense, RangeAndResolutionOfEachGain) {
  struct Row {
    CurrentSenseGain gain;
    double milliampere_per_code;
    double range;
  };
  for (const Row& row : {Row{CurrentSenseGain::x10, 161.13, 270}, Row{CurrentSenseGain::x20, 80.57, 135},
                         Row{CurrentSenseGain::x40, 40.28, 67.5}, Row{CurrentSenseGain::x80, 20.14, 33.75}}) {
    const CurrentSense sense{{.shunt_ohm = shunt, .gain = row.gain}};
    EXPECT_NEAR(1000.0 * static_cast<double>(amperes_per_code(sense)), row.milliampere_per_code,
                0.01 * row.milliampere_per_code / 100);
    EXPECT_NEAR(static_cast<double>(sense.range()), row.range, 0.002 * row.range);
  }
}

TEST(CurrentSense, AboveTheMiddleFlowsIntoTheMotor) {
  const CurrentSense sense{at_40};
  EXPECT_EQ(sense.ISR_amperes(2048), 0.0F);
  EXPECT_GT(sense.ISR_amperes(2049), 0.0F);
  EXPECT_LT(sense.ISR_amperes(2047), 0.0F);
}

TEST(CurrentSense, AnOffsetInAmperesIsThatOfItsCodes) {
  const CurrentSense sense{at_40};
  EXPECT_EQ(sense.offset(), 2048.0F);
  EXPECT_EQ(sense.offset_amperes(), 0.0F);
  CurrentSense moved{at_40};
  moved.track_offset(2058, 0);
  EXPECT_EQ(moved.offset(), 2048.0F + 10.0F / 4.0F);
  EXPECT_FLOAT_EQ(moved.offset_amperes(), 2.5F * amperes_per_code(moved));
}

// From amperes to volts as the amplifier does it, to a code as the converter does it, and back.
RC_GTEST_PROP(CurrentSense, InvertsTheAnalogChain, ()) {
  const auto gain = *rc::gen::element(CurrentSenseGain::x10, CurrentSenseGain::x20, CurrentSenseGain::x40,
                                      CurrentSenseGain::x80);
  const double offset_volt = *rc::gen::inRange(-150, 151) * 1e-3;
  const double factor = static_cast<double>(gain_factor(gain)) * 0.0005;
  const double current = *rc::gen::inRange(-1000, 1001) * 1e-3 * 1.15 / factor;
  const double volt = 1.65 + offset_volt + factor * current;
  const auto code = static_cast<std::uint16_t>(std::lround(volt / 3.3 * 4096));

  CurrentSense sense{{.shunt_ohm = shunt, .gain = gain}};
  sense.set_offset(static_cast<float>(2048 + offset_volt / 3.3 * 4096));
  RC_ASSERT(!sense.ISR_saturated(code));
  const double half_code = 0.501 * static_cast<double>(amperes_per_code(sense));
  RC_ASSERT(std::abs(static_cast<double>(sense.ISR_amperes(code)) - current) <= half_code);
}

TEST(CurrentSense, SaturatedOutsideTheLinearWindow) {
  const CurrentSense sense{at_40};
  using Code = std::uint16_t;
  for (const Code code : {Code{0}, Code{1}, Code{372}, Code{3724}, Code{4094}, Code{4095}})
    EXPECT_TRUE(sense.ISR_saturated(code)) << code;
  for (const Code code : {Code{373}, Code{2048}, Code{3723}}) EXPECT_FALSE(sense.ISR_saturated(code)) << code;
}

TEST(CurrentSense, OffsetNarrowsTheRangeOnOneSide) {
  CurrentSense sense{at_40};
  const float centred = sense.range();
  sense.set_offset(2148.0F);
  EXPECT_NEAR(sense.range(), centred - 100 * amperes_per_code(sense), 0.01F * centred);
  sense.set_offset(1948.0F);
  EXPECT_NEAR(sense.range(), centred - 100 * amperes_per_code(sense), 0.01F * centred);
}

TEST(CurrentSense, TracksAStepInMillisecondsAndTheTemperatureInQuarters) {
  CurrentSense sense{at_40};
  for (unsigned after = 0; after < 20; ++after) sense.track_offset(2058, after);
  EXPECT_NEAR(sense.offset(), 2058.0F - 10.0F * 3.0F / 23.0F, 0.01F) << "3 / (n + 3) of the step is left";
  for (unsigned after = 20; after < 300; ++after) sense.track_offset(2058, after);
  EXPECT_NEAR(sense.offset(), 2058.0F, 0.2F);
  sense.set_offset(2048.0F);
  for (unsigned after = 252; after < 508; ++after) sense.track_offset(2058, after);
  EXPECT_NEAR(sense.offset(), 2058.0F - 10.0F * std::exp(-1.0F), 0.02F);
}

TEST(CurrentSense, WhatDrivingMovesIsNoMoreThanSixteenCodesWhateverIsShown) {
  for (const float sign : {1.0F, -1.0F}) {
    CurrentSense sense{at_40};
    sense.set_offset(2100.0F);
    const auto code = static_cast<std::uint32_t>(2100.0F + sign * 60.0F);
    for (unsigned after = 0; after < 252; ++after) {
      sense.track_offset(code, after);
      ASSERT_LE(std::abs(sense.offset() - 2100.0F), 16.0F) << after;
    }
    EXPECT_EQ(sense.offset(), 2100.0F + sign * 16.0F);
    // From then on as fast as the temperature may do it, and not held where driving began.
    for (unsigned after = 252; after < 268; ++after) sense.track_offset(code, after);
    EXPECT_NEAR(sense.offset(), 2100.0F + sign * 17.0F, 0.01F);
    // Where driving ends, the bound is about what is taken off then.
    for (unsigned after = 0; after < 252; ++after) sense.track_offset(2100, after);
    EXPECT_NEAR(sense.offset(), 2100.0F + sign * 1.0F, 0.01F);
  }
}

TEST(CurrentSense, ACalibrationJustBehindDrivingMovesTheBound) {
  CurrentSense sense{at_40};
  sense.track_offset(2048, 0);
  sense.set_offset(2148.0F);
  sense.track_offset(2148, 1);
  EXPECT_EQ(sense.offset(), 2148.0F);
}

TEST(OffsetCalibration, TakesExactlyItsSamples) {
  OffsetCalibration calibration{{.log2_samples = 3}};
  for (int i = 0; i < 7; ++i) EXPECT_EQ(calibration.ISR_add(2050), OffsetResult::running) << i;
  EXPECT_EQ(calibration.offset(), 0.0F);
  EXPECT_EQ(calibration.ISR_add(2058), OffsetResult::accepted);
  EXPECT_EQ(calibration.offset(), 2051.0F);
  EXPECT_EQ(calibration.spread(), 8);
  EXPECT_EQ(calibration.ISR_add(0), OffsetResult::accepted) << "the result stands";
  EXPECT_EQ(calibration.offset(), 2051.0F);
  calibration.restart();
  EXPECT_EQ(calibration.spread(), 0) << "of no sample";
  EXPECT_EQ(calibration.result(), OffsetResult::running);
  for (int i = 0; i < 8; ++i) calibration.ISR_add(2040);
  EXPECT_EQ(calibration.offset(), 2040.0F) << "nothing of the first run is left";
  EXPECT_EQ(calibration.spread(), 0);
}

TEST(CurrentSense, TheGainIsTheLargestThatReadsTheCurrent) {
  EXPECT_EQ(gain_for_current(0.0F, shunt), CurrentSenseGain::x80);
  for (const auto gain : {CurrentSenseGain::x80, CurrentSenseGain::x40, CurrentSenseGain::x20}) {
    CurrentSense worst{{.shunt_ohm = shunt, .gain = gain}};
    worst.set_offset(2048.0F + static_cast<float>(offset_window(gain)));
    const float range = worst.range();
    worst.set_offset(2048.0F - static_cast<float>(offset_window(gain)));
    EXPECT_GE(worst.range(), range);
    EXPECT_EQ(gain_for_current(range, shunt), gain);
    EXPECT_EQ(gain_for_current(range * 1.0001F, shunt),
              static_cast<CurrentSenseGain>(static_cast<unsigned>(gain) - 1));
  }
  EXPECT_EQ(gain_for_current(1e6F, shunt), CurrentSenseGain::x10) << "beyond all of them";
  EXPECT_EQ(gain_for_current(std::numeric_limits<float>::quiet_NaN(), shunt), CurrentSenseGain::x10);
}

TEST(CurrentSense, TheWindowOfTheOffsetIsThatOfTheAmplifiersInput) {
  for (const auto gain :
       {CurrentSenseGain::x10, CurrentSenseGain::x20, CurrentSenseGain::x40, CurrentSenseGain::x80}) {
    const double volt_at_the_input =
        offset_window(gain) * 3.3 / 4096 / static_cast<double>(gain_factor(gain));
    EXPECT_GT(volt_at_the_input, 4.0e-3);
    EXPECT_LT(volt_at_the_input, 4.0e-3 + 16 * 3.3 / 4096 / static_cast<double>(gain_factor(gain)));
  }
}

// Whatever the codes are: between them and where it was, and no faster than by 4 codes at first and 62 codes
// a second in the end.
RC_GTEST_PROP(CurrentSense, TracksNoFurtherThanItsCodesAndNoFasterThanItMay, ()) {
  const auto first = *rc::gen::inRange<std::uint16_t>(0, 4096);
  auto after = *rc::gen::element(0U, 3U, 251U, 252U, 65'535U, 0xFFFF'FFFFU);
  const auto codes = *rc::gen::nonEmpty(
      rc::gen::container<std::vector<std::uint16_t>>(rc::gen::inRange<std::uint16_t>(0, 4096)));
  CurrentSense sense{at_40};
  sense.set_offset(first);
  float low = first, high = first;
  for (const std::uint16_t code : codes) {
    low = std::min(low, static_cast<float>(code));
    high = std::max(high, static_cast<float>(code));
    const float before = sense.offset();
    sense.track_offset(code, after);
    RC_ASSERT(std::abs(sense.offset() - before) <=
              0.0005F + 16.0F / std::min(256.0F, static_cast<float>(after) + 4.0F));
    after += after < 65'535U ? 1U : 0U;
    RC_ASSERT(sense.offset() >= low && sense.offset() <= high);
  }
}

TEST(OffsetCalibration, WindowIsInclusiveOnBothSides) {
  const auto result_of = [](std::uint16_t code) {
    OffsetCalibration calibration{{.log2_samples = 4, .window = 205}};
    for (int i = 0; i < 16; ++i) calibration.ISR_add(code);
    return calibration.result();
  };
  EXPECT_EQ(result_of(2048 + 205), OffsetResult::accepted);
  EXPECT_EQ(result_of(2048 - 205), OffsetResult::accepted);
  EXPECT_EQ(result_of(2048 + 206), OffsetResult::offset_out_of_window);
  EXPECT_EQ(result_of(2048 - 206), OffsetResult::offset_out_of_window);
  EXPECT_EQ(result_of(0), OffsetResult::offset_out_of_window) << "input shorted to ground";
  EXPECT_EQ(result_of(4095), OffsetResult::offset_out_of_window);
}

TEST(OffsetCalibration, OneOutlierIsTooMuchSpread) {
  for (const int at : {0, 7, 15}) {
    OffsetCalibration calibration{{.log2_samples = 4, .largest_spread = 64}};
    for (int i = 0; i < 16; ++i) calibration.ISR_add(i == at ? 2113 : 2048);
    EXPECT_EQ(calibration.result(), OffsetResult::spread_too_large) << at;
  }
  OffsetCalibration calibration{{.log2_samples = 4, .largest_spread = 64}};
  for (int i = 0; i < 16; ++i) calibration.ISR_add(i == 3 ? 2112 : 2048);
  EXPECT_EQ(calibration.result(), OffsetResult::accepted);
}

TEST(OffsetCalibration, TheLongestRunDoesNotOverflow) {
  OffsetCalibration calibration{{.log2_samples = 16, .window = 2048}};
  for (unsigned i = 0; i < 65'535; ++i) ASSERT_EQ(calibration.ISR_add(4095), OffsetResult::running);
  EXPECT_EQ(calibration.ISR_add(4095), OffsetResult::accepted);
  EXPECT_EQ(calibration.offset(), 4095.0F);
  // More is cut to that, not shifted out of the word.
  OffsetCalibration cut{{.log2_samples = 40}};
  for (unsigned i = 0; i < 65'535; ++i) cut.ISR_add(2048);
  EXPECT_EQ(cut.result(), OffsetResult::running);
  EXPECT_EQ(cut.ISR_add(2048), OffsetResult::accepted);
}

RC_GTEST_PROP(OffsetCalibration, IsTheMean, ()) {
  const auto log2_samples = *rc::gen::inRange<std::uint8_t>(0, 9);
  const auto codes = *rc::gen::container<std::vector<std::uint16_t>>(
      1U << log2_samples, rc::gen::inRange<std::uint16_t>(2020, 2080));
  OffsetCalibration calibration{{.log2_samples = log2_samples}};
  for (const std::uint16_t code : codes) calibration.ISR_add(code);
  const double mean = std::accumulate(codes.begin(), codes.end(), 0.0) / static_cast<double>(codes.size());
  RC_ASSERT(calibration.result() == OffsetResult::accepted);
  RC_ASSERT(static_cast<double>(calibration.offset()) == mean);
}

}  // namespace kmax::drivers::current_sense_test
