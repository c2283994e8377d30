#include "host_tools/kmax/parameters/parameter_table.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <sstream>

namespace kmax::cli::parameter_table_test {

using device::Parameter;

std::vector<std::string> table_of(std::span<const ParameterRow> rows,
                                  std::optional<base::TerminalSize> terminal, bool whole_texts) {
  std::ostringstream out;
  print_parameter_table(out, rows, terminal, whole_texts);
  std::istringstream in(out.str());
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<ParameterRow> everything() {
  std::vector<ParameterRow> rows;
  for (const Parameter& parameter : device::all_parameters())
    rows.push_back({parameter, parameter.default_raw()});
  return rows;
}

TEST(ParameterTable, FitsIntoTheTerminal) {
  for (const std::size_t columns : {60u, 80u, 119u, 120u, 200u}) {
    for (const bool whole_texts : {false, true}) {
      for (const std::string& line :
           table_of(everything(), base::TerminalSize{.columns = columns}, whole_texts)) {
        EXPECT_LE(line.size(), columns) << line;
        EXPECT_FALSE(line.ends_with(' ')) << line;
      }
    }
  }
}

TEST(ParameterTable, OneLineForEachAndAHeading) {
  for (const auto terminal :
       {std::optional<base::TerminalSize>{}, std::optional<base::TerminalSize>{base::TerminalSize{}}})
    EXPECT_EQ(table_of(everything(), terminal, false).size(), firmware::slot_count + 1);
}

// A table that is searched by grep must not lose what it is searched for.
TEST(ParameterTable, ElsewhereThanOnATerminalNothingIsCut) {
  const auto rows = everything();
  const auto lines = table_of(rows, std::nullopt, false);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_TRUE(lines[i + 1].ends_with(rows[i].parameter.definition().help)) << lines[i + 1];
    if (!rows[i].parameter.writable()) continue;
    for (const auto& value : rows[i].parameter.definition().values)
      EXPECT_NE(lines[i + 1].find(value.name), std::string::npos) << lines[i + 1];
  }
}

TEST(ParameterTable, EveryValueIsWholeAtEightyColumns) {
  const ParameterRow rows[] = {
      {Parameter::of<"wall.adaptive_velocity_max">(1), std::bit_cast<std::uint32_t>(-1.234567e-5f)}};
  EXPECT_NE(table_of(rows, base::TerminalSize{}, false)[1].find("*-1.234567e-5  m/s"), std::string::npos);
}

TEST(ParameterTable, MarksWhatIsNotTheDefault) {
  const ParameterRow rows[] = {{Parameter::of<"wall.stiffness">(), std::bit_cast<std::uint32_t>(5.0f)},
                               {Parameter::of<"wall.damping">(), 0},
                               {Parameter::of<"wall.position">(), std::bit_cast<std::uint32_t>(-0.0f)},
                               {Parameter::of<"measured.force">(), std::bit_cast<std::uint32_t>(1.0f)}};
  const auto lines = table_of(rows, std::nullopt, false);
  EXPECT_NE(lines[1].find("*5"), std::string::npos);
  for (const std::size_t unmarked : {2u, 3u, 4u})
    EXPECT_EQ(lines[unmarked].find('*'), std::string::npos) << lines[unmarked];
}

TEST(ParameterTable, WholeTextsLoseNoWord) {
  const ParameterRow rows[] = {{Parameter::of<"velocity.estimator">(), 0}};
  std::string all;
  for (const std::string& line : table_of(rows, base::TerminalSize{}, true))
    all += line.substr(std::min<std::size_t>(line.find_first_not_of(' '), line.size())) + " ";
  EXPECT_NE(all.find(rows[0].parameter.definition().help), std::string::npos) << all;
  EXPECT_NE(all.find("difference|low_pass|foaw|foaw_end_fit|tracking|edge_period"), std::string::npos) << all;
}

}  // namespace kmax::cli::parameter_table_test
