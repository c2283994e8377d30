#include "firmware/canopen/lss_slave.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace kmax::firmware::canopen::lss_slave_test {
namespace {

using drivers::CanFrame;
using Eight = std::array<std::uint8_t, 8>;

constexpr LssIdentity identity{0x0000'05B5, 0x1234'5678, 0x0001'0002, 0xDEAD'BEEF};

CanFrame request(const Eight& data) {
  return {.identifier = 0x7E5, .length = 8, .data = data};
}
CanFrame response(const Eight& data) {
  return {.identifier = 0x7E4, .length = 8, .data = data};
}

CanFrame numbered(std::uint8_t specifier, std::uint32_t number) {
  return request({specifier, static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8),
                  static_cast<std::uint8_t>(number >> 16), static_cast<std::uint8_t>(number >> 24)});
}

// A slave and the answer to each request.
struct Bench {
  explicit Bench(std::uint8_t node_id = unconfigured_node_id, const LssIdentity& who = identity)
      : slave(who) {
    slave.start(node_id, 500'000);
  }

  std::optional<CanFrame> ask(const CanFrame& frame) {
    action = slave.receive(frame, now_us);
    return answer();
  }

  std::optional<CanFrame> answer() {
    CanFrame frame;
    return slave.next_frame(frame) ? std::optional(frame) : std::nullopt;
  }

  void configure() {
    EXPECT_FALSE(ask(request({0x04, 1})));
    EXPECT_TRUE(slave.configuring());
  }

  LssSlave slave;
  LssAction action = LssAction::none;
  std::uint32_t now_us = 0xFFFF'F000;
};

TEST(LssSlave, SwitchStateGlobalIsNeverAnswered) {
  Bench bench;
  bench.configure();
  bench.configure();
  EXPECT_FALSE(bench.ask(request({0x04, 0})));
  EXPECT_FALSE(bench.slave.configuring());
  bench.configure();
  EXPECT_FALSE(bench.ask(request({0x04, 2})));
  EXPECT_TRUE(bench.slave.configuring()) << "there is no such state";
}

// CiA 305: error code 255 says that the specific error code behind it counts.
TEST(LssSlave, LockedItTakesNoNodeIdAndNoBitRateAndStoresNothing) {
  Bench bench(7);
  bench.slave.hold(false, true);
  bench.configure();
  for (const Eight& wanted : {Eight{0x11, 9}, Eight{0x13, 0, 3}, Eight{0x17}}) {
    EXPECT_EQ(bench.ask(request(wanted)), response({wanted[0], 0xFF, 1}));
    EXPECT_EQ(bench.action, LssAction::none);
  }
  EXPECT_FALSE(bench.ask(request({0x15, 0, 0})));
  EXPECT_EQ(bench.slave.poll(bench.now_us + 1'000'000), LssAction::none);
  EXPECT_EQ(bench.slave.pending_node_id(), 7);
  EXPECT_EQ(bench.slave.pending_bit_rate(), 500'000u);
  EXPECT_EQ(bench.ask(request({0x5E})), response({0x5E, 7}));
  bench.slave.hold(false, false);
  EXPECT_EQ(bench.ask(request({0x11, 9})), response({0x11, 0}));
  EXPECT_EQ(bench.slave.pending_node_id(), 9);
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
  const Eight configure{0x04, 1};
  bench.ask(response(configure));
  bench.ask({.identifier = 0x7E5, .extended = true, .length = 8, .data = configure});
  bench.ask({.identifier = 0x7E5, .remote = true, .length = 8, .data = configure});
  EXPECT_FALSE(bench.slave.configuring());
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

// As this device has them, and as one that had all of the table.
TEST(LssSlave, BitTimings) {
  Bench ours(1), with_all(1);
  with_all.slave = LssSlave(identity, 0xFFFF);
  with_all.slave.start(1, 500'000);
  const std::vector<std::uint32_t> our_rates{1'000'000, 0, 500'000, 250'000, 125'000},
      all_rates{1'000'000, 800'000, 500'000, 250'000, 125'000, 0, 50'000, 20'000, 10'000};
  for (const auto& [bench, rates] : {std::pair{&ours, &our_rates}, {&with_all, &all_rates}}) {
    bench->configure();
    for (unsigned table = 0; table < 256; ++table) {
      for (unsigned place = 0; place < 256; ++place) {
        const bool good = table == 0 && place < rates->size() && rates->at(place) != 0;
        ASSERT_EQ(
            bench->ask(request({0x13, static_cast<std::uint8_t>(table), static_cast<std::uint8_t>(place)})),
            response({0x13, static_cast<std::uint8_t>(good ? 0 : 1)}))
            << table << ' ' << place;
        if (good) {
          EXPECT_EQ(bench->slave.pending_bit_rate(), rates->at(place));
        }
      }
    }
    EXPECT_EQ(bench->slave.pending_bit_rate(), rates->back()) << "refused ones change nothing";
    EXPECT_EQ(bench->slave.active_bit_rate(), 500'000U);
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
    EXPECT_EQ(bench.slave.poll(start + 2 * delay_us - 1), LssAction::none);
    EXPECT_TRUE(bench.slave.quiet());
    EXPECT_EQ(bench.slave.poll(start + 2 * delay_us), LssAction::none);
    EXPECT_FALSE(bench.slave.quiet());
    EXPECT_EQ(bench.slave.poll(start + 3 * delay_us), LssAction::none);
    EXPECT_TRUE(bench.ask(request({0x5E})));
  }
}

// Nobody who holds a device that makes force loses it with the bus; what has been switched is finished.
TEST(LssSlave, ArmedItKeepsItsBitRate) {
  Bench bench(1);
  bench.configure();
  bench.ask(request({0x13, 0, 4}));
  bench.slave.hold(true, false);
  EXPECT_FALSE(bench.ask(request({0x15, 0, 0})));
  EXPECT_FALSE(bench.slave.quiet()) << "it does not begin";
  EXPECT_EQ(bench.ask(request({0x11, 9})), response({0x11, 0})) << "but is not locked";
  bench.slave.hold(false, false);
  bench.ask(request({0x15, 10, 0}));
  EXPECT_TRUE(bench.slave.quiet());
  bench.slave.hold(true, false);
  EXPECT_FALSE(bench.slave.quiet()) << "it is given up";
  EXPECT_EQ(bench.slave.poll(bench.now_us + 10'000), LssAction::none);
  bench.slave.hold(false, false);
  bench.ask(request({0x15, 10, 0}));
  EXPECT_EQ(bench.slave.poll(bench.now_us + 10'000), LssAction::switch_bit_rate);
  bench.slave.hold(true, false);
  EXPECT_TRUE(bench.slave.quiet()) << "the second delay is waited for";
  EXPECT_EQ(bench.slave.active_bit_rate(), 125'000U);
}

TEST(LssSlave, BeforeItsStartItHasNoNodeIdAndTheFactorysBitRate) {
  LssSlave slave(identity);
  EXPECT_EQ(slave.active_node_id(), unconfigured_node_id);
  EXPECT_EQ(slave.pending_node_id(), unconfigured_node_id);
  EXPECT_EQ(slave.active_bit_rate(), 1'000'000U);
  EXPECT_EQ(slave.pending_bit_rate(), 1'000'000U);
  EXPECT_FALSE(slave.quiet());
  EXPECT_FALSE(slave.configuring());
  CanFrame frame;
  EXPECT_FALSE(slave.next_frame(frame));
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
}

TEST(LssSlave, InquireIdentity) {
  Bench bench;
  bench.configure();
  EXPECT_EQ(bench.ask(request({0x5A})), response({0x5A, 0xB5, 0x05, 0x00, 0x00}));
  EXPECT_EQ(bench.ask(request({0x5B})), response({0x5B, 0x78, 0x56, 0x34, 0x12}));
  EXPECT_EQ(bench.ask(request({0x5C})), response({0x5C, 0x02, 0x00, 0x01, 0x00}));
  EXPECT_EQ(bench.ask(request({0x5D})), response({0x5D, 0xEF, 0xBE, 0xAD, 0xDE}));
}

CanFrame scan(std::uint32_t number, unsigned check, unsigned sub, unsigned next) {
  CanFrame frame = numbered(0x51, number);
  frame.data[5] = static_cast<std::uint8_t>(check);
  frame.data[6] = static_cast<std::uint8_t>(sub);
  frame.data[7] = static_cast<std::uint8_t>(next);
  return frame;
}

const std::vector<CanFrame> selection{numbered(0x40, identity.vendor), numbered(0x41, identity.product),
                                      numbered(0x42, identity.revision), numbered(0x43, identity.serial)};

bool identifies(Bench& bench, const std::array<std::uint32_t, 6>& numbers) {
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_FALSE(bench.ask(numbered(static_cast<std::uint8_t>(0x46 + i), numbers[i])));
  const std::optional<CanFrame> answer = bench.ask(numbered(0x4B, numbers[5]));
  EXPECT_TRUE(!answer || *answer == response({0x4F}));
  return answer.has_value();
}

TEST(LssSlave, SwitchStateSelective) {
  for (const std::uint8_t node_id : {std::uint8_t{7}, unconfigured_node_id}) {
    Bench bench(node_id);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_FALSE(bench.ask(selection[i]));
    EXPECT_EQ(bench.ask(selection[3]), response({0x44}));
    EXPECT_TRUE(bench.slave.configuring());
  }
}

TEST(LssSlave, SelectionAndIdentificationMayBeginAgain) {
  for (std::size_t given_up_after = 1; given_up_after < 4; ++given_up_after) {
    Bench bench;
    for (std::size_t i = 0; i < given_up_after; ++i) EXPECT_FALSE(bench.ask(selection[i]));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_FALSE(bench.ask(selection[i]));
    EXPECT_TRUE(bench.ask(selection[3])) << given_up_after;
  }
  Bench bench;
  EXPECT_FALSE(bench.ask(numbered(0x46, identity.vendor)));
  EXPECT_FALSE(bench.ask(numbered(0x47, identity.product)));
  const auto [vendor, product, revision, serial] = identity;
  EXPECT_TRUE(identifies(bench, {vendor, product, revision, revision, serial, serial}));
}

TEST(LssSlave, SelectionNeedsAllFourNumbersInTheirOrder) {
  for (std::size_t wrong = 0; wrong < 4; ++wrong) {
    for (unsigned bit = 0; bit < 32; ++bit) {
      Bench bench;
      for (std::size_t i = 0; i < 4; ++i) {
        CanFrame frame = selection[i];
        if (i == wrong) frame.data[1 + bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
        EXPECT_FALSE(bench.ask(frame)) << wrong << ' ' << bit;
      }
      EXPECT_FALSE(bench.slave.configuring());
    }
  }
  for (std::size_t left_out = 0; left_out < 4; ++left_out) {
    Bench bench;
    for (std::size_t i = 0; i < 4; ++i) {
      if (i != left_out) {
        EXPECT_FALSE(bench.ask(selection[i]));
      }
    }
    EXPECT_FALSE(bench.slave.configuring());
  }
  Bench bench;
  for (const std::size_t i : {1U, 0U, 2U, 3U, 0U, 1U, 1U, 2U, 3U}) EXPECT_FALSE(bench.ask(selection[i]));
  EXPECT_FALSE(bench.slave.configuring());
}

TEST(LssSlave, IdentifyRemoteSlaveWithinBoundsInBothStates) {
  for (const bool configuring : {false, true}) {
    Bench bench(7);
    if (configuring) bench.configure();
    const auto [vendor, product, revision, serial] = identity;
    constexpr std::uint32_t most = 0xFFFF'FFFF;
    EXPECT_TRUE(identifies(bench, {vendor, product, revision, revision, serial, serial}));
    EXPECT_TRUE(identifies(bench, {vendor, product, 0, most, 0, most}));
    EXPECT_FALSE(identifies(bench, {vendor + 1, product, 0, most, 0, most}));
    EXPECT_FALSE(identifies(bench, {vendor, product - 1, 0, most, 0, most}));
    EXPECT_FALSE(identifies(bench, {vendor, product, revision + 1, most, 0, most}));
    EXPECT_FALSE(identifies(bench, {vendor, product, 0, revision - 1, 0, most}));
    EXPECT_FALSE(identifies(bench, {vendor, product, 0, most, serial + 1, most}));
    EXPECT_FALSE(identifies(bench, {vendor, product, 0, most, 0, serial - 1}));
    EXPECT_EQ(bench.slave.configuring(), configuring);
    EXPECT_FALSE(bench.ask(numbered(0x4B, serial))) << "the last number alone";
  }
}

TEST(LssSlave, IdentifyNonConfigured) {
  Bench bench;
  EXPECT_EQ(bench.ask(request({0x4C})), response({0x50}));
  bench.configure();
  EXPECT_EQ(bench.ask(request({0x4C})), response({0x50}));
  bench.ask(request({0x11, 3}));
  EXPECT_FALSE(bench.ask(request({0x4C}))) << "a node ID is pending";
  EXPECT_FALSE(Bench(7).ask(request({0x4C})));
}

TEST(LssSlave, FastscanOnlyWithoutANodeIdAndInTheWaitingState) {
  EXPECT_EQ(Bench().ask(scan(0, 0x80, 0, 0)), response({0x4F}));
  EXPECT_FALSE(Bench(7).ask(scan(0, 0x80, 0, 0)));
  Bench bench;
  bench.configure();
  EXPECT_FALSE(bench.ask(scan(0, 0x80, 0, 0)));
}

TEST(LssSlave, FastscanRefusesWhatCannotBe) {
  Bench bench;
  bench.ask(scan(0, 0x80, 0, 0));
  for (unsigned check = 32; check < 256; ++check) {
    if (check != 0x80) {
      EXPECT_FALSE(bench.ask(scan(identity.vendor, check, 0, 0))) << check;
    }
  }
  EXPECT_FALSE(bench.ask(scan(identity.vendor, 0, 0, 4)));
  EXPECT_FALSE(bench.ask(scan(identity.vendor, 0, 4, 0)));
  EXPECT_FALSE(bench.ask(scan(identity.product, 0, 1, 2))) << "it is not at this number yet";
  EXPECT_FALSE(bench.slave.configuring());
  EXPECT_TRUE(bench.ask(scan(identity.vendor, 0, 0, 1)));
  EXPECT_FALSE(bench.ask(scan(identity.vendor, 0, 0, 1))) << "it is further";
  EXPECT_TRUE(bench.ask(scan(identity.product, 0, 1, 2)));
  bench.ask(scan(0, 0x80, 0, 0));
  EXPECT_TRUE(bench.ask(scan(identity.vendor, 0, 0, 1))) << "from the beginning";
}

TEST(LssSlave, FastscanEndsOnlyWithTheLastBitOfTheLastNumber) {
  Bench bench;
  const std::array<std::uint32_t, 4> numbers{identity.vendor, identity.product, identity.revision,
                                             identity.serial};
  bench.ask(scan(0, 0x80, 0, 0));
  for (unsigned sub = 0; sub < 3; ++sub) EXPECT_TRUE(bench.ask(scan(numbers[sub], 0, sub, sub + 1)));
  EXPECT_TRUE(bench.ask(scan(numbers[3], 1, 3, 3)));
  EXPECT_TRUE(bench.ask(scan(numbers[3], 0, 3, 3)));
  EXPECT_FALSE(bench.slave.configuring()) << "the master has not gone on";
  EXPECT_TRUE(bench.ask(scan(numbers[3], 1, 3, 0)));
  EXPECT_FALSE(bench.slave.configuring()) << "the last bit was not compared";
  EXPECT_FALSE(bench.ask(scan(numbers[3], 0, 3, 0))) << "it is at the first number again";
  EXPECT_FALSE(bench.slave.configuring());
}

// A master by the description of the service: does any device answer "yes"?
std::optional<std::array<std::uint32_t, 4>> fastscan(std::vector<Bench>& bus) {
  const auto any = [&bus](const CanFrame& frame) {
    bool yes = false;
    for (Bench& bench : bus) yes = bench.ask(frame).has_value() || yes;
    return yes;
  };
  if (!any(scan(0, 0x80, 0, 0))) return std::nullopt;
  std::array<std::uint32_t, 4> found{};
  for (unsigned sub = 0; sub < 4; ++sub) {
    for (unsigned bit = 32; bit-- > 0;) {
      if (!any(scan(found[sub], bit, sub, sub))) found[sub] |= 1U << bit;
    }
    if (!any(scan(found[sub], 0, sub, (sub + 1) % 4))) return std::nullopt;
  }
  return found;
}

// Devices that differ in few or many bits are found one after the other and get their node IDs.
RC_GTEST_PROP(LssSlave, FastscanFindsEveryDeviceOnTheBus, ()) {
  const auto number = rc::gen::element<std::uint32_t>(0, 1, 2, 0x8000'0000, 0xFFFF'FFFF, 0x1234'5678);
  std::vector<LssIdentity> identities;
  const auto count = *rc::gen::inRange<std::uint32_t>(1, 5);
  for (std::uint32_t i = 0; i < count; ++i) {
    identities.push_back({*number, *number, *number, *number * 8 + i});
  }
  std::vector<Bench> bus;
  for (const LssIdentity& who : identities) bus.emplace_back(unconfigured_node_id, who);
  for (std::uint8_t id = 1; id <= count; ++id) {
    const auto found = fastscan(bus);
    RC_ASSERT(found.has_value());
    unsigned answers = 0;
    for (std::size_t i = 0; i < bus.size(); ++i) {
      const LssIdentity& who = identities[i];
      const bool is_it = *found == std::array{who.vendor, who.product, who.revision, who.serial};
      RC_ASSERT(bus[i].slave.configuring() == is_it);
      if (bus[i].ask(request({0x11, id}))) ++answers;
      bus[i].ask(request({0x04, 0}));
      RC_ASSERT(bus[i].action == (is_it ? LssAction::start_node : LssAction::none));
      if (is_it) {
        RC_ASSERT(bus[i].slave.reset_communication() == id);
      }
    }
    RC_ASSERT(answers == 1U);
  }
  RC_ASSERT(!fastscan(bus).has_value());
}

}  // namespace
}  // namespace kmax::firmware::canopen::lss_slave_test
