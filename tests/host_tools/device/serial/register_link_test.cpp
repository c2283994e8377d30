#include "host_tools/device/serial/register_link.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "host_tools/device/parameter.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::register_link_test {

using device::all_parameters;
using device::Parameter;
using device::Table;

std::set<std::uint16_t> registers_of(const RegisterRange& range) {
  std::set<std::uint16_t> all;
  for (std::uint32_t i = 0; i < range.count; ++i) all.insert(static_cast<std::uint16_t>(range.address + i));
  return all;
}

std::vector<std::size_t> slots_of(std::span<const Parameter> parameters) {
  std::vector<std::size_t> slots;
  for (const Parameter& parameter : parameters) slots.push_back(parameter.slot());
  return slots;
}

TEST(RegisterPlan, OneRequestForEachRunOfRegisters) {
  std::set<std::pair<std::uint16_t, std::size_t>> groups;
  for (const Parameter& parameter : all_parameters())
    groups.insert({parameter.definition().group.index, parameter.axis()});
  EXPECT_LE(plan_registers(slots_of(all_parameters()), 125).size(), groups.size());
}

TEST(RegisterPlan, AValueIsNeverCutByTheLimit) {
  const Parameter two_words_each[] = {Parameter::of<"wall.stiffness">(), Parameter::of<"wall.damping">(),
                                      Parameter::of<"wall.magnetic_coefficient">()};
  const auto plan = plan_registers(slots_of(two_words_each), 5);
  ASSERT_EQ(plan.size(), 2u);
  EXPECT_EQ(plan[0].count, 4);
  EXPECT_EQ(plan[1].count, 2);
}

TEST(RegisterPlan, NothingPlansNothing) {
  EXPECT_TRUE(plan_registers({}, 125).empty());
}

TEST(RegisterPlan, TheTwoTablesAreKeptApart) {
  // Both begin at register 0 of their tables.
  const Parameter both[] = {Parameter::of<"drive.statusword">(), Parameter::of<"wall.law">()};
  ASSERT_EQ(both[0].address(), both[1].address());
  EXPECT_EQ(plan_registers(slots_of(both), 125).size(), 2u);
}

RC_GTEST_PROP(RegisterPlan, CoversWhatWasAskedAndNothingElse, ()) {
  const auto picks = *rc::gen::container<std::vector<std::size_t>>(
      rc::gen::inRange<std::size_t>(0, all_parameters().size()));
  const auto limit = *rc::gen::inRange<std::uint16_t>(2, 126);
  std::vector<Parameter> asked;
  std::set<std::pair<Table, std::uint16_t>> wanted, covered;
  for (const std::size_t pick : picks) {
    const Parameter& parameter = all_parameters()[pick];
    asked.push_back(parameter);
    for (int word = 0; word < parameter.words(); ++word)
      wanted.insert({parameter.table(), static_cast<std::uint16_t>(parameter.address() + word)});
  }
  std::vector<int> seen(asked.size());
  for (const RegisterRange& range : plan_registers(slots_of(asked), limit)) {
    RC_ASSERT(range.count <= limit);
    for (const std::uint16_t address : registers_of(range))
      RC_ASSERT(covered.insert({range.holding ? Table::holding : Table::input, address}).second);
    for (const std::size_t member : range.members) {
      ++seen[member];
      RC_ASSERT((asked[member].table() == Table::holding) == range.holding);
      RC_ASSERT(asked[member].address() >= range.address);
      RC_ASSERT(asked[member].address() + asked[member].words() <= range.address + range.count);
    }
  }
  RC_ASSERT(covered == wanted);
  RC_ASSERT(seen == std::vector<int>(asked.size(), 1));
}

TEST(RegisterRefused, AnotherLinksTransactionIsSaidInWords) {
  EXPECT_CONTAINS(std::string(RegisterRefused(6, 16, 0x10).what()), "another link has a transaction open");
}

}  // namespace kmax::device::register_link_test
