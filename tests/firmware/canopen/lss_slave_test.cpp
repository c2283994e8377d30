#include "firmware/canopen/lss_slave.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "tests/firmware/canopen/lss_bench.hpp"

namespace kmax::firmware::canopen::lss_test::lss_slave_test {
namespace {

TEST(LssSlave, SwitchStateGlobalIsNeverAnswered) {
  Bench bench;
  bench.configure();
  bench.configure();
  EXPECT_FALSE(bench.ask(request({0x04, 0})));
  EXPECT_FALSE(bench.slave.configuring());
  bench.configure();
  EXPECT_FALSE(bench.ask(request({0x04, 2})));
  EXPECT_TRUE(bench.slave.configuring()) << "there is no such state";
  EXPECT_EQ(bench.slave.counters().unknown, 1U);
}

TEST(LssSlave, NothingIsConfiguredInTheWaitingState) {
  Bench bench;
  for (const std::uint8_t specifier :
       std::vector<std::uint8_t>{0x11, 0x13, 0x15, 0x17, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E}) {
    EXPECT_FALSE(bench.ask(request({specifier, 1}))) << int{specifier};
    EXPECT_EQ(bench.action, LssAction::none);
  }
  EXPECT_EQ(bench.slave.pending_node_id(), unconfigured_node_id);
  EXPECT_FALSE(bench.slave.quiet());
  EXPECT_EQ(bench.slave.counters().unknown, 9U);
}

TEST(LssSlave, EveryOtherServiceIsIgnoredInBothStates) {
  for (const bool configuring : {false, true}) {
    Bench bench(7);
    if (configuring) bench.configure();
    for (unsigned specifier = 0; specifier < 256; ++specifier) {
      if (specifier == 0x04) continue;
      const bool known = configuring && (specifier == 0x11 || specifier == 0x13 || specifier == 0x15 ||
                                         specifier == 0x17 || (specifier >= 0x5A && specifier <= 0x5E));
      if (known) continue;
      EXPECT_FALSE(bench.ask(request({static_cast<std::uint8_t>(specifier)}))) << specifier;
      EXPECT_EQ(bench.action, LssAction::none);
      EXPECT_EQ(bench.slave.configuring(), configuring);
    }
  }
}

TEST(LssSlave, OtherFramesAreIgnored) {
  Bench bench;
  for (std::uint8_t length = 0; length < 8; ++length) {
    CanFrame frame = request({0x04, 1});
    frame.length = length;
    EXPECT_FALSE(bench.ask(frame));
  }
  EXPECT_EQ(bench.slave.counters().wrong_length, 8U);
  CanFrame frame = request({0x04, 1});
  frame.identifier = 0x7E4;
  bench.ask(frame);
  frame = request({0x04, 1});
  frame.extended = true;
  bench.ask(frame);
  frame = request({0x04, 1});
  frame.remote = true;
  bench.ask(frame);
  EXPECT_FALSE(bench.slave.configuring());
  EXPECT_EQ(bench.slave.counters().requests, 0U);
}

TEST(LssSlave, FirstNodeIdIsAdoptedWhenTheMasterSendsItBackToWaiting) {
  Bench bench;
  bench.configure();
  EXPECT_EQ(bench.ask(request({0x5E})), response({0x5E, 255}));
  EXPECT_EQ(bench.ask(request({0x11, 0x22})), response({0x11, 0}));
  EXPECT_EQ(bench.ask(request({0x5E})), response({0x5E, 0x22})) << "pending, for none is active";
  EXPECT_EQ(bench.slave.active_node_id(), unconfigured_node_id);
  EXPECT_FALSE(bench.ask(request({0x04, 1})));
  EXPECT_EQ(bench.action, LssAction::none);
  EXPECT_FALSE(bench.ask(request({0x04, 0})));
  EXPECT_EQ(bench.action, LssAction::start_node);
  EXPECT_FALSE(bench.ask(request({0x04, 0})));
  EXPECT_EQ(bench.action, LssAction::none) << "it was back already";
  EXPECT_EQ(bench.slave.reset_communication(), 0x22);
  EXPECT_EQ(bench.slave.active_node_id(), 0x22);
  bench.configure();
  bench.ask(request({0x04, 0}));
  EXPECT_EQ(bench.action, LssAction::none) << "once";
}

TEST(LssSlave, ANodeIdThatReplacesAnotherWaitsForTheReset) {
  Bench bench(0x11);
  bench.configure();
  EXPECT_EQ(bench.ask(request({0x11, 0x7F})), response({0x11, 0}));
  EXPECT_EQ(bench.ask(request({0x5E})), response({0x5E, 0x11})) << "the active one";
  bench.ask(request({0x04, 0}));
  EXPECT_EQ(bench.action, LssAction::none);
  EXPECT_EQ(bench.slave.active_node_id(), 0x11);
  EXPECT_EQ(bench.slave.reset_communication(), 0x7F);
  bench.configure();
  EXPECT_EQ(bench.ask(request({0x11, 255})), response({0x11, 0}));
  EXPECT_EQ(bench.slave.reset_communication(), unconfigured_node_id);
  EXPECT_FALSE(bench.slave.configuring()) << "a reset leads back to waiting";
}

TEST(LssSlave, NodeIdsOutOfRangeAreRefused) {
  Bench bench(0x11);
  bench.configure();
  for (unsigned id = 0; id < 256; ++id) {
    const bool good = (id >= 1 && id <= 127) || id == 255;
    const std::uint8_t before = bench.slave.pending_node_id();
    EXPECT_EQ(bench.ask(request({0x11, static_cast<std::uint8_t>(id)})),
              response({0x11, static_cast<std::uint8_t>(good ? 0 : 1)}));
    EXPECT_EQ(bench.slave.pending_node_id(), good ? id : before);
  }
}

TEST(LssSlave, StartTakesWhatIsStored) {
  for (const std::uint8_t node_id : std::vector<std::uint8_t>{0, 128, 254, 255}) {
    EXPECT_EQ(Bench(node_id).slave.active_node_id(), unconfigured_node_id);
  }
  Bench bench(127);
  EXPECT_EQ(bench.slave.active_node_id(), 127);
  EXPECT_EQ(bench.slave.active_bit_rate(), 500'000U);
  bench.configure();
  bench.slave.receive(request({0x5E}), 0);
  bench.slave.start(5, 125'000);
  EXPECT_FALSE(bench.answer());
  EXPECT_FALSE(bench.slave.configuring());
  EXPECT_EQ(bench.slave.active_node_id(), 5);
  EXPECT_EQ(bench.slave.pending_bit_rate(), 125'000U);
}

TEST(LssSlave, BitTimings) {
  Bench bench(1);
  bench.configure();
  const std::array<std::uint32_t, 5> rates{1'000'000, 0, 500'000, 250'000, 125'000};
  for (unsigned table = 0; table < 256; ++table) {
    for (unsigned place = 0; place < 256; ++place) {
      const bool good = table == 0 && place < rates.size() && rates[place] != 0;
      ASSERT_EQ(
          bench.ask(request({0x13, static_cast<std::uint8_t>(table), static_cast<std::uint8_t>(place)})),
          response({0x13, static_cast<std::uint8_t>(good ? 0 : 1)}))
          << table << ' ' << place;
      if (good) {
        EXPECT_EQ(bench.slave.pending_bit_rate(), rates[place]);
      }
    }
  }
  EXPECT_EQ(bench.slave.pending_bit_rate(), 125'000U) << "refused ones change nothing";
  EXPECT_EQ(bench.slave.active_bit_rate(), 500'000U);
}

TEST(LssSlave, EveryBitTimingOfTheTableIfTheDeviceHasThemAll) {
  LssSlave slave(identity, 0xFFFF);
  slave.start(1, 500'000);
  slave.receive(request({0x04, 1}), 0);
  const std::array<std::uint32_t, 12> rates{1'000'000, 800'000, 500'000, 250'000, 125'000, 0,
                                            50'000,    20'000,  10'000,  0,       0,       0};
  for (std::uint8_t place = 0; place < rates.size(); ++place) {
    slave.receive(request({0x13, 0, place}), 0);
    CanFrame frame;
    ASSERT_TRUE(slave.next_frame(frame));
    EXPECT_EQ(frame, response({0x13, static_cast<std::uint8_t>(rates[place] != 0 ? 0 : 1)}));
    if (rates[place] != 0) {
      EXPECT_EQ(slave.pending_bit_rate(), rates[place]);
    }
  }
}

TEST(LssSlave, ActivationIsQuietForTheDelayBeforeAndAfterTheSwitch) {
  for (const std::uint32_t delay_ms : {1U, 258U, 65535U}) {
    Bench bench(1);
    bench.configure();
    bench.ask(request({0x13, 0, 4}));
    const std::uint32_t start = bench.now_us, delay_us = delay_ms * 1000;
    EXPECT_FALSE(bench.ask(
        request({0x15, static_cast<std::uint8_t>(delay_ms), static_cast<std::uint8_t>(delay_ms >> 8)})));
    EXPECT_EQ(bench.action, LssAction::none);
    EXPECT_TRUE(bench.slave.quiet());
    EXPECT_EQ(bench.slave.poll(start + delay_us - 1), LssAction::none);
    EXPECT_EQ(bench.slave.active_bit_rate(), 500'000U);
    EXPECT_EQ(bench.slave.poll(start + delay_us), LssAction::switch_bit_rate);
    EXPECT_EQ(bench.slave.active_bit_rate(), 125'000U);
    EXPECT_FALSE(bench.ask(request({0x5E}))) << "requests while quiet";
    EXPECT_EQ(bench.slave.counters().busy, 1U);
    EXPECT_EQ(bench.slave.poll(start + 2 * delay_us - 1), LssAction::none);
    EXPECT_TRUE(bench.slave.quiet());
    EXPECT_EQ(bench.slave.poll(start + 2 * delay_us), LssAction::none);
    EXPECT_FALSE(bench.slave.quiet());
    EXPECT_EQ(bench.slave.poll(start + 3 * delay_us), LssAction::none);
    EXPECT_TRUE(bench.ask(request({0x5E})));
  }
}

TEST(LssSlave, ActivationWithoutDelayOrWithoutANewBitRate) {
  Bench bench(1);
  bench.configure();
  bench.ask(request({0x15, 0, 0}));
  EXPECT_EQ(bench.slave.poll(bench.now_us), LssAction::switch_bit_rate);
  EXPECT_EQ(bench.slave.active_bit_rate(), 500'000U);
  bench.slave.poll(bench.now_us);
  EXPECT_FALSE(bench.slave.quiet());
}

TEST(LssSlave, StoreIsAnsweredWithTheOwnersResult) {
  for (const LssStore result : {LssStore::stored, LssStore::not_supported, LssStore::failed}) {
    Bench bench;
    bench.configure();
    bench.ask(request({0x11, 9}));
    bench.ask(request({0x13, 0, 3}));
    bench.slave.finish(result);
    EXPECT_FALSE(bench.answer()) << "nothing was to be stored";
    EXPECT_FALSE(bench.ask(request({0x17})));
    EXPECT_EQ(bench.action, LssAction::store);
    EXPECT_EQ(bench.slave.pending_node_id(), 9);
    EXPECT_EQ(bench.slave.pending_bit_rate(), 250'000U);
    EXPECT_FALSE(bench.ask(request({0x17})));
    EXPECT_EQ(bench.action, LssAction::none) << "one at a time";
    EXPECT_FALSE(bench.ask(request({0x11, 10})));
    EXPECT_EQ(bench.slave.pending_node_id(), 9) << "not while it is being stored";
    EXPECT_EQ(bench.slave.counters().busy, 2U);
    bench.slave.finish(result);
    EXPECT_EQ(bench.answer(), response({0x17, static_cast<std::uint8_t>(result)}));
    bench.slave.finish(result);
    EXPECT_FALSE(bench.answer());
  }
}

TEST(LssSlave, AnAnswerThatDidNotGoIsNotTakenForTheNextOne) {
  Bench bench(7);
  bench.configure();
  bench.slave.receive(request({0x5A}), 0);
  bench.slave.receive(request({0x5B}), 0);
  EXPECT_EQ(bench.answer(), response({0x5B, 0x78, 0x56, 0x34, 0x12}));
  EXPECT_FALSE(bench.answer());
  EXPECT_EQ(bench.slave.counters().withdrawn, 1U);
  EXPECT_EQ(bench.slave.counters().answers, 1U);
}

TEST(LssSlave, InquireIdentity) {
  Bench bench;
  bench.configure();
  EXPECT_EQ(bench.ask(request({0x5A})), response({0x5A, 0xB5, 0x05, 0x00, 0x00}));
  EXPECT_EQ(bench.ask(request({0x5B})), response({0x5B, 0x78, 0x56, 0x34, 0x12}));
  EXPECT_EQ(bench.ask(request({0x5C})), response({0x5C, 0x02, 0x00, 0x01, 0x00}));
  EXPECT_EQ(bench.ask(request({0x5D})), response({0x5D, 0xEF, 0xBE, 0xAD, 0xDE}));
}

}  // namespace
}  // namespace kmax::firmware::canopen::lss_test::lss_slave_test
