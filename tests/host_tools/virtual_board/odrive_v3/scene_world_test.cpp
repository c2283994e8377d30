// The scene on the virtual board's connectors, and the same scene on the native board: one physical world,
// sampled and driven at the same instants, gives the same codes.
#include "host_tools/virtual_board/odrive_v3/scene_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "board/odrive_v3/description.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/simulated_board/simulated_power_hardware.hpp"
#include "host_tools/simulation/converter_code.hpp"

namespace kmax::virtual_board::scene_world_test {

using simulation::Defect;

constexpr const auto& wiring = board::odrive_v3::sampling_config;
constexpr BoardTime half_tick = units_per_second / 40'000;

/// Of every tick: the codes of B, C and the supply, the edges, the serial encoder's angle.
struct Record {
  std::vector<std::uint32_t> codes;
  friend bool operator==(const Record&, const Record&) = default;
};

simulation::Scene scene_of(const char* name) {
  return simulated_board::open_scene(name);
}

class OnWorld {
 public:
  explicit OnWorld(const simulation::Scene& scene) : world(scene) { world.set_amplifiers(0, 80.0, false, 0); }
  void tick(const simulated_board::SimulatedBridge& before, const simulated_board::SimulatedBridge& after,
            Record& record) {
    sample(record);
    set(before);
    now_ += half_tick;
    set(after);
    now_ += half_tick;
  }
  /// The world is integrated up to the board's last look; a defect is there from that moment on.
  void look() { static_cast<void>(world.encoder(0, now_)); }

  SceneWorld world;

 private:
  void sample(Record& record) {
    for (const unsigned channel :
         {unsigned{wiring.axes[0].b}, unsigned{wiring.axes[0].c}, unsigned{wiring.supply}})
      record.codes.push_back(simulation::converter_code(world.analogue(channel, now_)));
    record.codes.push_back(static_cast<std::uint32_t>(world.encoder(0, now_).edges));
    record.codes.push_back(static_cast<std::uint32_t>(world.serial_encoder(now_).angle));
  }
  void set(const simulated_board::SimulatedBridge& bridge) {
    const auto command = bridge.command();
    std::array<PwmLegOutput, 3> legs;
    for (std::size_t leg = 0; leg < 3; ++leg)
      legs[leg] = {command.legs[leg].enabled, command.legs[leg].duty, command.dead_time};
    world.set_bridge(0, legs, now_);
  }

  BoardTime now_ = 0;
};

class OnDrives {
 public:
  explicit OnDrives(const simulation::Scene& scene) : drives(scene) {
    drives.drive(0).current_sensor().set_gain(80.0);
  }
  void tick(const simulated_board::SimulatedBridge& before, const simulated_board::SimulatedBridge& after,
            Record& record) {
    using Channel = simulation::CurrentSensor::Channel;
    using simulation::converter_code;
    record.codes.push_back(converter_code(drives.drive(0).current_pin(Channel::b)));
    record.codes.push_back(converter_code(drives.drive(0).current_pin(Channel::c)));
    record.codes.push_back(converter_code(drives.supply().pin_voltage()));
    const bool serial = drives.encoder_kind(0) == simulation::EncoderKind::as5047p;
    record.codes.push_back(serial ? 0U : static_cast<std::uint32_t>(drives.drive(0).encoder().edges()));
    record.codes.push_back(serial ? static_cast<std::uint32_t>(drives.serial_angle(0)) : 0U);
    drives.set_bridge(0, before.command());
    drives.advance(25e-6);
    drives.set_bridge(0, after.command());
    drives.advance(25e-6);
  }
  void look() {}

  simulation::SceneDrives drives;
};

/// Voltage steps, in the middle of them a defect comes.
template <typename Board>
Record respond(const simulation::Scene& scene, std::optional<Defect> defect) {
  Board board(scene);
  const auto drives = [&]() -> simulation::SceneDrives& {
    if constexpr (requires { board.world; }) {
      return board.world.drives();
    } else {
      return board.drives;
    }
  };
  Record record;
  simulated_board::SimulatedBridge before, after;
  for (auto* bridge : {&before, &after}) {
    EXPECT_TRUE(bridge->pwm().enable_legs({.a = drives().drive(0).synchronous_motor() != nullptr}));
    EXPECT_TRUE(bridge->pwm().arm());
  }
  // The share of 24 V that drives some amperes through the winding, and makes up for the dead time.
  const double resistance =
      std::visit([](const auto& motor) { return motor.resistance; }, *scene.axes[0].motor);
  const auto amperes = static_cast<float>((resistance + 0.15) / 24.0);
  for (int n = 0; n < 400; ++n) {
    const float step = n % 100 < 50 ? amperes : -0.5f * amperes;
    const drivers::stm32f4::PhaseDuty duty{0.5f - step, 0.5f + step, 0.5f - step};
    static_cast<void>(after.pwm().ISR_set_duty(duty));
    after.update();
    if (n == 200) {
      board.look();
      if (defect) drives().plant(0, *defect);
    }
    board.tick(before, after, record);
    static_cast<void>(before.pwm().ISR_set_duty(duty));
    before.update();
  }
  return record;
}

TEST(SceneWorld, AgreesToTheCodeWithTheNativeBoardsWorld) {
  for (const char* name : {"dc_coreless_a", "dc_coreless_b", "gimbal_a", "gimbal_b", "drone"}) {
    for (const auto& [defect, named] : simulation::defect_names) {
      const Record world = respond<OnWorld>(scene_of(name), defect);
      const Record native = respond<OnDrives>(scene_of(name), defect);
      ASSERT_EQ(world.codes.size(), 2000u);
      const auto differ = std::mismatch(world.codes.begin(), world.codes.end(), native.codes.begin());
      EXPECT_TRUE(differ.first == world.codes.end())
          << name << ", " << named << " from word " << differ.first - world.codes.begin()
          << " on: " << *differ.first << ", " << *differ.second;
    }
  }
}

TEST(SceneWorld, EveryDefectShowsInWhatTheBoardReads) {
  for (const char* name : {"dc_coreless_a", "gimbal_a", "gimbal_b", "drone"}) {
    const bool brushed = simulation::SceneDrives(scene_of(name)).drive(0).synchronous_motor() == nullptr;
    const Record good = respond<OnWorld>(scene_of(name), std::nullopt);
    for (const auto& [defect, named] : simulation::defect_names) {
      const bool without_effect = brushed && defect == Defect::phase_a_open;
      // The codes say nothing about a chip that does not answer: SerialEncoderState::fitted does.
      if (defect == Defect::encoder_unplugged && std::string_view(name) == "gimbal_a") continue;
      if (defect == Defect::index_loose) continue;  // nor about the line Z
      EXPECT_EQ(respond<OnWorld>(scene_of(name), defect) == good, without_effect) << name << ", " << named;
    }
  }
}

TEST(SceneWorld, TheStepsAreNotLostInNoiseAndDefectsShow) {
  const Record one = respond<OnWorld>(scene_of("gimbal_b"), Defect::supply_low);
  EXPECT_GT(one.codes[5 * 49], one.codes[5 * 99] + 5) << "the current of B follows its duty";
  const Record other = respond<OnWorld>(scene_of("gimbal_b"), Defect::phase_b_open);
  EXPECT_TRUE(std::equal(one.codes.begin(), one.codes.begin() + 5 * 200, other.codes.begin()));
  EXPECT_FALSE(one == other);
}

TEST(SceneWorld, UnpluggingThroughTheWorldIsTheDefect) {
  SceneWorld world(scene_of("gimbal_a"));
  EXPECT_TRUE(world.serial_encoder(0).fitted);
  world.connect_encoder(0, false);
  EXPECT_TRUE(world.drives().planted(0, Defect::encoder_unplugged));
  EXPECT_FALSE(world.serial_encoder(0).fitted);
  world.connect_encoder(0, true);
  EXPECT_TRUE(world.serial_encoder(0).fitted);
  world.connect_encoder(1, false);  // nothing is plugged in there
  EXPECT_FALSE(world.has_drive(1));
}

TEST(SceneWorld, AnOpenConnectorHasNoCurrentAndNoEdges) {
  SceneWorld world(scene_of("touch"));
  EXPECT_EQ(world.analogue(wiring.axes[0].b, 1000), 1.65);
  EXPECT_EQ(world.encoder(0, 2000).edges, 0);
  EXPECT_FALSE(world.serial_encoder(3000).fitted);
  world.set_amplifiers(0, 40.0, false, 4000);
  world.set_bridge(0, {{{true, 0.9, 0.0}, {true, 0.1, 0.0}, {true, 0.1, 0.0}}}, 5000);
  EXPECT_EQ(world.analogue(wiring.axes[0].b, 6000), 1.65);
}

}  // namespace kmax::virtual_board::scene_world_test
