#include "host_tools/device/can/register_objects.hpp"

#include <gtest/gtest.h>

#include <set>

namespace kmax::link::register_objects_test {
namespace {
using firmware::entry_at;
using firmware::entry_of;
using firmware::modbus_address;
using firmware::Type;
using Words = std::vector<std::uint16_t>;
using Bytes = std::vector<std::uint8_t>;
using Table = RegisterTable;

RegisterObject one(Table table, std::size_t entry, std::size_t axis = 0) {
  return objects_in(table, modbus_address(entry, axis), firmware::register_count(entry_at(entry).type))
      .value()
      .at(0);
}

// Every value of the dictionary is reached through its registers, at the index CANopen has it at.
TEST(RegisterObjects, CoverTheWholeDictionary) {
  std::set<std::pair<std::uint16_t, std::uint8_t>> objects;
  for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
    const auto [entry, axis] = firmware::owner_of(slot);
    const auto& definition = entry_at(entry);
    const auto table = definition.access == firmware::Access::read_write ? Table::holding : Table::input;
    const RegisterObject found = one(table, entry, axis);
    EXPECT_EQ(found.entry, entry);
    EXPECT_EQ(found.object.index, definition.index() + 0x800 * axis) << definition.name;
    EXPECT_EQ(found.object.subindex, definition.object_subindex()) << definition.name;
    objects.insert({found.object.index, found.object.subindex});
  }
  EXPECT_EQ(objects.size(), firmware::slot_count) << "no two at the same place";
}

TEST(RegisterObjects, AxisOneAndStandardObjects) {
  EXPECT_EQ(one(Table::holding, entry_of<"wall.stiffness">(), 1).object,
            (firmware::canopen::ObjectAddress{0x2800, 4}));
  EXPECT_EQ(one(Table::holding, entry_of<"drive.controlword">(), 1).object,
            (firmware::canopen::ObjectAddress{0x6840, 0}));
}

TEST(RegisterObjects, ARangeIsItsValuesInOrder) {
  const auto first = modbus_address(entry_of<"wall.stiffness">(), 0);
  const auto values = objects_in(Table::holding, first, 4);
  ASSERT_TRUE(values);
  ASSERT_EQ(values->size(), 2u);
  EXPECT_EQ((*values)[0].definition().name, "wall.stiffness");
  EXPECT_EQ((*values)[1].definition().name, "wall.damping");
  EXPECT_EQ((*values)[1].address, first + 2);
  EXPECT_FALSE(objects_in(Table::holding, first, 3)) << "half a value";
  EXPECT_FALSE(objects_in(Table::holding, static_cast<std::uint16_t>(first + 1), 2))
      << "a value's second half";
  EXPECT_FALSE(objects_in(Table::holding, 0x7000, 1)) << "nobody's register";
  EXPECT_FALSE(objects_in(Table::holding, 0xFFFF, 2)) << "beyond the end";
  EXPECT_FALSE(objects_in(Table::holding, first, 125)) << "a gap inside";
}

TEST(RegisterObjects, BytesAndRegistersOfEachType) {
  const auto stiffness = one(Table::holding, entry_of<"wall.stiffness">());
  EXPECT_EQ(registers_from_bytes(stiffness, 1, Bytes{0x00, 0x00, 0x7A, 0x44}), (Words{0x447A, 0x0000}));
  EXPECT_EQ(bytes_from_registers(stiffness, Words{0x447A, 0x1234}), (Bytes{0x34, 0x12, 0x7A, 0x44}));

  const auto side = one(Table::holding, entry_of<"wall.side">());
  ASSERT_EQ(side.definition().type, Type::integer8);
  EXPECT_EQ(registers_from_bytes(side, 1, Bytes{0xFF}), Words{0xFFFF});
  EXPECT_EQ(registers_from_bytes(side, 1, Bytes{0xFF, 0, 0, 0}), Words{0xFFFF}) << "a longer answer";
  EXPECT_EQ(bytes_from_registers(side, Words{0xFFFF}), Bytes{0xFF});
  EXPECT_EQ(bytes_from_registers(side, Words{0x007F}), Bytes{0x7F});
  EXPECT_FALSE(bytes_from_registers(side, Words{0x0080}));
  EXPECT_FALSE(bytes_from_registers(side, Words{0x00FF})) << "255 is not -1";

  const auto law = one(Table::holding, entry_of<"wall.law">());
  ASSERT_EQ(law.definition().type, Type::unsigned8);
  EXPECT_EQ(registers_from_bytes(law, 1, Bytes{0xFF}), Words{0x00FF});
  EXPECT_EQ(bytes_from_registers(law, Words{0x00FF}), Bytes{0xFF});
  EXPECT_FALSE(bytes_from_registers(law, Words{0x0100}));

  const auto control = one(Table::holding, entry_of<"drive.controlword">());
  ASSERT_EQ(control.definition().type, Type::unsigned16);
  EXPECT_EQ(registers_from_bytes(control, 1, Bytes{0x0F, 0x80}), Words{0x800F});
  EXPECT_EQ(bytes_from_registers(control, Words{0x800F}), (Bytes{0x0F, 0x80}));
}

TEST(RegisterObjects, EveryPatternOfA16BitNumberIsKept) {
  for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
    const auto [entry, axis] = firmware::owner_of(slot);
    const auto& definition = entry_at(entry);
    if (definition.type != Type::integer16 && definition.type != Type::unsigned16) continue;
    const auto table = definition.access == firmware::Access::read_write ? Table::holding : Table::input;
    const RegisterObject value = one(table, entry, axis);
    EXPECT_EQ(registers_from_bytes(value, 1, Bytes{0x34, 0xF2}), Words{0xF234}) << definition.name;
  }
}

// In the registers as it is stored, in the object as it is used.
TEST(RegisterObjects, APredefinedIdentifierLosesTheNodeIdAndAnotherKeepsIt) {
  const auto cob_id = one(Table::input, entry_of<"tpdo1.cob_id">());
  ASSERT_TRUE(cob_id.definition().node_relative);
  EXPECT_EQ(registers_from_bytes(cob_id, 5, Bytes{0x85, 0x01, 0x00, 0x40}), (Words{0x4000, 0x0180}));
  EXPECT_EQ(registers_from_bytes(cob_id, 5, Bytes{0x23, 0x02, 0x00, 0x80}), (Words{0x8000, 0x0223}));
}

}  // namespace
}  // namespace kmax::link::register_objects_test
