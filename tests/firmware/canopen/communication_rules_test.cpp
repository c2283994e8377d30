#include "firmware/canopen/communication_rules.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/firmware/canopen/communication_writes.hpp"

namespace kmax::firmware::canopen::communication_rules_test {
namespace {

using Writes = CommunicationWrites;

// The table of CiA 301 v4.2 "restricted CAN-IDs", written down once more.
bool restricted_identifier(std::uint32_t id) {
  const std::pair<std::uint32_t, std::uint32_t> ranges[] = {{0x000, 0x07F}, {0x101, 0x180}, {0x581, 0x5FF},
                                                            {0x601, 0x67F}, {0x6E0, 0x6FF}, {0x701, 0x7FF}};
  for (const auto& [first, last] : ranges) {
    if (id >= first && id <= last) return true;
  }
  return false;
}

struct Pdo {
  std::uint16_t communication, mapping;
  std::uint32_t predefined;  // without the node ID
  bool transmit;
};

std::vector<Pdo> all_pdos() {
  std::vector<Pdo> pdos;
  pdos.push_back({0x1804, 0x1A04, 0x500U, true});
  for (std::uint16_t n = 0; n < 4; ++n) {
    pdos.push_back({static_cast<std::uint16_t>(0x1400 + n), static_cast<std::uint16_t>(0x1600 + n),
                    0x200U + 0x100U * n, false});
    pdos.push_back({static_cast<std::uint16_t>(0x1800 + n), static_cast<std::uint16_t>(0x1A00 + n),
                    0x180U + 0x100U * n, true});
  }
  return pdos;
}

// A PDO made not to exist; with an object in it that both kinds may hold. There is no other.
void prepare(Writes& w, const Pdo& pdo) {
  for (const Pdo& other : all_pdos()) ASSERT_EQ(w.write(other.communication, 1, bit_31 | 0x222), Abort::none);
  ASSERT_EQ(w.write(pdo.communication, 1, bit_31 | 0x222), Abort::none);
  ASSERT_EQ(w.write(pdo.mapping, 0, 0), Abort::none);
  ASSERT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6040, 0, 16)), Abort::none);
  ASSERT_EQ(w.write(pdo.mapping, 0, 1), Abort::none);
}

TEST(CommunicationRules, EveryCommunicationEntryHasItsRule) {
  std::vector<int> counts(12);
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const Entry& entry = entry_at(owner_of(slot).entry);
    ASSERT_EQ(is_communication(slot), entry.access == Access::communication) << entry.name;
    if (!is_communication(slot)) continue;
    const CommunicationRow& row = communication_rows[slot - first_communication_slot];
    ++counts[static_cast<std::size_t>(row.rule)];
    EXPECT_EQ(row.predefined != 0, entry.node_relative) << entry.name;
    if (entry.node_relative) {
      EXPECT_EQ(row.predefined, raw_from_number(entry.type, entry.default_value) & 0x7FF);
    }
  }
  // bounds: 0x1015, 0x1017, 0x1029:1 and five event times
  EXPECT_EQ(counts, (std::vector<int>{8, 1, 1, 4, 9, 9, 5, 9, 72, 1, 1, 2}));
}

TEST(CommunicationRules, OtherEntriesAreNoneOfItsBusiness) {
  const ParameterValues values;
  for (const std::size_t slot : {std::size_t{0}, first_communication_slot - 1, slot_count, slot_count + 1000})
    EXPECT_EQ(check_communication(values, slot, 0, 5), Abort::unsupported_access);
}

TEST(CommunicationRules, WritingBackWhatIsThereIsAllowedButForTheMapping) {
  Writes w;
  for (std::size_t slot = first_communication_slot; slot < slot_count; ++slot) {
    const Entry& entry = entry_at(owner_of(slot).entry);
    const bool mapping = (entry.index() & 0xF600) == 0x1600 || (entry.index() & 0xFE00) == 0x1A00;
    // RPDO 3 and 4 do not exist and have no objects: their mapping is open
    const bool open = entry.index() == 0x1602 || entry.index() == 0x1603;
    const std::uint32_t shown = w.read(entry.index(), entry.object_subindex());
    EXPECT_EQ(check_communication(w.values, slot, shown, test_node_id),
              mapping && !open ? Abort::device_state : Abort::none)
        << entry.name;
    EXPECT_EQ(stored_communication(slot, shown, test_node_id), w.values.raw(slot)) << entry.name;
  }
}

TEST(CommunicationRules, SyncIdentifier) {
  Writes w;
  for (std::uint32_t id = 0; id <= 0x7FF; ++id)
    EXPECT_EQ(w.write(0x1005, 0, id), restricted_identifier(id) ? Abort::value_range : Abort::none) << id;
  for (unsigned bit = 11; bit <= 29; ++bit)
    EXPECT_EQ(w.write(0x1005, 0, 0x80U | 1U << bit), Abort::value_range) << bit;
}

TEST(CommunicationRules, TheSyncThatIsMadeKeepsItsIdentifier) {
  Writes w;
  EXPECT_EQ(w.write(0x1005, 0, 1U << 30 | 0x85), Abort::none) << "both at once";
  EXPECT_EQ(w.write(0x1005, 0, 1U << 30 | 0x86), Abort::device_state);
  EXPECT_EQ(w.write(0x1005, 0, 0x86), Abort::device_state) << "first the bit";
  EXPECT_EQ(w.write(0x1005, 0, 1U << 30 | 0x181), Abort::device_state);
  EXPECT_EQ(w.write(0x1005, 0, 1U << 30 | 0x180), Abort::value_range);
  EXPECT_EQ(w.read(0x1005, 0), 1U << 30 | 0x85);
  EXPECT_EQ(w.write(0x1005, 0, 0x85), Abort::none);
  EXPECT_EQ(w.write(0x1005, 0, 0x86), Abort::none);
}

TEST(CommunicationRules, TheSyncCounterChangesOnlyWithoutAPeriod) {
  Writes w;
  for (std::uint32_t overflow = 0; overflow <= 0x101; ++overflow) {
    const bool good = overflow == 0 || (overflow >= 2 && overflow <= 240);
    EXPECT_EQ(w.write(0x1019, 0, overflow), good ? Abort::none : Abort::value_range) << overflow;
  }
  EXPECT_EQ(w.read(0x1019, 0), 240U);
  for (const std::uint32_t period : {0U, 1000U, 1001U, 0x7FFF'FFFFU})
    EXPECT_EQ(w.write(0x1006, 0, period), Abort::none);
  for (const std::uint32_t period : {1U, 999U, 0x8000'0000U, 0xFFFF'FFFFU})
    EXPECT_EQ(w.write(0x1006, 0, period), Abort::value_range) << period;
  EXPECT_EQ(w.write(0x1019, 0, 10), Abort::device_state);
  EXPECT_EQ(w.write(0x1019, 0, 1), Abort::value_range);
  EXPECT_EQ(w.write(0x1019, 0, 240), Abort::none) << "as it is";
  EXPECT_EQ(w.write(0x1006, 0, 0), Abort::none);
  EXPECT_EQ(w.write(0x1019, 0, 10), Abort::none);
}

TEST(CommunicationRules, IdentifiersOfTheSecondSdoServer) {
  for (const unsigned sub : {1U, 2U}) {
    Writes w;
    EXPECT_EQ(w.read(0x1201, sub), bit_31);
    for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
      ASSERT_EQ(w.write(0x1201, sub, bit_31 | id), Abort::none);
      EXPECT_EQ(w.write(0x1201, sub, id), restricted_identifier(id) ? Abort::value_range : Abort::none) << id;
    }
    for (unsigned bit = 11; bit <= 30; ++bit) {
      EXPECT_EQ(w.write(0x1201, sub, 0x6A0U | 1U << bit), Abort::value_range) << bit;
      EXPECT_EQ(w.write(0x1201, sub, bit_31 | 0x6A0U | 1U << bit), Abort::value_range) << bit;
    }
    ASSERT_EQ(w.write(0x1201, sub, bit_31), Abort::none);
    EXPECT_EQ(w.write(0x1201, sub, 0x6A0), Abort::none);
    EXPECT_EQ(w.write(0x1201, sub, 0x6A0), Abort::none);
    EXPECT_EQ(w.write(0x1201, sub, 0x6A1), Abort::device_state);
    EXPECT_EQ(w.write(0x1201, 3 - sub, 0x6A0), Abort::incompatible) << "it would hear itself";
    EXPECT_EQ(w.write(0x1201, 3 - sub, 0x6A1), Abort::none);
  }
}

TEST(CommunicationRules, NothingIsSentByAnIdentifierThatIsListenedTo) {
  Writes w;
  EXPECT_EQ(w.remap(0x1403, {mapping_of(0x6040, 0, 16)}, 0x505), Abort::incompatible) << "of TPDO 5";
  EXPECT_EQ(w.remap(0x1403, {mapping_of(0x6040, 0, 16)}, 0x285), Abort::incompatible);
  EXPECT_EQ(w.remap(0x1800, {mapping_of(0x6041, 0, 16)}, 0x205), Abort::incompatible) << "of RPDO 1";
  ASSERT_EQ(w.write(0x1804, 1, bit_31 | 0x505), Abort::none);
  EXPECT_EQ(w.remap(0x1403, {mapping_of(0x6040, 0, 16)}, 0x505), Abort::none);
  EXPECT_EQ(w.write(0x1804, 1, 0x505), Abort::incompatible);
  EXPECT_EQ(w.remap(0x1402, {mapping_of(0x6040, 0, 16)}, 0x505), Abort::none) << "two may listen to one";
}

TEST(CommunicationRules, EmergencyIdentifier) {
  Writes w;
  EXPECT_EQ(w.read(0x1014, 0), 0x85U);
  EXPECT_EQ(w.write(0x1014, 0, 0x90), Abort::device_state);
  for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
    ASSERT_EQ(w.write(0x1014, 0, bit_31 | 0x222), Abort::none);
    const bool bad = restricted_identifier(id) || id == 0x80;
    EXPECT_EQ(w.write(0x1014, 0, id), bad ? Abort::value_range : Abort::none) << id;
    if (!bad) {
      EXPECT_EQ(w.read(0x1014, 0), id);
    }
  }
  ASSERT_EQ(w.write(0x1014, 0, bit_31 | 0x222), Abort::none);
  for (unsigned bit = 11; bit <= 30; ++bit) {
    EXPECT_EQ(w.write(0x1014, 0, 0x85U | 1U << bit), Abort::value_range) << bit;
    EXPECT_EQ(w.write(0x1014, 0, bit_31 | 0x85U | 1U << bit), Abort::value_range) << bit;
  }
}

TEST(CommunicationRules, PlainNumbersHaveTheirBounds) {
  Writes w;
  const std::vector<std::tuple<std::uint16_t, unsigned, std::uint32_t>> bounds{
      {0x1015, 0, 65535}, {0x1017, 0, 65535}, {0x1029, 1, 2}, {0x1800, 5, 65535}, {0x1803, 5, 65535}};
  for (const auto& [index, subindex, highest] : bounds) {
    for (const std::uint32_t value : {0U, 1U, highest})
      EXPECT_EQ(w.write(index, subindex, value), Abort::none) << index;
    for (const std::uint32_t value : {highest + 1, 0x10000U, 0x80000000U, 0xFFFFFFFFU})
      EXPECT_EQ(w.write(index, subindex, value), Abort::value_range) << index;
  }
}

TEST(CommunicationRules, AWatchedNodeStandsThereOnce) {
  Writes w;
  EXPECT_EQ(w.write(0x1016, 1, 10U << 16 | 100), Abort::none);
  EXPECT_EQ(w.write(0x1016, 4, 10U << 16 | 200), Abort::incompatible);
  EXPECT_EQ(w.write(0x1016, 4, 10U << 16), Abort::none);
  EXPECT_EQ(w.write(0x1016, 4, 11U << 16 | 200), Abort::none);
  EXPECT_EQ(w.write(0x1016, 1, 11U << 16 | 100), Abort::incompatible);
  EXPECT_EQ(w.write(0x1016, 4, 11U << 16 | 300), Abort::none);
  EXPECT_EQ(w.write(0x1016, 2, 127U << 16 | 65535), Abort::none);
  EXPECT_EQ(w.write(0x1016, 3, 128U << 16 | 100), Abort::value_range);
  EXPECT_EQ(w.write(0x1016, 3, 1U << 24), Abort::value_range);
}

TEST(CommunicationRules, AnIdentifierChangesOnlyWhileThePdoDoesNotExist) {
  for (const Pdo& pdo : all_pdos()) {
    Writes w;
    prepare(w, pdo);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x333), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x334), Abort::device_state);
    EXPECT_EQ(w.read(pdo.communication, 1), 0x333U);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x333), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x333 | 1U << 30), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, bit_31 | 0x333), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x334), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, bit_31 | 0x335), Abort::none);
    EXPECT_EQ(w.read(pdo.communication, 1), bit_31 | 0x335);
    EXPECT_EQ(w.write(pdo.communication, 1, bit_31), Abort::none);
    EXPECT_EQ(w.read(pdo.communication, 1), bit_31);
  }
}

TEST(CommunicationRules, EveryIdentifierOfEveryPdo) {
  for (const Pdo& pdo : all_pdos()) {
    Writes w;
    prepare(w, pdo);
    for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
      const bool kept_bad = id == pdo.predefined;
      EXPECT_EQ(w.write(pdo.communication, 1, bit_31 | id), kept_bad ? Abort::value_range : Abort::none)
          << id;
      const bool bad = kept_bad || restricted_identifier(id);
      EXPECT_EQ(w.write(pdo.communication, 1, id), bad ? Abort::value_range : Abort::none) << id;
      if (!bad) {
        EXPECT_EQ(w.read(pdo.communication, 1), id);
      }
      ASSERT_EQ(w.write(pdo.communication, 1, bit_31 | 0x222), Abort::none);
    }
    for (unsigned bit = 11; bit <= 29; ++bit) {
      EXPECT_EQ(w.write(pdo.communication, 1, 0x333U | 1U << bit), Abort::value_range) << bit;
      EXPECT_EQ(w.write(pdo.communication, 1, bit_31 | 0x333U | 1U << bit), Abort::value_range) << bit;
    }
  }
}

TEST(CommunicationRules, APredefinedIdentifierFollowsTheNodeId) {
  Writes w;
  const std::size_t slot = Writes::at(0x1801, 1);
  EXPECT_EQ(w.read(0x1801, 1), 1U << 30 | 0x285U);
  ASSERT_EQ(w.write(0x1801, 1, bit_31 | 0x285), Abort::none);
  EXPECT_EQ(shown_communication(slot, w.values.raw(slot), 77), bit_31 | (0x280 + 77));
  ASSERT_EQ(w.write(0x1801, 1, bit_31 | 0x286), Abort::none);
  EXPECT_EQ(shown_communication(slot, w.values.raw(slot), 77), bit_31 | 0x286);
}

TEST(CommunicationRules, TransmissionTypesAtAnyTime) {
  for (const Pdo& pdo : all_pdos()) {
    Writes w;
    for (std::uint32_t type = 0; type <= 300; ++type) {
      const bool good = type <= 240 || type == 254 || type == 255;
      EXPECT_EQ(w.write(pdo.communication, 2, type), good ? Abort::none : Abort::value_range) << type;
    }
  }
}

TEST(CommunicationRules, TheInhibitTimeOnlyWhileThePdoDoesNotExist) {
  for (const Pdo& pdo : all_pdos()) {
    if (!pdo.transmit) continue;
    Writes w;
    const std::uint32_t factory = w.read(pdo.communication, 3);
    EXPECT_EQ(w.write(pdo.communication, 3, 10), Abort::device_state);
    EXPECT_EQ(w.write(pdo.communication, 3, 65536), Abort::value_range);
    EXPECT_EQ(w.write(pdo.communication, 3, factory), Abort::none);  // as it is
    ASSERT_EQ(w.write(pdo.communication, 1, bit_31 | 0x222), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 3, 65535), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 3, 65536), Abort::value_range);
    EXPECT_EQ(w.write(pdo.communication, 5, 65535), Abort::none);
  }
}

TEST(CommunicationRules, TheMappingInTheStandardsOrderOnly) {
  for (const Pdo& pdo : all_pdos()) {
    Writes w;
    prepare(w, pdo);
    ASSERT_EQ(w.write(pdo.communication, 1, 0x333), Abort::none);
    for (const std::uint32_t count : {0U, 1U, 9U})
      EXPECT_EQ(w.write(pdo.mapping, 0, count), Abort::device_state) << count;
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6040, 0, 16)), Abort::device_state);
    EXPECT_EQ(w.write(pdo.mapping, 8, 0), Abort::device_state);
    ASSERT_EQ(w.write(pdo.communication, 1, bit_31 | 0x333), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6040, 0, 16)), Abort::device_state);
    EXPECT_EQ(w.write(pdo.mapping, 8, 0), Abort::device_state);
    ASSERT_EQ(w.write(pdo.mapping, 0, 0), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6840, 0, 16)), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 8, 0), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x333), Abort::value_range);  // nothing is mapped
    EXPECT_EQ(w.write(pdo.mapping, 0, 1), Abort::none);
    EXPECT_EQ(w.write(pdo.communication, 1, 0x333), Abort::none);
  }
}

TEST(CommunicationRules, ObjectsAndTheirNumber) {
  for (const Pdo& pdo : all_pdos()) {
    Writes w;
    prepare(w, pdo);
    ASSERT_EQ(w.write(pdo.mapping, 0, 0), Abort::none);
    for (unsigned i = 1; i <= 8; ++i)
      ASSERT_EQ(w.write(pdo.mapping, i, mapping_of(0x6060, 0, 8)), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x5FFF, 0, 8)), Abort::no_object);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6060, 1, 8)), Abort::no_subindex);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6060, 0, 16)), Abort::not_mappable);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x1800, 1, 32)), Abort::not_mappable);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6041, 0, 16)),
              pdo.transmit ? Abort::none : Abort::not_mappable);
    EXPECT_EQ(w.write(pdo.mapping, 1, mapping_of(5, 0, 8)), pdo.transmit ? Abort::not_mappable : Abort::none);
    ASSERT_EQ(w.write(pdo.mapping, 1, mapping_of(0x6060, 0, 8)), Abort::none);
    for (const std::uint32_t count : {9U, 64U, 254U, 255U, 256U, 0xFFFFFFFFU})
      EXPECT_EQ(w.write(pdo.mapping, 0, count), Abort::pdo_length) << count;
    EXPECT_EQ(w.write(pdo.mapping, 0, 8), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 0, 3), Abort::none);
    ASSERT_EQ(w.write(pdo.mapping, 0, 0), Abort::none);
    ASSERT_EQ(w.write(pdo.mapping, 8, mapping_of(0x6040, 0, 16)), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 0, 8), Abort::pdo_length);  // 72 bits
    ASSERT_EQ(w.write(pdo.mapping, 8, 0), Abort::none);
    EXPECT_EQ(w.write(pdo.mapping, 0, 8), Abort::no_object);
    EXPECT_EQ(w.write(pdo.mapping, 0, 7), Abort::none);
  }
}

TEST(CommunicationRules, AStoredMappingThatIsWrongCannotComeToLife) {
  Writes w;
  ASSERT_EQ(w.write(0x1800, 1, bit_31 | 0x185), Abort::none);
  w.values.set_whole<"tpdo1.mapped_1">(mapping_of(0x5FFF, 0, 8));
  EXPECT_EQ(w.write(0x1800, 1, 0x185), Abort::no_object);
  w.values.set_whole<"tpdo1.mapped_count">(9);
  EXPECT_EQ(w.write(0x1800, 1, 0x185), Abort::pdo_length);
}

TEST(CommunicationRules, RemapGoesThroughInTheStandardsOrder) {
  Writes w;
  EXPECT_EQ(w.remap(0x1802, {mapping_of(0x6041, 0, 16), mapping_of(0x6841, 0, 16)}, 0x385, 1, 5, 10),
            Abort::none);
  EXPECT_EQ(w.remap(0x1403, {mapping_of(5, 0, 8), mapping_of(0x6040, 0, 16)}, 0x506, 1), Abort::none);
}

// What a PDO holds, judged from the dictionary's rows alone.
bool legal(const ParameterValues& values, const Pdo& pdo) {
  const auto raw = [&](std::uint16_t index, unsigned subindex) {
    return values.raw(Writes::at(index, subindex));
  };
  if (raw(pdo.communication, 1) >> 31 != 0) return true;
  const std::uint32_t count = raw(pdo.mapping, 0);
  if (count == 0 || count > 8) return false;
  unsigned bits = 0;
  for (unsigned i = 1; i <= count; ++i) {
    const std::uint32_t mapped = raw(pdo.mapping, i);
    bits += mapped & 0xFF;
    bool found = !pdo.transmit && mapped >> 16 >= 1 && mapped >> 16 <= 7;
    for (std::size_t slot = 0; slot < slot_count; ++slot) {
      const auto [e, axis] = owner_of(slot);
      const Entry& entry = entry_at(e);
      const auto index = static_cast<std::uint16_t>(entry.index() + axis_index_offset * axis);
      if (mapping_of(index, entry.object_subindex(), 8U * bytes_of(entry.type)) != mapped) continue;
      found = pdo.transmit ? tpdo_mappable(entry) : rpdo_mappable(entry);
    }
    if (!found) return false;
  }
  const std::uint32_t type = raw(pdo.communication, 2);
  return bits <= 64 && (type <= 240 || type >= 254);
}

RC_GTEST_PROP(CommunicationRules, NoSequenceOfWritesLeavesAnIllegalPdo, ()) {
  Writes w;
  const Pdo pdo = *rc::gen::elementOf(all_pdos());
  const std::vector<std::uint32_t> objects{0,
                                           mapping_of(0x6040, 0, 16),
                                           mapping_of(0x6041, 0, 16),
                                           mapping_of(0x2012, 2, 32),
                                           mapping_of(0x2000, 4, 32),
                                           mapping_of(0x6060, 0, 8),
                                           mapping_of(1, 0, 1),
                                           mapping_of(7, 0, 32),
                                           mapping_of(0x5FFF, 0, 8),
                                           mapping_of(0x1001, 0, 8),
                                           mapping_of(0x6040, 0, 8)};
  int lives = 0;
  for (int step = 0; step < 120; ++step) {
    const int what = *rc::gen::inRange(0, 12);
    if (what < 3) {
      const std::uint32_t id = *rc::gen::element(0x333U, 0x334U, 0x185U, 0x205U, 0x601U, 0x20000333U);
      const bool there = w.write(pdo.communication, 1, id) == Abort::none;
      lives += there ? 1 : 0;
    } else if (what < 5) {
      w.write(pdo.communication, 1, bit_31 | 0x333);
    } else if (what < 7) {
      w.write(pdo.mapping, 0, *rc::gen::inRange(0U, 10U));
    } else if (what < 8) {
      w.write(pdo.mapping, 0, 0);
    } else if (what < 11) {
      w.write(pdo.mapping, *rc::gen::inRange(1U, 9U), *rc::gen::elementOf(objects));
    } else {
      w.write(pdo.communication, 2, *rc::gen::inRange(0U, 260U));
    }
    RC_ASSERT(legal(w.values, pdo));
    PdoSettings settings;
    RC_ASSERT(read_pdo(pdo.transmit ? PdoKind::transmit : PdoKind::receive, pdo.communication & 7U, w.values,
                       test_node_id, settings));
  }
  RC_CLASSIFY(lives > 0, "a PDO came to life");
}

}  // namespace
}  // namespace kmax::firmware::canopen::communication_rules_test
