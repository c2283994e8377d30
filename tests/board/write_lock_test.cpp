// The write lock through the whole firmware: every way in which a host can change the device, over both links
// and in several states, while it is locked and after it has been opened.
#include <gtest/gtest.h>

#include <rapidcheck.h>

#include <bit>
#include <map>
#include <optional>

#include "firmware/canopen/object_places.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::write_lock_test {
namespace {

using firmware::Access;
using firmware::Entry;
using firmware::entry_of;

constexpr std::uint32_t code = 0x4B6D'6178;
constexpr std::uint32_t abort_locked = 0x0601'0000;
constexpr int exception_locked = 7;

enum class Way { serial, can };
enum class Lock { no_code, open, locked };

class Node : public CanOpenHost {
 public:
  Node() {
    bench.set_up_plain_wall();
    bench.device.stand_at(1000);
    run_ms(5);
  }
  Lock lock() { return static_cast<Lock>(static_cast<int>(bench.get("lock.state"))); }
  Refusal reason() { return static_cast<Refusal>(static_cast<int>(bench.get("refusal.reason"))); }
  void finish_save() {
    for (int i = 0; i < 200 && bench.application().store_busy(); ++i) run_ms(1);
    run_ms(1);
  }
  void set_code() {
    ASSERT_EQ(bench.set("lock.code", code), 0);
    finish_save();
    ASSERT_EQ(lock(), Lock::locked);
  }
  /// 0, or the exception or abort code.
  std::uint32_t write(Way way, std::size_t entry, std::size_t axis, std::uint32_t raw) {
    const Entry& e = firmware::entry_at(entry);
    if (way == Way::serial)
      return static_cast<std::uint32_t>(
          bench.write(firmware::modbus_address(entry, axis), firmware::words_of_raw(e.type, raw)));
    const std::size_t offset = e.scope() == firmware::Scope::axis ? axis * firmware::axis_index_offset : 0;
    return CanOpenHost::write(static_cast<std::uint16_t>(e.index() + offset), e.object_subindex(), raw,
                              firmware::bytes_of(e.type));
  }
  std::vector<std::uint32_t> settings() {
    std::vector<std::uint32_t> all;
    for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
      if (firmware::descriptors[firmware::owner_of(slot).entry].kept)
        all.push_back(bench.application().values().raw(slot));
    }
    return all;
  }
  std::uint32_t raw(std::size_t entry, std::size_t axis) {
    return bench.application().values().raw(firmware::slot_of(entry, axis));
  }

 private:
  using CanOpenHost::write;
};

/// Another value, allowed by itself where there is one.
std::uint32_t other_value(std::size_t entry, std::uint32_t now) {
  const firmware::SlotDescriptor& descriptor = firmware::descriptors[entry];
  for (const std::int32_t choice : descriptor.choices()) {
    if (static_cast<std::uint32_t>(choice) != now) return static_cast<std::uint32_t>(choice);
  }
  if (!descriptor.choices().empty()) return now + 1;
  return descriptor.maximum() != now ? descriptor.maximum() : descriptor.minimum();
}

bool is_command(std::size_t entry) {
  for (const std::size_t one : {entry_of<"store.command">(), entry_of<"lock.code">(), entry_of<"lock.key">(),
                                entry_of<"transaction.control">(), entry_of<"capture.command">()}) {
    if (one == entry) return true;
  }
  return firmware::acts_at_once(firmware::slot_of(entry, 0));
}
bool only_measures(std::size_t entry) {
  const std::string_view name = firmware::entry_at(entry).name;
  return name.starts_with("trace.") || name.starts_with("capture.");
}

template <typename Act>
void for_each_setting(Act act) {
  for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
    const auto [entry, axis] = firmware::owner_of(slot);
    if (firmware::entry_at(entry).access == Access::read_only || is_command(entry) || only_measures(entry))
      continue;
    for (const Way way : {Way::serial, Way::can}) {
      if (way == Way::can || firmware::entry_at(entry).access == Access::read_write) act(entry, axis, way);
    }
  }
}

std::string place(std::size_t entry, std::size_t axis, Way way) {
  return std::string(firmware::entry_at(entry).name) + " of axis " + std::to_string(axis) +
         (way == Way::can ? " by CAN" : " by serial");
}

enum class State { disarmed, operational, armed_over_serial, armed_over_can, fault, transaction_open };

void bring_into(Node& node, State state) {
  switch (state) {
    case State::disarmed:
      return;
    case State::operational:
      return node.nmt(1);
    case State::armed_over_serial:
      ASSERT_TRUE(node.bench.arm());
      return;
    case State::armed_over_can:
      for (const std::uint32_t word : {0U, 6U, 15U})
        ASSERT_EQ(node.write(Way::can, entry_of<"drive.controlword">(), 0, word), 0u);
      node.run_ms(2);
      ASSERT_TRUE(node.armed());
      return;
    case State::fault:
      ASSERT_TRUE(node.bench.arm());
      node.bench.device.valid[0] = false;
      node.run_ms(2);
      node.bench.device.valid[0] = true;
      node.run_ms(2);
      ASSERT_EQ(node.bench.state(), DriveState::fault);
      return;
    case State::transaction_open:
      ASSERT_EQ(node.bench.set("transaction.control", 1), 0);
      return;
  }
}

class WriteLockWalk : public testing::TestWithParam<State> {};
INSTANTIATE_TEST_SUITE_P(, WriteLockWalk,
                         testing::Values(State::disarmed, State::operational, State::armed_over_serial,
                                         State::armed_over_can, State::fault));

TEST(WriteLock, ACodeIsInForceAsSoonAsItIsSaved) {
  for (int offset = 0; offset < 10; ++offset) {
    Node node;
    node.run_ms(0.1 * offset);
    ASSERT_EQ(node.bench.set("lock.code", code), 0);
    while (node.bench.application().store_busy()) node.run_ms(0.05);
    EXPECT_EQ(node.write(Way::can, entry_of<"wall.stiffness">(), 0, std::bit_cast<std::uint32_t>(900.0f)),
              abort_locked)
        << offset;
  }
}

TEST_P(WriteLockWalk, EverySettingIsRefusedWithItsOwnErrorAndStaysAsItIs) {
  Node node;
  node.set_code();
  bring_into(node, GetParam());
  const auto before = node.settings();
  int tried = 0;
  for_each_setting([&](std::size_t entry, std::size_t axis, Way way) {
    const std::uint32_t now = node.raw(entry, axis);
    const std::uint32_t answer = node.write(way, entry, axis, other_value(entry, now));
    EXPECT_EQ(answer, way == Way::can ? abort_locked : static_cast<std::uint32_t>(exception_locked))
        << place(entry, axis, way);
    EXPECT_EQ(node.raw(entry, axis), now) << place(entry, axis, way);
    ++tried;
  });
  EXPECT_EQ(node.reason(), Refusal::locked);
  EXPECT_GT(tried, 500);
  EXPECT_EQ(node.settings(), before);
  EXPECT_EQ(node.lock(), Lock::locked);
}

// As if it had never been locked.
TEST(WriteLock, OpenedAgainEverythingIsTakenAsBefore) {
  const auto walk = [](Node& node) {
    std::map<std::string, std::uint32_t> answers;
    for_each_setting([&](std::size_t entry, std::size_t axis, Way way) {
      // Behind these the line would be another.
      if (firmware::entry_at(entry).name.starts_with("modbus.")) return;
      const std::uint32_t now = node.raw(entry, axis);
      answers[place(entry, axis, way)] = node.write(way, entry, axis, other_value(entry, now));
      node.write(way, entry, axis, now);
    });
    return answers;
  };
  Node never_locked, opened;
  opened.set_code();
  ASSERT_EQ(opened.bench.set("lock.key", code), 0);
  ASSERT_EQ(opened.lock(), Lock::open);
  const auto as_ever = walk(never_locked);
  EXPECT_EQ(walk(opened), as_ever);
  EXPECT_GT(std::count_if(as_ever.begin(), as_ever.end(), [](const auto& one) { return one.second == 0; }),
            400);
  EXPECT_EQ(opened.bench.set("store.command", 1), 0);
  opened.finish_save();
  EXPECT_EQ(opened.bench.get("store.unsaved_parameters"), 0);
}

TEST(WriteLock, WhatIsAsItIsMayBeWrittenAsAMasterDoesWhenItStarts) {
  Node node;
  node.set_code();
  const auto before = node.settings();
  for_each_setting([&](std::size_t entry, std::size_t axis, Way way) {
    const std::uint32_t now = node.raw(entry, axis);
    if (firmware::entry_at(entry).node_relative) return;       // written and kept are not the same number
    if (entry == firmware::entry_of<"log.command">()) return;  // a command: it has no value
    EXPECT_EQ(node.write(way, entry, axis, now), 0u) << place(entry, axis, way);
  });
  EXPECT_EQ(node.settings(), before);
}

TEST(WriteLock, CommandsAndMeasuringGoOn) {
  for (const Way way : {Way::serial, Way::can}) {
    Node node;
    node.set_code();
    const auto set = [&](std::string_view name, double number) {
      const std::size_t entry = firmware::entry_named(name);
      return node.write(way, entry, 0, firmware::raw_from_number(firmware::entry_at(entry).type, number));
    };
    for (const auto& [name, number] :
         std::initializer_list<std::pair<const char*, double>>{{"drive.commander", 0},
                                                               {"trace.axis", 1},
                                                               {"trace.interval", 3},
                                                               {"capture.channel_1", 1},
                                                               {"capture.samples", 10},
                                                               {"capture.command", 0},
                                                               {"profile.target_force", 0.5},
                                                               {"profile.max_torque", 500},
                                                               {"link.sign_of_life", 1}})
      EXPECT_EQ(set(name, number), 0u) << name;
    for (int round = 0; round < 3; ++round) {
      for (const unsigned word : {0U, 6U, 15U}) ASSERT_EQ(set("drive.controlword", word), 0u);
      node.run_ms(2);
      ASSERT_TRUE(node.armed()) << round;
      if (round == 0) {  // quick stop
        ASSERT_EQ(set("drive.controlword", 2), 0u);
      } else if (round == 1) {
        ASSERT_EQ(set("drive.controlword", 6), 0u);
      } else {
        node.bench.device.valid[0] = false;
        node.run_ms(2);
        node.bench.device.valid[0] = true;
      }
      node.run_ms(2);
      EXPECT_FALSE(node.armed()) << round;
    }
    ASSERT_EQ(node.bench.state(), DriveState::fault);
    ASSERT_EQ(set("drive.controlword", 0), 0u);
    ASSERT_EQ(set("drive.controlword", 0x80), 0u);
    node.run_ms(2);
    EXPECT_NE(node.bench.state(), DriveState::fault) << "a fault is cleared";
    EXPECT_EQ(node.lock(), Lock::locked);
  }
}

TEST(WriteLock, NothingIsStoredRestoredOrErasedWhileLocked) {
  Node node;
  ASSERT_EQ(node.bench.set("wall.stiffness", 500), 0);
  node.set_code();
  const auto before = node.settings();
  const int programs = node.flash.programs;
  for (const unsigned command : {1U, 2U}) {
    for (const Way way : {Way::serial, Way::can}) {
      const std::uint32_t answer = node.write(way, entry_of<"store.command">(), 0, command);
      EXPECT_EQ(answer, way == Way::can ? abort_locked : static_cast<std::uint32_t>(exception_locked));
    }
  }
  const auto special = [&node](std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
    return static_cast<CanOpenHost&>(node).write(index, sub, value, bytes);
  };
  EXPECT_EQ(special(0x1010, 1, firmware::signature_save, 4), abort_locked);
  EXPECT_EQ(special(0x1011, 1, firmware::signature_load, 4), abort_locked);
  EXPECT_EQ(special(0x1003, 0, 0, 1), abort_locked) << "who broke it stays known";
  EXPECT_EQ(node.reason(), Refusal::locked);
  // Every special object: nothing but the scratch pad takes anything.
  for (const auto& row : firmware::special_objects) {
    for (unsigned sub = row.first_subindex; sub <= row.last_subindex; ++sub) {
      const unsigned bytes = row.type == firmware::ObjectType::unsigned8 ? 1 : 4;
      const std::uint32_t answer = special(row.index, static_cast<std::uint8_t>(sub), 1, bytes);
      EXPECT_EQ(answer == 0, row.what == firmware::SpecialObject::scratch) << row.name;
    }
  }
  node.finish_save();
  EXPECT_EQ(node.flash.programs, programs);
  EXPECT_EQ(node.settings(), before);
  ASSERT_EQ(node.bench.set("lock.key", code), 0);
  EXPECT_EQ(special(0x1003, 0, 0, 1), 0u);
  EXPECT_EQ(special(0x1010, 1, firmware::signature_save, 4), 0u);
}

TEST(WriteLock, LssGivesNoOtherNodeIdAndNoOtherBitRate) {
  Node node;
  const auto ask = [&node](std::array<std::uint8_t, 8> data) {
    node.heard.clear();
    node.send({.identifier = 0x7E5, .length = 8, .data = data});
    for (const drivers::CanFrame& frame : node.heard) {
      if (frame.identifier == 0x7E4) return frame.data;
    }
    return std::array<std::uint8_t, 8>{};
  };
  using Answer = std::array<std::uint8_t, 8>;
  node.set_code();
  const auto before = node.settings();
  ask({0x04, 1});
  EXPECT_EQ(ask({0x11, 5}), (Answer{0x11, 0xFF, 1}));
  EXPECT_EQ(ask({0x13, 0, 3}), (Answer{0x13, 0xFF, 1}));
  EXPECT_EQ(ask({0x17}), (Answer{0x17, 0xFF, 1}));
  EXPECT_EQ(ask({0x15, 1, 0}), Answer{});
  node.run_ms(5);
  EXPECT_EQ(ask({0x5E}), (Answer{0x5E, 1})) << "looking is allowed";
  EXPECT_EQ(node.bench.application().can().settings().bit_rate, 1'000'000u);
  EXPECT_EQ(node.settings(), before);
  ASSERT_EQ(node.bench.set("lock.key", code), 0);
  EXPECT_EQ(ask({0x11, 5}), (Answer{0x11, 0}));
  EXPECT_EQ(ask({0x13, 0, 3}), (Answer{0x13, 0}));
  // What waited when it was locked does not switch either.
  ask({0x15, 50, 0});
  ASSERT_EQ(node.bench.set("lock.key", 0), 0);
  node.run_ms(200);
  EXPECT_EQ(node.bench.application().can().settings().bit_rate, 1'000'000u);
}

TEST(WriteLock, PdosBringCommandsAndNoSettings) {
  Node node;
  const auto write = [&node](std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
    ASSERT_EQ(static_cast<CanOpenHost&>(node).write(index, sub, value, bytes), 0u) << std::hex << index;
  };
  write(0x1400, 1, 0x8000'0201, 4);
  write(0x1600, 0, 0, 1);
  write(0x1600, 1, 0x6040'0010, 4);
  write(0x1600, 2, 0x2000'0420, 4);  // wall.stiffness
  write(0x1600, 0, 2, 1);
  write(0x1400, 1, 0x201, 4);
  node.nmt(1);
  const auto pdo = [&node](std::uint16_t word, float stiffness) {
    const auto bits = std::bit_cast<std::uint32_t>(stiffness);
    drivers::CanFrame frame{.identifier = 0x201, .length = 6, .data = {static_cast<std::uint8_t>(word)}};
    for (unsigned i = 0; i < 4; ++i) frame.data[2 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
    node.send(frame);
  };
  pdo(0, 700);
  EXPECT_EQ(node.bench.get("wall.stiffness"), 700);
  node.set_code();
  for (const unsigned word : {6U, 15U}) pdo(static_cast<std::uint16_t>(word), 600);
  EXPECT_TRUE(node.armed());
  EXPECT_EQ(node.bench.get("wall.stiffness"), 700);
  EXPECT_EQ(node.bench.get("can.rpdo_refused"), 2);
  pdo(6, 700);
  EXPECT_EQ(node.bench.get("can.rpdo_refused"), 2) << "as it is";
}

TEST(WriteLock, OpenedOnlyDisarmedAndOverEitherLink) {
  Node node;
  node.set_code();
  ASSERT_TRUE(node.bench.arm());
  EXPECT_EQ(node.write(Way::can, entry_of<"lock.key">(), 0, code), 0x0800'0022u);
  EXPECT_EQ(node.bench.set("lock.key", code), 4);
  EXPECT_EQ(node.reason(), Refusal::while_armed);
  node.bench.disarm();
  node.run_ms(2);
  EXPECT_EQ(node.write(Way::can, entry_of<"lock.key">(), 0, code), 0u);
  EXPECT_EQ(node.lock(), Lock::open);
  EXPECT_EQ(node.write(Way::can, entry_of<"lock.key">(), 0, 0), 0u);
  EXPECT_EQ(node.bench.set("lock.key", 5), 3);
  EXPECT_EQ(node.reason(), Refusal::wrong_code);
  EXPECT_EQ(node.bench.set("lock.key", code), 6);
  EXPECT_EQ(node.write(Way::can, entry_of<"lock.key">(), 0, code), 0x0800'0022u);
  EXPECT_EQ(node.reason(), Refusal::code_waits);
  EXPECT_EQ(node.bench.get("lock.wait"), 1);
  EXPECT_EQ(node.bench.get("lock.attempts"), 1);
  node.run_ms(1001);
  EXPECT_EQ(node.write(Way::can, entry_of<"lock.key">(), 0, 6), 0x0609'0030u);
  node.run_ms(2001);
  EXPECT_EQ(node.bench.set("lock.key", code), 0);
  ASSERT_TRUE(node.bench.arm());
  EXPECT_EQ(node.bench.set("lock.key", 0), 4) << "nor locked while armed";
}

TEST(WriteLock, AResetOfTheNodeLocksIt) {
  Node node;
  node.set_code();
  ASSERT_EQ(node.bench.set("lock.key", code), 0);
  node.nmt(0x82);  // the communication only
  EXPECT_EQ(node.lock(), Lock::open);
  Bench again;
  again.application().attach_store(firmware::AnyFlashSectors::of(node.flash));
  EXPECT_EQ(again.set("wall.stiffness", 500), exception_locked);
  EXPECT_EQ(again.get("lock.state"), static_cast<int>(Lock::locked));
}

// In everything that can be read over either link, in one byte order or the other.
TEST(WriteLock, TheCodeIsNowhereToBeRead) {
  Node node;
  node.set_code();
  ASSERT_EQ(node.bench.set("lock.key", 5), 3);
  for (std::size_t slot = 0; slot < firmware::slot_count; ++slot)
    EXPECT_NE(node.bench.application().values().raw(slot), code)
        << firmware::entry_at(firmware::owner_of(slot).entry).name;
  EXPECT_EQ(node.bench.get("lock.code"), 0);
  EXPECT_EQ(node.bench.get("lock.key"), 0);
  EXPECT_EQ(node.read(0x5808, 1), 0u);
  EXPECT_EQ(node.read(0x5809, 1), 0u);
  for (const std::uint8_t function : {std::uint8_t{3}, std::uint8_t{4}}) {
    for (unsigned address = 0x2000; address < 0x3000; ++address) {  // the device's own
      const auto words = node.bench.read(function, static_cast<std::uint16_t>(address), 2);
      EXPECT_FALSE(words.size() == 2 && (std::uint32_t{words[0]} << 16 | words[1]) == code) << address;
    }
  }
  // A PDO that maps it carries zeros.
  const auto write = [&node](std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
    return static_cast<CanOpenHost&>(node).write(index, sub, value, bytes);
  };
  EXPECT_EQ(write(0x1A00, 1, 0x5808'0120, 4), abort_locked);
  node.run_ms(1001);
  ASSERT_EQ(node.bench.set("lock.key", code), 0);
  ASSERT_EQ(write(0x1800, 1, 0xC000'0181, 4), 0u);
  ASSERT_EQ(write(0x1A00, 0, 0, 1), 0u);
  ASSERT_EQ(write(0x1A00, 1, 0x5808'0120, 4), 0u);
  ASSERT_EQ(write(0x1A00, 2, 0x5809'0120, 4), 0u);
  ASSERT_EQ(write(0x1A00, 0, 2, 1), 0u);
  ASSERT_EQ(write(0x1800, 1, 0x4000'0181, 4), 0u);
  node.nmt(1);
  node.heard.clear();
  node.run_ms(50);
  int sent = 0;
  for (const drivers::CanFrame& frame : node.heard) {
    if (frame.identifier != 0x181) continue;
    ++sent;
    EXPECT_EQ(frame.length, 8);
    EXPECT_EQ(frame.data, (std::array<std::uint8_t, 8>{}));
  }
  EXPECT_GT(sent, 2);
}

// Two hosts that know nothing of each other, against a model of the lock: no setting changes while it is
// locked, and it opens for nothing but its code.
TEST(WriteLock, WhateverTwoHostsDoInTurn) {
  const std::size_t stiffness = entry_of<"wall.stiffness">(), damping = entry_of<"wall.damping">();
  EXPECT_TRUE(rc::check("two hosts", [&] {
    Node node;
    std::uint32_t kept = 0;  // the code
    bool open = false, armed = false;
    std::uint32_t attempts = 0;
    std::uint64_t until_tick = 0;
    for (int i = 0; i < 40; ++i) {
      const Way way = *rc::gen::element(Way::serial, Way::can);
      const bool was_locked = kept != 0 && !open;
      const auto before = node.settings();
      const std::uint64_t tick = node.bench.device.tick;
      const std::uint32_t some_code = *rc::gen::element(1111U, 2222U, 3333U);
      switch (*rc::gen::inRange(0, 11)) {
        case 0: {
          const auto answer = node.write(way, entry_of<"lock.code">(), 0, some_code);
          RC_ASSERT((answer == 0) == (!was_locked && !armed));
          node.finish_save();
          if (answer == 0) kept = some_code, open = false;
          break;
        }
        case 1: {
          const auto answer = node.write(way, entry_of<"lock.code">(), 0, 0);
          RC_ASSERT((answer == 0) == (!was_locked && !armed));
          node.finish_save();
          if (answer == 0) kept = 0, open = false;
          break;
        }
        case 2:
        case 3: {
          const auto answer = node.write(way, entry_of<"lock.key">(), 0, some_code);
          // What lies between asking and being heard is a few ms.
          const bool waits = tick + 40 < until_tick;
          const bool surely_over = tick >= until_tick;
          if (!waits && !surely_over) {
            kept = node.lock() == Lock::no_code ? 0 : kept;
            open = node.lock() == Lock::open;
            attempts = static_cast<std::uint32_t>(node.bench.get("lock.attempts"));
            until_tick =
                node.bench.device.tick + static_cast<std::uint64_t>(node.bench.get("lock.wait")) * 20'000;
            break;
          }
          const bool looked_at = kept != 0 && !armed && surely_over;
          RC_ASSERT((answer == 0) == (looked_at && some_code == kept));
          if (!looked_at) break;
          attempts = some_code == kept ? 0 : attempts + 1;
          if (some_code == kept) open = true;
          if (attempts != 0) until_tick = node.bench.device.tick + (20'000ULL << std::min(attempts - 1, 8U));
          break;
        }
        case 4: {
          const auto answer = node.write(way, entry_of<"lock.key">(), 0, 0);
          RC_ASSERT((answer == 0) == (kept != 0 && !armed));
          if (answer == 0) open = false;
          break;
        }
        case 5: {
          const auto value = std::bit_cast<std::uint32_t>(static_cast<float>(*rc::gen::inRange(1, 1000)));
          node.write(way, *rc::gen::element(stiffness, damping), 0, value);
          break;
        }
        case 6:
          node.write(way, entry_of<"transaction.control">(), 0, *rc::gen::inRange(0U, 3U));
          break;
        case 7:
          node.write(way, entry_of<"store.command">(), 0, 1);
          node.finish_save();
          break;
        case 8:
          node.run_ms(*rc::gen::inRange(1, 3000));
          break;
        default:
          for (const std::uint32_t word : {0U, 6U, *rc::gen::element(15U, 6U)})
            node.write(way, entry_of<"drive.controlword">(), 0, word);
          node.run_ms(2);
          armed = node.armed();
          break;
      }
      const bool locked = kept != 0 && !open;
      RC_ASSERT(node.lock() == (kept == 0 ? Lock::no_code : open ? Lock::open : Lock::locked));
      if (was_locked && locked) {
        auto after = node.settings();
        // Whoever arms sets the controlword; all else stays.
        const auto words = [&](std::vector<std::uint32_t>& all) {
          std::size_t at = 0;
          for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
            if (!firmware::descriptors[firmware::owner_of(slot).entry].kept) continue;
            if (firmware::acts_at_once(slot)) all[at] = 0;
            ++at;
          }
          return all;
        };
        auto left = before;
        RC_ASSERT(words(after) == words(left));
      }
    }
  }));
}

}  // namespace
}  // namespace kmax::board::write_lock_test
