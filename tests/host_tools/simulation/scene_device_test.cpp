// scene_axis.hpp, through the scenes that it reads.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "host_tools/simulation/scene.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::scene_device_test {
namespace {

TEST(SceneDevice, ReadsStructureDelayAndIntegrator) {
  const Scene scene = parse_scene(R"(
[device]
delay = 0.7e-3
[structure]
stiffness = 2310
damping = 0.5
handle_mass = 0.02
[axis1.device]
[axis1.structure]
[integrator]
kind = "rk4"
substeps = 40
)",
                                  "s.toml");
  EXPECT_EQ(scene.axes[0].device.delay, 0.7e-3);
  ASSERT_TRUE(scene.axes[0].device.structure);
  EXPECT_EQ(scene.axes[0].device.structure->stiffness, 2310.0);
  EXPECT_EQ(scene.axes[0].device.structure->damping, 0.5);
  EXPECT_EQ(scene.axes[0].device.structure->handle_mass, 0.02);
  EXPECT_EQ(scene.axes[1].device.delay, 0.0);
  ASSERT_TRUE(scene.axes[1].device.structure);
  EXPECT_EQ(scene.axes[1].device.structure->stiffness, StructureModel{}.stiffness);
  EXPECT_EQ(scene.integrator.kind, IntegratorKind::rk4);
  EXPECT_EQ(scene.integrator.substeps, 40.0);
  EXPECT_EQ(scene.make_handle(1).integrator().kind, IntegratorKind::rk4);
  const Scene plain = parse_scene("[device]\n", "s.toml");
  EXPECT_FALSE(plain.axes[0].device.structure);
  EXPECT_EQ(plain.integrator.kind, IntegratorKind::exact);
  EXPECT_EQ(plain.make_handle(0).integrator().kind, IntegratorKind::exact);
}

TEST(SceneDevice, EveryIntegratorByItsName) {
  for (std::size_t n = 0; n < integrator_names.size(); ++n) {
    const Scene scene = parse_scene(
        "[device]\nstart_velocity = 0.1\n[integrator]\nkind = \"" + std::string(integrator_names[n]) + "\"\n",
        "s");
    EXPECT_EQ(scene.integrator.kind, static_cast<IntegratorKind>(n));
    CoupledHandle handle = scene.make_handle(0);
    handle.advance(0.05, 0.0, 2e-3);
    // 0.1 m/s against 0.093 N of friction and 0.05 N of force.
    EXPECT_NEAR(handle.velocity(), 0.1 - 2e-3 * (0.043 + 0.05 * 0.098) / 0.045, 2e-5) << n;
  }
  const Scene fine = parse_scene("[device]\n[integrator]\nkind = \"adaptive\"\ntolerance = 1e-8\n", "s");
  EXPECT_EQ(fine.integrator.tolerance, 1e-8);
}

// The motor's side is what the shaft turns; behind a motor a structure and another integrator are parts like
// any other.
TEST(SceneDevice, AStructureAndAnIntegratorBehindAMotor) {
  const std::string text =
      "[device]\n[structure]\nstiffness = 3000\n[operator]\n[motor]\nkind = \"dc\"\n[encoder]\ntransmission "
      "= 0.01\n";
  const Scene scene = parse_scene(text, "s");
  const Scene stepped = parse_scene(text + "[integrator]\nkind = \"rk4\"\n", "s");
  MotorDrive drive = scene.make_drive(0), other = stepped.make_drive(0);
  EXPECT_EQ(other.handle().integrator().kind, IntegratorKind::rk4);
  Supply supply = scene.make_supply(), second = scene.make_supply();
  for (int n = 0; n < 4000; ++n) {
    drive.advance(25e-6, {{{{false, 0.0}, {true, 0.52}, {true, 0.48}}}}, supply);
    other.advance(25e-6, {{{{false, 0.0}, {true, 0.52}, {true, 0.48}}}}, second);
  }
  EXPECT_GT(drive.force(), 0.5);
  EXPECT_GT(std::abs(drive.handle().position() - drive.handle().tip_position()), 1e-5);
  EXPECT_DOUBLE_EQ(drive.shaft_angle(), drive.handle().position() / 0.01);
  EXPECT_NEAR(other.handle().position(), drive.handle().position(),
              1e-3 * std::abs(drive.handle().position()));
}

TEST(SceneDevice, TheSamePersonHoldsBothAxes) {
  const std::string two = "[device]\n[operator]\n[axis1.device]\n[axis1.operator]\n";
  EXPECT_FALSE(parse_scene(two, "s").axes[1].same_person);
  EXPECT_TRUE(parse_scene(two + "same_person = true\n", "s").axes[1].same_person);
  EXPECT_EQ(refusal("[device]\n[axis1.device]\n[axis1.operator]\nsame_person = true\n"),
            "bad.toml:4:15: axis1.operator.same_person = true: nobody holds axis 0; allowed is that with an "
            "[operator]");
  EXPECT_EQ(refusal(two + "same_person = 1\n"),
            "bad.toml:5:15: axis1.operator.same_person = 1: allowed is true or false");
  EXPECT_EQ(
      refusal(two + "same_person = true\n[motor]\nkind = \"dc\"\n"),
      "bad.toml:5:15: axis1.operator.same_person = true: allowed is that where neither axis has a motor of "
      "kind \"dc\" or \"pmsm\"");
  EXPECT_NE(refusal("[device]\n[operator]\nsame_person = true\n").find("unknown key"), std::string::npos);
}

}  // namespace
}  // namespace kmax::simulation::scene_device_test
