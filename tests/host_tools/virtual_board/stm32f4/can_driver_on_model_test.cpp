// drivers/stm32f4/can.hpp on the models of controller and bus.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>

#include "tests/host_tools/virtual_board/stm32f4/can_on_model.hpp"
#include "tests/host_tools/virtual_board/stm32f4/random_can_frame.hpp"

namespace kmax::virtual_board::can_driver_on_model_test {
namespace {

using drivers::CanFrame;
using namespace drivers::stm32f4;
using testing::CanBench;
constexpr BoardTime ms = 1000 * units_per_microsecond;

TEST(CanDriverOnModel, JoinsTheBusAtEveryRate) {
  for (const std::uint32_t rate : {125'000U, 250'000U, 500'000U, 1'000'000U}) {
    CanBench bench;
    CanHostNode host{bench.bus, rate};
    std::vector<CanFrame> heard;
    host.on_frame([&](const CanFrame& frame, BoardTime) { heard.push_back(frame); });
    bench.configure({.timing = solve_can_bit_timing(42'000'000, rate).timing});
    const CanFrame out{.identifier = 0x701, .length = 1, .data = {5}}, in{.identifier = 0x601, .length = 8};
    ASSERT_EQ(bench.board.driver.send(out), CanSendResult::queued);
    host.send(in, bench.now);
    bench.run(5 * ms);
    ASSERT_EQ(heard.size(), 1U) << rate;
    EXPECT_EQ(heard[0], out);
    ASSERT_EQ(bench.board.received.size(), 1U);
    EXPECT_EQ(bench.board.received[0].frame, in);
    EXPECT_EQ(bench.board.driver.errors().transmit + bench.board.driver.errors().receive, 0);
  }
}

TEST(CanDriverOnModel, ThousandRandomFramesLoopBackEqual) {
  CanBench bench;
  bench.configure({.timing = can_bit_timing<42'000'000, 1'000'000>(), .self_test = true});
  rc::Random random(42);
  unsigned sent = 0;
  std::vector<CanFrame> frames;
  while (sent < 1000) {
    const CanFrame frame = testing::random_can_frame()(random.split(), 100).value();
    ASSERT_TRUE(frame.valid());
    frames.push_back(frame);
    ASSERT_EQ(bench.board.driver.send(frame), CanSendResult::queued);
    ++sent;
    bench.run(ms);
    ASSERT_EQ(bench.board.received.size(), sent);
    ASSERT_EQ(bench.board.received.back().frame, frame) << sent;
  }
  EXPECT_EQ(bench.board.driver.transmit_counters().sent, 1000U);
  EXPECT_EQ(bench.bus.frames_sent(), 0U) << "the bus is untouched";
}

/// Frames of some identifiers with a number each, against a bus that is loaded: nothing is lost, doubled or
/// overtaken.
RC_GTEST_PROP(CanDriverOnModel, OneIdentifierIsNeverReordered, ()) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  std::map<std::uint32_t, std::uint8_t> next_heard, next_sent;
  unsigned heard = 0;
  bool in_order = true;
  host.on_frame([&](const CanFrame& frame, BoardTime) {
    in_order = in_order && frame.data[0] == next_heard[frame.identifier]++;
    ++heard;
  });
  bench.configure();
  unsigned queued = 0;
  const auto steps = *rc::gen::container<std::vector<unsigned>>(120, rc::gen::inRange(0U, 40U));
  for (const unsigned step : steps) {
    const std::uint32_t identifier = 0x100 + 0x10 * (step % 5);
    CanFrame frame{.identifier = identifier, .length = 1, .data = {next_sent[identifier]}};
    if (bench.board.driver.send(frame) == CanSendResult::queued) {
      ++next_sent[identifier];
      ++queued;
    }
    // Load that wins against some and not against others; now and then a destroyed frame. No identifier of
    // the board's own: that would collide.
    if (step % 3 == 0) host.send({.identifier = 0x101 + 2 * step, .length = 8}, bench.now);
    const bool healthy =
        bench.board.model.errors().transmit_errors() < 100 && host.errors().transmit_errors() < 100;
    if (step % 7 == 0 && healthy) bench.bus.destroy_frames(2);
    bench.run(step * 10 * units_per_microsecond);
  }
  bench.run(100 * ms);
  RC_ASSERT(in_order);
  RC_ASSERT(heard == queued);
  RC_ASSERT(bench.board.driver.transmit_counters().sent == queued);
}

TEST(CanDriverOnModel, AlarmOvertakesThreeFramesThatLoseEveryArbitration) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000}, babbler{bench.bus, 500'000};
  std::vector<std::uint32_t> heard;
  host.on_frame([&](const CanFrame& frame, BoardTime) {
    if (frame.identifier != 0x200) heard.push_back(frame.identifier);
  });
  bench.configure();
  babbler.babble(CanFrame{.identifier = 0x200, .length = 8}, bench.now);
  for (const std::uint32_t identifier : {0x500U, 0x501U, 0x502U, 0x503U}) {
    ASSERT_EQ(bench.board.driver.send({.identifier = identifier}), CanSendResult::queued);
  }
  bench.run(20 * ms);
  EXPECT_TRUE(heard.empty());
  const BoardTime begin = bench.now;
  ASSERT_EQ(bench.board.driver.send({.identifier = 0x081}), CanSendResult::queued);
  while (heard.empty() && bench.now - begin < 10 * ms) bench.run(10 * units_per_microsecond);
  ASSERT_EQ(heard, std::vector<std::uint32_t>{0x081});
  EXPECT_LT(bench.now - begin, ms) << "two frames at 500 kbit/s";
  babbler.babble(std::nullopt, bench.now);
  bench.run(10 * ms);
  EXPECT_EQ(heard, (std::vector<std::uint32_t>{0x081, 0x500, 0x501, 0x502, 0x503}));
  EXPECT_EQ(bench.board.driver.transmit_counters().aborted, 1U);
  EXPECT_EQ(bench.board.driver.transmit_counters().arbitration_lost, 1U)
      << "only the most urgent mailbox has tried";
}

TEST(CanDriverOnModel, BusOffAndBackWithGrowingPatience) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.configure();
  auto& driver = bench.board.driver;
  bench.bus.destroy_frames_of(bench.board.model.node());
  BoardTime expected_wait = 100 * ms;
  for (unsigned round = 0; round < 3; ++round) {
    bench.bus.destroy_frames(32);
    for (std::uint32_t i = 0; i < 5; ++i)
      ASSERT_EQ(driver.send({.identifier = 0x180 + i}), CanSendResult::queued);
    bench.run(15 * ms);
    ASSERT_EQ(driver.state(), CanBusState::waiting) << round;
    EXPECT_TRUE(driver.errors().bus_off);
    EXPECT_EQ(driver.transmit_counters().discarded, 5 * (round + 1));
    EXPECT_EQ(driver.send({}), CanSendResult::not_on_the_bus);
    const BoardTime begin = bench.now;
    while (driver.state() != CanBusState::on_bus && bench.now - begin < 3000 * ms) bench.run(ms);
    const BoardTime took = bench.now - begin;
    EXPECT_GT(took + 16 * ms, expected_wait) << round;
    EXPECT_LT(took, expected_wait + 10 * ms) << "128 times 11 bits are 2.8 ms";
    expected_wait *= 2;
    EXPECT_EQ(driver.errors().transmit, 0);
    bench.bus.destroy_frames(0);
    ASSERT_EQ(driver.send({.identifier = 0x123}), CanSendResult::queued);
    bench.run(ms);
    EXPECT_EQ(driver.transmit_counters().sent, round + 1) << "nothing of before comes out now";
  }
  EXPECT_EQ(driver.bus_off_counters().bus_offs, 3U);
  EXPECT_GE(bench.board.status_interrupts, 3U);
}

TEST(CanDriverOnModel, RecoversOnABusThatIsNeverIdle) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000}, babbler{bench.bus, 500'000};
  bench.configure();
  bench.bus.destroy_frames_of(bench.board.model.node());
  bench.bus.destroy_frames(32);
  ASSERT_EQ(bench.board.driver.send({.identifier = 0x180}), CanSendResult::queued);
  bench.run(15 * ms);
  babbler.babble(CanFrame{.identifier = 0x700, .length = 8}, bench.now);
  bench.run(200 * ms);
  EXPECT_EQ(bench.board.driver.state(), CanBusState::on_bus);
  EXPECT_GT(bench.board.driver.receive_counters().received, 0U);
}

TEST(CanDriverOnModel, AloneOnTheBusIsNotBusOff) {
  CanBench bench;
  bench.configure();
  ASSERT_EQ(bench.board.driver.send({.identifier = 0x701}), CanSendResult::queued);
  bench.run(100 * ms);
  EXPECT_EQ(bench.board.driver.state(), CanBusState::on_bus);
  const CanErrors errors = bench.board.driver.errors();
  EXPECT_EQ(errors.transmit, 128);
  EXPECT_TRUE(errors.passive && !errors.bus_off);
  EXPECT_EQ(errors.last, CanLastError::acknowledgement);
  CanHostNode host{bench.bus, 500'000};
  bench.run(5 * ms);
  EXPECT_EQ(bench.board.driver.transmit_counters().sent, 1U);
}

TEST(CanDriverOnModel, BusyOrStuckBusIsJoinedLater) {
  CanBench bench;
  bench.bus.set_stuck_dominant(true, bench.now);
  EXPECT_EQ(bench.board.driver.configure({}, std::array{can_filter_accept_all()}),
            CanConfigureResult::waiting_for_idle_bus);
  bench.run(50 * ms);
  EXPECT_EQ(bench.board.driver.state(), CanBusState::joining);
  bench.bus.set_stuck_dominant(false, bench.now);
  bench.run(5 * ms);
  EXPECT_EQ(bench.board.driver.state(), CanBusState::on_bus);
}

TEST(CanDriverOnModel, FiltersSortIntoTheFifos) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  const std::array filters{can_filter_standard(0x600, 0x780, 0), can_filter_standard_list(0x000, 0x601, 1),
                           can_filter_extended(0x1234500, 0x1FFFFF00, 1)};
  ASSERT_EQ(bench.board.driver.configure({}, filters), CanConfigureResult::ok);
  host.send({.identifier = 0x000}, bench.now);
  host.send({.identifier = 0x600}, bench.now);
  host.send({.identifier = 0x601}, bench.now);  // the list takes priority over the mask
  host.send({.identifier = 0x580}, bench.now);
  host.send({.identifier = 0x1234567, .extended = true}, bench.now);
  host.send({.identifier = 0x600, .remote = true}, bench.now);
  bench.run(10 * ms);
  EXPECT_EQ(host.waiting(), 0U) << "acknowledged, whether received or not";
  std::map<std::uint32_t, std::pair<unsigned, unsigned>> where;
  for (const auto& each : bench.board.received) where[each.frame.identifier] = {each.fifo, each.filter};
  const std::map<std::uint32_t, std::pair<unsigned, unsigned>> expected{
      {0x000, {1, 0}}, {0x600, {0, 0}}, {0x601, {1, 1}}, {0x1234567, {1, 2}}};
  EXPECT_EQ(where, expected);
}

TEST(CanDriverOnModel, LateInterruptLosesFramesAndSaysSo) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.configure();
  bench.board.interrupts_enabled = false;
  for (std::uint32_t i = 0; i < 6; ++i) host.send({.identifier = 0x100 + i}, bench.now);
  bench.run(5 * ms);
  bench.board.interrupts_enabled = true;
  bench.run(ms);
  ASSERT_EQ(bench.board.received.size(), 3U);
  EXPECT_EQ(bench.board.received[0].frame.identifier, 0x100U);
  EXPECT_EQ(bench.board.received[1].frame.identifier, 0x101U);
  EXPECT_EQ(bench.board.received[2].frame.identifier, 0x105U) << "RFLM = 0: the newest replaces the newest";
  EXPECT_EQ(bench.board.driver.receive_counters().overruns, 1U);
}

TEST(CanDriverOnModel, ConfiguredAgainWhileFramesAreWaiting) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000}, slow{bench.bus, 250'000};
  slow.set_listen_only(true);
  bench.configure();
  for (std::uint32_t i = 0; i < 8; ++i)
    ASSERT_EQ(bench.board.driver.send({.identifier = 0x180 + i}), CanSendResult::queued);
  bench.run(100 * units_per_microsecond);  // in the middle of a frame
  host.set_connected(false, bench.now);
  slow.set_listen_only(false);
  bench.configure({.timing = can_bit_timing<42'000'000, 250'000>()});
  const std::uint32_t before = bench.board.driver.transmit_counters().sent;
  bench.run(10 * ms);
  EXPECT_EQ(bench.board.driver.transmit_counters().sent, before) << "what waited is gone";
  ASSERT_EQ(bench.board.driver.send({.identifier = 0x200}), CanSendResult::queued);
  bench.run(10 * ms);
  EXPECT_EQ(bench.board.driver.transmit_counters().sent, before + 1);
}

}  // namespace
}  // namespace kmax::virtual_board::can_driver_on_model_test
