// drivers/stm32f4/can.hpp on the models of controller and bus.
#include "drivers/stm32f4/can.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>

#include "host_tools/virtual_board/stm32f4/can_controller.hpp"
#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"
#include "tests/host_tools/virtual_board/stm32f4/random_can_frame.hpp"

namespace kmax::virtual_board::can_driver_on_model_test {

using drivers::CanFrame;
using namespace drivers::stm32f4;
using testing::RegisterOnModel;
constexpr CanConfig at_500k{.timing = can_bit_timing<42'000'000, 500'000>()};
constexpr BoardTime us = units_per_microsecond, ms = 1000 * us;

struct CanOnModel {
  struct Mailbox {
    RegisterOnModel tir, tdtr, tdlr, tdhr;
  };
  struct Fifo {
    RegisterOnModel rir, rdtr, rdlr, rdhr;
  };
  struct Bank {
    RegisterOnModel fr1, fr2;
  };
  RegisterOnModel mcr, msr, tsr, rfr[2], ier, esr, btr, reserved_020[88];
  Mailbox mailbox[3];
  Fifo fifo[2];
  RegisterOnModel reserved_1d0[12], fmr, fm1r, reserved_208, fs1r, reserved_210, ffa1r, reserved_218, fa1r;
  RegisterOnModel reserved_220[8];
  Bank bank[can1_filter_banks];
};

/// One board on a bus: controller, driver, and the processor that serves their interrupts.
struct CanBench : testing::ModelBench {
  struct Pend {
    bool* pending;
    void operator()() const { *pending = true; }
  };
  struct Received {
    CanFrame frame;
    unsigned fifo;
    std::uint8_t filter;
  };

  CanBench() : ModelBench({&model}) {
    clocks.apb1 = units_per_period(42'000'000);
    access_time = 10;  // so that a wait with a bound in reads ends
  }

  /// Handlers of all interrupts that are up; false when there was none.
  bool serve() {
    if (!interrupts_enabled) return false;
    bool any = false;
    if (pending || interrupts.level(Interrupt::can1_tx)) {
      pending = false;
      driver.ISR_serve_transmit();
      any = true;
    }
    for (const unsigned fifo : {0U, 1U}) {
      if (!interrupts.level(fifo == 0 ? Interrupt::can1_rx0 : Interrupt::can1_rx1)) continue;
      driver.ISR_receive(fifo, [&](const CanFrame& frame, std::uint8_t filter) {
        received.push_back({frame, fifo, filter});
      });
      any = true;
    }
    if (interrupts.level(Interrupt::can1_sce)) {
      driver.ISR_serve_status();
      ++status_interrupts;
      any = true;
    }
    return any;
  }

  /// Until `duration` has passed, interrupts served, the main loop every millisecond.
  void run(BoardTime duration) {
    const BoardTime end = now + duration;
    while (now < end) {
      while (serve()) {
      }
      if (now >= next_poll) {
        driver.poll(static_cast<std::uint32_t>(now / us));
        next_poll = now + ms;
      } else {
        run_until(std::min({std::max(now, model.next_event()), end, next_poll}));
      }
    }
  }
  void configure(const CanConfig& config = at_500k) {
    ASSERT_EQ(driver.configure(config, std::array{CanFilter{}}), CanConfigureResult::ok);
    run(2 * ms);
    ASSERT_EQ(driver.state(), CanBusState::on_bus);
  }

  CanBus bus;
  CanController model{clocks, interrupts, bus};
  CanOnModel registers = block_on_model<CanOnModel>(*this, model);
  bool pending = false;
  bool interrupts_enabled = true;
  unsigned status_interrupts = 0;
  std::vector<Received> received;
  Can<Pend, 16, CanOnModel> driver{registers, Pend{&pending}};
  BoardTime next_poll = 0;
};

TEST(CanDriverOnModel, JoinsTheBusAtEveryRate) {
  for (const std::uint32_t rate : {125'000U, 250'000U, 500'000U, 1'000'000U}) {
    CanBench bench;
    CanHostNode host{bench.bus, rate};
    std::vector<CanFrame> heard;
    host.on_frame([&](const CanFrame& frame, BoardTime) { heard.push_back(frame); });
    bench.configure({.timing = solve_can_bit_timing(42'000'000, rate).timing});
    const CanFrame out{.identifier = 0x701, .length = 1, .data = {5}}, in{.identifier = 0x601, .length = 8};
    ASSERT_EQ(bench.driver.send(out), CanSendResult::queued);
    host.send(in, bench.now);
    bench.run(5 * ms);
    ASSERT_EQ(heard.size(), 1U) << rate;
    EXPECT_EQ(heard[0], out);
    ASSERT_EQ(bench.received.size(), 1U);
    EXPECT_EQ(bench.received[0].frame, in);
    EXPECT_EQ(bench.driver.errors().transmit + bench.driver.errors().receive, 0);
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
    ASSERT_EQ(bench.driver.send(frame), CanSendResult::queued);
    ++sent;
    bench.run(ms);
    ASSERT_EQ(bench.received.size(), sent);
    ASSERT_EQ(bench.received.back().frame, frame) << sent;
  }
  EXPECT_EQ(bench.driver.transmit_counters().sent, 1000U);
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
    if (bench.driver.send(frame) == CanSendResult::queued) {
      ++next_sent[identifier];
      ++queued;
    }
    // Load that wins against some and not against others; now and then a destroyed frame. No identifier of
    // the board's own: that would collide.
    if (step % 3 == 0) host.send({.identifier = 0x101 + 2 * step, .length = 8}, bench.now);
    const bool healthy =
        bench.model.errors().transmit_errors() < 100 && host.errors().transmit_errors() < 100;
    if (step % 7 == 0 && healthy) bench.bus.destroy_frames(2);
    bench.run(step * 10 * us);
  }
  bench.run(100 * ms);
  RC_ASSERT(in_order);
  RC_ASSERT(heard == queued);
  RC_ASSERT(bench.driver.transmit_counters().sent == queued);
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
    ASSERT_EQ(bench.driver.send({.identifier = identifier}), CanSendResult::queued);
  }
  bench.run(20 * ms);
  EXPECT_TRUE(heard.empty());
  const BoardTime begin = bench.now;
  ASSERT_EQ(bench.driver.send({.identifier = 0x081}), CanSendResult::queued);
  while (heard.empty() && bench.now - begin < 10 * ms) bench.run(10 * us);
  ASSERT_EQ(heard, std::vector<std::uint32_t>{0x081});
  EXPECT_LT(bench.now - begin, ms) << "two frames at 500 kbit/s";
  babbler.babble(std::nullopt, bench.now);
  bench.run(10 * ms);
  EXPECT_EQ(heard, (std::vector<std::uint32_t>{0x081, 0x500, 0x501, 0x502, 0x503}));
  EXPECT_EQ(bench.driver.transmit_counters().aborted, 1U);
  EXPECT_EQ(bench.driver.transmit_counters().arbitration_lost, 1U)
      << "only the most urgent mailbox has tried";
}

TEST(CanDriverOnModel, BusOffAndBackWithGrowingPatience) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.configure();
  auto& driver = bench.driver;
  bench.bus.destroy_frames_of(bench.model.node());
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
  EXPECT_GE(bench.status_interrupts, 3U);
}

TEST(CanDriverOnModel, RecoversOnABusThatIsNeverIdle) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000}, babbler{bench.bus, 500'000};
  bench.configure();
  bench.bus.destroy_frames_of(bench.model.node());
  bench.bus.destroy_frames(32);
  ASSERT_EQ(bench.driver.send({.identifier = 0x180}), CanSendResult::queued);
  bench.run(15 * ms);
  babbler.babble(CanFrame{.identifier = 0x700, .length = 8}, bench.now);
  bench.run(200 * ms);
  EXPECT_EQ(bench.driver.state(), CanBusState::on_bus);
  EXPECT_GT(bench.driver.receive_counters().received, 0U);
}

TEST(CanDriverOnModel, AloneOnTheBusIsNotBusOff) {
  CanBench bench;
  bench.configure();
  ASSERT_EQ(bench.driver.send({.identifier = 0x701}), CanSendResult::queued);
  bench.run(100 * ms);
  EXPECT_EQ(bench.driver.state(), CanBusState::on_bus);
  const CanErrors errors = bench.driver.errors();
  EXPECT_EQ(errors.transmit, 128);
  EXPECT_TRUE(errors.passive && !errors.bus_off);
  EXPECT_EQ(errors.last, CanLastError::acknowledgement);
  CanHostNode host{bench.bus, 500'000};
  bench.run(5 * ms);
  EXPECT_EQ(bench.driver.transmit_counters().sent, 1U);
}

TEST(CanDriverOnModel, BusyOrStuckBusIsJoinedLater) {
  CanBench bench;
  bench.bus.set_stuck_dominant(true, bench.now);
  EXPECT_EQ(bench.driver.configure(at_500k, std::array{CanFilter{}}),
            CanConfigureResult::waiting_for_idle_bus);
  bench.run(50 * ms);
  EXPECT_EQ(bench.driver.state(), CanBusState::joining);
  bench.bus.set_stuck_dominant(false, bench.now);
  bench.run(5 * ms);
  EXPECT_EQ(bench.driver.state(), CanBusState::on_bus);
}

/// Data frames whose identifier equals `wanted`'s wherever `mask`'s is 1.
CanFilter masked(const CanFrame& wanted, const CanFrame& mask, std::uint8_t fifo) {
  return {can_identifier_word(wanted),
          can_identifier_word(mask) | can_identifier::Extended::mask | can_identifier::Remote::mask, false,
          fifo};
}

TEST(CanDriverOnModel, FiltersSortIntoTheFifos) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  const std::array filters{
      masked({.identifier = 0x600}, {.identifier = 0x780}, 0), can_filter_standard_list(0x000, 0x601, 1),
      masked({.identifier = 0x1234500, .extended = true}, {.identifier = 0x1FFFFF00, .extended = true}, 1)};
  ASSERT_EQ(bench.driver.configure(at_500k, filters), CanConfigureResult::ok);
  host.send({.identifier = 0x000}, bench.now);
  host.send({.identifier = 0x600}, bench.now);
  host.send({.identifier = 0x601}, bench.now);  // the list takes priority over the mask
  host.send({.identifier = 0x580}, bench.now);
  host.send({.identifier = 0x1234567, .extended = true}, bench.now);
  host.send({.identifier = 0x600, .remote = true}, bench.now);
  bench.run(10 * ms);
  EXPECT_EQ(host.waiting(), 0U) << "acknowledged, whether received or not";
  std::map<std::uint32_t, std::pair<unsigned, unsigned>> where;
  for (const auto& each : bench.received) where[each.frame.identifier] = {each.fifo, each.filter};
  const std::map<std::uint32_t, std::pair<unsigned, unsigned>> expected{
      {0x000, {1, 0}}, {0x600, {0, 0}}, {0x601, {1, 1}}, {0x1234567, {1, 2}}};
  EXPECT_EQ(where, expected);
}

TEST(CanDriverOnModel, LateInterruptLosesFramesAndSaysSo) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.configure();
  bench.interrupts_enabled = false;
  for (std::uint32_t i = 0; i < 6; ++i) host.send({.identifier = 0x100 + i}, bench.now);
  bench.run(5 * ms);
  bench.interrupts_enabled = true;
  bench.run(ms);
  ASSERT_EQ(bench.received.size(), 3U);
  EXPECT_EQ(bench.received[0].frame.identifier, 0x100U);
  EXPECT_EQ(bench.received[1].frame.identifier, 0x101U);
  EXPECT_EQ(bench.received[2].frame.identifier, 0x105U) << "RFLM = 0: the newest replaces the newest";
  EXPECT_EQ(bench.driver.receive_counters().overruns, 1U);
}

TEST(CanDriverOnModel, ConfiguredAgainWhileFramesAreWaiting) {
  CanBench bench;
  CanHostNode host{bench.bus, 500'000}, slow{bench.bus, 250'000};
  slow.set_listen_only(true);
  bench.configure();
  for (std::uint32_t i = 0; i < 8; ++i)
    ASSERT_EQ(bench.driver.send({.identifier = 0x180 + i}), CanSendResult::queued);
  bench.run(100 * us);  // in the middle of a frame
  host.set_connected(false, bench.now);
  slow.set_listen_only(false);
  bench.configure({.timing = can_bit_timing<42'000'000, 250'000>()});
  const std::uint32_t before = bench.driver.transmit_counters().sent;
  bench.run(10 * ms);
  EXPECT_EQ(bench.driver.transmit_counters().sent, before) << "what waited is gone";
  ASSERT_EQ(bench.driver.send({.identifier = 0x200}), CanSendResult::queued);
  bench.run(10 * ms);
  EXPECT_EQ(bench.driver.transmit_counters().sent, before + 1);
}

}  // namespace kmax::virtual_board::can_driver_on_model_test
