#include "host_tools/device/parameter.hpp"

#include <gtest/gtest.h>

#include <set>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::parameter_test {

using host_tools_test::thrown_message;

TEST(Resolve, ANameWithoutPrefixIsOnTheDefaultAxis) {
  EXPECT_EQ(resolve("wall.stiffness"), Parameter::of<"wall.stiffness">(0));
  EXPECT_EQ(resolve("wall.stiffness", 1), Parameter::of<"wall.stiffness">(1));
  EXPECT_EQ(resolve("axis0.wall.stiffness", 1), Parameter::of<"wall.stiffness">(0));
  EXPECT_EQ(resolve("axis1.wall.stiffness"), Parameter::of<"wall.stiffness">(1));
}

TEST(Resolve, DeviceNamesHaveNoAxis) {
  EXPECT_EQ(resolve("link.timeout", 1), Parameter::of<"link.timeout">());
  const auto message = thrown_message<base::ValueError>([] { resolve("axis1.link.timeout"); });
  EXPECT_CONTAINS(message, "belongs to the whole device");
  EXPECT_CONTAINS(message, "write link.timeout");
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] { resolve("axis0.node.id"); }), "whole device");
}

TEST(Resolve, SaysWhatIsWrong) {
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] { resolve("axis2.wall.stiffness"); }),
                  "axes are 0 .. 1");
  EXPECT_CONTAINS(
      thrown_message<base::ValueError>([] { resolve("axis18446744073709551617.wall.stiffness"); }),
      "axes are 0 .. 1");
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] { resolve("wall"); }), "is a group");
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] { resolve("axis1.wall"); }), "'kmax list axis1.wall.'");
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] { resolve("axis1.stiffness"); }),
                  "axis1.wall.stiffness or axis1.excitation.stiffness?");
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] { resolve("zzz"); }), "kmax list");
  for (const char* bad :
       {"", ".", "axis", "axis.", "axis1.", "axisx.wall.law", "wall.", "WALL.LAW", "wall.law "})
    thrown_message<base::ValueError>([bad] { resolve(bad); });
}

TEST(Parameter, EveryNameResolvesToItselfAndToAPlaceOfItsOwn) {
  std::set<std::string> names;
  std::set<std::pair<Table, std::uint16_t>> places;
  for (const Parameter& parameter : all_parameters()) {
    EXPECT_EQ(resolve(parameter.name()), parameter);
    EXPECT_TRUE(names.insert(parameter.name()).second) << parameter.name();
    EXPECT_TRUE(places.insert({parameter.table(), parameter.address()}).second) << parameter.name();
  }
  EXPECT_EQ(all_parameters().size(), firmware::slot_count);
}

TEST(Parameter, AxisOneIsTheDictionarysOffsetAway) {
  const auto first = Parameter::of<"wall.stiffness">(0), second = Parameter::of<"wall.stiffness">(1);
  EXPECT_EQ(second.address() - first.address(), firmware::axis_modbus_offset);
  EXPECT_EQ(second.index() - first.index(), firmware::axis_index_offset);
  EXPECT_EQ(Parameter::of<"link.timeout">(1), Parameter::of<"link.timeout">(0));
}

TEST(OwnerOfHoldingRegister, FindsBothWordsOfAValueAndNothingBetween) {
  const auto stiffness = Parameter::of<"wall.stiffness">(1);
  EXPECT_EQ(owner_of_holding_register(stiffness.address()), stiffness);
  EXPECT_EQ(owner_of_holding_register(static_cast<std::uint16_t>(stiffness.address() + 1)), stiffness);
  EXPECT_EQ(owner_of_holding_register(0xFFFF), std::nullopt);
}

}  // namespace kmax::device::parameter_test
