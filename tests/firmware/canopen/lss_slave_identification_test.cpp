#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/canopen/lss_slave.hpp"
#include "tests/firmware/canopen/lss_bench.hpp"

namespace kmax::firmware::canopen::lss_test::lss_slave_identification_test {
namespace {

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
    EXPECT_TRUE(identifies(bench, {vendor, product, revision, revision, serial, serial}));
    EXPECT_TRUE(identifies(bench, {vendor, product, 0, 0xFFFF'FFFF, 0, 0xFFFF'FFFF}));
    EXPECT_FALSE(identifies(bench, {vendor + 1, product, 0, 0xFFFF'FFFF, 0, 0xFFFF'FFFF}));
    EXPECT_FALSE(identifies(bench, {vendor, product - 1, 0, 0xFFFF'FFFF, 0, 0xFFFF'FFFF}));
    EXPECT_FALSE(identifies(bench, {vendor, product, revision + 1, 0xFFFF'FFFF, 0, 0xFFFF'FFFF}));
    EXPECT_FALSE(identifies(bench, {vendor, product, 0, revision - 1, 0, 0xFFFF'FFFF}));
    EXPECT_FALSE(identifies(bench, {vendor, product, 0, 0xFFFF'FFFF, serial + 1, 0xFFFF'FFFF}));
    EXPECT_FALSE(identifies(bench, {vendor, product, 0, 0xFFFF'FFFF, 0, serial - 1}));
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
}  // namespace kmax::firmware::canopen::lss_test::lss_slave_identification_test
