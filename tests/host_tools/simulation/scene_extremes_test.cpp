// A value at either end of its range is a scene like any other: it is refused with a place, or it runs.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "host_tools/simulation/axis_encoder.hpp"
#include "host_tools/simulation/scene_drives.hpp"
#include "tests/host_tools/simulation/scene_keys.hpp"

namespace kmax::simulation::scene_extremes_test {
namespace {

std::optional<Scene> accepted(const std::string& text) {
  try {
    return parse_scene(text, "extreme.toml");
  } catch (const SceneError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("extreme.toml:", 0), 0u) << error.what();
    return std::nullopt;
  }
}

void expect_finite(const CoupledHandle& handle, const std::string& text) {
  for (const double value :
       {handle.position(), handle.velocity(), handle.tip_position(), handle.tip_velocity(),
        handle.hand_position(), handle.hand_velocity(), handle.intended_position()})
    ASSERT_TRUE(std::isfinite(value)) << text;
}

void run_ideal(const Scene& scene, std::size_t axis, const std::string& text) {
  CoupledHandle handle = scene.make_handle(axis);
  AxisEncoder encoder(scene.axes[axis].encoder, handle.position(), scene.seed_of(axis));
  if (scene.axes[axis].motion) handle.begin_motion();
  for (const double duration : {50e-6, 2e-3}) {
    for (int n = 0; n < 10; ++n) {
      handle.advance(n % 2 == 0 ? 3.0 : -3.0, 1.0, duration);
      encoder.sample(handle.position());
      expect_finite(handle, text);
    }
  }
}

void run_driven(const Scene& scene, const std::string& text) {
  SceneDrives drives(scene);
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis)
    drives.set_bridge(axis, {{{{true, 0.5}, {true, 0.6}, {true, 0.4}}}});
  for (int n = 0; n < 20; ++n) drives.advance(25e-6);
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    if (!drives.has(axis)) continue;
    expect_finite(drives.drive(axis).handle(), text);
    for (const double current : drives.drive(axis).currents()) ASSERT_TRUE(std::isfinite(current)) << text;
  }
}

TEST(SceneExtremes, BothEndsOfEveryRangeRunOrAreRefused) {
  int ran = 0;
  for (const Key& key : every_number()) {
    if (key.whole) continue;
    for (const double end : {key.minimum, key.maximum}) {
      const std::string text = scene_with(key, key.name, fmt::format("{:.17e}", end)).text;
      const std::optional<Scene> scene = accepted(text);
      if (!scene) continue;
      ++ran;
      for (std::size_t axis = 0; axis < scene->axes.size(); ++axis) {
        if (!scene->axes[axis].motor) run_ideal(*scene, axis, text);
      }
      try {
        run_driven(*scene, text);
      } catch (const std::invalid_argument& error) {
        // 1 um of travel per radian, or 1000 N m/A: the shaft would turn faster than anything.
        EXPECT_NE(std::string(error.what()).find("allowed are"), std::string::npos) << error.what();
        EXPECT_TRUE(key.name == "transmission" || key.name == "torque_constant") << key.name;
      }
    }
  }
  EXPECT_GT(ran, 130);
}

// The corners of the mechanical parts together: stiffest on lightest, softest on heaviest.
TEST(SceneExtremes, StiffOnLightAndSoftOnHeavy) {
  for (const bool stiff : {false, true}) {
    for (const char* integrator : {"exact", "semi_implicit_euler", "rk4"}) {
      std::string text = fmt::format("[integrator]\nkind = \"{}\"\n", integrator);
      if (stiff) {
        text +=
            "[device]\nmass = 1e-3\ndelay = 1.7e-3\n[structure]\nstiffness = 1e5\nhandle_mass = 1e-3\n"
            "[operator]\ngrip_stiffness = 1e4\nhand_mass = 1e-2\n";
      } else {
        text +=
            "[device]\nmass = 100\n[structure]\nstiffness = 1\ndamping = 0\nhandle_mass = 100\n[operator]\n"
            "grip_stiffness = 1\ngrip_damping = 0\nhand_mass = 100\narm_stiffness = 1\narm_damping = 0\n";
      }
      const std::optional<Scene> scene = accepted(text);
      ASSERT_TRUE(scene) << text;
      if (stiff && std::string(integrator) != "exact") continue;  // what a fixed step cannot do
      run_ideal(*scene, 0, text);
    }
  }
}

}  // namespace
}  // namespace kmax::simulation::scene_extremes_test
