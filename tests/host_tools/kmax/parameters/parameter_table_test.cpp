#include "host_tools/kmax/parameters/parameter_table.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <sstream>

namespace kmax::cli::parameter_table_test {

using device::Parameter;

std::vector<std::string> lines_of(std::span<const ParameterRow> rows, bool whole_texts) {
  std::ostringstream out;
  print_parameter_table(out, rows, whole_texts);
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
  for (const bool whole_texts : {false, true}) {
    for (const std::string& line : lines_of(everything(), whole_texts)) {
      EXPECT_LE(line.size(), 120u) << line;
      EXPECT_FALSE(line.ends_with(' ')) << line;
    }
  }
}

TEST(ParameterTable, OneLineForEachAndAHeading) {
  EXPECT_EQ(lines_of(everything(), false).size(), firmware::slot_count + 1);
}

TEST(ParameterTable, MarksWhatIsNotTheDefault) {
  const ParameterRow rows[] = {{Parameter::of<"wall.stiffness">(), std::bit_cast<std::uint32_t>(5.0f)},
                               {Parameter::of<"wall.damping">(), 0},
                               {Parameter::of<"wall.position">(), std::bit_cast<std::uint32_t>(-0.0f)},
                               {Parameter::of<"measured.force">(), std::bit_cast<std::uint32_t>(1.0f)}};
  const auto lines = lines_of(rows, false);
  EXPECT_NE(lines[1].find("*5"), std::string::npos);
  for (const std::size_t unmarked : {2u, 3u, 4u})
    EXPECT_EQ(lines[unmarked].find('*'), std::string::npos) << lines[unmarked];
}

TEST(ParameterTable, WholeTextsLoseNoWord) {
  const ParameterRow rows[] = {{Parameter::of<"velocity.estimator">(), 0}};
  std::string all;
  for (const std::string& line : lines_of(rows, true))
    all += line.substr(std::min<std::size_t>(line.find_first_not_of(' '), line.size())) + " ";
  EXPECT_NE(all.find(rows[0].parameter.definition().help), std::string::npos) << all;
  EXPECT_NE(all.find("difference|low_pass|foaw|foaw_end_fit|tracking"), std::string::npos) << all;
}

}  // namespace kmax::cli::parameter_table_test
