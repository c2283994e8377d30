#include "host_tools/base/numbers.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <fmt/format.h>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/base/errors.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::base::numbers_test {

TEST(NumberText, IsShortAndPlainWherePeopleReadIt) {
  EXPECT_EQ(number_text(2.4f), "2.4");
  EXPECT_EQ(number_text(3580.0f), "3580");
  EXPECT_EQ(number_text(0.0001f), "0.0001");
  EXPECT_EQ(number_text(1e-6f), "1e-6");
  EXPECT_EQ(number_text(1e6), "1e6");
  EXPECT_EQ(number_text(1234567.0), "1234567");
  EXPECT_EQ(number_text(999999.0), "999999");
  EXPECT_EQ(number_text(-2.5e-7), "-2.5e-7");
  EXPECT_EQ(number_text(1e100), "1e100");
  EXPECT_EQ(number_text(0.0), "0");
  EXPECT_EQ(number_text(-0.0), "0");
}

TEST(NumberText, CannotBreakOnWhatADeviceMaySend) {
  EXPECT_EQ(number_text(std::numeric_limits<float>::infinity()), "inf");
  EXPECT_EQ(number_text(-std::numeric_limits<float>::infinity()), "-inf");
  EXPECT_EQ(number_text(std::numeric_limits<float>::quiet_NaN()), "nan");
  EXPECT_EQ(number_text(std::numeric_limits<double>::denorm_min()), "5e-324");
  EXPECT_FALSE(number_text(std::numeric_limits<double>::max()).empty());
}

TEST(ShortestDouble, HasTheTextOfTheFloat) {
  EXPECT_EQ(shortest_double(2.4f), 2.4);
  EXPECT_EQ(shortest_double(0.1f), 0.1);
  EXPECT_EQ(shortest_double(std::numeric_limits<float>::max()), 3.4028235e38);
}

RC_GTEST_PROP(NumberText, EveryFiniteFloatComesBack, (std::uint32_t pattern)) {
  const auto value = std::bit_cast<float>(pattern);
  RC_PRE(std::isfinite(value));
  RC_ASSERT(std::strtof(number_text(value).c_str(), nullptr) == value);
  RC_ASSERT(static_cast<float>(shortest_double(value)) == value);
}

RC_GTEST_PROP(NumberText, EveryFiniteDoubleComesBack, (std::uint64_t pattern)) {
  const auto value = std::bit_cast<double>(pattern);
  RC_PRE(std::isfinite(value));
  RC_ASSERT(std::strtod(number_text(value).c_str(), nullptr) == value);
}

double convert(double number, std::string_view suffix, std::string_view unit) {
  const auto scale = scale_from(suffix, unit);
  EXPECT_TRUE(scale.has_value()) << suffix << " of " << unit;
  return scale ? scale->to_si(number) : 0;
}

TEST(Unit, ConvertsToTheNearestDouble) {
  EXPECT_EQ(convert(3.58, "N/mm", "N/m"), 3580.0);
  EXPECT_EQ(convert(1, "mm", "m"), 0.001);
  EXPECT_EQ(convert(55, "um", "m"), 55e-6);
  EXPECT_EQ(convert(2400, "mm/s", "m/s"), 2.4);
  EXPECT_EQ(convert(0.5, "kHz", "Hz"), 500.0);
  EXPECT_EQ(convert(45, "g", "kg"), 0.045);
  EXPECT_EQ(convert(1, "Mbit/s", "bit/s"), 1e6);
}

TEST(Unit, SpacingDoesNotMatterCaseDoes) {
  EXPECT_EQ(convert(2, "Ns/m", "N s/m"), 2.0);
  EXPECT_EQ(convert(2, "N·s/m", "N s/m"), 2.0);
  EXPECT_EQ(convert(2, "N*s/m", "N s/m"), 2.0);
  EXPECT_EQ(convert(2, "Nm/A", "N m/A"), 2.0);
  EXPECT_FALSE(scale_from("MN", "N").has_value());
  EXPECT_FALSE(scale_from("n", "N").has_value());
}

TEST(Unit, AnotherQuantityIsRefused) {
  EXPECT_FALSE(scale_from("N", "N/m").has_value());
  EXPECT_FALSE(scale_from("mm", "m/s").has_value());
  EXPECT_FALSE(scale_from("m", "").has_value());
  EXPECT_TRUE(scale_from("", "").has_value());
}

TEST(Unit, EveryUnitOfTheDictionaryIsItsOwnSuffix) {
  for (std::size_t i = 0; i < firmware::entry_count; ++i) {
    const auto unit = firmware::entry_at(i).unit;
    EXPECT_EQ(convert(1, unit, unit), 1.0) << unit;
    for (const std::string& suffix : suffixes_of(unit)) EXPECT_GT(convert(1, suffix, unit), 0.0) << suffix;
  }
}

// A conversion to a unit that no parameter has could never be used: it would be a misspelt unit.
TEST(Unit, SuffixesStartWithTheUnitItself) {
  EXPECT_EQ(suffixes_of("N/m").front(), "N/m");
  EXPECT_GE(suffixes_of("m").size(), 4u);
  EXPECT_TRUE(suffixes_of("").empty());
}

TEST(WrittenNumber, HasTheUnitOrOneThatConverts) {
  const auto value = [](std::string_view text, std::string_view unit) {
    return written_number(text, unit, "a number", "0 .. 1").value;
  };
  EXPECT_EQ(value("0.5 N/mm", "N/m"), 500.0);
  EXPECT_EQ(value(" 60g ", "kg"), 0.06);
  EXPECT_EQ(value("-1e-3", "m"), -0.001);
  EXPECT_EQ(value("+.5", ""), 0.5);
  EXPECT_EQ(value("470uF", "F"), 470e-6);
  EXPECT_EQ(value("2 mN m", "N m"), 2e-3);
  EXPECT_EQ(written_number("0.5N/mm", "N/m", "", "").as_given, "0.5 N/mm");
  EXPECT_EQ(written_number("800", "N/m", "", "").as_given, "800 N/m");
}

TEST(WrittenNumber, AnythingElseIsRefused) {
  const auto refusal = [](std::string_view text, std::string_view unit) {
    return host_tools_test::thrown_message<ValueError>(
        [&] { written_number(text, unit, "a number", "0 .. 1 kg"); });
  };
  for (const char* text : {"", "heavy", "nan", "inf", "-inf", "+-1", "--1", "e5"})
    EXPECT_EQ(refusal(text, "kg"), fmt::format("'{}' is not a number", text));
  EXPECT_EQ(refusal("1e400", "kg"), "1e400 is not a number this program can hold; allowed is 0 .. 1 kg");
  EXPECT_EQ(refusal("5 N", "kg"),
            "'5 N': 'N' is not one of its units kg, g, mg; without a unit the number is in kg");
  EXPECT_EQ(refusal("5 N", ""), "'5 N': it has no unit, so nothing may follow the number");
}

}  // namespace kmax::base::numbers_test
