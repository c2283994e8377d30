// How long an encoder edge takes to the duty that answers it, with the serial line busy.
#include <gtest/gtest.h>

#include <random>

#include "firmware/modbus/crc.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests {
namespace {

using virtual_board::BoardTime;

/// Inside a stiff plain wall; every edge that it is told to make changes the force and so the duty.
class SteppingWorld final : public virtual_board::BoardWorld {
 public:
  void set_bridge(std::size_t axis, const std::array<virtual_board::PwmLegOutput, 3>& legs,
                  BoardTime now) override {
    if (axis == 0 && legs[1].enabled && on_duty && legs[1].high_duty != duty_) on_duty(now);
    if (axis == 0) duty_ = legs[1].high_duty;
  }
  void set_brake(bool, BoardTime) override {}
  void set_amplifiers(std::size_t, double, bool, BoardTime) override {}
  double supply_voltage() const override { return 24.0; }
  double analogue(unsigned channel, BoardTime) override {
    if (channel == 6) return 24.0 / 11.0;
    return channel == 15 || channel == 4 || channel == 5 ? 0.82 : 1.65;
  }
  virtual_board::EncoderSignals encoder(std::size_t axis, BoardTime) override {
    return {axis == 0 ? edges : 0, false};
  }

  std::int64_t edges = 0;
  std::function<void(BoardTime)> on_duty;

 private:
  double duty_ = -1.0;
};

TEST(EdgeToDuty, TheSampleAfterAnEdgeSetsTheDutyOfItsOwnTick) {
  SteppingWorld world;
  virtual_board::VirtualBoardConfig config;
  config.identity.volts = 24;
  virtual_board::VirtualBoard board(image(), &world, config);
  auto scene = simulated_board::open_scene("motor_axes");
  scene.parameters.push_back({"link.timeout", 0.0, "test"});
  scene.parameters.push_back({"velocity.limit", 0.0, "test"});
  scene.parameters.push_back({"current.limit", 20.0, "test"});
  virtual_board::store_parameters(board, simulated_board::assignments_of(scene));
  virtual_board::ModbusMaster master(board);
  board.run_for(0.3);
  master.arm(0);
  const auto misses = [&] {
    const auto words =
        master.read_input(firmware::register_address(firmware::entry_of<"counters.missed_ticks">(), 0), 2);
    return static_cast<std::uint32_t>(words[0]) << 16 | words[1];
  };
  const std::uint32_t missed_before = misses();
  world.edges = -2000;  // well inside: 32 mm, 12 mm deep
  board.run_for(0.3);

  // Edges at random phases of the tick; a serial request is always on the line.
  std::mt19937_64 random(7);
  BoardTime edge = 0, worst = 0;
  double sum = 0;
  std::uint64_t answered = 0;
  bool waiting = false;
  world.on_duty = [&](BoardTime now) {
    if (!waiting) return;
    waiting = false;
    worst = std::max(worst, now - edge);
    sum += virtual_board::seconds(now - edge);
    ++answered;
  };
  std::vector<std::uint8_t> request{1, 4, 0, 0, 0, 5};
  const std::uint16_t crc = firmware::modbus::crc_of(request);
  request.insert(request.end(), {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)});
  constexpr std::uint64_t total_ticks = 1'000'000;
  const BoardTime end = board.now() + ticks(static_cast<double>(total_ticks));
  std::uint64_t round = 0;
  while (board.now() < end) {
    const double phase = static_cast<double>(random() % 1000) / 1000.0;
    board.run_until(board.now() + ticks(4.0 + phase));
    // Measured from the edge itself: the counter is told at once.
    world.edges += random() % 2 == 0 ? 20 : -20;
    board.encoder_timer(0).set_encoder_count(world.edges);
    edge = board.now();
    waiting = true;
    if (++round % 40 == 0) board.receive(request);
  }
  world.on_duty = nullptr;
  ASSERT_TRUE(board.bridge_armed(0));
  board.run_for(0.02);  // the line falls silent
  const double worst_ticks = virtual_board::seconds(worst) / tick_s;
  std::printf("%llu edges: worst %.1f us = %.2f ticks, mean %.1f us from edge to active duty\n",
              static_cast<unsigned long long>(answered), virtual_board::seconds(worst) * 1e6, worst_ticks,
              sum / static_cast<double>(answered) * 1e6);
  EXPECT_GT(answered, 150'000u);
  // Up to one tick until the next sample, then half a tick from the sample to the update: never a tick more.
  EXPECT_LE(worst_ticks, 1.5 + 0.01);
  EXPECT_EQ(misses(), missed_before);
}

}  // namespace
}  // namespace kmax::tests
