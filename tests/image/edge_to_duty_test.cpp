// How long an encoder edge takes to the duty that answers it, with the serial line busy.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "firmware/modbus/crc.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests::edge_to_duty_test {

using virtual_board::BoardTime;

/// A scene whose axis 0 has edges that no motion has made, and somebody who looks at its duty.
class SteppingWorld final : public virtual_board::SceneWorld {
 public:
  using SceneWorld::SceneWorld;

  void set_bridge(std::size_t axis, const std::array<virtual_board::PwmLegOutput, 3>& legs,
                  BoardTime now) override {
    SceneWorld::set_bridge(axis, legs, now);
    if (axis != 0) return;
    duty = legs[1].high_duty;
    if (on_duty) on_duty(now);
  }
  virtual_board::EncoderSignals encoder(std::size_t axis, BoardTime now) override {
    auto signals = SceneWorld::encoder(axis, now);
    if (axis == 0) signals.edges += extra_edges;
    return signals;
  }

  std::int64_t extra_edges = 0;
  double duty = 0.5;
  std::function<void(BoardTime)> on_duty;
};

/// What the line asks all the time: the first readings of axis 0.
std::vector<std::uint8_t> busy_request() {
  std::vector<std::uint8_t> request{1, 4, 0, 0, 0, 5};
  const std::uint16_t crc = firmware::modbus::crc_of(request);
  request.insert(request.end(), {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)});
  return request;
}

/// `estimator`: what the answer, the feed-forward of the back-EMF, has its velocity from. `most_ticks`: from
/// an edge to the duty.
void expect_answers(const char* estimator, double ticks_of_board, double most_ticks) {
  simulation::Scene scene = simulated_board::open_scene("motor_axes");
  for (const auto& [name, value] :
       {std::pair{"link.timeout", 0.0}, {"velocity.limit", 0.0}, {"wall.stiffness", 3000.0}})
    scene.parameters.push_back({name, value, "test"});
  scene.parameters.push_back({"velocity.estimator", std::string(estimator), "test"});
  scene.axes[0].motion->push_force = 2.0;
  SteppingWorld world(scene);
  const auto owned = board_for_24_v(&world);
  virtual_board::VirtualBoard& board = *owned;
  virtual_board::store_parameters(board, simulated_board::assignments_of(scene));
  virtual_board::BoardLink master(board);
  board.run_for(0.3);
  for (std::size_t axis = 0; axis < 2; ++axis) master.arm(axis);
  const auto missed = [&] {
    const auto words =
        master.read_input(firmware::register_address(firmware::entry_of<"counters.missed_ticks">(), 0), 2);
    return static_cast<std::uint32_t>(words[0]) << 16 | words[1];
  };
  board.run_for(1.2);
  world.drive(0).block(true);  // pressed in, and held there: nothing but our edges changes the force
  board.run_for(0.1);
  const std::uint32_t missed_before = missed();

  std::mt19937_64 random(7);
  BoardTime edge = 0, worst = 0;
  double before = 0.0, sum = 0.0;
  std::uint64_t answered = 0, edges = 0;
  bool waiting = false;
  // 4 counts in two ticks are 0.6 m/s: the back-EMF's feed-forward moves the duty by 0.04; settled noise is
  // far below.
  world.on_duty = [&](BoardTime now) {
    if (!waiting || std::abs(world.duty - before) < 0.01) return;
    waiting = false;
    worst = std::max(worst, now - edge);
    sum += virtual_board::seconds(now - edge);
    ++answered;
  };
  const auto request = busy_request();
  const BoardTime end = board.now() + ticks(in_a_soak() ? 4.0 * ticks_of_board : ticks_of_board);
  while (board.now() < end) {
    const double phase = static_cast<double>(random() % 1000) / 1000.0;
    board.run_until(board.now() + ticks(60.0 + phase));
    world.extra_edges = world.extra_edges == 0 ? -4 : 0;
    board.chip().peripherals().general_timers[0].set_encoder_count(world.encoder(0, board.now()).edges);
    edge = board.now();
    before = world.duty;
    waiting = true;
    if (++edges % 3 == 0) board.receive(request);
  }
  world.on_duty = nullptr;
  board.run_for(0.02);  // the line falls silent
  const double worst_ticks = virtual_board::seconds(worst) / tick_s;
  std::printf(
      "%s: %llu of %llu edges answered: worst %.1f us = %.0f cycles of the core = %.2f ticks, "
      "mean %.1f us from edge to active duty\n",
      estimator, static_cast<unsigned long long>(answered), static_cast<unsigned long long>(edges),
      virtual_board::seconds(worst) * 1e6, virtual_board::seconds(worst) * 168e6, worst_ticks,
      sum / static_cast<double>(answered) * 1e6);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    ASSERT_TRUE(board.bridge_armed(axis))
        << axis << ": error code "
        << master.read_input(firmware::register_address(firmware::entry_of<"drive.error_code">(), axis),
                             1)[0];
  }
  EXPECT_GT(edges, ticks_of_board / 65.0);
  EXPECT_GE(answered + 1, edges);
  EXPECT_LE(worst_ticks, most_ticks);
  EXPECT_EQ(missed(), missed_before);
}

// Up to one tick until the next sample, then half a tick from the sample to the update: never a tick more.
// Each of a thousand phases twice over.
TEST(EdgeToDuty, TheSampleAfterAnEdgeSetsTheDutyOfItsOwnTick) {
  expect_answers("difference", 1.3e5, 1.55);
}

// And a tick more where the velocity is of the next sample, since FOAW leaves out this one.
TEST(EdgeToDuty, FoawAnswersWithTheNextSampleThatItTakes) {
  expect_answers("foaw", 1.3e5, 2.55);
}

}  // namespace kmax::tests::edge_to_duty_test
