#include "host_tools/simulation/axis_encoder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace kmax::simulation::axis_encoder_test {
namespace {

constexpr double count = 0x1p-20;  // m

EncoderConfig config_of() {
  EncoderConfig config;
  config.counts_per_turn = 4000.0;
  config.transmission = 4000.0 * count / 6.283185307179586;
  return config;
}

TEST(AxisEncoder, WithoutDefectsIsTheIdealOneToTheCount) {
  const EncoderModel ideal(config_of().count_length());
  AxisEncoder encoder(config_of(), 0.3, 1);
  for (int n = -1000; n < 1000; ++n) {
    const double position = 1e-4 * std::sin(0.37 * n) + 1e-7 * n;
    EXPECT_EQ(encoder.sample(position), ideal.counts(position));
    EXPECT_EQ(encoder.counts(-position), ideal.counts(-position));
  }
  EXPECT_EQ(encoder.lost_edges(), 0);
  EncoderConfig odd = config_of();
  odd.counts_per_turn = 16.5;  // no lines, so any unit will do
  EXPECT_NO_THROW(AxisEncoder(odd, 0.0, 1));
  odd.edge_noise = 0.1;
  EXPECT_THROW(AxisEncoder(odd, 0.0, 1), std::invalid_argument);
}

TEST(AxisEncoder, WithNoiseEveryLookIsAnother) {
  EncoderConfig config = config_of();
  config.edge_noise = 2.0;
  AxisEncoder encoder(config, 10.5 * count, 7), same(config, 10.5 * count, 7), other(config, 10.5 * count, 8);
  EXPECT_EQ(encoder.counts(0.0), 10u) << "nobody has looked yet";
  double sum = 0.0, squares = 0.0;
  bool differs = false;
  constexpr int looks = 20000;
  for (int n = 0; n < looks; ++n) {
    const auto seen = static_cast<std::int32_t>(encoder.sample(10.5 * count));
    EXPECT_EQ(encoder.counts(0.0), static_cast<std::uint32_t>(seen)) << "asking again is not looking again";
    EXPECT_EQ(same.sample(10.5 * count), static_cast<std::uint32_t>(seen));
    differs = differs || other.sample(10.5 * count) != static_cast<std::uint32_t>(seen);
    sum += seen - 10;
    squares += (seen - 10) * (seen - 10);
  }
  EXPECT_TRUE(differs);
  EXPECT_NEAR(sum / looks, 0.0, 0.06);
  EXPECT_NEAR(squares / looks, 4.0 + 1.0 / 12.0, 0.15);
}

TEST(AxisEncoder, CountsBelowZeroWrapAsATimerDoes) {
  EncoderConfig config = config_of();
  config.dropout_probability = 1e-12;
  AxisEncoder encoder(config, 0.5 * count, 1);
  EXPECT_EQ(encoder.sample(-0.5 * count), 0xFFFFFFFFu);
  EXPECT_EQ(encoder.sample(0.5 * count), 0u);
}

TEST(AxisEncoder, DropoutsAreCounted) {
  EncoderConfig config = config_of();
  config.dropout_probability = 0.1;
  AxisEncoder encoder(config, 0.5 * count, 1);
  const std::uint32_t seen = encoder.sample(1000.5 * count);
  EXPECT_EQ(seen, static_cast<std::uint32_t>(1000 - encoder.lost_edges()));
  EXPECT_NEAR(static_cast<double>(encoder.lost_edges()), 100.0, 40.0);
}

TEST(AxisEncoder, RefusesWhatCannotBeCounted) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EncoderConfig config = config_of();
  EXPECT_THROW(AxisEncoder(config, 0.0, 1).sample(nan), std::domain_error);
  config.edge_noise = 0.5;
  EXPECT_THROW(AxisEncoder(config, 0.0, 1).sample(nan), std::domain_error);
  config.edge_noise = nan;
  config.dropout_probability = 0.5;
  EXPECT_THROW(AxisEncoder(config, 0.0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace kmax::simulation::axis_encoder_test
