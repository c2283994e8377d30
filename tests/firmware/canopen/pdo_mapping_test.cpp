#include "firmware/canopen/pdo_mapping.hpp"

#include <gtest/gtest.h>

#include <initializer_list>

namespace kmax::firmware::canopen::pdo_mapping_test {
namespace {

constexpr auto receive = PdoKind::receive;
constexpr auto transmit = PdoKind::transmit;

Abort find(PdoKind kind, std::uint16_t index, std::uint8_t subindex, unsigned bits) {
  MappedObject object;
  return find_mapped(kind, mapping_of(index, subindex, bits), object);
}

// CiA 301: 64 bits in a PDO, the dummies of objects 0x0001 to 0x0007.
TEST(PdoMapping, ItsBoundsAreTheStandards) {
  EXPECT_EQ(pdo_bits_max, 64U);
  EXPECT_EQ(mapped_max, 8U);
  EXPECT_EQ(dummy_bits, (std::array<std::uint8_t, 7>{1, 8, 16, 32, 8, 16, 32}));
}

TEST(PdoMapping, FindsAValueOfEachAxisAndItsLength) {
  MappedObject object;
  ASSERT_EQ(find_mapped(receive, mapping_of(0x6071, 0, 16), object), Abort::none);
  EXPECT_EQ(object,
            (MappedObject{static_cast<std::uint16_t>(slot_of(entry_of<"profile.target_torque">(), 0)), 16}));
  ASSERT_EQ(find_mapped(receive, mapping_of(0x6871, 0, 16), object), Abort::none);
  EXPECT_EQ(object.slot, slot_of(entry_of<"profile.target_torque">(), 1));
  ASSERT_EQ(find_mapped(transmit, mapping_of(0x2812, 3, 32), object), Abort::none);
  EXPECT_EQ(object,
            (MappedObject{static_cast<std::uint16_t>(slot_of(entry_of<"measured.velocity">(), 1)), 32}));
}

TEST(PdoMapping, EveryMappableValueFitsWithItsOwnLengthOnly) {
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [i, axis] = owner_of(slot);
    const Entry& entry = entry_at(i);
    const auto index = static_cast<std::uint16_t>(entry.index() + axis_index_offset * axis);
    for (unsigned bits = 0; bits < 256; ++bits) {
      const bool fits = bits == 8U * bytes_of(entry.type);
      EXPECT_EQ(find(transmit, index, entry.object_subindex(), bits),
                fits && tpdo_mappable(entry) ? Abort::none : Abort::not_mappable)
          << entry.name << ' ' << bits;
      EXPECT_EQ(find(receive, index, entry.object_subindex(), bits),
                fits && rpdo_mappable(entry) ? Abort::none : Abort::not_mappable)
          << entry.name << ' ' << bits;
    }
  }
}

TEST(PdoMapping, SaysWhetherTheIndexTheSubindexOrTheObjectIsWrong) {
  for (const PdoKind kind : {receive, transmit}) {
    EXPECT_EQ(find(kind, 0x0000, 0, 0), Abort::no_object);
    EXPECT_EQ(find(kind, 0x0008, 0, 64), Abort::no_object);
    EXPECT_EQ(find(kind, 0x5FFF, 0, 32), Abort::no_object);
    EXPECT_EQ(find(kind, 0xFFFF, 0xFF, 0xFF), Abort::no_object);
    EXPECT_EQ(find(kind, 0x1805, 1, 32), Abort::no_object);
    EXPECT_EQ(find(kind, 0x2012, 99, 32), Abort::no_subindex);
    EXPECT_EQ(find(kind, 0x6041, 1, 16), Abort::no_subindex);
    EXPECT_EQ(find(kind, 0x1800, 4, 8), Abort::no_subindex);   // a gap in a record
    EXPECT_EQ(find(kind, 0x1010, 2, 32), Abort::no_subindex);  // a special object's
    EXPECT_EQ(find(kind, 0x2012, 0, 8), Abort::not_mappable);  // the number of sub-indices
    EXPECT_EQ(find(kind, 0x1001, 0, 8), Abort::not_mappable);  // a special object
    EXPECT_EQ(find(kind, 0x1003, 8, 32), Abort::not_mappable);
    EXPECT_EQ(find(kind, 0x1800, 1, 32), Abort::not_mappable);  // a setting of CANopen
    EXPECT_EQ(find(kind, 0x1A00, 0, 8), Abort::not_mappable);
  }
  EXPECT_EQ(find(receive, 0x6041, 0, 16), Abort::not_mappable);
  EXPECT_EQ(find(transmit, 0x6041, 0, 16), Abort::none);
}

TEST(PdoMapping, OnlyReceivedPdosHoldDummies) {
  const unsigned lengths[] = {1, 8, 16, 32, 8, 16, 32};
  for (std::uint16_t type = 1; type <= 7; ++type) {
    for (unsigned bits = 0; bits < 256; ++bits) {
      EXPECT_EQ(find(receive, type, 0, bits), bits == lengths[type - 1] ? Abort::none : Abort::not_mappable);
      EXPECT_EQ(find(transmit, type, 0, bits), Abort::not_mappable);
    }
    EXPECT_EQ(find(receive, type, 1, lengths[type - 1]), Abort::no_subindex);
  }
}

struct Entries {
  Entries(PdoKind kind, std::size_t pdo, std::initializer_list<std::uint32_t> objects) {
    std::size_t slot = slots_of(kind, pdo).first_mapped;
    for (std::size_t i = 0; i < mapped_max; ++i) values.set_raw(slot + i, 0);
    for (const std::uint32_t object : objects) values.set_raw(slot++, object);
  }
  ParameterValues values;
};

TEST(PdoMapping, AddsTheLengthsUpTo64Bits) {
  const std::uint32_t long_one = mapping_of(0x2012, 2, 32), short_one = mapping_of(0x6041, 0, 16);
  const Entries full(transmit, 3, {long_one, short_one, short_one, mapping_of(0x6061, 0, 8)});
  PdoMapping mapping;
  EXPECT_EQ(compile_mapping(transmit, 3, full.values, 0, mapping), Abort::none);
  EXPECT_EQ(mapping.bytes(), 0);
  EXPECT_EQ(compile_mapping(transmit, 3, full.values, 2, mapping), Abort::none);
  EXPECT_EQ(mapping.bytes(), 6);
  EXPECT_EQ(mapping.count, 2);
  EXPECT_EQ(compile_mapping(transmit, 3, full.values, 3, mapping), Abort::none);
  EXPECT_EQ(mapping.bits, 64);
  EXPECT_EQ(compile_mapping(transmit, 3, full.values, 4, mapping), Abort::pdo_length);
  EXPECT_EQ(compile_mapping(transmit, 3, full.values, 9, mapping), Abort::pdo_length);
  EXPECT_EQ(compile_mapping(transmit, 3, full.values, 0xFFFFFFFF, mapping), Abort::pdo_length);
}

TEST(PdoMapping, HoldsNothingBeyondItsCount) {
  const Entries full(transmit, 0, {mapping_of(0x6041, 0, 16), mapping_of(0x6041, 0, 16)});
  for (const std::uint32_t count : {0U, 1U, 2U}) {
    PdoMapping mapping;
    mapping.objects.fill({0, 16});
    ASSERT_EQ(compile_mapping(transmit, 0, full.values, count, mapping), Abort::none);
    for (std::size_t i = count; i < mapped_max; ++i) {
      EXPECT_EQ(mapping.objects[i].slot, dummy_slot);
      EXPECT_EQ(mapping.objects[i].bits, 0);
    }
  }
  PdoMapping refused{.count = 1, .bits = 16};
  EXPECT_EQ(compile_mapping(transmit, 0, full.values, 9, refused), Abort::pdo_length);
  EXPECT_EQ(refused.count, 0);
  EXPECT_EQ(refused.bits, 0);
}

TEST(PdoMapping, AnEmptyEntryWithinTheCountIsNoObject) {
  const Entries gap(transmit, 0, {mapping_of(0x6041, 0, 16), 0, mapping_of(0x6041, 0, 16)});
  PdoMapping mapping;
  EXPECT_EQ(compile_mapping(transmit, 0, gap.values, 1, mapping), Abort::none);
  EXPECT_EQ(compile_mapping(transmit, 0, gap.values, 2, mapping), Abort::no_object);
  EXPECT_EQ(compile_mapping(transmit, 0, gap.values, 3, mapping), Abort::no_object);
}

TEST(PdoMapping, CountsPartsOfAByteAsAByte) {
  const Entries odd(receive, 0, {mapping_of(1, 0, 1), mapping_of(0x6040, 0, 16)});
  PdoMapping mapping;
  ASSERT_EQ(compile_mapping(receive, 0, odd.values, 2, mapping), Abort::none);
  EXPECT_EQ(mapping.bits, 17);
  EXPECT_EQ(mapping.bytes(), 3);
}

TEST(PdoMapping, TheSettingsAreWhereTheStandardHasThem) {
  for (std::uint16_t n = 0; n < 4; ++n) {
    for (const PdoKind kind : {receive, transmit}) {
      const auto communication = static_cast<std::uint16_t>((kind == transmit ? 0x1800 : 0x1400) + n);
      const auto mapping = static_cast<std::uint16_t>((kind == transmit ? 0x1A00 : 0x1600) + n);
      const PdoSlots& slots = slots_of(kind, n);
      EXPECT_EQ(slot_at({communication, 1}), slots.cob_id);
      EXPECT_EQ(slot_at({communication, 2}), slots.transmission_type);
      EXPECT_EQ(slot_at({mapping, 0}), slots.mapped_count);
      for (std::uint8_t i = 0; i < 8; ++i)
        EXPECT_EQ(slot_at({mapping, static_cast<std::uint8_t>(1 + i)}), slots.first_mapped + i);
      if (kind == receive) continue;
      EXPECT_EQ(slot_at({communication, 3}), slots.inhibit_time);
      EXPECT_EQ(slot_at({communication, 5}), slots.event_time);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::pdo_mapping_test
