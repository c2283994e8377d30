#include "host_tools/simulated_board/simulated_board.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulated_board::simulated_board_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using simulation::SceneError;

TEST(SimulatedBoard, FilesComeBeforeSuppliedScenes) {
  const TemporaryFolder folder;
  const auto file = folder.write("touch", "duration = 2.5\n[device]\n");
  EXPECT_EQ(open_scene(file.string()).duration, 2.5);
  EXPECT_EQ(open_scene("touch").duration, 5.0);
}

TEST(SimulatedBoard, UnknownScenesNameTheSuppliedOnes) {
  for (const char* name : {"tuoch", "", "touch.toml", "/no/such.toml"})
    EXPECT_CONTAINS(thrown_message<SceneError>([&] { open_scene(name); }),
                    "supplied are compliant_structure, dc_coreless_a, dc_coreless_b, drone, free_handle, "
                    "gimbal_a, gimbal_b, motor_axes, noisy_encoder, paper1_deviation, paper1_fig_10, "
                    "paper1_fig_11, paper1_fig_12, paper1_fig_9, paper1_jitter, paper1_magnetic_limit, "
                    "paper1_plain_limit, paper2_fig_1, paper2_fig_2, single_motor, touch, two_axes");
  const TemporaryFolder folder;
  thrown_message<SceneError>([&] { open_scene(folder.path().string()); });
}

TEST(SimulatedBoard, ErrorsOfASceneHaveFileAndLine) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    return thrown_message<SceneError>([&] { open_scene(folder.write("s.toml", text).string()); });
  };
  EXPECT_CONTAINS(message("[device]\n[parameters]\nwall.stifness = 1\n"), "s.toml:3:");
  EXPECT_CONTAINS(message("[device]\n[parameters]\nwall.stifness = 1\n"), "did you mean wall.stiffness");
  EXPECT_CONTAINS(message("[device]\n\n[parameters]\nhaptic.rate = 1e9\n"), "s.toml:4:");
  EXPECT_CONTAINS(message("[device]\n[parameters]\nmeasured.position = 0\n"), "can only be read");
  EXPECT_CONTAINS(message("[device\n"), "s.toml:1:");
}

TEST(SimulatedBoard, FactorySceneHasOnlyWhatDescribesTheHardware) {
  SimulatedBoard simulation(factory_scene());
  const auto& values = simulation.board().application().values();
  const simulation::Scene touch = open_scene("touch");
  for (std::size_t entry = 0; entry < firmware::entry_count; ++entry) {
    const firmware::Entry& definition = firmware::entry_at(entry);
    const bool hardware = entry == firmware::entry_of<"encoder.counts_per_turn">() ||
                          entry == firmware::entry_of<"device.transmission">() ||
                          entry == firmware::entry_of<"device.mass">();
    if (definition.access != firmware::Access::read_write || hardware) continue;
    EXPECT_EQ(values.raw(firmware::slot_of(entry, 0)),
              firmware::raw_from_number(definition.type, definition.default_value))
        << definition.name;
  }
  EXPECT_EQ(values.real<"device.mass">(), static_cast<float>(touch.axes[0].device.mass));
}

}  // namespace kmax::simulated_board::simulated_board_test
