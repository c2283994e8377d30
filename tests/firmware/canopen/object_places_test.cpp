#include "firmware/canopen/object_places.hpp"

#include <gtest/gtest.h>

#include <map>

namespace kmax::firmware::canopen::object_places_test {
namespace {

/// Index of an entry as an object of an axis, from the dictionary itself.
std::uint16_t index_of(std::size_t entry, std::size_t axis) {
  return static_cast<std::uint16_t>(entry_at(entry).index() + axis * axis_index_offset);
}

/// By index and sub-index.
std::map<std::pair<unsigned, unsigned>, std::size_t> all_places() {
  std::map<std::pair<unsigned, unsigned>, std::size_t> places;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const bool is_new =
        places.emplace(std::pair{index_of(entry, axis), entry_at(entry).object_subindex()}, slot).second;
    EXPECT_TRUE(is_new) << entry_at(entry).name;
  }
  return places;
}

TEST(ObjectPlaces, EveryAddressHasTheSlotThatTheDictionarySays) {
  const auto places = all_places();
  ASSERT_EQ(places.size(), slot_count);
  std::size_t found = 0;
  for (unsigned index = 0; index <= 0xFFFF; ++index) {
    for (unsigned subindex = 0; subindex <= 0xFF; subindex += subindex == 0x40 ? 0xBF : 1) {
      const auto place = places.find({index, subindex});
      const auto slot = slot_at({static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(subindex)});
      ASSERT_EQ(slot.has_value(), place != places.end()) << index << ":" << subindex;
      if (!slot) continue;
      ASSERT_EQ(*slot, place->second) << index << ":" << subindex;
      ++found;
    }
  }
  EXPECT_EQ(found, slot_count);
}

TEST(ObjectPlaces, APredefinedCobIdFollowsTheNode) {
  EXPECT_EQ(resolved_cob_id(0x180, 0x180, 5), 0x185U);
  EXPECT_EQ(resolved_cob_id(0x8000'0180, 0x180, 5), 0x8000'0185U) << "one that is switched off";
  EXPECT_EQ(resolved_cob_id(0x185, 0x180, 5), 0x185U) << "its own choice";
  EXPECT_EQ(stored_cob_id(0x185, 0x180, 5), 0x180U);
  EXPECT_EQ(stored_cob_id(0x8000'0185, 0x180, 5), 0x8000'0180U);
  EXPECT_EQ(stored_cob_id(0x186, 0x180, 5), 0x186U);
  EXPECT_EQ(stored_cob_id(0x180, 0x180, 5), 0x180U);
}

TEST(ObjectPlaces, TheHighestSubindexIsTheLastThatThereIs) {
  std::map<unsigned, unsigned> highest;
  for (const auto& [address, slot] : all_places()) highest[address.first] = address.second;
  for (const SpecialPlace& row : special_places) {
    const auto [at, is_new] = highest.emplace(row.index, row.last_subindex);
    if (!is_new && at->second < row.last_subindex) at->second = row.last_subindex;
  }
  for (unsigned index = 0; index <= 0xFFFF; ++index) {
    const auto there = highest.find(index);
    const auto got = highest_subindex(static_cast<std::uint16_t>(index));
    ASSERT_EQ(got.has_value(), there != highest.end()) << index;
    if (got) {
      ASSERT_EQ(*got, there->second) << index;
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::object_places_test
