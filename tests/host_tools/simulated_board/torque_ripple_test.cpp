#include "tests/host_tools/simulated_board/torque_ripple.hpp"

#include <gtest/gtest.h>

#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::torque_ripple::torque_ripple_test {

using simulated_board::open_scene;

constexpr double unbounded = 100.0;

class TorqueRipple : public testing::TestWithParam<const char*> {
 protected:
  simulation::Scene scene_ = open_scene(GetParam());
  double friction() const { return scene_.axes[0].device.friction; }
  double cogging() const {
    const auto* motor = std::get_if<simulation::SynchronousMotorConfig>(&*scene_.axes[0].motor);
    return motor == nullptr ? 0.0 : motor->cogging_torque / scene_.axes[0].encoder.transmission;
  }
  Felt moving(const Compensations& on) const { return Rig(scene_, on).moving(); }
  Felt standing(const Compensations& on) const { return Rig(scene_, on).standing(8); }
};

// What is felt without compensation is what the device was given: the rig measures the right thing.
TEST_P(TorqueRipple, WithoutCompensationAllOfTheDeviceIsFelt) {
  const Felt felt = moving({});
  const double rms = std::sqrt(friction() * friction() + cogging() * cogging() / 2);
  EXPECT_GT(felt.rms, 0.95 * rms);
  EXPECT_LT(felt.rms, rms + gravity_constant + gravity_cosine);
  EXPECT_GT(felt.peak, friction() + cogging());
}

// With all of the truth and no bound, noise is left: the same whether the handle moves or not.
TEST_P(TorqueRipple, WithoutTheBoundAllOfItCanBeTakenAway) {
  const Compensations all{true, true, true, true, unbounded};
  const Felt moved = moving(all), held = standing(all);
  EXPECT_LT(moved.rms, 0.1 * moving({}).rms);
  EXPECT_LT(moved.rms, 1.5 * held.rms + 1e-3);
}

TEST_P(TorqueRipple, EachCompensationLessensWhatItIsFor) {
  const Felt none = moving({});
  const Felt friction_off = moving({.friction = true});
  // What the bound leaves of the friction, less nothing: 0.3 of it and the rest of the device.
  EXPECT_LT(friction_off.rms, 0.65 * none.rms);
  EXPECT_LT(friction_off.ripple, 1.02 * none.ripple);
  EXPECT_LT(moving({.gravity = true}).rms, none.rms);
  EXPECT_LT(standing({.gravity = true}).rms, standing({}).rms);
  const Felt smooth = moving({.cogging = true});
  if (cogging() > 0.0) {
    EXPECT_LT(smooth.ripple, 0.4 * none.ripple);
    EXPECT_LT(smooth.rms, none.rms);
    EXPECT_LT(standing({.cogging = true}).rms, standing({}).rms);
  } else {
    EXPECT_EQ(smooth.rms, none.rms);  // nothing to compensate: the same bits
  }
}

// All of them under the bound: lighter and smoother than without, and not rougher than the map alone, since
// friction gets only what the map leaves over.
TEST_P(TorqueRipple, TogetherUnderTheBoundTheyAreBetterThanNone) {
  const Felt none = moving({}), all = moving({true, true, true, true});
  EXPECT_LT(all.rms, none.rms);
  EXPECT_LT(all.peak, none.peak);
  EXPECT_LT(all.ripple, 0.4 * none.ripple + 0.6 * Rig(scene_, {true, true, true, true}).standing(8).ripple);
  EXPECT_LT(standing({true, true, true, true}).rms, 0.4 * standing({}).rms);
}

// At this speed the current loop makes up for the dead time; its compensation must not make it worse.
TEST_P(TorqueRipple, DeadTimeCompensationDoesNoHarm) {
  EXPECT_LT(moving({.dead_time = true}).ripple, 1.02 * moving({}).ripple);
  EXPECT_LT(standing({.dead_time = true}).ripple, 1.05 * standing({}).ripple);
}

// Where its 57 mV a leg stand against 52 mOhm they are felt once all else is gone.
TEST(TorqueRippleRig, DeadTimeCompensationSmoothsAMotorOfLowResistance) {
  const auto motor = open_scene("drone");
  Compensations on{true, true, true, true, unbounded};
  const double with = Rig(motor, on).moving().ripple;
  on.dead_time = false;
  EXPECT_LT(with, 0.9 * Rig(motor, on).moving().ripple);
}

INSTANTIATE_TEST_SUITE_P(Motors, TorqueRipple, testing::Values("dc_coreless_a", "gimbal_b", "drone"),
                         [](const auto& tested) { return std::string(tested.param); });

// A map with the wrong sign doubles the cogging, within the bound: the tests above would see one.
TEST(TorqueRippleRig, AWrongMapIsFelt) {
  const auto motor = open_scene("gimbal_b");
  const double none = Rig(motor, {}).moving().ripple;
  EXPECT_GT(Rig(motor, {.cogging = true, .limit_share = unbounded, .map_share = -1.0}).moving().ripple,
            1.9 * none);
  const double bounded = Rig(motor, {.cogging = true, .limit_share = 0.2, .map_share = -1.0}).moving().ripple;
  EXPECT_GT(bounded, 1.2 * none);
  EXPECT_LT(bounded, 1.6 * none);
}

TEST(TorqueRippleRig, NeedsAMotor) {
  EXPECT_THROW(Rig(open_scene("touch"), {}), std::invalid_argument);
}

}  // namespace kmax::torque_ripple::torque_ripple_test
