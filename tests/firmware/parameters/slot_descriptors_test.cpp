#include "firmware/parameters/slot_descriptors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <span>
#include <vector>

namespace kmax::firmware::slot_descriptors_test {
namespace {

TEST(SharedRows, AddsARowOnlyIfItIsNotThere) {
  SharedRows<int, 16> rows;
  const auto place = [&rows](std::initializer_list<int> row) {
    const std::vector<int> values(row);
    return rows.place(std::span<const int>(values));
  };
  EXPECT_EQ(place({1, 2, 3}), 0u);
  EXPECT_EQ(place({2, 3}), 1u);
  EXPECT_EQ(rows.count, 3u);
  EXPECT_EQ(place({3, 2}), 3u);
  EXPECT_EQ(rows.count, 5u);
  EXPECT_EQ(place({3, 3}), 2u);  // across two rows: what matters is that they are there
  EXPECT_EQ(rows.place(2), 1u);
  EXPECT_EQ(place({}), 0u);
  EXPECT_EQ(rows.count, 5u);
  EXPECT_EQ(rows.first<5>(), (std::array{1, 2, 3, 3, 2}));
}

TEST(SharedRows, WhatHasNotBeenPlacedIsNotFound) {
  // Behind the rows there are zeros, which belong to nobody.
  SharedRows<int, 4> rows;
  rows.place(5);
  EXPECT_EQ(rows.place(0), 1u);
  EXPECT_EQ(rows.count, 2u);
}

TEST(SlotDescriptors, SayWhatTheTableSays) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    const SlotDescriptor& d = descriptors[i];
    EXPECT_EQ(d.address, modbus_addresses[i]) << e.name;
    EXPECT_EQ(d.index, e.index()) << e.name;
    EXPECT_EQ(d.subindex, e.object_subindex()) << e.name;
    EXPECT_EQ(d.type, e.type) << e.name;
    EXPECT_EQ(d.writable, e.access == Access::read_write) << e.name;
    EXPECT_EQ(d.kept, e.access == Access::read_write || e.access == Access::communication) << e.name;
    EXPECT_EQ(d.change(), e.change) << e.name;
    EXPECT_EQ(d.unbounded_at_zero(), e.unbounded_at_zero) << e.name;
    EXPECT_EQ(d.per_axis, e.scope() == Scope::axis) << e.name;
    EXPECT_EQ(d.persistent, e.persistent) << e.name;
    EXPECT_EQ(d.minimum(), raw_from_number(e.type, e.minimum)) << e.name;
    EXPECT_EQ(d.maximum(), raw_from_number(e.type, e.maximum)) << e.name;
    EXPECT_EQ(d.default_value(), raw_from_number(e.type, e.default_value)) << e.name;
    ASSERT_EQ(d.choices().size(), e.values.size()) << e.name;
    for (std::size_t c = 0; c < e.values.size(); ++c) EXPECT_EQ(d.choices()[c], e.values[c].value) << e.name;
  }
}

TEST(SlotDescriptors, GroupsAreTheTables) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      ASSERT_EQ(descriptors[i].group == descriptors[j].group,
                entry_at(i).group.index == entry_at(j).group.index)
          << entry_at(i).name << ", " << entry_at(j).name;
  }
}

TEST(SlotDescriptors, AreStoredOnce) {
  auto patterns = slot_descriptors::patterns;
  std::sort(patterns.begin(), patterns.end());
  EXPECT_EQ(std::adjacent_find(patterns.begin(), patterns.end()), patterns.end());
}

}  // namespace
}  // namespace kmax::firmware::slot_descriptors_test
