#include "host_tools/simulation/quadrature_encoder.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "host_tools/simulation/encoder_config.hpp"
#include "host_tools/simulation/encoder_coupling.hpp"

namespace kmax::simulation::quadrature_encoder_test {

constexpr double count = 0x1p-20;  // m; a power of two, so that positions have no rounding of their own

EncoderConfig config_of(double counts_per_turn = 16.0) {
  return EncoderConfig{.counts_per_turn = counts_per_turn,
                       .transmission = counts_per_turn * count / 6.283185307179586};
}

// What a timer in encoder mode counts from one pair of levels to the next.
int decoded(const EncoderLines& from, const EncoderLines& to) {
  const auto gray = [](const EncoderLines& lines) { return lines.b ? (lines.a ? 2 : 3) : (lines.a ? 1 : 0); };
  const int step = (gray(to) - gray(from) + 4) & 3;
  EXPECT_NE(step, 2) << "both lines changed at once";
  return step == 3 ? -1 : step;
}

TEST(QuadratureEncoder, LinesDecodeToTheEdges) {
  QuadratureEncoder encoder(config_of(), 0.5 * count);
  EXPECT_EQ(encoder.edges(), 0);
  std::int64_t decoder = 0;
  EncoderLines last = encoder.lines();
  EXPECT_EQ(last, (EncoderLines{false, false, true}));
  const auto visit = [&](int n) {
    encoder.update((n + 0.5) * count);
    decoder += decoded(last, encoder.lines());
    last = encoder.lines();
    EXPECT_EQ(encoder.edges(), n);
    EXPECT_EQ(decoder, n);
  };
  for (int n = 0; n <= 40; ++n) visit(n);
  for (int n = 39; n >= -40; --n) visit(n);
  QuadratureEncoder forward(config_of(), 0.5 * count);
  forward.update(1.5 * count);
  EXPECT_TRUE(forward.lines().a && !forward.lines().b) << "A leads B upwards";
}

TEST(QuadratureEncoder, TheIndexIsHighOnceATurnAndOneStateWide) {
  EncoderConfig config = config_of();
  config.index_position = 5.0;
  QuadratureEncoder encoder(config, 0.0);
  for (int n = -64; n < 64; ++n) {
    encoder.update((n + 0.5) * count);
    EXPECT_EQ(encoder.lines().z, ((n % 16) + 16) % 16 == 5) << n;
  }
}

TEST(QuadratureEncoder, BeginsWithTheDiscsCountAndCountsFarAway) {
  QuadratureEncoder encoder(config_of(), -7.5 * count);
  EXPECT_EQ(encoder.edges(), -8);
  encoder.update(0x1p40 * count);
  EXPECT_EQ(encoder.edges(), std::int64_t{1} << 40);
}

TEST(QuadratureEncoder, UnpluggedAllLinesAreHighAndNothingCounts) {
  QuadratureEncoder encoder(config_of(), 0.5 * count);
  encoder.update(3.5 * count);
  encoder.set_plugged(false);
  for (int n = 3; n < 30; ++n) {
    encoder.update((n + 0.5) * count);
    EXPECT_EQ(encoder.lines(), (EncoderLines{true, true, true}));
    EXPECT_EQ(encoder.edges(), 3);
  }
  encoder.set_plugged(true);
  EXPECT_EQ(encoder.edges(), 3) << "what happened meanwhile is lost";
  encoder.update(31.5 * count);
  EXPECT_EQ(encoder.edges(), 5);
  EXPECT_TRUE((encoder.update(32.5 * count), encoder.lines().z)) << "the disc is where it is";
}

TEST(QuadratureEncoder, DropoutsLoseEdgesButNotTheIndex) {
  EncoderConfig config = config_of();
  config.dropout_probability = 0.01;
  QuadratureEncoder encoder(config, 0.5 * count, 3);
  constexpr int edges = 100000;
  for (int n = 1; n <= edges; ++n) {
    encoder.update((n + 0.5) * count);
    EXPECT_EQ(encoder.lines().z, n % 16 == 0);
  }
  EXPECT_EQ(encoder.edges() + encoder.lost_edges(), edges);
  EXPECT_NEAR(static_cast<double>(encoder.lost_edges()), 0.01 * edges, 4 * std::sqrt(0.01 * edges));
  // Several edges at once are lost one by one.
  QuadratureEncoder quick(config, 0.5 * count, 3);
  quick.update((edges + 0.5) * count);
  EXPECT_EQ(quick.edges(), encoder.edges());
  quick.update(-0.5 * count);
  EXPECT_GT(quick.lost_edges(), 1.5 * static_cast<double>(encoder.lost_edges()));
  config.dropout_probability = 1.0;
  QuadratureEncoder dead(config, 0.5 * count, 3);
  dead.update(50.5 * count);
  EXPECT_EQ(dead.edges(), 0);
}

TEST(QuadratureEncoder, TheSameSeedGivesTheSameDefects) {
  EncoderConfig config = config_of();
  config.dropout_probability = 0.3;
  config.edge_noise = 0.5;
  QuadratureEncoder one(config, 0.0, 11), two(config, 0.0, 11), other(config, 0.0, 12);
  bool differs = false;
  for (int n = 0; n < 500; ++n) {
    const double position = 30.0 * std::sin(0.05 * n) * count;
    one.update(position);
    two.update(position);
    other.update(position);
    ASSERT_EQ(one.edges(), two.edges());
    differs = differs || one.edges() != other.edges();
  }
  EXPECT_TRUE(differs);
}

TEST(QuadratureEncoder, EdgeNoiseChattersAtAnEdgeAndNowhereElse) {
  EncoderConfig config = config_of();
  config.edge_noise = 0.02;
  QuadratureEncoder encoder(config, 10.0 * count);
  int changes = 0;
  std::int64_t last = encoder.edges();
  for (int n = 0; n < 1000; ++n) {
    encoder.update(10.0 * count);
    changes += encoder.edges() != last ? 1 : 0;
    last = encoder.edges();
    EXPECT_TRUE(last == 9 || last == 10) << last;
  }
  EXPECT_GT(changes, 300);
  for (int n = 0; n < 1000; ++n) {
    encoder.update(10.5 * count);
    EXPECT_EQ(encoder.edges(), 10);
  }
}

TEST(QuadratureEncoder, RefusesWhatCannotBeCounted) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EncoderConfig config = config_of();
  config.index_position = 16.0;
  EXPECT_THROW(QuadratureEncoder(config, 0.0), std::invalid_argument);
  config.index_position = 0.5;
  EXPECT_THROW(QuadratureEncoder(config, 0.0), std::invalid_argument);
  config = config_of(16.5);
  EXPECT_THROW(QuadratureEncoder(config, 0.0), std::invalid_argument);
  config = config_of();
  config.dropout_probability = nan;
  EXPECT_THROW(QuadratureEncoder(config, 0.0), std::invalid_argument);
  config = config_of();
  config.counts_per_turn = nan;
  EXPECT_THROW(QuadratureEncoder(config, 0.0), std::invalid_argument);
  QuadratureEncoder encoder(config_of(), 0.0);
  EXPECT_THROW(encoder.update(nan), std::domain_error);
}

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

TEST(AxisEncoder, WithoutDefectsIsTheIdealOneToTheCount) {
  const EncoderModel ideal(config_of(4000.0).count_length());
  AxisEncoder encoder(config_of(4000.0), 0.3, 1);
  for (int n = -1000; n < 1000; ++n) {
    const double position = 1e-4 * std::sin(0.37 * n) + 1e-7 * n;
    EXPECT_EQ(encoder.sample(position), ideal.counts(position));
    EXPECT_EQ(encoder.counts(-position), ideal.counts(-position));
  }
  EXPECT_EQ(encoder.lost_edges(), 0);
  EncoderConfig odd = config_of(4000.0);
  odd.counts_per_turn = 16.5;  // no lines, so any unit will do
  EXPECT_NO_THROW(AxisEncoder(odd, 0.0, 1));
  odd.edge_noise = 0.1;
  EXPECT_THROW(AxisEncoder(odd, 0.0, 1), std::invalid_argument);
}

TEST(AxisEncoder, WithNoiseEveryLookIsAnother) {
  EncoderConfig config = config_of(4000.0);
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
  EncoderConfig config = config_of(4000.0);
  config.dropout_probability = 1e-12;
  AxisEncoder encoder(config, 0.5 * count, 1);
  EXPECT_EQ(encoder.sample(-0.5 * count), 0xFFFFFFFFu);
  EXPECT_EQ(encoder.sample(0.5 * count), 0u);
}

TEST(AxisEncoder, DropoutsAreCounted) {
  EncoderConfig config = config_of(4000.0);
  config.dropout_probability = 0.1;
  AxisEncoder encoder(config, 0.5 * count, 1);
  const std::uint32_t seen = encoder.sample(1000.5 * count);
  EXPECT_EQ(seen, static_cast<std::uint32_t>(1000 - encoder.lost_edges()));
  EXPECT_NEAR(static_cast<double>(encoder.lost_edges()), 100.0, 40.0);
}

TEST(AxisEncoder, RefusesWhatCannotBeCounted) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EncoderConfig config = config_of(4000.0);
  EXPECT_THROW(AxisEncoder(config, 0.0, 1).sample(nan), std::domain_error);
  config.edge_noise = 0.5;
  EXPECT_THROW(AxisEncoder(config, 0.0, 1).sample(nan), std::domain_error);
  config.edge_noise = nan;
  config.dropout_probability = 0.5;
  EXPECT_THROW(AxisEncoder(config, 0.0, 1), std::invalid_argument);
}

TEST(EncoderCoupling, WithoutDefectsTheDiscIsExactlyWhereTheShaftIs) {
  EncoderCoupling coupling(0.1, false);
  EXPECT_EQ(coupling.disc(), 0.1);
  for (const double position : {0.3, -0.7, 1e-9, 0.123456789}) {
    coupling.update(position, 5.0);
    EXPECT_EQ(coupling.disc(), position);
  }
}

TEST(EncoderCoupling, MountedTheOtherWayRoundItIsTheMirrorImage) {
  EncoderCoupling coupling(0.1, true);
  EXPECT_EQ(coupling.disc(), -0.1);
  coupling.update(0.3, 0.0);
  EXPECT_EQ(coupling.disc(), -0.3);
}

TEST(EncoderCoupling, ADefectActsOnTheMotionThatFollowsAndNothingJumps) {
  EncoderCoupling coupling(0.0, false);
  coupling.update(0.5, 0.0);
  coupling.set_reversed(true);
  coupling.update(0.5, 0.0);
  EXPECT_EQ(coupling.disc(), 0.5);
  coupling.update(0.75, 0.0);
  EXPECT_EQ(coupling.disc(), 0.25);
  coupling.set_reversed(false);
  coupling.update(1.0, 0.0);
  EXPECT_EQ(coupling.disc(), 0.5);
  coupling.set_stuck(true);
  coupling.update(-3.0, 0.0);
  EXPECT_EQ(coupling.disc(), 0.5);
  coupling.set_stuck(false);
  coupling.update(-2.0, 0.0);
  EXPECT_EQ(coupling.disc(), 1.5);
}

TEST(EncoderCoupling, SlipLosesItsShareInBothDirections) {
  EncoderCoupling coupling(0.0, false);
  coupling.set_slip(0.25);
  coupling.update(1.0, 0.0);
  EXPECT_EQ(coupling.disc(), 0.75);
  coupling.update(-1.0, 0.0);
  EXPECT_EQ(coupling.disc(), -0.75);
  coupling.set_slip(1.0);
  coupling.update(5.0, 0.0);
  EXPECT_EQ(coupling.disc(), -0.75);
  coupling.set_slip(0.0);
  coupling.update(6.0, 0.0);
  EXPECT_EQ(coupling.disc(), 0.25);
}

TEST(EncoderCoupling, AHubThatHoldsUpToATorqueSlipsAboveItOnly) {
  EncoderCoupling coupling(0.0, false);
  coupling.set_slip(0.5, 0.02);
  coupling.update(1.0, 0.0199);
  EXPECT_EQ(coupling.disc(), 1.0);
  coupling.update(2.0, -0.02);
  EXPECT_EQ(coupling.disc(), 1.5);
  coupling.update(1.0, 0.0);
  EXPECT_EQ(coupling.disc(), 0.5) << "what is lost stays lost";
  EncoderCoupling reversed(0.0, true);
  reversed.set_slip(0.5, 0.02);
  reversed.update(1.0, 0.03);
  EXPECT_EQ(reversed.disc(), -0.5);
}

TEST(EncoderCoupling, RefusesWhatIsNoShareOrTorque) {
  EncoderCoupling coupling(0.0, false);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double share : {-0.1, 1.1, nan}) EXPECT_THROW(coupling.set_slip(share), std::invalid_argument);
  for (const double torque : {-1.0, nan, 1e7})
    EXPECT_THROW(coupling.set_slip(0.5, torque), std::invalid_argument);
  coupling.update(1.0, 10.0);
  EXPECT_EQ(coupling.disc(), 1.0);
}

}  // namespace kmax::simulation::quadrature_encoder_test
