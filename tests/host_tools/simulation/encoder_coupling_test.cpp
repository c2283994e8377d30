#include "host_tools/simulation/encoder_coupling.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace kmax::simulation::encoder_coupling_test {
namespace {

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

}  // namespace
}  // namespace kmax::simulation::encoder_coupling_test
