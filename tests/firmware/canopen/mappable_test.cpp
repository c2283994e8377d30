#include "firmware/canopen/mappable.hpp"

#include <gtest/gtest.h>

#include <string_view>

namespace kmax::firmware::canopen::mappable_test {
namespace {

const Entry& named_entry(std::string_view name) {
  return entry_at(find_entry(name));
}

TEST(Mappable, SentPdosHoldEveryValueButTheSettingsOfCanopen) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const std::uint16_t index = entry_at(i).index();
    const bool communication =
        (index >= 0x1000 && index < 0x2000 && index != 0x1018) || index == group::communication.index;
    EXPECT_EQ(tpdo_mappable(entry_at(i)), !communication) << entry_at(i).name;
  }
}

TEST(Mappable, ReceivedPdosSetWhatAnAxisTakesAtAnyTime) {
  for (const std::string_view name :
       {"drive.controlword", "profile.target_torque", "profile.operation_mode", "profile.max_torque",
        "profile.target_force", "wall.stiffness", "force.limit"})
    EXPECT_TRUE(rpdo_mappable(named_entry(name))) << name;
  for (const std::string_view name :
       {"drive.mode", "wall.law", "encoder.offset", "excitation.run", "excitation.bias", "measured.position",
        "drive.statusword", "node.id", "store.command", "transaction.control", "rpdo1.cob_id",
        "canopen.heartbeat_time"})
    EXPECT_FALSE(rpdo_mappable(named_entry(name))) << name;
}

TEST(Mappable, WhatIsReceivedIsWritableAndOfAnAxis) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    if (!rpdo_mappable(entry)) continue;
    ++count;
    EXPECT_EQ(entry.access, Access::read_write) << entry.name;
    EXPECT_EQ(entry.scope(), Scope::axis) << entry.name;
    EXPECT_FALSE(entry.name.starts_with("excitation.")) << entry.name;
    EXPECT_TRUE(entry.change != Change::disarmed_only || entry.index() == 0x6060) << entry.name;
    EXPECT_TRUE(tpdo_mappable(entry)) << entry.name;
  }
  EXPECT_GT(count, 20U);
}

TEST(Mappable, TheCompactTableSaysTheSame) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    EXPECT_EQ(tpdo_mappable(i), tpdo_mappable(entry_at(i)));
    EXPECT_EQ(rpdo_mappable(i), rpdo_mappable(entry_at(i)));
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::mappable_test
