#include "drivers/ntc_thermistor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "board/odrive_v3/description.hpp"

namespace kmax::drivers::ntc_thermistor_test {

constexpr NtcThermistorConfig board_config = board::odrive_v3::description.thermistor;
constexpr NtcThermistor board_ntc{board_config};

double exact_celsius(double code) {
  const double resistance = 3300.0 * (4096.0 / code - 1.0);
  return 1.0 / (1.0 / 298.15 + std::log(resistance / 10'000.0) / 3434.0) - 273.15;
}

double exact_code(double celsius) {
  const double resistance = 10'000.0 * std::exp(3434.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15));
  return 4096.0 * 3300.0 / (3300.0 + resistance);
}

double largest_error(double from_celsius, double to_celsius) {
  double worst = 0.0;
  const auto last = static_cast<std::uint16_t>(exact_code(to_celsius));
  for (auto code = static_cast<std::uint16_t>(exact_code(from_celsius) + 1.0); code <= last; ++code) {
    const NtcReading reading = board_ntc.read(code);
    EXPECT_EQ(reading.state, NtcState::ok) << code;
    worst = std::max(worst, std::abs(static_cast<double>(reading.celsius) - exact_celsius(code)));
  }
  return worst;
}

TEST(NtcThermistor, ErrorAgainstTheBetaFormulaIsAsStated) {
  EXPECT_LT(largest_error(0, 120), 0.02);
  EXPECT_LT(largest_error(-20, 150), 0.07);
  EXPECT_LT(largest_error(-40, 180), 0.7);
}

// Voltages at the tap over the supply of the converter, from the board's vendor.
TEST(NtcThermistor, KnownPointsOfTheBoard) {
  struct Row {
    double ratio, celsius;
  };
  for (const Row& row : {Row{0.248, 25}, Row{0.446, 50}, Row{0.665, 80}, Row{0.770, 100}, Row{0.842, 120}}) {
    const auto code = static_cast<std::uint16_t>(std::lround(4096 * row.ratio));
    EXPECT_NEAR(static_cast<double>(board_ntc.read(code).celsius), row.celsius, 0.2) << row.celsius;
  }
}

TEST(NtcThermistor, HotterMeansALargerCodeEverywhere) {
  for (std::uint16_t code = 49; code <= 3936; ++code) {
    EXPECT_GT(board_ntc.read(code).celsius, board_ntc.read(static_cast<std::uint16_t>(code - 1)).celsius)
        << code;
  }
}

TEST(NtcThermistor, OpenAndShorted) {
  EXPECT_EQ(board_ntc.read(0).state, NtcState::open);
  EXPECT_EQ(board_ntc.read(47).state, NtcState::open);
  EXPECT_EQ(board_ntc.read(48).state, NtcState::ok);
  EXPECT_EQ(board_ntc.read(3936).state, NtcState::ok);
  EXPECT_EQ(board_ntc.read(3937).state, NtcState::shorted);
  EXPECT_EQ(board_ntc.read(4095).state, NtcState::shorted);
  EXPECT_EQ(board_ntc.read(0xFFFF).state, NtcState::shorted);
  EXPECT_NEAR(static_cast<double>(board_ntc.read(0).celsius), -42, 1.5);
  EXPECT_NEAR(static_cast<double>(board_ntc.read(4095).celsius), 203, 1.5);
}

TEST(NtcThermistor, CodesBeyondTheConverterReadAsItsLast) {
  static constexpr NtcThermistor whole{[] {
    NtcThermistorConfig config = board_config;
    config.shorted_above = 0xFFFF;
    return config;
  }()};
  for (const std::uint16_t code : {std::uint16_t{4096}, std::uint16_t{0xFFFF}})
    EXPECT_EQ(whole.read(code).celsius, whole.read(4095).celsius) << code;
}

TEST(NtcThermistor, StatedStepsPerCode) {
  const auto step = [](std::uint16_t code) {
    return static_cast<double>(board_ntc.read(static_cast<std::uint16_t>(code + 1)).celsius -
                               board_ntc.read(code).celsius);
  };
  EXPECT_NEAR(step(1016), 0.034, 0.001);
  EXPECT_NEAR(step(3450), 0.081, 0.004);
}

TEST(NtcThermistor, OtherPartsAndResistors) {
  static constexpr NtcThermistor other{{.resistance_25_ohm = 47'000.0,
                                        .beta_kelvin = 4050.0,
                                        .ground_resistor_ohm = 10'000.0,
                                        .open_below = 48,
                                        .shorted_above = 3936}};
  for (const double celsius : {0.0, 25.0, 60.0, 90.0}) {
    const double resistance = 47'000.0 * std::exp(4050.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15));
    const auto code = static_cast<std::uint16_t>(std::lround(4096.0 * 10'000.0 / (10'000.0 + resistance)));
    EXPECT_NEAR(static_cast<double>(other.read(code).celsius), celsius, 0.1) << celsius;
  }
}

}  // namespace kmax::drivers::ntc_thermistor_test
