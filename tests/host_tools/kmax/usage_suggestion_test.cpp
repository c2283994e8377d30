#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::usage_suggestion_test {

using UsageSuggestion = SimulatedCommandLine;

TEST_F(UsageSuggestion, AMisspeltOptionGetsOne) {
  expect_error({"simulate", "touch", "--pictur", "a.svg"}, base::wrong_usage, "; did you mean --picture?");
  expect_error({"wall", "--positon=0"}, base::wrong_usage, "; did you mean --position?");
  expect_error({"experiment", "jitter", "--puhs", "1"}, base::wrong_usage, "; did you mean --push?");
  EXPECT_EQ(kmax({"simulate", "touch", "--bananas"}), base::wrong_usage);
  EXPECT_EQ(said.find("did you mean"), std::string::npos) << said;
}

TEST_F(UsageSuggestion, AMisspeltChoiceGetsOne) {
  expect_error({"capture", "--trigger", "contct"}, base::wrong_usage, "; did you mean contact?");
  expect_error({"experiment", "resolution", "--rounding", "nearst"}, base::wrong_usage,
               "; did you mean nearest?");
  EXPECT_EQ(kmax({"experiment", "resolution", "--rounding", "bananas"}), base::wrong_usage);
  EXPECT_EQ(said.find("did you mean"), std::string::npos) << said;
}

TEST_F(UsageSuggestion, AnOptionBeforeItsCommandIsToldItsPlace) {
  expect_error({"--axis", "0", "get", "wall.law"}, base::wrong_usage,
               "--axis stands behind its command: 'kmax get --axis ...'");
  expect_error({"--axis=0", "get"}, base::wrong_usage, "'kmax get --axis ...'");
  expect_error({"--trials", "1", "experiment", "contact"}, base::wrong_usage,
               "'kmax experiment contact --trials ...'");
  EXPECT_EQ(kmax({"--device", "sim", "get", "wall.law", "--axis", "0"}), base::done) << said;
}

}  // namespace kmax::cli::usage_suggestion_test
