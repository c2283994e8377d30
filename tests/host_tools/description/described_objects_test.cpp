#include "host_tools/description/described_objects.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "firmware/canopen/object_places.hpp"
#include "firmware/canopen/pdo_mapping.hpp"

namespace kmax::description::described_objects_test {

const DescribedObject* find(const std::vector<DescribedObject>& all, std::uint16_t index,
                            std::uint8_t subindex) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const DescribedObject& object) {
    return object.index == index && object.subindex == subindex;
  });
  return found == all.end() ? nullptr : &*found;
}

TEST(DescribedObjects, EveryPlaceOfTheFirmwareIsThereOnceAndInOrder) {
  const auto all = described_objects();
  for (std::size_t i = 1; i < all.size(); ++i)
    EXPECT_LT(std::pair(all[i - 1].index, all[i - 1].subindex), std::pair(all[i].index, all[i].subindex));
  for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
    const auto [entry, axis] = firmware::owner_of(slot);
    const firmware::Entry& e = firmware::entry_at(entry);
    const auto index = static_cast<std::uint16_t>(e.index() + axis * firmware::axis_index_offset);
    EXPECT_NE(find(all, index, e.object_subindex()), nullptr) << index << ":" << int{e.object_subindex()};
  }
  std::set<std::uint16_t> indices;
  for (const DescribedObject& object : all) indices.insert(object.index);
  for (const std::uint16_t index : indices) {
    // Sub-index 0 of all, and nothing beyond the highest.
    EXPECT_NE(find(all, index, 0), nullptr) << index;
    std::uint8_t highest = 0;
    for (const DescribedObject& object : all) {
      if (object.index == index) highest = std::max(highest, object.subindex);
    }
    EXPECT_EQ(firmware::canopen::highest_subindex(index), highest) << index;
  }
}

TEST(DescribedObjects, TheFirmwareHasEveryObjectThatIsDescribed) {
  for (const DescribedObject& object : described_objects()) {
    const firmware::canopen::ObjectAddress address{object.index, object.subindex};
    const bool is_count = object.subindex == 0 && firmware::canopen::highest_subindex(object.index) > 0;
    EXPECT_TRUE(firmware::canopen::slot_at(address) || firmware::canopen::special_at(address) || is_count)
        << object.name;
  }
}

TEST(DescribedObjects, PdosMayHoldWhatTheFirmwareMaps) {
  using firmware::canopen::Abort;
  using firmware::canopen::PdoKind;
  const auto maps = [](PdoKind kind, const DescribedObject& object) {
    firmware::canopen::MappedObject found;
    const std::uint32_t mapping =
        firmware::mapping_of(object.index, object.subindex, 8 * object.length % 256);
    return firmware::canopen::find_mapped(kind, mapping, found) == Abort::none;
  };
  std::size_t only_sent = 0, both = 0;
  for (const DescribedObject& object : described_objects()) {
    EXPECT_EQ(object.tpdo_mappable, maps(PdoKind::transmit, object)) << object.name;
    EXPECT_EQ(object.rpdo_mappable, maps(PdoKind::receive, object)) << object.name;
    if (object.access != ObjectAccess::read_write || !object.tpdo_mappable) continue;
    ++(object.rpdo_mappable ? both : only_sent);
  }
  EXPECT_GT(only_sent, 100u);
  EXPECT_GT(both, 50u);
}

TEST(DescribedObjects, ValuesAreDescribedAsTheyAre) {
  const auto all = described_objects();
  const DescribedObject* stiffness = find(all, 0x2800, 4);
  ASSERT_NE(stiffness, nullptr);
  EXPECT_EQ(stiffness->name, "axis1.wall.stiffness");
  EXPECT_EQ(stiffness->type, DataType::real32);
  EXPECT_EQ(stiffness->access, ObjectAccess::read_write);
  EXPECT_EQ(stiffness->length, 4u);
  EXPECT_EQ(stiffness->default_raw, 0x447A0000u);  // 1000
  EXPECT_EQ(stiffness->high, 1e6);
  EXPECT_TRUE(stiffness->tpdo_mappable);
  EXPECT_TRUE(stiffness->rpdo_mappable);

  const DescribedObject* torque = find(all, 0x6077, 0);
  ASSERT_NE(torque, nullptr);
  EXPECT_EQ(torque->type, DataType::integer16);
  EXPECT_EQ(torque->access, ObjectAccess::read_only);
  EXPECT_FALSE(torque->default_raw);

  const DescribedObject* cob = find(all, 0x1801, 1);
  ASSERT_NE(cob, nullptr);
  EXPECT_TRUE(cob->node_relative);
  EXPECT_EQ(cob->default_raw, 0x40000280u);
  EXPECT_FALSE(cob->tpdo_mappable);
  EXPECT_FALSE(cob->rpdo_mappable);

  // Fixed, but what it is depends on the node ID.
  const DescribedObject* request = find(all, 0x1200, 1);
  ASSERT_NE(request, nullptr);
  EXPECT_TRUE(request->node_relative);
  EXPECT_EQ(request->default_raw, 0x600u);
  EXPECT_EQ(request->access, ObjectAccess::read_only);

  const DescribedObject* name = find(all, 0x1008, 0);
  ASSERT_NE(name, nullptr);
  EXPECT_EQ(name->type, DataType::visible_string);
  EXPECT_EQ(name->access, ObjectAccess::constant);
  EXPECT_EQ(name->length, 0u);

  // What a communication record's sub-index 0 says is its highest sub-index, not how many there are.
  EXPECT_EQ(find(all, 0x1800, 0)->default_raw, 5u);
  EXPECT_EQ(find(all, 0x1800, 4), nullptr);
  // A count that is a setting stays one.
  EXPECT_EQ(find(all, 0x1A00, 0)->access, ObjectAccess::read_write);
  EXPECT_EQ(find(all, 0x1A00, 0)->default_raw, 2u);
  EXPECT_EQ(find(all, 0x1003, 0)->access, ObjectAccess::read_write);
}

TEST(DescribedIndices, KindsAndNames) {
  std::map<std::uint16_t, DescribedIndex> by_index;
  std::set<std::string> names;
  for (const DescribedIndex& index : described_indices()) {
    EXPECT_TRUE(names.insert(index.name).second) << index.name;
    EXPECT_LE(index.name.size(), 241u);
    by_index[index.index] = index;
  }
  EXPECT_EQ(by_index[0x1000].kind, ObjectKind::variable);
  EXPECT_EQ(by_index[0x1003].kind, ObjectKind::array);
  EXPECT_EQ(by_index[0x1018].kind, ObjectKind::record);
  EXPECT_EQ(by_index[0x1018].name, "Identity object");
  EXPECT_EQ(by_index[0x1A03].name, "TPDO4 mapping parameter");
  EXPECT_EQ(by_index[0x1A04].name, "TPDO5 mapping parameter");
  EXPECT_EQ(by_index[0x1200].kind, ObjectKind::record);
  EXPECT_EQ(by_index[0x1200].objects.size(), 3u);
  EXPECT_EQ(by_index[0x1200].name, "SDO server parameter");
  EXPECT_EQ(by_index[0x1201].kind, ObjectKind::record);
  EXPECT_EQ(by_index[0x1201].name, "SDO server 2 parameter");
  EXPECT_EQ(by_index[0x2000].name, "wall");
  EXPECT_EQ(by_index[0x2800].name, "axis1.wall");
  EXPECT_EQ(by_index[0x6840].name, "axis1.drive.controlword");
  EXPECT_EQ(by_index[0x5820].kind, ObjectKind::array);
  EXPECT_EQ(by_index[0x5820].objects.size(), 1u + firmware::trace_objects);
}

}  // namespace kmax::description::described_objects_test
