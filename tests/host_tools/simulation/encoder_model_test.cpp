#include "host_tools/simulation/encoder_model.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <stdexcept>

namespace kmax::simulation::encoder_model_test {
namespace {

TEST(EncoderModel, CountsDownwardsFromZeroAndWraps) {
  const EncoderModel encoder(0.25e-3);  // a power-of-two part of a millimetre has no rounding of its own here
  EXPECT_EQ(encoder.counts(0.0), 0u);
  EXPECT_EQ(encoder.counts(0.2499e-3), 0u);
  EXPECT_EQ(encoder.counts(0.2501e-3), 1u);
  EXPECT_EQ(encoder.counts(-1e-12), 0xFFFFFFFFu);
  EXPECT_EQ(encoder.counts(-0.2501e-3), 0xFFFFFFFEu);
  EXPECT_EQ(encoder.extended_counts(-0.2501e-3), -2);
}

TEST(EncoderModel, WrapsAtTwoToThe32) {
  const EncoderModel encoder(1e-9);
  EXPECT_EQ(encoder.counts(4.2949672955), 0xFFFFFFFFu);
  EXPECT_EQ(encoder.counts(4.2949672965), 0u);
  EXPECT_EQ(encoder.extended_counts(4.2949672975), 4294967297);
  EXPECT_EQ(encoder.counts(4.2949672975), 1u);
  EXPECT_EQ(encoder.counts(-4.2949672975), static_cast<std::uint32_t>(-4294967298LL));
}

TEST(EncoderModel, CountLengthOfAMotorEncoder) {
  EXPECT_NEAR(count_length(4000, 0.035), 2.0 * 3.14159265358979 * 0.035 / 4000, 1e-18);
  EXPECT_NEAR(count_length(4000, 0.03501408748), 0.055e-3, 1e-14);
}

TEST(EncoderModel, RefusesWhatCannotBeCounted) {
  EXPECT_THROW(EncoderModel(0.0), std::invalid_argument);
  EXPECT_THROW(EncoderModel(-1e-6), std::invalid_argument);
  EXPECT_THROW(EncoderModel{std::numeric_limits<double>::quiet_NaN()}, std::invalid_argument);
  const EncoderModel encoder(1e-12);
  EXPECT_THROW(encoder.counts(std::numeric_limits<double>::quiet_NaN()), std::domain_error);
  EXPECT_THROW(encoder.counts(1e6), std::domain_error);
  EXPECT_THROW(encoder.counts(-std::numeric_limits<double>::infinity()), std::domain_error);
}

RC_GTEST_PROP(EncoderModel, DifferencesSurviveTheWrap, (std::int32_t from, std::int16_t by)) {
  const EncoderModel encoder(0x1p-20);
  const double start = (static_cast<double>(from) + 0.5) * 0x1p-20;
  const double end = start + by * 0x1p-20;
  RC_ASSERT(static_cast<std::int32_t>(encoder.counts(end) - encoder.counts(start)) == by);
}

}  // namespace
}  // namespace kmax::simulation::encoder_model_test
