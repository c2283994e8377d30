// The tick of several axes: what crosses between them, and the place for laws over all of their positions.
#include "firmware/drive/axes_tick.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::axes_tick_test {
namespace {

ParameterValues micrometre_counts() {
  ParameterValues values;
  values.set_real<"device.transmission">(0.15915494309189535f);
  values.set_whole<"encoder.counts_per_turn">(1'000'000);
  values.set_real<"force.ramp_time">(0.0f);
  values.set_real<"force.limit">(3.0f);
  values.set_real<"velocity.limit">(0.0f);
  return values;
}

template <std::size_t axes, template <std::size_t> typename Law = DeviceLaw>
typename AxesTick<axes, Law<axes>>::Settings settings_of(const ParameterValues& values) {
  typename AxesTick<axes, Law<axes>>::Settings settings{.law = Law<axes>::settings(values)};
  for (AxisSetting& setting : settings.axis) {
    setting.haptic = control::HapticLoop<float>::prepare(haptic_configuration(values, 0), 0);
    setting.generation = 1;
    setting.mode = values.choice<DriveMode, "drive.mode">(0);
  }
  return settings;
}

Axis::Input at(std::int32_t count, bool valid = true) {
  return {.count = static_cast<std::uint32_t>(count), .count_valid = valid};
}

/// A spring between the handles: each axis is drawn to the mean of all, as stiff as axis 0's wall. Stands for
/// any law whose force follows from all positions and from parameters.
template <std::size_t axes>
struct SpringBetweenHandles {
  static constexpr bool needs_all_positions = true;
  struct Settings {
    float stiffness = 0.0f;  ///< N/um
  };
  static Settings settings(const ParameterValues& values) {
    return {1e-6f * values.real<"wall.stiffness">(0)};
  }
  static bool couples(const ParameterValues&, std::size_t, std::size_t) { return true; }
  float ISR_force(const Settings& s, std::size_t axis, const AxesPositions<axes>& at) const {
    std::int64_t sum = 0;
    for (std::size_t other = 0; other < axes; ++other) {
      if (!at.valid[other]) return 0.0f;
      sum += at.position[other] - at.position[axis];
    }
    return s.stiffness * static_cast<float>(static_cast<std::int32_t>(sum)) / float{axes};
  }
  void ISR_rendered(const Settings&, std::size_t, const control::HapticLoop<float>::Output&, bool) {}
};

TEST(AxesTick, ALawOverAllPositionsSeesTheCountersOfItsOwnSlotInEveryAxis) {
  ParameterValues values = micrometre_counts();
  values.set_whole<"wall.law">(0);
  AxesTick<3, SpringBetweenHandles<3>> tick(settings_of<3, SpringBetweenHandles>(values));
  const auto force = [&](std::size_t axis, std::int32_t a, std::int32_t b, std::int32_t c) {
    return tick.ISR_tick(axis, {at(a), at(b), at(c)}).force;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(force(axis, 0, 0, 0), 0.0f) << "its first tick takes the counts over";
    tick.enable(axis, true);
  }
  // All move between one axis' slot and the next: each force is of that very moment.
  for (std::int32_t n = 1; n <= 50; ++n) {
    const std::int32_t a = 30 * n, b = -20 * n, c = 10 * n;
    EXPECT_FLOAT_EQ(force(0, a, b, c), 0.001f * static_cast<float>(b + c - 2 * a) / 3.0f);
    EXPECT_FLOAT_EQ(force(1, a + 3, b + 3, c), 0.001f * static_cast<float>(a + 3 + c - 2 * (b + 3)) / 3.0f);
    EXPECT_FLOAT_EQ(force(2, a + 6, b, c + 6), 0.001f * static_cast<float>(a + 6 + b - 2 * (c + 6)) / 3.0f);
  }
}

TEST(AxesTick, ALawsForceKeepsToTheAxisLimitsAndAnUnknownPositionMakesNone) {
  ParameterValues values = micrometre_counts();
  values.set_whole<"wall.law">(0);
  AxesTick<2, SpringBetweenHandles<2>> tick(settings_of<2, SpringBetweenHandles>(values));
  for (std::size_t axis = 0; axis < 2; ++axis) (void)tick.ISR_tick(axis, {at(0), at(0)});
  tick.enable(0, true);
  EXPECT_EQ(tick.ISR_tick(0, {at(0), at(100'000)}).force, 3.0f) << "force.limit";
  EXPECT_EQ(tick.ISR_tick(0, {at(0), at(100'000, false)}).force, 0.0f);
  Axis::Input referred = at(100'000);
  referred.reference_generation = 1;
  EXPECT_EQ(tick.ISR_tick(0, {at(0), referred}).force, 0.0f)
      << "until its own tick has taken the origin over";
  EXPECT_EQ(tick.ISR_tick(1, {at(0), referred}).force, 0.0f) << "not enabled";
  EXPECT_EQ(tick.ISR_tick(0, {at(0), referred}).force, 3.0f);
}

// A set in which the law's parameter and the axes' limits belong together must never be seen in parts.
TEST(AxesTick, ALawsSettingsAreTakenOverTogetherWithThoseOfTheAxes) {
  ParameterValues values = micrometre_counts();
  values.set_whole<"wall.law">(0);
  AxesTick<2, SpringBetweenHandles<2>> tick(settings_of<2, SpringBetweenHandles>(values));
  const auto force = [&](std::size_t axis) { return tick.ISR_tick(axis, {at(0), at(1000)}).force; };
  for (std::size_t axis = 0; axis < 2; ++axis) {
    (void)force(axis);
    tick.enable(axis, true);
  }
  EXPECT_FLOAT_EQ(force(0), 0.5f);
  EXPECT_FLOAT_EQ(force(1), -0.5f);
  values.set_real<"wall.stiffness">(8000.0f);
  values.set_real<"force.limit">(2.5f);
  (void)force(0);
  tick.offer(settings_of<2, SpringBetweenHandles>(values));
  EXPECT_FLOAT_EQ(force(1), -0.5f) << "the second half of a tick: as the first";
  EXPECT_EQ(force(0), 2.5f) << "4 N, and the limit that came with them";
  EXPECT_EQ(force(1), -2.5f);
}

static_assert(sizeof(AxesTick<2, TangentialInterference<2>>::Settings) == 2 * sizeof(AxisSetting),
              "a law without parameters pays nothing");

// Each axis' tangential force is felt along the next one, and nowhere else, whatever their number.
template <std::size_t axes>
void expect_tangential_forces_along_the_next_axis() {
  ParameterValues values = micrometre_counts();
  values.set_whole<"interference.mode">(static_cast<std::uint32_t>(control::InterferenceMode::parallel));
  values.set_real<"interference.force">(1.0f);
  for (std::size_t touching = 0; touching < axes; ++touching) {
    AxesTick<axes> tick(settings_of<axes>(values));
    for (std::size_t axis = 0; axis < axes; ++axis) tick.enable(axis, true);
    std::array<float, axes> force{};
    for (int round = 0; round < 3; ++round) {
      for (std::size_t axis = 0; axis < axes; ++axis)
        force[axis] = tick.ISR_tick(axis, at(axis == touching ? -1 : 1000)).force;
    }
    for (std::size_t axis = 0; axis < axes; ++axis) {
      if (axis == touching) {
        EXPECT_NEAR(force[axis], 0.001f, 1e-6f) << "the wall's own";
      } else {
        EXPECT_EQ(force[axis], axis == (touching + 1) % axes ? 1.0f : 0.0f) << axes << " axes, " << axis;
      }
    }
    // Disabled, it makes none.
    tick.enable(touching, false);
    for (int round = 0; round < 2; ++round) {
      for (std::size_t axis = 0; axis < axes; ++axis)
        force[axis] = tick.ISR_tick(axis, at(axis == touching ? -1 : 1000)).force;
    }
    for (const float each : force) EXPECT_EQ(each, 0.0f);
  }
}

TEST(AxesTick, TheTangentialForceIsFeltAlongTheNextAxis) {
  expect_tangential_forces_along_the_next_axis<1>();
  expect_tangential_forces_along_the_next_axis<2>();
  expect_tangential_forces_along_the_next_axis<3>();
}

class TorqueMode : public testing::Test {
 protected:
  TorqueMode() { values.set_whole<"drive.mode">(static_cast<std::uint32_t>(DriveMode::torque)); }
  /// Disarmed ticks, which settle the estimators, then armed ones.
  void begin() {
    tick.offer(settings_of<2>(values));
    for (int n = 0; n < 3; ++n) (void)run(false);
  }
  float run(bool enabled = true, std::int32_t count = -1000) {
    float force = 0.0f;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      tick.enable(axis, enabled);
      force = tick.ISR_tick(axis, at(count)).force;
      if (axis == 0) first = force;
    }
    return force;
  }
  ParameterValues values = micrometre_counts();
  AxesTick<2> tick{settings_of<2>(values)};
  float first = 0.0f;  ///< N, axis 0's; run() gives axis 1's
};

TEST_F(TorqueMode, MakesWhatIsAskedForOfEachAxisWhateverTheWallIs) {
  values.set_whole<"interference.mode">(static_cast<std::uint32_t>(control::InterferenceMode::parallel));
  values.set_real<"interference.force">(2.0f);
  begin();
  tick.command_force(0, 1.25f);
  tick.command_force(1, -0.5f);
  for (int n = 0; n < 5; ++n) {
    EXPECT_EQ(run(), -0.5f);
    EXPECT_EQ(first, 1.25f) << "neither spring nor the other axis' tangential force";
  }
  EXPECT_EQ(tick.ISR_background_force(0), 0.0f);
  tick.command_force(0, 100.0f);
  (void)run();
  EXPECT_EQ(first, 3.0f) << "force.limit";
  EXPECT_EQ(run(false), 0.0f);
}

TEST_F(TorqueMode, ComesWithTheSoftStartAndTheSlewLimit) {
  values.set_real<"force.ramp_time">(0.001f);  // 20 ticks
  begin();
  tick.command_force(1, 2.0f);
  float last = 0.0f;
  for (int n = 0; n < 20; ++n) {
    const float force = run();
    EXPECT_GT(force, last);
    EXPECT_LE(force - last, 0.11f);
    last = force;
  }
  EXPECT_EQ(run(), 2.0f);
  values.set_real<"force.slew_limit">(2000.0f);  // 0.1 N a tick
  tick.offer(settings_of<2>(values));
  tick.command_force(1, -2.0f);
  EXPECT_NEAR(run(), 1.9f, 1e-5f);
}

TEST_F(TorqueMode, TripsAsAWallDoes) {
  values.set_real<"velocity.limit">(0.5f);
  values.set_whole<"velocity.estimator">(0);
  begin();
  tick.command_force(1, 1.0f);
  EXPECT_EQ(run(), 1.0f);
  EXPECT_EQ(run(true, 0), 0.0f) << "20 m/s";
  EXPECT_EQ(tick.ISR_report(1).fault, Fault::over_speed);
  begin();
  tick.command_force(1, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(run(), 0.0f);
  EXPECT_EQ(tick.ISR_report(1).fault, Fault::not_finite);
}

TEST(AxesTick, CountsItsTicksFromOneAndCapturesTheFlagsOfEach) {
  ParameterValues values = micrometre_counts();
  values.set_real<"force.limit">(0.01f);
  std::array<std::uint32_t, 7> memory{};
  AxesTick<2> tick(settings_of<2>(values), memory);
  ASSERT_TRUE(tick.capture().arm({.channels = {CaptureChannel::flags}, .samples = 7}));
  struct Tick {
    Axis::Input input;
    bool enable;
    std::uint32_t flags;
  };
  const std::uint32_t valid = 1U << 6, armed = 1U << 4, inside = 1U << 0, limited = 1U << 1;
  const Tick ticks[] = {{at(1000), false, valid},
                        {at(1000), true, valid | armed},
                        {at(-5), true, valid | armed | inside},
                        {at(-50), true, valid | armed | inside | limited},
                        {at(-50, false), true, inside | static_cast<std::uint32_t>(Fault::encoder) << 8},
                        {at(-50, false), false, inside},
                        {at(1000), false, valid}};
  std::uint32_t number = 0;
  for (const Tick& one : ticks) {
    tick.enable(0, one.enable);
    (void)tick.ISR_tick(0, one.input);
    EXPECT_EQ(tick.ISR_report(0).tick, ++number);
  }
  ASSERT_TRUE(tick.capture().readable());
  for (std::uint32_t i = 0; i < 7; ++i) EXPECT_EQ(tick.capture().value_at(i), ticks[i].flags) << i;
}

TEST(AxesTick, TripsEveryEnabledAxisWhenTheMainLoopStands) {
  AxesTick<3> tick(settings_of<3>(micrometre_counts()));
  tick.enable(1, true);
  const auto run = [&] {
    for (std::size_t axis = 0; axis < 3; ++axis) (void)tick.ISR_tick(axis, at(0));
  };
  for (std::uint32_t n = 0; n < 3 * tick_rate_hz / 10; ++n) {
    tick.keep_alive();
    run();
  }
  EXPECT_EQ(tick.ISR_report(1).fault, Fault::none);
  for (std::uint32_t n = 0; n <= tick_rate_hz / 10; ++n) run();
  EXPECT_EQ(tick.ISR_report(1).fault, Fault::main_loop);
  EXPECT_EQ(tick.ISR_report(0).fault, Fault::none) << "there was nothing to trip";
  EXPECT_EQ(tick.report(2).tick % AxesTick<3>::round_ticks, 1u) << "every axis reports once a round";
}

/// Two plain walls, both handles a millimetre inside.
class TwoWalls : public testing::Test {
 protected:
  explicit TwoWalls(float rate = 20000.0f) {
    ParameterValues values = micrometre_counts();
    values.set_real<"haptic.rate">(rate);
    settings = settings_of<2>(values);
    tick.offer(settings);
    ticks(1);
    for (const std::size_t axis : {0u, 1u}) tick.enable(axis, true);
  }
  void ticks(int number) {
    for (int i = 0; i < number; ++i) {
      tick.keep_alive();
      for (const std::size_t axis : {0u, 1u}) force[axis] = tick.ISR_tick(axis, at(-1000)).force;
    }
  }
  AxesTick<2>::Settings settings = settings_of<2>(micrometre_counts());
  AxesTick<2> tick{settings};
  std::array<float, 2> force{};
};

TEST_F(TwoWalls, EachReportsInEveryFourthTickAndAtOnceWhenSomethingHasChanged) {
  EXPECT_TRUE(tick.ISR_round_begins()) << "the first tick";
  for (std::uint32_t number = 2; number < 20; ++number) {
    ticks(1);
    EXPECT_EQ(tick.ISR_round_begins(), number % 4 == 1) << number;
    const std::uint32_t reported = number == 2 ? 2 : (number - 1) / 4 * 4 + 1;
    for (const std::size_t axis : {0u, 1u})
      EXPECT_EQ(tick.report(axis).tick, number < 5 ? 2 : reported) << number;
  }
  tick.enable(1, false);
  ticks(1);
  EXPECT_EQ(tick.report(0).tick, 17u);
  EXPECT_EQ(tick.report(1).tick, 20u);
  EXPECT_FALSE(tick.report(1).enabled);
  EXPECT_EQ(tick.ISR_report(0).tick, 20u);
}

TEST_F(TwoWalls, LessIsLeftOfTheForceOfTheAxisThatFades) {
  ticks(1);
  EXPECT_EQ(force, (std::array{1.0f, 1.0f}));
  tick.leave_share(1, 0.25f);
  ticks(1);
  EXPECT_EQ(force, (std::array{1.0f, 0.25f}));
  tick.leave_share(1, 1.0f);
  ticks(1);
  EXPECT_EQ(force, (std::array{1.0f, 1.0f}));
}

TEST_F(TwoWalls, TheTraceIsOfOneAxisAtEverySoManySamples) {
  ticks(10);
  EXPECT_EQ(tick.trace().next(), 0u) << "none is asked for";
  const auto tick_of = [this](std::uint32_t record) {
    const auto address = static_cast<std::uint16_t>(trace_window + 8 * record);
    return std::uint32_t{tick.trace().word_at(address)} << 16 |
           tick.trace().word_at(static_cast<std::uint16_t>(address + 1));
  };
  tick.trace_axis(1, 3);
  ticks(7);
  ASSERT_EQ(tick.trace().next(), 3u);
  for (const std::uint32_t record : {0u, 1u, 2u}) EXPECT_EQ(tick_of(record), 12 + 3 * record);
  tick.trace_axis(1, 1'000'000);
  ticks(10);
  const std::uint32_t before = tick.trace().next();
  tick.trace_axis(0, 2);
  ticks(4);
  EXPECT_EQ(tick.trace().next(), before + 2) << "a countdown from a longer interval is cut";
  tick.trace_axis(0, 0);
  ticks(10);
  EXPECT_EQ(tick.trace().next(), before + 2);
}

TEST_F(TwoWalls, AnAxisThatIsNotThereTakesSettingsAndReportsInItsRounds) {
  settings.axis[0].generation = settings.axis[1].generation = 9;
  tick.offer(settings);
  EXPECT_FALSE(tick.settings_taken());
  tick.ISR_tick(0);
  EXPECT_TRUE(tick.settings_taken());
  tick.ISR_tick(1);
  for (int number = 3; number <= 5; ++number) {
    EXPECT_NE(tick.report(1).generation, 9u) << "not before its round";
    tick.ISR_tick(0);
    tick.ISR_tick(1);
  }
  EXPECT_EQ(tick.report(1).generation, 9u);
  EXPECT_EQ(tick.report(1).tick, 5u);
  EXPECT_FALSE(tick.report(1).count_valid);
}

struct TwoSlowWalls : TwoWalls {
  TwoSlowWalls() : TwoWalls(2000.0f) { ticks(25); }
};

TEST_F(TwoSlowWalls, TellHowManyTicksWouldChangeNothing) {
  while (!tick.ISR_haptic(0).new_sample) ticks(1);
  ticks(1);
  EXPECT_EQ(tick.ISR_held_ticks(2), 8u);
  EXPECT_EQ(tick.ISR_held_ticks(1), 8u);
  EXPECT_EQ(tick.ISR_held_ticks(0), 0u);
  tick.leave_share(1, 0.5f);
  EXPECT_EQ(tick.ISR_held_ticks(2), 0u);
  EXPECT_EQ(tick.ISR_held_ticks(1), 8u) << "of the one that is there";
  tick.leave_share(1, 1.0f);
  tick.enable(1, false);
  EXPECT_EQ(tick.ISR_held_ticks(2), 0u);
  tick.enable(1, true);
  const std::uint32_t now = tick.ISR_report(0).tick;
  tick.ISR_pass_held(5);
  EXPECT_EQ(tick.ISR_held_ticks(2), 3u);
  for (const std::size_t axis : {0u, 1u}) EXPECT_EQ(tick.report(axis).tick, now + 5);
  ticks(1);
  EXPECT_EQ(tick.ISR_report(1).tick, now + 6);
  EXPECT_EQ(tick.ISR_held_ticks(2), 2u);
  tick.offer(settings);
  EXPECT_EQ(tick.ISR_held_ticks(2), 0u) << "settings are on their way";
}

}  // namespace
}  // namespace kmax::firmware::axes_tick_test
