#include "board/native/native_board.hpp"

#include <gtest/gtest.h>

#include "tests/board/bench.hpp"

namespace kmax::board::native_board_test {
namespace {

TEST(NativeBoard, OneAdvanceIsOneTickOfFiftyMicroseconds) {
  Bench bench;
  bench.run_ticks(123);
  EXPECT_EQ(bench.device.tick, 123u);
  EXPECT_EQ(bench.board().now_us(), 123u * 50u);
}

TEST(NativeBoard, EachAxisGetsItsOwnCounterAndForce) {
  Bench bench;
  bench.set_up_plain_wall(0);
  bench.set_up_plain_wall(1);
  bench.device.stand_at(1000, 0);
  bench.device.stand_at(2000, 1);
  ASSERT_TRUE(bench.arm(0));
  ASSERT_TRUE(bench.arm(1));
  bench.device.stand_at(-1000, 0);
  bench.device.stand_at(-2000, 1);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(0), 1.0f);
  EXPECT_EQ(bench.force(1), 2.0f);
  EXPECT_EQ(bench.board().output().axis[1].force, 2.0f);
}

TEST(NativeBoard, CharactersTakeTheirTimeInBothDirections) {
  Bench bench;
  const Bytes request = firmware::modbus::adu(1, {3, 0, 0, 0, 10});
  const auto start = bench.board().now_us();
  bench.board().receive(request);
  std::size_t received = 0;
  std::uint64_t first = 0;
  while (received == 0 && bench.board().now_us() < start + 100'000) {
    bench.run_ticks(1);
    received = bench.board().transmitted().size();
    if (received != 0) first = bench.board().now_us();
  }
  EXPECT_EQ(received, 25u) << "a reply comes whole";
  // 8 characters in, at least t3.5 of silence, 25 characters out; at most three ticks and a character more.
  const std::uint64_t least = 8 * 95 + 1750 + 25 * 95;
  EXPECT_GE(first - start, least);
  EXPECT_LE(first - start, least + 33 + 96 + 4 * 50);
}

TEST(NativeBoard, BytesOfSeveralCallsFollowEachOtherOnTheLine) {
  Bench bench;
  const Bytes request = firmware::modbus::adu(1, {3, 0, 0, 0, 1});
  for (const std::uint8_t byte : request) bench.board().receive(Bytes{byte});
  bench.run_ms(10);
  EXPECT_EQ(bench.board().transmitted().size(), 7u);
}

TEST(NativeBoard, TransmittedHandsEveryByteOutOnce) {
  Bench bench;
  bench.board().receive(firmware::modbus::adu(1, {3, 0, 0, 0, 1}));
  bench.run_ms(10);
  EXPECT_FALSE(bench.board().transmitted().empty());
  EXPECT_TRUE(bench.board().transmitted().empty());
}

TEST(NativeBoard, AnswersAgainAfterWhateverNoiseCameBefore) {
  Bench bench;
  std::uint32_t state = 12345;
  for (int burst = 0; burst < 50; ++burst) {
    Bytes noise(burst * 13 % 400);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
    bench.board().receive(noise);
    bench.run_ms(40);
    (void)bench.board().transmitted();
    EXPECT_EQ(bench.request({3, 0, 0, 0, 1}).size(), 4u) << burst;
  }
}

TEST(NativeBoard, TwoBoardsWithTheSameCallsMakeTheSameBits) {
  Bench one, other;
  for (Bench* bench : {&one, &other}) {
    bench->set_up_plain_wall();
    bench->device.stand_at(1000);
    EXPECT_TRUE(bench->arm());
    bench->device.move(1000, -1);
    bench->run_ms(300);
  }
  EXPECT_EQ(one.device.hash, other.device.hash);
  EXPECT_NE(one.device.hash, ScriptedDevice{}.hash);
}

}  // namespace
}  // namespace kmax::board::native_board_test
