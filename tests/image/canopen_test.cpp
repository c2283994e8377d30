// CANopen on the flashed image, over a bus with its bits and their time.
#include <gtest/gtest.h>

#include "firmware/axis_state_machine.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "tests/image/can_bench.hpp"

namespace kmax::tests {
namespace {

using firmware::DriveState;
using firmware::statusword::state_of;

std::vector<std::uint8_t> pattern(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 31 + i / 251);
  return bytes;
}

TEST(CanOpen, BootsUpAndAnswersTransfersOfEveryKind) {
  CanBench bench;
  bench.start();
  const auto boot_up = bench.next(0x701, 0.0001);
  ASSERT_TRUE(boot_up);
  EXPECT_EQ(boot_up->frame.length, 1);
  EXPECT_EQ(boot_up->frame.data[0], 0);
  EXPECT_EQ(bench.number(0x1000, 0), firmware::device_type_of_several_axes);
  for (const std::size_t size : {1, 7, 8, 889, 890, 2000}) {
    bench.sdo.download({0x3022, 1}, pattern(size), true);
    EXPECT_EQ(bench.sdo.upload({0x3022, 1}, size), pattern(size)) << size;
    EXPECT_EQ(bench.sdo.upload({0x3022, 1}, 0), pattern(size)) << size << " segmented";
  }
  EXPECT_EQ(bench.number(0x3012, 10), 0U) << "a tick was missed";
}

TEST(CanOpen, ArmedOverTheBusAnAxisMakesForceAndNmtStopTakesIt) {
  CanBench bench({{"axis0.wall.law", std::string("plain")}, {"axis0.wall.stiffness", 1000.0}}, 1.0);
  bench.start();
  EXPECT_EQ(state_of(static_cast<std::uint16_t>(bench.arm())), DriveState::operation_enabled);
  EXPECT_TRUE(bench.board->bridge_armed(0));
  bench.nmt(0x02);
  bench.board->run_for(0.001);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  bench.nmt(0x80);
  bench.board->run_for(0.001);
  EXPECT_EQ(state_of(static_cast<std::uint16_t>(bench.number(0x6041, 0))), DriveState::switch_on_disabled);
}

TEST(CanOpen, ResetNodeRestartsTheBoard) {
  CanBench bench;
  bench.start();
  bench.port.forget();
  const auto resets = bench.board->resets();
  bench.nmt(0x81);
  const auto boot_up = bench.next(0x701, 0.2);
  ASSERT_TRUE(boot_up);
  EXPECT_EQ(boot_up->frame.data[0], 0);
  EXPECT_EQ(bench.board->resets(), resets + 1);
  bench.nmt(0x82);
  ASSERT_TRUE(bench.next(0x701, 0.2));
  EXPECT_EQ(bench.board->resets(), resets + 1) << "the communication alone";
}

// What is in a PDO is as old as that of any other, wherever in the main loop's own rhythm the node is
// started: every 10 ms the loop has more to do.
TEST(CanOpen, ValuesOfPdosAreAPeriodApartAtAnyPhaseOfTheMainLoop) {
  CanBench bench;
  bench.start();
  virtual_board::CanHostNode listener(bench.board->can_bus(), 1'000'000);
  std::vector<unsigned> ticks;
  listener.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime) {
    if (frame.identifier == 0x481) ticks.push_back(frame.data[6] | unsigned{frame.data[7]} << 8);
  });
  for (int phase = 0; phase < 20; ++phase) {
    ticks.clear();
    bench.nmt(0x01);
    bench.board->run_for(0.025);
    bench.nmt(0x80);
    bench.board->run_for(0.0051);
    ASSERT_GE(ticks.size(), 24U);
    // The first goes at once, before the next of the loop's rounds.
    for (std::size_t i = 2; i < ticks.size(); ++i)
      EXPECT_EQ((ticks[i] - ticks[i - 1]) & 0xFFFF, 20U) << "PDO " << i << " at phase " << phase;
  }
}

}  // namespace
}  // namespace kmax::tests
