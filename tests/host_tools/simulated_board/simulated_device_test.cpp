#include "host_tools/simulated_board/simulated_device.hpp"

#include <gtest/gtest.h>

#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::simulated_board::simulated_device_test {

firmware::AxisOutput output(float force, bool enabled) {
  firmware::AxisOutput out{};
  out.force = force;
  out.enabled = enabled;
  return out;
}

void pass(SimulatedDevice& device, double duration) {
  for (int i = 0; i < duration * 20000; ++i) device.advance(50e-6);
}

TEST(SimulatedDevice, CountsArePositionsInItsOwnResolution) {
  const simulation::Scene scene = open_scene("touch");
  const SimulatedDevice device(scene);
  const double length = scene.axes[0].encoder.count_length();
  EXPECT_NEAR(static_cast<std::int32_t>(device.count(0)) * length, device.handle(0).position(), length);
  EXPECT_EQ(device.axis_count(), 1u);
}

TEST(SimulatedDevice, AnAxisThatIsNotThereStandsStill) {
  SimulatedDevice device(open_scene("touch"));
  device.drive(1, output(3.0f, true));
  pass(device, 0.01);
  EXPECT_EQ(device.count(1), 0u);
  EXPECT_TRUE(device.count_valid(1));
}

TEST(SimulatedDevice, ForceOfOneAxisMovesOnlyThatOne) {
  simulation::Scene scene = open_scene("two_axes");
  scene.axes[0] = scene.axes[1];
  SimulatedDevice device(scene);
  const double start = device.handle(0).position();
  device.drive(1, output(1.0f, true));
  pass(device, 0.05);
  EXPECT_EQ(device.handle(0).position(), start);
  EXPECT_GT(device.handle(1).position(), start + 1e-3);
  EXPECT_GT(static_cast<std::int32_t>(device.count(1)), static_cast<std::int32_t>(device.count(0)));
  EXPECT_EQ(device.axis_count(), 2u);
}

TEST(SimulatedDevice, AHandleNobodyHoldsIsLetGoWhenItIsArmed) {
  SimulatedDevice device(open_scene("free_handle"));
  const double start = device.handle(0).position();
  pass(device, 0.5);
  EXPECT_EQ(device.handle(0).position(), start);
  device.drive(0, output(0, true));
  pass(device, 0.005);
  EXPECT_LT(device.handle(0).position(), start - 3e-4);
  device.drive(0, output(0, false));
  const double later = device.handle(0).position();
  pass(device, 0.005);
  EXPECT_LT(device.handle(0).position(), later) << "it goes on without force";
}

TEST(SimulatedDevice, PlugsArePulledOneByOne) {
  SimulatedDevice device(open_scene("two_axes"));
  device.connect_encoder(1, false);
  EXPECT_TRUE(device.count_valid(0));
  EXPECT_FALSE(device.count_valid(1));
  device.connect_encoder(1, true);
  EXPECT_TRUE(device.count_valid(1));
}

TEST(SimulatedDevice, ThePersonBeginsWhenTheAxisIsArmedAndAgainWhenArmedAgain) {
  SimulatedDevice device(open_scene("touch"));
  const double start = device.handle(0).position();
  pass(device, 0.5);
  EXPECT_NEAR(device.handle(0).position(), start, 1e-4) << "nobody has said 'now'";
  device.drive(0, output(0, true));
  pass(device, 0.3);
  const double after = device.handle(0).intended_position();
  EXPECT_LT(after, start - 5e-3);
  device.drive(0, output(0, true));
  EXPECT_EQ(device.handle(0).intended_position(), after) << "already armed: the motion goes on";
  device.drive(0, output(0, false));
  pass(device, 3.0);
  device.drive(0, output(0, true));
  EXPECT_NEAR(device.handle(0).intended_position(), start, 5e-3);
}

TEST(SimulatedDevice, AnAxisWithAMotorAndOneWithoutShareABoard) {
  simulation::Scene scene = open_scene("two_axes");
  scene.axes[1].motor = simulation::BrushedDcMotorConfig{};
  SimulatedDevice device(scene);
  EXPECT_FALSE(device.has_motor(0));
  EXPECT_TRUE(device.has_motor(1));
  EXPECT_FALSE(device.sample(0).motor.present);
  EXPECT_EQ(device.sample(0).condition, firmware::Fault::none);
  const auto sample = device.sample(1);
  EXPECT_TRUE(sample.motor.present);
  EXPECT_EQ(sample.condition, firmware::Fault::power_stage) << "nobody has powered it up";
  EXPECT_EQ(device.count(1), sample.count);
  EXPECT_NEAR(device.handle(1).position(), scene.axes[1].start.position, 1e-12);
  EXPECT_NEAR(static_cast<double>(device.readings().supply_voltage), 24.0, 0.01);
  device.drive(0, output(1.0f, true));
  pass(device, 0.01);
  EXPECT_NE(device.handle(0).position(), scene.axes[0].start.position);
  EXPECT_EQ(device.handle(1).position(), scene.axes[1].start.position);
}

TEST(SimulatedDevice, APersonWithoutAMotionStaysWhenTheAxisIsArmed) {
  simulation::Scene scene = open_scene("touch");
  scene.axes[0].motion.reset();
  scene.axes[0].start.position = 0.01;
  SimulatedDevice device(scene);
  device.drive(0, output(0.0f, true));
  pass(device, 0.5);
  EXPECT_EQ(device.handle(0).position(), 0.01);
  EXPECT_EQ(device.handle(0).intended_position(), 0.01);
}

TEST(SimulatedDevice, AnEncoderWithDefectsIsLookedAtInEverySample) {
  simulation::Scene scene = open_scene("touch");
  scene.axes[0].encoder.edge_noise = 3.0;
  SimulatedDevice device(scene), same(scene);
  int changes = 0;
  std::uint32_t last = device.count(0);
  for (int n = 0; n < 100; ++n) {
    const std::uint32_t seen = device.sample(0).count;
    EXPECT_EQ(device.count(0), seen);
    EXPECT_EQ(same.sample(0).count, seen);
    changes += seen != last ? 1 : 0;
    last = seen;
  }
  EXPECT_GT(changes, 50) << "the handle stands still, the count does not";
  scene.axes[0].encoder.edge_noise = 0.0;
  scene.axes[0].encoder.dropout_probability = 1.0;
  SimulatedDevice dead(scene);
  const std::uint32_t start = dead.sample(0).count;
  dead.drive(0, output(0.0f, true));
  pass(dead, 0.3);
  EXPECT_EQ(dead.sample(0).count, start);
  EXPECT_GT(dead.lost_edges(0), 100);
  EXPECT_EQ(dead.lost_edges(1), 0);
}

TEST(SimulatedDevice, OnePersonOnBothAxesAnswersToBothBackgroundForces) {
  simulation::Scene scene = open_scene("paper1_deviation");
  const auto activation = [&](bool same_person) {
    scene.axes[1].same_person = same_person;
    SimulatedDevice device(scene);
    device.drive(0, output(0.0f, true));
    device.drive(1, output(0.0f, true));
    device.set_background_force(0, 3.0f);
    device.set_background_force(1, 4.0f);
    pass(device, 3.0);
    return std::pair(device.handle(0).activation(), device.handle(1).activation());
  };
  EXPECT_NEAR(activation(true).first, 5.0, 0.01) << "they stand at right angles";
  EXPECT_NEAR(activation(true).second, 5.0, 0.01);
  EXPECT_NEAR(activation(false).first, 3.0, 0.01);
  EXPECT_NEAR(activation(false).second, 4.0, 0.01);
}

TEST(SimulatedDevice, WithoutAMotorThereIsNoPowerStage) {
  SimulatedDevice device(open_scene("touch"));
  EXPECT_FALSE(device.has_motor(0));
  EXPECT_FALSE(device.has_motor(7));
  EXPECT_THROW(device.power(), std::logic_error);
  EXPECT_EQ(device.readings().supply_voltage, 0.0f);
}

TEST(SimulatedDevice, ThePlugOfAMotorsEncoder) {
  SimulatedDevice device(open_scene("gimbal_a"));
  EXPECT_TRUE(device.power().drives().drive(0).encoder().plugged());
  device.connect_encoder(0, false);
  EXPECT_TRUE(device.power().drives().planted(0, simulation::Defect::encoder_unplugged));
  device.connect_encoder(0, true);
  EXPECT_TRUE(device.power().drives().drive(0).encoder().plugged());
}

TEST(SimulatedDevice, ABoardHasTwoAxes) {
  simulation::Scene scene = open_scene("two_axes");
  scene.axes.push_back(scene.axes[0]);
  EXPECT_THROW(SimulatedDevice device(scene), std::invalid_argument);
}

}  // namespace kmax::simulated_board::simulated_device_test
