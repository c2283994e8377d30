#include "firmware/object_dictionary/entry.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <limits>

namespace kmax::firmware::entry_test {
namespace {

constexpr Group plain_group{"group", 0x2000, Scope::axis, 0x10};

TEST(Entry, WordsOfEveryType) {
  EXPECT_EQ(register_count(Type::unsigned8), 1);
  EXPECT_EQ(register_count(Type::integer8), 1);
  EXPECT_EQ(register_count(Type::integer16), 1);
  EXPECT_EQ(register_count(Type::unsigned16), 1);
  EXPECT_EQ(register_count(Type::unsigned32), 2);
  EXPECT_EQ(register_count(Type::integer32), 2);
  EXPECT_EQ(register_count(Type::float32), 2);
}

TEST(Entry, BytesOfEveryTypeAsAnObject) {
  for (const Type type : {Type::unsigned8, Type::integer8}) EXPECT_EQ(bytes_of(type), 1);
  for (const Type type : {Type::unsigned16, Type::integer16}) EXPECT_EQ(bytes_of(type), 2);
  for (const Type type : {Type::unsigned32, Type::integer32, Type::float32}) EXPECT_EQ(bytes_of(type), 4);
}

TEST(Entry, PatternsOfTheEdgesOfEveryType) {
  EXPECT_EQ(raw_from_number(Type::integer8, -1), 0xFFFFFFFFu);
  EXPECT_EQ(raw_from_number(Type::integer8, -128), 0xFFFFFF80u);
  EXPECT_EQ(raw_from_number(Type::integer16, -1), 0xFFFFFFFFu);
  EXPECT_EQ(raw_from_number(Type::integer16, -32768), 0xFFFF8000u);
  EXPECT_EQ(raw_from_number(Type::integer16, 32767), 0x7FFFu);
  EXPECT_EQ(raw_from_number(Type::integer32, -2147483648.0), 0x80000000u);
  EXPECT_EQ(raw_from_number(Type::unsigned32, 4294967295.0), 0xFFFFFFFFu);
  EXPECT_EQ(raw_from_number(Type::unsigned16, 65535), 0xFFFFu);
  EXPECT_EQ(raw_from_number(Type::float32, 1.0), 0x3F800000u);
  EXPECT_EQ(raw_from_number(Type::float32, -0.0), 0x80000000u);
  EXPECT_EQ(number_from_raw(Type::integer8, 0xFFFFFFFFu), -1.0);
  EXPECT_EQ(number_from_raw(Type::integer16, 0xFFFF8000u), -32768.0);
  EXPECT_EQ(number_from_raw(Type::unsigned32, 0xFFFFFFFFu), 4294967295.0);
  EXPECT_EQ(number_from_raw(Type::float32, 0x7F7FFFFFu),
            static_cast<double>(std::numeric_limits<float>::max()));
}

RC_GTEST_PROP(Entry, AShorterValueIsExtendedByItsSign, (std::uint32_t bits)) {
  RC_ASSERT(extended(Type::unsigned8, bits) == static_cast<std::uint8_t>(bits));
  RC_ASSERT(extended(Type::unsigned16, bits) == static_cast<std::uint16_t>(bits));
  RC_ASSERT(extended(Type::integer8, bits) == static_cast<std::uint32_t>(static_cast<std::int8_t>(bits)));
  RC_ASSERT(extended(Type::integer16, bits) == static_cast<std::uint32_t>(static_cast<std::int16_t>(bits)));
  for (const Type type : {Type::unsigned32, Type::integer32, Type::float32})
    RC_ASSERT(extended(type, bits) == bits);
}

RC_GTEST_PROP(Entry, PatternAndNumberAreInverse, (std::uint32_t bits)) {
  for (const Type type : {Type::unsigned32, Type::integer32})
    RC_ASSERT(raw_from_number(type, number_from_raw(type, bits)) == bits);
  RC_ASSERT(raw_from_number(Type::unsigned16, number_from_raw(Type::unsigned16, bits & 0xFFFF)) ==
            (bits & 0xFFFF));
  const auto value = std::bit_cast<float>(bits);
  if (value - value == 0.0f)
    RC_ASSERT(raw_from_number(Type::float32, number_from_raw(Type::float32, bits)) == bits);
}

TEST(Entry, WordsOfARowSetWhatTheySay) {
  static constexpr NamedValue sides[] = {{"left", -1}, {"right", 1}};
  constexpr Entry side = choice("group.side", plain_group, 3, sides, 1, "help").disarmed_only();
  EXPECT_EQ(side.type, Type::integer8);
  EXPECT_EQ(side.minimum, -1);
  EXPECT_EQ(side.maximum, 1);
  EXPECT_EQ(side.change, Change::disarmed_only);
  EXPECT_EQ(side.index(), 0x2000);
  EXPECT_EQ(side.object_subindex(), 3);
  constexpr Entry word =
      reading("group.word", plain_group, 1, Type::unsigned16, "", "help").at_standard_index(0x6041);
  EXPECT_EQ(word.access, Access::read_only);
  EXPECT_FALSE(word.persistent);
  EXPECT_EQ(word.index(), 0x6041);
  EXPECT_EQ(word.object_subindex(), 0);
  EXPECT_EQ(word.maximum, 65535);
  constexpr Entry command =
      whole("group.command", plain_group, 2, Type::unsigned16, "", 0, 9, 0, "h").volatile_value();
  EXPECT_FALSE(command.persistent);
  EXPECT_EQ(command.access, Access::read_write);
  constexpr Entry id =
      whole("group.id", plain_group, 4, Type::unsigned32, "", 0, 9, 0, "h").of_communication().plus_node_id();
  EXPECT_EQ(id.access, Access::communication);
  EXPECT_TRUE(id.persistent);
  EXPECT_TRUE(id.node_relative);
  EXPECT_FALSE(command.node_relative);
  constexpr Entry torque = reading("group.torque", plain_group, 5, Type::integer16, "", "h");
  EXPECT_EQ(torque.minimum, -32768);
  EXPECT_EQ(torque.maximum, 32767);
}

TEST(Entry, ARowSaysNothingThatItWasNotAskedTo) {
  const Entry plain = real("group.plain", plain_group, 1, "m", -1, 2, 0.5, "h");
  EXPECT_EQ(plain.type, Type::float32);
  EXPECT_EQ(plain.minimum, -1);
  EXPECT_EQ(plain.maximum, 2);
  EXPECT_EQ(plain.default_value, 0.5);
  EXPECT_EQ(plain.access, Access::read_write);
  EXPECT_EQ(plain.change, Change::any_time);
  EXPECT_TRUE(plain.persistent);
  EXPECT_TRUE(plain.values.empty());
  EXPECT_EQ(plain.standard_index, 0);
  EXPECT_EQ(plain.standard_subindex, 0);
  EXPECT_FALSE(plain.node_relative);
  EXPECT_FALSE(plain.unbounded_at_zero);
  EXPECT_EQ(plain.ceiling, "");
  EXPECT_EQ(plain.scope(), Scope::axis);
  EXPECT_FALSE(plain_group.of_commander);

  EXPECT_EQ(plain.only_lower().change, Change::only_lower);
  EXPECT_EQ(plain.only_lower("group.top").ceiling, "group.top");
  EXPECT_EQ(plain.only_higher().change, Change::only_higher);
  EXPECT_EQ(plain.only_higher().ceiling, "");
  EXPECT_EQ(plain.only_nearer_zero("group.top").change, Change::only_nearer_zero);
  EXPECT_EQ(plain.only_nearer_zero("group.top").ceiling, "group.top");
  EXPECT_TRUE(plain.off_at_zero().unbounded_at_zero);
  EXPECT_EQ(plain.at_standard_index(0x1018, 3).object_subindex(), 3);

  static constexpr NamedValue states[] = {{"second", 2}, {"first", 1}, {"third", 3}};
  const Entry state = named_reading("group.state", plain_group, 1, states, "h");
  EXPECT_EQ(state.type, Type::unsigned8);
  EXPECT_EQ(state.minimum, 1);
  EXPECT_EQ(state.maximum, 3);
  EXPECT_EQ(state.default_value, 2) << "the one that is named first";
  EXPECT_EQ(state.access, Access::read_only);
  EXPECT_FALSE(state.persistent);
}

// CiA 402 has several axes 0x800 apart.
TEST(Entry, PlacesOfFurtherAxes) {
  EXPECT_EQ(axis_index_offset, 0x800);
  EXPECT_EQ(axis_modbus_offset, 0x400);
  EXPECT_EQ(most_axes, 7U);
}

TEST(Entry, AReadingMayBeAllThatItsTypeHolds) {
  const auto range = [](Type type) {
    const Entry e = reading("group.reading", plain_group, 1, type, "", "h");
    return std::pair(e.minimum, e.maximum);
  };
  EXPECT_EQ(range(Type::unsigned8), std::pair(0.0, 255.0));
  EXPECT_EQ(range(Type::integer8), std::pair(-128.0, 127.0));
  EXPECT_EQ(range(Type::unsigned16), std::pair(0.0, 65535.0));
  EXPECT_EQ(range(Type::unsigned32), std::pair(0.0, 4294967295.0));
  EXPECT_EQ(range(Type::integer32), std::pair(-2147483648.0, 2147483647.0));
  const double largest = static_cast<double>(std::numeric_limits<float>::max());
  EXPECT_EQ(range(Type::float32), std::pair(-largest, largest));
}

}  // namespace
}  // namespace kmax::firmware::entry_test
