#include "host_tools/simulation/scene_drives.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::simulation::scene_drives_test {

using Channel = CurrentSensor::Channel;

constexpr const char* free_text = R"(
[supply]
voltage = 24.0
[device]
mass = 0.05
damping = 0.5
friction = 0.0
force_limit = 0.0
[encoder]
transmission = 0.01
counts_per_turn = 8192
)";

Scene scene_of(const std::string& motor, const std::string& more = "") {
  return parse_scene(std::string(free_text) + "[motor]\n" + motor + "\n" + more, "s");
}
Scene dc() {
  return scene_of("kind = \"dc\"");
}
Scene pmsm() {
  return scene_of("kind = \"pmsm\"");
}

InverterCommand duties(double a, double b, double c) {
  return {{{{true, a}, {true, b}, {true, c}}}};
}
InverterCommand brushed(double b, double c) {
  return {{{{false, 0.0}, {true, b}, {true, c}}}};
}

void run(SceneDrives& drives, const InverterCommand& command, double duration) {
  drives.set_bridge(0, command);
  for (int n = 0; n < std::lround(duration / 25e-6); ++n) drives.advance(25e-6);
}

TEST(SceneDrives, AxesWithoutAMotorAreOpenConnectors) {
  SceneDrives drives(parse_scene("[device]\n[axis1.device]\n[axis1.motor]\nkind = \"dc\"\n", "s"));
  EXPECT_FALSE(drives.has(0));
  EXPECT_TRUE(drives.has(1));
  EXPECT_FALSE(drives.has(2));
  EXPECT_TRUE(drives.any());
  EXPECT_THROW(drives.drive(0), std::out_of_range);
  EXPECT_THROW(drives.plant(0, Defect::encoder_stuck), std::out_of_range);
  run(drives, brushed(0.9, 0.1), 1e-3);
  EXPECT_NEAR(drives.supply().source_charge(), 0.0, 1e-12);
  EXPECT_FALSE(SceneDrives(parse_scene("[device]\n", "s")).any());
}

TEST(SceneDrives, RefusesWhatABoardHasNoPlaceFor) {
  Scene scene = dc();
  scene.axes.resize(3, scene.axes[0]);
  EXPECT_THROW(SceneDrives{scene}, std::invalid_argument);
  Scene serial = dc();
  serial.axes[0].encoder.kind = EncoderKind::as5047p;
  serial.axes.push_back(serial.axes[0]);
  EXPECT_THROW(SceneDrives{serial}, std::invalid_argument);
  serial.axes[1].encoder.kind = EncoderKind::quadrature;
  EXPECT_NO_THROW(SceneDrives{serial});
}

TEST(SceneDrives, AFreeHandleIsLetGoWhenItIsFirstDriven) {
  Scene scene = pmsm();
  auto& motor = std::get<SynchronousMotorConfig>(*scene.axes[0].motor);
  motor.cogging_torque = 1e-3;
  scene.axes[0].start.position = 1e-4;  // not where it would cog to
  SceneDrives drives(scene);
  run(drives, {}, 0.1);
  EXPECT_EQ(drives.drive(0).handle().position(), 1e-4);
  run(drives, duties(0.5, 0.5, 0.5), 0.1);
  const double moved = drives.drive(0).handle().position();
  EXPECT_NE(moved, 1e-4);
  run(drives, {}, 0.01);
  EXPECT_NE(drives.drive(0).handle().position(), moved) << "it stays free";
}

TEST(SceneDrives, APersonBeginsWheneverTheAxisBeginsToBeDriven) {
  SceneDrives drives(scene_of("kind = \"dc\"", "[operator]\n[motion]\nstart_position = 0.02\n"));
  run(drives, {}, 0.2);
  EXPECT_EQ(drives.drive(0).handle().intended_position(), 0.02);
  run(drives, brushed(0.5, 0.5), 0.05);
  EXPECT_LT(drives.drive(0).handle().intended_position(), 0.015);
  run(drives, {}, 6.0);
  const double back = drives.drive(0).handle().intended_position();
  EXPECT_NEAR(back, 0.02, 5e-3);
  run(drives, brushed(0.5, 0.5), 0.05);
  EXPECT_LT(drives.drive(0).handle().intended_position(), back - 5e-3);
}

// Long intervals are divided; the sum of the steps is the interval.
TEST(SceneDrives, ALongIntervalIsThatManyShortOnes) {
  SceneDrives one(dc()), many(dc());
  one.set_bridge(0, brushed(0.51, 0.49));
  many.set_bridge(0, brushed(0.51, 0.49));
  one.advance(0.025);
  for (int n = 0; n < 2; ++n) many.advance(0.01);
  many.advance(0.005);
  EXPECT_NEAR(one.drive(0).handle().position(), many.drive(0).handle().position(), 1e-12);
  EXPECT_GT(one.drive(0).handle().position(), 1e-5);
}

TEST(Defects, OpenPhasesCarryNoCurrentUntilMended) {
  const std::pair<Defect, std::size_t> wires[] = {{Defect::phase_a_open, terminal_a},
                                                  {Defect::phase_b_open, terminal_b},
                                                  {Defect::phase_c_open, terminal_c}};
  for (const auto& [defect, terminal] : wires) {
    SceneDrives drives(pmsm());
    drives.drive(0).block(true);
    const InverterCommand command = duties(0.52, 0.46, 0.51);
    run(drives, command, 0.005);
    ASSERT_GT(std::abs(drives.drive(0).currents()[terminal]), 0.3);
    drives.plant(0, defect);
    EXPECT_TRUE(drives.planted(0, defect));
    run(drives, command, 0.005);
    EXPECT_NEAR(drives.drive(0).currents()[terminal], 0.0, 1e-12) << name_of(defect);
    drives.mend(0, defect);
    run(drives, command, 0.005);
    EXPECT_GT(std::abs(drives.drive(0).currents()[terminal]), 0.3);
  }
}

TEST(Defects, SwappedPhasesTurnTheForceRound) {
  SceneDrives good(dc()), bad(dc());
  bad.plant(0, Defect::phases_swapped);
  bad.plant(0, Defect::phases_swapped);  // planted already
  for (SceneDrives* drives : {&good, &bad}) {
    drives->drive(0).block(true);
    run(*drives, brushed(0.52, 0.48), 0.01);
  }
  EXPECT_GT(good.drive(0).force(), 2.0);
  EXPECT_EQ(bad.drive(0).force(), -good.drive(0).force());
  // The board measures its legs.
  EXPECT_EQ(bad.drive(0).current_pin(Channel::b), good.drive(0).current_pin(Channel::b));
  bad.mend(0, Defect::phases_swapped);
  run(bad, brushed(0.52, 0.48), 0.01);
  EXPECT_NEAR(bad.drive(0).force(), good.drive(0).force(), 1e-6);
}

TEST(Defects, SwappedPhasesOfASynchronousMotorMirrorItsVector) {
  SceneDrives good(pmsm()), bad(pmsm());
  bad.plant(0, Defect::phases_swapped);
  for (SceneDrives* drives : {&good, &bad}) {
    drives->drive(0).block(true);
    run(*drives, duties(0.5, 0.52, 0.48), 0.01);  // along beta: torque with d at alpha
  }
  EXPECT_GT(good.drive(0).force(), 1.0);
  EXPECT_NEAR(bad.drive(0).force(), -good.drive(0).force(), 1e-9);
}

// Runs for a while and tells by how much the encoder was off its shaft, in counts, and by how much it moved.
struct Travel {
  std::int64_t shaft, encoder;
};
Travel travel(SceneDrives& drives) {
  const MotorDrive& drive = drives.drive(0);
  const auto shaft = [&] {
    return static_cast<std::int64_t>(drive.shaft_angle() / 6.283185307179586 * 8192.0);
  };
  const Travel before{shaft(), drive.encoder().edges()};
  run(drives, brushed(0.52, 0.48), 0.05);
  return {shaft() - before.shaft, drive.encoder().edges() - before.encoder};
}

TEST(Defects, OfTheEncoder) {
  SceneDrives drives(dc());
  const auto expect_ratio = [&](double ratio, const char* when) {
    const Travel moved = travel(drives);
    ASSERT_GT(moved.shaft, 300) << when;
    EXPECT_NEAR(static_cast<double>(moved.encoder), ratio * static_cast<double>(moved.shaft), 2.0) << when;
  };
  expect_ratio(1.0, "good");
  for (const auto& [defect, ratio] : {std::pair{Defect::encoder_unplugged, 0.0},
                                      {Defect::encoder_stuck, 0.0},
                                      {Defect::encoder_reversed, -1.0},
                                      {Defect::encoder_slipping, 2.0 / 3.0}}) {
    drives.plant(0, defect);
    expect_ratio(ratio, name_of(defect).data());
    drives.mend(0, defect);
    expect_ratio(1.0, "mended");
  }
}

TEST(Defects, ReversedIsAgainstTheMounting) {
  Scene scene = dc();
  scene.axes[0].encoder.reversed = true;
  SceneDrives drives(scene);
  const Travel mounted = travel(drives);
  EXPECT_LT(mounted.encoder, -300);
  drives.plant(0, Defect::encoder_reversed);
  EXPECT_GT(travel(drives).encoder, 300);
  drives.mend(0, Defect::encoder_reversed);
  EXPECT_LT(travel(drives).encoder, -300);
}

TEST(Defects, TheSerialEncoderHasTheSameOnes) {
  Scene scene = dc();
  scene.axes[0].encoder.kind = EncoderKind::as5047p;
  SceneDrives drives(scene);
  static_cast<void>(travel(drives));
  const std::int64_t angle = drives.serial_angle(0);
  EXPECT_NEAR(static_cast<double>(angle), drives.drive(0).shaft_angle() / 6.283185307179586 * 16384.0, 1.0);
  drives.plant(0, Defect::encoder_stuck);
  static_cast<void>(travel(drives));
  EXPECT_EQ(drives.serial_angle(0), angle);
  drives.mend(0, Defect::encoder_stuck);
  drives.plant(0, Defect::encoder_unplugged);
  static_cast<void>(travel(drives));
  EXPECT_FALSE(drives.drive(0).encoder().plugged());
}

TEST(Defects, OfSupplyMotorAndSensors) {
  SceneDrives drives(dc());
  drives.plant(0, Defect::supply_low);
  EXPECT_EQ(drives.supply().voltage(), 12.0);
  run(drives, brushed(0.7, 0.3), 0.05);
  EXPECT_LT(drives.supply().voltage(), 12.0);
  drives.mend(0, Defect::supply_low);
  run(drives, brushed(0.5, 0.5), 0.01);
  EXPECT_NEAR(drives.supply().voltage(), 24.0, 0.01);

  SceneDrives blocked(dc());
  blocked.plant(0, Defect::motor_blocked);
  run(blocked, brushed(0.6, 0.4), 0.05);
  EXPECT_EQ(blocked.drive(0).handle().position(), 0.0) << "driving lets go the hand, not the jam";
  const double b = blocked.drive(0).current_pin(Channel::b) - 1.65;
  const double c = blocked.drive(0).current_pin(Channel::c) - 1.65;
  ASSERT_GT(b, 0.05);
  ASSERT_LT(c, -0.05);
  blocked.plant(0, Defect::current_b_inverted);
  EXPECT_NEAR(blocked.drive(0).current_pin(Channel::b) - 1.65, -b, 1e-12);
  EXPECT_NEAR(blocked.drive(0).current_pin(Channel::c) - 1.65, c, 1e-12);
  blocked.plant(0, Defect::current_c_inverted);
  blocked.mend(0, Defect::current_b_inverted);
  EXPECT_NEAR(blocked.drive(0).current_pin(Channel::b) - 1.65, b, 1e-12);
  EXPECT_NEAR(blocked.drive(0).current_pin(Channel::c) - 1.65, -c, 1e-12);
  blocked.mend(0, Defect::motor_blocked);
  run(blocked, brushed(0.6, 0.4), 0.01);
  EXPECT_GT(blocked.drive(0).handle().position(), 0.0);
}

TEST(Defects, ASceneMayBeginWithThem) {
  SceneDrives drives(scene_of("kind = \"dc\"\ndefects = [\"encoder_stuck\", \"current_c_inverted\"]"));
  EXPECT_TRUE(drives.planted(0, Defect::encoder_stuck));
  EXPECT_TRUE(drives.planted(0, Defect::current_c_inverted));
  EXPECT_FALSE(drives.planted(0, Defect::phase_b_open));
  EXPECT_EQ(travel(drives).encoder, 0);
}

}  // namespace kmax::simulation::scene_drives_test
