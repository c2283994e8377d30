// The image's tick against the same source on this machine, bit for bit: every call of Axis::ISR_tick in the
// image is repeated here with the very bytes that it was given.
#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "board/odrive_v3/description.hpp"
#include "host_tools/device/parameter.hpp"
#include "tests/image/parity/axis_tick_calls.hpp"

namespace kmax::tests::parity_test {

using firmware::Axis;
using virtual_board::BoardTime;

/// Listens to the image and computes along.
class Companion {
 public:
  explicit Companion(virtual_board::VirtualBoard& board)
      : board_(board),
        calls_(
            board, [this] { enter(); }, [this] { leave(); }) {}

  std::uint64_t ticks = 0, driven = 0, excited = 0, commanded = 0, differences = 0;
  std::string first_difference;

 private:
  void enter() {
    const auto setting = calls_.value_at<firmware::AxisSetting>(calls_.argument(1));
    mode_ = setting.mode;
    const auto input = calls_.value_at<Axis::Input>(calls_.argument(2));
    const auto command = calls_.value_at<Axis::Command>(calls_.argument(3));
    const auto tick = calls_.value_at<std::uint32_t>(calls_.argument(13));
    expected_ = axes_[calls_.axis()].ISR_tick(setting, input, command, tick);
  }

  void leave() {
    const auto made = calls_.value_at<Axis::Output>(calls_.argument(0));
    ++ticks;
    driven += made.enabled ? 1 : 0;
    excited += made.enabled && mode_ == firmware::DriveMode::excitation ? 1 : 0;
    commanded += made.enabled && mode_ == firmware::DriveMode::torque && made.force != 0.0f ? 1 : 0;
    compare("force", made.force, expected_.force);
    compare("current_reference", made.motor.current_reference, expected_.motor.current_reference);
    compare("current", made.motor.current, expected_.motor.current);
    compare("duty_a", made.motor.duty_a, expected_.motor.duty_a);
    compare("duty_b", made.motor.duty_b, expected_.motor.duty_b);
    compare("duty_c", made.motor.duty_c, expected_.motor.duty_c);
    if (made.enabled != expected_.enabled || made.motor.fault != expected_.motor.fault)
      note("enabled or fault", 0, 0);
  }

  void compare(const char* name, float made, float expected) {
    if (std::bit_cast<std::uint32_t>(made) != std::bit_cast<std::uint32_t>(expected))
      note(name, made, expected);
  }

  void note(const char* name, float made, float expected) {
    if (differences++ == 0)
      first_difference = fmt::format("tick {}, axis {}: {} is {} in the image, {} here", ticks, calls_.axis(),
                                     name, made, expected);
  }

  virtual_board::VirtualBoard& board_;
  AxisTickCalls calls_;
  firmware::DriveMode mode_ = firmware::DriveMode::haptic;
  std::array<Axis, 2> axes_;
  Axis::Output expected_{};
};

/// Handles that jump and drift, and sensors that read anything.
class RandomWorld final : public EmptyWorld {
 public:
  explicit RandomWorld(std::uint64_t seed) : random_(seed) {}

  double analogue(unsigned channel, BoardTime now) override {
    if (!quiet && channel == 6) return (22.0 + uniform(0, 3.4)) / 11.0;
    if (quiet || channel == 15 || channel == 4 || channel == 5) return EmptyWorld::analogue(channel, now);
    // The currents of B and C nearly add up to nothing, so that their sum does not end every run at once.
    constexpr const auto& wiring = board::odrive_v3::sampling_config;
    for (std::size_t axis = 0; axis < wiring.axes.size(); ++axis) {
      const bool b = channel == wiring.axes[axis].b, c = channel == wiring.axes[axis].c;
      // No current passes the shunts of the other axis, whose zero is looked at.
      if ((b || c) && axis != low_sides_of_) return 1.65 + uniform(-0.02, 0.02);
      if (c) return 1.65 - deviation_b_ + uniform(-0.02, 0.02);
    }
    deviation_b_ = uniform(-0.25, 0.25);
    return 1.65 + deviation_b_;
  }
  void set_low_sides(std::size_t axis) override { low_sides_of_ = axis; }
  virtual_board::EncoderSignals encoder(std::size_t axis, BoardTime) override {
    if (!quiet) {
      const double kind = uniform(0, 1);
      if (kind < 0.3) edges_[axis] += static_cast<std::int64_t>(uniform(-3, 4));
      if (kind > 0.999) edges_[axis] += static_cast<std::int64_t>(uniform(-200, 200));
      // Drawn back, so that the wall is crossed again and again.
      if (kind > 0.7 && kind < 0.8) edges_[axis] -= edges_[axis] / 400 + (edges_[axis] > 0 ? 1 : -1);
    }
    return {edges_[axis], false};
  }

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }

  bool quiet = true;

 private:
  std::mt19937_64 random_;
  std::array<std::int64_t, 2> edges_{};
  double deviation_b_ = 0.0;
  std::size_t low_sides_of_ = 0;
};

void expect_equal(const Companion& companion) {
  EXPECT_EQ(companion.differences, 0u) << companion.first_difference;
}

TEST(Parity, OneMillionRandomTicksAreBitIdentical) {
  RandomWorld world(20260101);
  const auto owned = board_for_24_v(&world);
  virtual_board::VirtualBoard& board = *owned;
  Companion companion(board);
  virtual_board::BoardLink master(board);
  const auto write = [&master](std::string_view name, std::size_t axis, std::uint32_t raw) {
    const std::size_t entry = firmware::find_entry(name);
    const std::uint16_t address = firmware::register_address(entry, axis);
    if (firmware::register_count(firmware::descriptors[entry].type) == 1)
      return master.write_register(address, static_cast<std::uint16_t>(raw));
    master.write_holding(address,
                         std::array{static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint16_t>(raw)});
  };
  const auto any_choice = [&world](const char* name) {
    const auto& choices = device::resolve(name).definition().values;
    return static_cast<std::uint32_t>(
        choices[static_cast<std::size_t>(world.uniform(0, static_cast<double>(choices.size())))].value);
  };
  const auto real = [](double value) { return std::bit_cast<std::uint32_t>(static_cast<float>(value)); };
  board.run_for(0.3);
  while (companion.ticks < 1'000'000) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      write("drive.controlword", axis, 0);
      write("drive.controlword", axis, 0x80);
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      write("wall.law", axis, any_choice("wall.law"));
      write("wall.side", axis, world.uniform(0, 1) < 0.5 ? 0xFFFFu : 1u);
      write("wall.stiffness", axis, real(world.uniform(0, 20000)));
      write("wall.damping", axis, real(world.uniform(0, 20)));
      write("wall.damping_window", axis, static_cast<std::uint32_t>(world.uniform(0, 17)));
      write("wall.touch_stiffness", axis, real(std::max(0.0, world.uniform(-5000, 5000))));
      write("wall.growth_time", axis, real(world.uniform(0.001, 0.3)));
      write("wall.adaptive_mode", axis, any_choice("wall.adaptive_mode"));
      write("wall.adaptive_relation", axis, any_choice("wall.adaptive_relation"));
      write("interference.mode", axis, any_choice("interference.mode"));
      write("interference.force", axis, real(world.uniform(-1, 5)));
      write("interference.background_force", axis, real(world.uniform(-1, 4)));
      write("interference.onset_time", axis, real(world.uniform(0, 0.002)));
      write("velocity.estimator", axis, any_choice("velocity.estimator"));
      write("velocity.window", axis, static_cast<std::uint32_t>(world.uniform(1, 17)));
      write("velocity.limit", axis, real(0.0));
      write("position.resolution", axis, real(world.uniform(0, 2e-4)));
      write("position.rounding", axis, any_choice("position.rounding"));
      write("motor.kind", axis, any_choice("motor.kind"));
      write("motor.commutation_known", axis, 1);
      write("compensation.dead_time", axis, real(world.uniform(-1, 1) < 0 ? 0.0 : 2e-7));
      write("guard.friction", axis, real(1.0));
      write("compensation.limit", axis, real(world.uniform(-1, 1) < 0 ? 0.0 : 0.5));
      write("compensation.friction", axis, real(world.uniform(0, 0.5)));
      write("compensation.cogging_periods", axis, 42);
      write("compensation.cogging_sine_1", axis, real(world.uniform(-0.3, 0.3)));
      // What jumps cannot be plausible: watched, but seldom tripped.
      write("device.hand_force", axis, real(world.uniform(0, 1) < 0.1 ? 5.0 : 1000.0));
      const double mode = world.uniform(0, 1);
      write("drive.mode", axis, mode < 0.25 ? 1 : mode < 0.5 ? 2 : 0);
      write("excitation.kind", axis, any_choice("excitation.kind"));
      write("excitation.bias", axis, real(world.uniform(-5, 5)));
      write("excitation.alternation", axis, real(world.uniform(-5, 5)));
      write("excitation.half_period", axis, static_cast<std::uint32_t>(world.uniform(0, 40)));
      write("excitation.alternation_axis", axis, static_cast<std::uint32_t>(world.uniform(0, 2)));
      write("excitation.angle_rate", axis, real(world.uniform(-300, 300)));
      write("excitation.angle_span", axis, real(world.uniform(0, 60)));
      write("excitation.stroke", axis, real(world.uniform(-0.05, 0.05)));
      write("excitation.travel", axis, real(1.0));
      write("current.limit", axis, real(20.0));
      write("haptic.rate", axis, real(world.uniform(0, 1) < 0.5 ? 20000.0 : 2000.0));
    }
    board.run_for(0.25);  // another amplifier gain restarts the power stage
    for (std::size_t axis = 0; axis < 2; ++axis) {
      try {
        master.arm(axis);
      } catch (const std::runtime_error&) {
        // Inside the wall: it computes all the same.
      }
      write("profile.target_torque", axis, static_cast<std::uint16_t>(world.uniform(-1000, 1000)));
    }
    world.quiet = false;
    board.run_for(0.8);
    world.quiet = true;
  }
  expect_equal(companion);
  EXPECT_GT(companion.driven, 100'000u) << "the comparison must see forces";
  EXPECT_GT(companion.excited, 10'000u) << "and excitation";
  // Fewer: the random counts trip an axis in mode torque within some hundred ticks.
  EXPECT_GT(companion.commanded, 300u) << "and forces that the host asks for";
}

TEST(Parity, AContactIsBitIdentical) {
  ImageBench bench(
      {{"wall.law", std::string("adaptive")}, {"wall.stiffness", 3000.0}, {"link.timeout", 0.0}});
  Companion companion(*bench.board);
  bench.start();
  for (std::size_t axis = 0; axis < 2; ++axis) bench.master->arm(axis);
  bench.board->run_for(1.0);
  expect_equal(companion);
  EXPECT_GT(companion.driven, 30'000u);
}

}  // namespace kmax::tests::parity_test
