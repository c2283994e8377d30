// The same scene through the native firmware and through the image, bit for bit, each closing the loop over a
// plant of its own.
//
// parity_test.cpp repeats every tick of the image with the very bytes that the image was given: a difference
// would show, but could not grow. Here nothing is handed across: two plants are made from the same scene and
// moved by two controllers, and a single bit that differed anywhere, in a force, in the order of axes, in the
// moment of a haptic sample, would drive the traces apart.
//
// What is common is the start. Both sides begin with a fresh plant at a haptic sample, and the native axis is
// armed in the tick, counted from there, in which the image's master had armed the image's.
//
// The image runs whole: main loop, interrupts, Modbus, its own settings made on the emulated processor from
// its own parameters. Only its samples are exchanged where Axis::ISR_tick takes them: a scene's ideal force
// source has no connector on the board, and what the board's converters and timers make of a motor
// (closed_loop_test.cpp) has other sampling instants than the native board: half a PWM period between the two
// axes, duties that act from the update event on, counters that are read microseconds after the currents.
// With the native board's sampling on both sides, scenes with motors can be compared too, and are: currents,
// current controllers and duties then belong to the loop.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <tuple>

#include "tests/image/parity/axis_tick_calls.hpp"

namespace kmax::tests::scene_parity_test {

using firmware::Axis;
using simulated_board::SimulatedDevice;

constexpr std::uint32_t tick_us = board::NativeBoard<SimulatedDevice>::tick_us;

/// One tick of one axis: the handle as it was sampled, and what the firmware made of it.
struct AxisTick {
  double position, velocity, hand_position;
  float force, background_force, current, duty_a, duty_b, duty_c;
  std::uint32_t enabled;
};
using Tick = std::array<AxisTick, 2>;
using Trace = std::vector<Tick>;

AxisTick seen(const SimulatedDevice& device, std::size_t axis) {
  AxisTick tick{};
  if (axis >= device.axis_count()) return tick;
  const simulation::CoupledHandle& handle = device.handle(axis);
  tick.position = handle.position();
  tick.velocity = handle.velocity();
  tick.hand_position = handle.hand_position();
  return tick;
}

void add_output(AxisTick& tick, const Axis::Output& output, float background_force) {
  tick.force = output.force;
  tick.background_force = background_force;
  tick.current = output.motor.current;
  tick.duty_a = output.motor.duty_a;
  tick.duty_b = output.motor.duty_b;
  tick.duty_c = output.motor.duty_c;
  tick.enabled = output.enabled ? 1 : 0;
}

constexpr std::array names{"position", "velocity", "hand position", "force",  "background force",
                           "current",  "duty a",   "duty b",        "duty c", "enabled"};

std::array<double, names.size()> values_of(const AxisTick& tick) {
  return {tick.position,
          tick.velocity,
          tick.hand_position,
          static_cast<double>(tick.force),
          static_cast<double>(tick.background_force),
          static_cast<double>(tick.current),
          static_cast<double>(tick.duty_a),
          static_cast<double>(tick.duty_b),
          static_cast<double>(tick.duty_c),
          static_cast<double>(tick.enabled)};
}

/// What differs in a bit, in words; empty: nothing. A float keeps its bits, sign of zero included, as a
/// double.
std::string difference(const AxisTick& image, const AxisTick& native) {
  const auto there = values_of(image), here = values_of(native);
  std::string words;
  for (std::size_t n = 0; n < names.size(); ++n) {
    if (std::bit_cast<std::uint64_t>(there[n]) == std::bit_cast<std::uint64_t>(here[n])) continue;
    words += fmt::format("{}{} is {} in the image, {} here", words.empty() ? "" : "; ", names[n], there[n],
                         here[n]);
  }
  return words;
}

simulation::Scene scene_of(const std::string& name, const ImageBench::Parameters& parameters) {
  simulation::Scene scene = simulated_board::open_scene(name);
  for (const auto& [parameter, value] : parameters) scene.parameters.push_back({parameter, value, "test"});
  scene.parameters.push_back({"link.timeout", 0.0, "test"});
  return scene;
}

/// The image with a plant of its own, which replaces what the board has sampled.
class ImageSide {
 public:
  explicit ImageSide(const simulation::Scene& scene) : scene_(scene), parameters_(scene) {
    virtual_board::store_parameters(*board_, simulated_board::assignments_of(scene));
  }

  /// Arms every axis of the scene when the plant is ready, and lets `duration` (s) pass.
  void run(double duration) {
    virtual_board::BoardLink master(*board_);
    for (int tries = 0; tries < 100 && !board_->healthy(); ++tries) board_->run_for(0.01);
    board_->run_for(0.3);
    for (std::size_t axis = 0; axis < scene_.axes.size(); ++axis) master.arm(axis);
    board_->run_for(duration);
  }

  /// From the plant's start on.
  const Trace& trace() const { return trace_; }

 private:
  void enter() {
    const std::size_t axis = calls_.axis();
    self_[axis] = calls_.self();
    firmware::AxisSetting& setting = setting_[axis];
    setting = calls_.value_at<firmware::AxisSetting>(calls_.argument(1));
    // The axis starts afresh, and with it its haptic samples.
    if (axis == 0 && (!device_ || setting.generation != generation_)) start();
    if (axis == 0) generation_ = setting.generation;
    const Axis::Input input = device_->sample(axis);
    std::memcpy(calls_.bytes_at<Axis::Input>(calls_.argument(2)).data(), static_cast<const void*>(&input),
                sizeof input);
    tick_[axis] = seen(*device_, axis);
  }

  void start() {
    device_.emplace(scene_);
    trace_.clear();
    now_us_ = 0;
  }

  void leave() {
    const std::size_t axis = calls_.axis();
    const auto output = calls_.value_at<Axis::Output>(calls_.argument(0));
    // The image does not work it out: what it has, the same source makes into it here.
    const float background_force = calls_.value_at<Axis>(self_[axis]).ISR_background_force(setting_[axis]);
    add_output(tick_[axis], output, background_force);
    device_->set_background_force(axis, background_force);
    device_->drive(axis, output);
    if (axis != 1) return;
    trace_.push_back(tick_);
    device_->advance(static_cast<double>(tick_us) * 1e-6);  // to the bit as NativeBoard does
    now_us_ += tick_us;
    device_->poll(parameters_.board().application(), now_us_);
  }

  simulation::Scene scene_;
  /// Not run: its application only holds the parameters that the plant's power stage is set by.
  simulated_board::SimulatedBoard parameters_;
  EmptyWorld world_;
  std::unique_ptr<virtual_board::VirtualBoard> board_ = board_for_24_v(&world_);
  AxisTickCalls calls_{*board_, [this] { enter(); }, [this] { leave(); }};
  std::array<std::uint32_t, 2> self_{};
  std::array<firmware::AxisSetting, 2> setting_{};
  std::uint32_t generation_ = 0, now_us_ = 0;
  std::optional<SimulatedDevice> device_;
  Tick tick_{};
  Trace trace_;
};

/// The first tick in which the axis was driven; the trace's length when there is none.
std::size_t armed_in(const Trace& trace, std::size_t axis) {
  std::size_t tick = 0;
  while (tick < trace.size() && trace[tick][axis].enabled == 0) ++tick;
  return tick;
}

/// Lets the settings arrive, and time pass until the next tick is a haptic sample of axis 0.
void stop_before_a_sample(simulated_board::SimulatedBoard& simulation) {
  auto& board = simulation.board();
  const auto run_to_sample = [&] {
    std::uint64_t ticks = 0;
    do {
      board.advance(1);
      ++ticks;
    } while (!board.application().ISR_report(0).haptic.new_sample);
    return ticks;
  };
  board.advance(2000);
  run_to_sample();
  const std::uint64_t divider = run_to_sample();
  board.advance(divider - 1);
}

/// The native firmware with a plant of its own, for as many ticks as `image` has, each axis armed in the same
/// tick.
Trace native_trace(const simulation::Scene& scene, const Trace& image) {
  constexpr std::size_t controlword = firmware::entry_of<"drive.controlword">();
  // What is written before a tick is heard by the main loop after it, and seen by the tick after that.
  constexpr std::array<std::uint32_t, 3> words{0x06, 0x07, 0x0F};
  constexpr std::size_t lead = words.size();
  simulated_board::SimulatedBoard simulation(scene);
  stop_before_a_sample(simulation);
  simulation.device() = SimulatedDevice(scene);
  Trace trace;
  for (std::size_t n = 0; n < image.size(); ++n) {
    for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
      const std::size_t step = n + lead - armed_in(image, axis);
      if (step < words.size()) simulation.board().application().preset(controlword, axis, words[step]);
    }
    Tick tick{seen(simulation.device(), 0), seen(simulation.device(), 1)};
    simulation.board().advance(1);
    for (std::size_t axis = 0; axis < tick.size(); ++axis)
      add_output(tick[axis], simulation.board().output().axis[axis],
                 simulation.board().application().ISR_background_force(axis));
    trace.push_back(tick);
  }
  return trace;
}

struct Touched {
  double deepest = 0.0;        // m inside the wall
  double largest_force = 0.0;  // N
  std::size_t driven = 0;      // ticks
  std::size_t forces = 0;      // different ones
};

Touched touched(const Trace& trace, std::size_t axis, double wall) {
  Touched all;
  float last = 0.0f;
  for (const Tick& tick : trace) {
    const AxisTick& one = tick[axis];
    if (one.enabled == 0) continue;
    ++all.driven;
    all.deepest = std::max(all.deepest, wall - one.position);
    all.largest_force = std::max(all.largest_force, static_cast<double>(std::abs(one.force)));
    all.forces += one.force != last ? 1 : 0;
    last = one.force;
  }
  return all;
}

/// Runs both sides; every tick of every axis must be equal.
Trace expect_equal_traces(const simulation::Scene& scene, double duration) {
  ImageSide image(scene);
  image.run(duration);
  const Trace& expected = image.trace();
  const Trace native = native_trace(scene, expected);
  EXPECT_EQ(native.size(), expected.size());
  std::size_t differences = 0;
  for (std::size_t n = 0; n < native.size(); ++n) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const std::string words = difference(expected[n][axis], native[n][axis]);
      if (words.empty() || differences++ > 0) continue;
      ADD_FAILURE() << "axis " << axis << ", tick " << n << " (armed in " << armed_in(expected, axis)
                    << "): " << words;
    }
  }
  EXPECT_EQ(differences, 0u) << "of " << 2 * native.size();
  return native;
}

class SceneParity : public testing::TestWithParam<std::tuple<const char*, double>> {};

TEST_P(SceneParity, AWholeContactIsBitIdentical) {
  const auto [name, rate] = GetParam();
  const simulation::Scene scene = scene_of(name, {{"haptic.rate", rate}});
  const Trace trace = expect_equal_traces(scene, 3.5);
  const Touched contact = touched(trace, 0, 0.0);
  EXPECT_GT(contact.driven, 60'000u) << "3 s";
  EXPECT_GT(contact.deepest, 0.1e-3);
  EXPECT_GT(contact.largest_force, 0.5);
  EXPECT_GT(contact.forces, 100u);
}

INSTANTIATE_TEST_SUITE_P(Papers, SceneParity,
                         testing::Combine(testing::Values("paper1_fig_9", "paper1_fig_12"),
                                          testing::Values(500.0, 20000.0)));

// Three times what the plain wall holds, at the papers' rate: docs/experiments/max_stiffness.md.
TEST(SceneParityOfGrowingWalls, AWholeContactIsBitIdentical) {
  const simulation::Scene scene = scene_of("paper1_fig_9", {{"haptic.rate", 500.0},
                                                            {"wall.stiffness", 10700.0},
                                                            {"wall.touch_stiffness", 3000.0},
                                                            {"wall.damping", 6.0},
                                                            {"wall.damping_window", 1.0}});
  const Trace trace = expect_equal_traces(scene, 3.5);
  const Touched contact = touched(trace, 0, 0.0);
  EXPECT_GT(contact.driven, 60'000u) << "3 s";
  EXPECT_GT(contact.deepest, 0.1e-3);
  EXPECT_GT(contact.forces, 100u);
}

// A delay and a coarse position; a structure; an encoder with noise and lost edges; two axes, one person.
class SceneParityOfParts : public testing::TestWithParam<const char*> {};

TEST_P(SceneParityOfParts, IsBitIdentical) {
  const Trace trace = expect_equal_traces(scene_of(GetParam(), {}), 1.2);
  const Touched contact = touched(trace, 0, 0.0);
  EXPECT_GT(contact.driven, 20'000u);
  EXPECT_GT(contact.largest_force, 0.2);
  EXPECT_GT(contact.forces, 10u);
}

INSTANTIATE_TEST_SUITE_P(Parts, SceneParityOfParts,
                         testing::Values("paper2_fig_2", "compliant_structure", "noisy_encoder",
                                         "paper1_deviation"));

// The whole way from noise in the current sensors to the duties, and back through motors and handles.
TEST(SceneParityWithMotors, BothAxesAreBitIdentical) {
  const simulation::Scene scene = scene_of("motor_axes", {});
  const Trace trace = expect_equal_traces(scene, 3.5);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Touched contact = touched(trace, axis, -0.02);
    EXPECT_GT(contact.driven, 60'000u);
    EXPECT_GT(contact.deepest, 0.1e-3);
    EXPECT_GT(contact.forces, 100u);
  }
}

// What is compared would show a force that differs in its last bit once.
TEST(SceneParityItself, SeesAStiffnessThatDiffersInItsLastBit) {
  const simulation::Scene scene = scene_of("paper1_fig_9", {{"haptic.rate", 20000.0}});
  ImageSide image(scene);
  image.run(0.3);
  const float next = std::nextafter(5500.0f, 6000.0f);
  const Trace native = native_trace(
      scene_of("paper1_fig_9", {{"haptic.rate", 20000.0}, {"wall.stiffness", static_cast<double>(next)}}),
      image.trace());
  std::size_t different = 0, first = 0;
  for (std::size_t n = native.size(); n-- > 0;) {
    if (difference(image.trace()[n][0], native[n][0]).empty()) continue;
    ++different;
    first = n;
  }
  EXPECT_GT(different, 100u);
  EXPECT_GT(first, armed_in(native, 0)) << "the start is common";
}

}  // namespace kmax::tests::scene_parity_test
