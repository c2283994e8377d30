#include "firmware/canopen/rpdo.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>
#include <utility>
#include <vector>

#include "tests/firmware/canopen/communication_writes.hpp"

namespace kmax::firmware::canopen::rpdo_test {
namespace {

using drivers::CanFrame;
using Written = std::vector<std::pair<std::size_t, std::uint32_t>>;

constexpr std::uint32_t controlword = mapping_of(0x6040, 0, 16);
constexpr std::uint32_t torque = mapping_of(0x6071, 0, 16);
constexpr std::uint32_t mode = mapping_of(0x6060, 0, 8);
constexpr std::uint32_t stiffness = mapping_of(0x2000, 4, 32);
const std::size_t controlword_slot = slot_of(entry_of<"drive.controlword">(), 0);
const std::size_t torque_slot = slot_of(entry_of<"profile.target_torque">(), 0);
const std::size_t mode_slot = slot_of(entry_of<"profile.operation_mode">(), 0);
const std::size_t stiffness_slot = slot_of(entry_of<"wall.stiffness">(), 0);

CanFrame frame(std::uint32_t identifier, std::initializer_list<std::uint8_t> bytes) {
  CanFrame f{.identifier = identifier, .length = static_cast<std::uint8_t>(bytes.size())};
  std::copy(bytes.begin(), bytes.end(), f.data.begin());
  return f;
}

struct Node {
  explicit Node(const ParameterValues& values) { rpdos.configure(values, test_node_id); }
  auto writer() {
    return [this](std::size_t slot, std::uint32_t raw) {
      written.emplace_back(slot, raw);
      return slot != refused_slot;
    };
  }
  RpdoResult receive(const CanFrame& f) { return rpdos.receive(f, writer()); }
  void sync() { rpdos.on_sync(writer()); }
  Written take() { return std::exchange(written, {}); }

  Rpdos rpdos;
  Written written;
  std::size_t refused_slot = slot_count;
};

struct Mapped : CommunicationWrites {
  Mapped(std::initializer_list<std::uint32_t> objects, std::uint32_t type = 255) {
    EXPECT_EQ(remap(0x1400, objects, 0x205, type), Abort::none);
  }
};

TEST(Rpdo, TheDefaultsSetControlwordAndTorqueOfBothAxes) {
  Node node{ParameterValues{}};
  EXPECT_EQ(node.receive(frame(0x205, {0x0F, 0x00, 0x18, 0xFC})), RpdoResult::taken);
  EXPECT_EQ(node.take(), (Written{{controlword_slot, 15}, {torque_slot, 0xFFFFFC18}}));
  EXPECT_EQ(node.receive(frame(0x305, {0x06, 0x80, 0xFF, 0x7F})), RpdoResult::taken);
  EXPECT_EQ(node.take(), (Written{{slot_of(entry_of<"drive.controlword">(), 1), 0x8006},
                                  {slot_of(entry_of<"profile.target_torque">(), 1), 0x7FFF}}));
}

TEST(Rpdo, OtherFramesAreIgnored) {
  Node node{ParameterValues{}};
  for (const std::uint32_t identifier : {0x000U, 0x080U, 0x200U, 0x204U, 0x206U, 0x405U, 0x505U, 0x605U})
    EXPECT_EQ(node.receive(frame(identifier, {1, 2, 3, 4})), RpdoResult::ignored) << identifier;
  for (const CanFrame& f : {CanFrame{.identifier = 0x205, .remote = true, .length = 4},
                            {.identifier = 0x205, .extended = true, .length = 4},
                            {.identifier = 0x205, .length = 9}})
    EXPECT_EQ(node.receive(f), RpdoResult::ignored);
  EXPECT_TRUE(node.written.empty());
}

TEST(Rpdo, NothingIsReceivedBeforeTheStart) {
  Rpdos never;
  EXPECT_EQ(never.receive(frame(0, {}), [](std::size_t, std::uint32_t) { return true; }),
            RpdoResult::ignored);
}

TEST(Rpdo, AShortFrameIsNotUsedALongOneIs) {
  for (const std::uint32_t type : {0U, 255U}) {
    Node node{Mapped({controlword, mode}, type).values};
    EXPECT_EQ(node.receive(frame(0x205, {})), RpdoResult::too_short);
    EXPECT_EQ(node.receive(frame(0x205, {1, 2})), RpdoResult::too_short);
    node.sync();
    EXPECT_TRUE(node.take().empty());
    EXPECT_EQ(node.receive(frame(0x205, {1, 2, 3, 4, 5, 6, 7, 8})), RpdoResult::too_long);
    node.sync();
    EXPECT_EQ(node.take(), (Written{{controlword_slot, 0x201}, {mode_slot, 3}}));
    EXPECT_EQ(node.rpdos.counters().too_short, 2U);
  }
}

TEST(Rpdo, SynchronousOnesWaitForSyncAndTheNewestWins) {
  for (const std::uint32_t type : {0U, 1U, 17U, 240U}) {
    Node node{Mapped({controlword}, type).values};
    node.sync();
    node.receive(frame(0x205, {1, 0}));
    node.receive(frame(0x205, {2, 0}));
    EXPECT_EQ(node.receive(frame(0x205, {9})), RpdoResult::too_short);
    EXPECT_TRUE(node.take().empty());
    node.sync();  // the next one, whatever the number of the type (CiA 301: object 0x1400)
    EXPECT_EQ(node.take(), (Written{{controlword_slot, 2}}));
    node.sync();
    EXPECT_TRUE(node.take().empty());
  }
  for (const std::uint32_t type : {254U, 255U}) {
    Node node{Mapped({controlword}, type).values};
    node.receive(frame(0x205, {1, 0}));
    EXPECT_EQ(node.take().size(), 1U);
    node.sync();
    EXPECT_TRUE(node.take().empty());
  }
}

// What a host wanted a tenth of a second ago it need not want now.
TEST(Rpdo, WhatIsKeptGetsOldAndIsDroppedWhenOperationalIsLeft) {
  Node node{Mapped({controlword}, 1).values};
  for (const std::uint32_t start : {0U, 0xFFFF'FF00U}) {
    for (const std::uint32_t age : {0U, 99'999U, 100'000U, 100'001U}) {
      node.rpdos.receive(frame(0x205, {1, 0}), node.writer(), start);
      node.rpdos.on_sync(node.writer(), start + age);
      EXPECT_EQ(node.take().size(), age <= 100'000 ? 1U : 0U) << age;
      node.rpdos.on_sync(node.writer(), start);
      EXPECT_TRUE(node.take().empty()) << "nor by a later SYNC";
    }
  }
  node.receive(frame(0x205, {1, 0}));
  node.rpdos.drop_kept();
  node.sync();
  EXPECT_TRUE(node.take().empty());
}

TEST(Rpdo, SaysWhatMustBeListenedTo) {
  const Node node{ParameterValues{}};
  EXPECT_EQ(node.rpdos.identifier(0), 0x205U);
  EXPECT_EQ(node.rpdos.identifier(1), 0x305U);
  EXPECT_FALSE(node.rpdos.identifier(2));
  EXPECT_FALSE(node.rpdos.identifier(3));
}

TEST(Rpdo, SeveralAtOneSyncInTheOrderOfTheirNumbers) {
  Mapped mapped({mode}, 1);
  ASSERT_EQ(mapped.remap(0x1401, {torque}, 0x305, 2), Abort::none);
  ASSERT_EQ(mapped.remap(0x1403, {controlword}, 0x205, 0), Abort::none);  // the identifier of RPDO 1
  Node node{mapped.values};
  node.receive(frame(0x305, {7, 0}));
  EXPECT_EQ(node.receive(frame(0x205, {3})), RpdoResult::too_short);  // for one of the two
  EXPECT_EQ(node.receive(frame(0x205, {4, 0})), RpdoResult::too_long);
  node.sync();
  EXPECT_EQ(node.take(), (Written{{mode_slot, 4}, {torque_slot, 7}, {controlword_slot, 4}}));
}

TEST(Rpdo, ARefusedValueDoesNotKeepTheOthersBack) {
  Node node{Mapped({mode, controlword, torque}).values};
  node.refused_slot = mode_slot;
  EXPECT_EQ(node.receive(frame(0x205, {0xFE, 15, 0, 1, 0})), RpdoResult::taken);
  EXPECT_EQ(node.take(), (Written{{mode_slot, 0xFFFFFFFE}, {controlword_slot, 15}, {torque_slot, 1}}));
  EXPECT_EQ(node.rpdos.counters().refused, 1U);
}

TEST(Rpdo, DummiesAreSkippedDownToTheBit) {
  Node bytes{Mapped({mapping_of(5, 0, 8), controlword, mapping_of(7, 0, 32), mode}).values};
  EXPECT_EQ(bytes.receive(frame(0x205, {9, 0x34, 0x12, 9, 9, 9, 9, 0x80})), RpdoResult::taken);
  EXPECT_EQ(bytes.take(), (Written{{controlword_slot, 0x1234}, {mode_slot, 0xFFFFFF80}}));

  const std::uint32_t bit = mapping_of(1, 0, 1);
  Node bits{Mapped({bit, controlword, bit, bit, stiffness, mode}).values};  // 59 bits
  const std::uint64_t word =
      1ULL | 0xBEEFULL << 1 | 3ULL << 17 | 0xDEADBEE1ULL << 19 | 0x85ULL << 51 | 0x1FULL << 59;
  CanFrame f{.identifier = 0x205, .length = 8};
  for (std::size_t i = 0; i < 8; ++i) f.data[i] = static_cast<std::uint8_t>(word >> 8 * i);
  EXPECT_EQ(bits.receive(f), RpdoResult::taken);
  EXPECT_EQ(bits.take(),
            (Written{{controlword_slot, 0xBEEF}, {stiffness_slot, 0xDEADBEE1}, {mode_slot, 0xFFFFFF85}}));
  f.length = 7;
  EXPECT_EQ(bits.receive(f), RpdoResult::too_short);

  Node nothing{Mapped({mapping_of(5, 0, 8)}).values};
  EXPECT_EQ(nothing.receive(frame(0x205, {1})), RpdoResult::taken);
  EXPECT_TRUE(nothing.take().empty());
}

TEST(Rpdo, AnotherSettingLeavesWhatOtherPdosKeep) {
  Mapped mapped({controlword}, 1);
  ASSERT_EQ(mapped.remap(0x1401, {torque}, 0x305, 1), Abort::none);
  Node node{mapped.values};
  node.receive(frame(0x205, {1, 0}));
  node.receive(frame(0x305, {2, 0}));
  ASSERT_EQ(mapped.write(0x1401, 2, 2), Abort::none);
  node.rpdos.configure(mapped.values, test_node_id);
  node.sync();
  EXPECT_EQ(node.take(), (Written{{controlword_slot, 1}}));
}

TEST(Rpdo, APdoWithBrokenSettingsIsLeftOutTheOthersGo) {
  Mapped mapped({controlword});
  mapped.values.set_whole<"rpdo2.mapped_1">(0x12345678);
  Node node{mapped.values};
  EXPECT_EQ(node.receive(frame(0x305, {1, 2, 3, 4})), RpdoResult::ignored);
  EXPECT_EQ(node.receive(frame(0x205, {1, 2})), RpdoResult::taken);
}

// Whatever is mapped: each value comes as it was put in, extended by its type.
RC_GTEST_PROP(Rpdo, UnpacksWhatWasPacked, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  std::vector<std::uint32_t> objects;
  Written expected;
  std::vector<std::uint8_t> bytes;
  for (;;) {
    const std::size_t slot = random() % (2 * axis_entries.size());
    const auto [e, axis] = owner_of(slot);
    const Entry& entry = entry_at(e);
    if (!rpdo_mappable(entry)) continue;
    const unsigned size = bytes_of(entry.type);
    if (bytes.size() + size > 8) break;
    objects.push_back(mapping_of(static_cast<std::uint16_t>(entry.index() + axis_index_offset * axis),
                                 entry.object_subindex(), 8 * size));
    auto raw = static_cast<std::uint32_t>(random());
    for (unsigned i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(raw >> 8 * i));
    if (entry.type == Type::integer8) raw = static_cast<std::uint32_t>(static_cast<std::int8_t>(raw));
    if (entry.type == Type::integer16) raw = static_cast<std::uint32_t>(static_cast<std::int16_t>(raw));
    if (entry.type == Type::unsigned8) raw = static_cast<std::uint8_t>(raw);
    if (entry.type == Type::unsigned16) raw = static_cast<std::uint16_t>(raw);
    expected.emplace_back(slot, raw);
  }
  RC_PRE(!objects.empty());
  CommunicationWrites writes;
  RC_ASSERT(writes.remap(0x1402, objects, 0x405, 255) == Abort::none);
  Node node{writes.values};
  CanFrame f{.identifier = 0x405, .length = static_cast<std::uint8_t>(bytes.size())};
  std::copy(bytes.begin(), bytes.end(), f.data.begin());
  RC_ASSERT(node.receive(f) == RpdoResult::taken);
  RC_ASSERT(node.take() == expected);
}

}  // namespace
}  // namespace kmax::firmware::canopen::rpdo_test
