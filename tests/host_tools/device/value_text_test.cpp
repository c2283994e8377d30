#include "host_tools/device/value_text.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/base/errors.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::value_text_test {

using host_tools_test::thrown_message;

float parse_float(const Parameter& parameter, std::string_view text) {
  return std::bit_cast<float>(parse_value(parameter, text));
}
std::string complaint(const Parameter& parameter, std::string_view text) {
  return thrown_message<base::ValueError>([&] { parse_value(parameter, text); });
}

constexpr Parameter stiffness = Parameter::of<"wall.stiffness">();
constexpr Parameter position = Parameter::of<"wall.position">();
constexpr Parameter window = Parameter::of<"velocity.window">();
constexpr Parameter law = Parameter::of<"wall.law">();
constexpr Parameter side = Parameter::of<"wall.side">();
constexpr Parameter offset = Parameter::of<"encoder.offset">();

TEST(ParseValue, NumbersWithAndWithoutUnits) {
  EXPECT_EQ(parse_float(stiffness, "3580"), 3580.0f);
  EXPECT_EQ(parse_float(stiffness, "3.58N/mm"), 3580.0f);
  EXPECT_EQ(parse_float(stiffness, " 3.58 N/mm "), 3580.0f);
  EXPECT_EQ(parse_float(stiffness, "+3.58e3"), 3580.0f);
  EXPECT_EQ(parse_float(stiffness, ".5"), 0.5f);
  EXPECT_EQ(parse_float(stiffness, "5."), 5.0f);
  EXPECT_EQ(parse_float(position, "-1mm"), -0.001f);
  EXPECT_EQ(parse_value(Parameter::of<"haptic.rate">(), "0.5kHz"), std::bit_cast<std::uint32_t>(500.0f));
}

TEST(ParseValue, TheMessageHasNameValueUnitAndRange) {
  EXPECT_EQ(complaint(stiffness, "2e6"),
            "wall.stiffness: 2e6 N/m is above the largest allowed value 1e6 N/m (0 .. 1e6)");
  EXPECT_EQ(complaint(stiffness, "-1"),
            "wall.stiffness: -1 N/m is below the smallest allowed value 0 N/m (0 .. 1e6)");
  EXPECT_EQ(complaint(stiffness, "2000 N/mm"),
            "wall.stiffness: 2000 N/mm is above the largest allowed value 1e6 N/m (0 .. 1e6)");
  EXPECT_CONTAINS(complaint(Parameter::of<"wall.stiffness">(1), "-1"), "axis1.wall.stiffness");
  EXPECT_CONTAINS(complaint(stiffness, "1kg"), "'kg' is not one of its units N/m, N/mm");
  EXPECT_CONTAINS(complaint(window, "8 furlongs"), "'furlongs'");
}

TEST(ParseValue, WhatIsNotANumberIsRefused) {
  for (const char* text : {"",    " ",   "nan", "NaN",   "-nan", "inf", "-inf",  "infinity", "1e", "1e+",
                           "--1", "+-1", "-+1", "1.2.3", "0x10", "1,5", "1_000", "e5",       ".",  "-",
                           "+",   "N/m", "1 1", "1;",    "true", "1\n", "1\t2",  "1e5e"}) {
    EXPECT_NE(complaint(stiffness, text), "") << text;
    EXPECT_NE(complaint(window, text), "") << text;
    EXPECT_NE(complaint(law, text), "") << text;
  }
}

TEST(ParseValue, WhatNoFloatHoldsIsRefused) {
  for (const char* text : {"1e39", "-1e39", "3.5e38", "1e308", "1e309", "1e999999"}) {
    EXPECT_NE(complaint(stiffness, text), "") << text;
    EXPECT_NE(complaint(offset, text), "") << text;
  }
}

TEST(ParseValue, MinusZeroIsZero) {
  EXPECT_EQ(parse_value(position, "-0"), 0u);
}

TEST(ParseValue, ABoundIsAllowedHoweverItRounds) {
  EXPECT_EQ(parse_float(Parameter::of<"wall.magnetic_length">(), "1e-6"), 1e-6f);
  EXPECT_EQ(parse_float(Parameter::of<"wall.magnetic_length">(), "1um"), 1e-6f);
  EXPECT_EQ(parse_float(Parameter::of<"device.mass">(), "0.1g"), 1e-4f);
  EXPECT_NE(complaint(Parameter::of<"wall.magnetic_length">(), "0.99e-6"), "");
}

TEST(ParseValue, WholeNumbers) {
  EXPECT_EQ(parse_value(window, "16"), 16u);
  EXPECT_EQ(parse_value(window, "8 samples"), 8u);
  EXPECT_EQ(parse_value(offset, "-2147483648"), 0x80000000u);
  EXPECT_EQ(parse_value(offset, "2147483647"), 0x7FFFFFFFu);
  EXPECT_NE(complaint(offset, "2147483648"), "");
  EXPECT_NE(complaint(offset, "-2147483649"), "");
  EXPECT_CONTAINS(complaint(window, "8.5"), "not a whole number");
  EXPECT_EQ(complaint(window, "17"),
            "velocity.window: 17 samples is above the largest allowed value 16 samples (1 .. 16)");
  EXPECT_NE(complaint(window, "0"), "");
  EXPECT_NE(complaint(window, "-1"), "");
  EXPECT_NE(complaint(window, "256"), "");  // 0 in its 8 bits
  EXPECT_NE(complaint(window, "4294967297"), "");
}

TEST(ParseValue, ChoicesByNameOrNumber) {
  EXPECT_EQ(parse_value(law, "magnetic"), parse_value(law, "2"));
  EXPECT_EQ(parse_value(side, "-1"), 0xFFFFFFFFu);
  EXPECT_EQ(parse_value(side, "+1"), 1u);
  EXPECT_EQ(parse_value(side, "1"), 1u);
  EXPECT_EQ(parse_value(Parameter::of<"can.bit_rate">(), "500 kbit/s"), 500000u);
  EXPECT_EQ(complaint(law, "magnetik"),
            "wall.law: 'magnetik' is not one of none, plain, magnetic, adaptive; did you mean magnetic?");
  EXPECT_NE(complaint(law, "4"), "");
  EXPECT_NE(complaint(law, "1.5"), "");
  EXPECT_NE(complaint(side, "0"), "");
  EXPECT_NE(complaint(law, "Plain"), "");
}

TEST(ParseAssignments, RefusesWhatCannotBeSet) {
  const auto refusal = [](std::vector<std::string> texts) {
    return thrown_message<base::ValueError>([&] { parse_assignments(texts); });
  };
  EXPECT_CONTAINS(refusal({"wall.stiffness"}), "NAME=VALUE");
  EXPECT_CONTAINS(refusal({"wall.stiffness="}), "missing");
  EXPECT_CONTAINS(refusal({"measured.force=1"}), "only be read");
  EXPECT_CONTAINS(refusal({"drive.controlword=6"}), "kmax arm");
  EXPECT_CONTAINS(refusal({"transaction.control=1"}), "kmax set");
  EXPECT_CONTAINS(refusal({"wall.stiffness=1", "axis0.wall.stiffness=2"}), "twice");
  EXPECT_CONTAINS(refusal({"=1"}), "no parameter");
}

TEST(ParseAssignments, TakesTheDefaultAxis) {
  const auto all = parse_assignments({"wall.stiffness=1", "axis0.wall.stiffness = 2", "link.timeout=3"}, 1);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].parameter, Parameter::of<"wall.stiffness">(1));
  EXPECT_EQ(all[1].parameter, Parameter::of<"wall.stiffness">(0));
  EXPECT_EQ(all[2].parameter, Parameter::of<"link.timeout">());
}

TEST(ParseAssignments, AWallIsPutWhereTheHandleIs) {
  int asked = 0;
  const HandlePosition here = [&](std::size_t axis) {
    ++asked;
    return axis == 1 ? 0.25 : -0.5;
  };
  const auto metres = [&](const std::string& text) {
    return std::bit_cast<float>(parse_assignments({text}, 0, here).front().raw);
  };
  EXPECT_EQ(metres("wall.position=here"), -0.5f);
  EXPECT_EQ(metres("axis1.wall.position = here + 5 mm"), 0.255f);
  EXPECT_EQ(metres("wall.position=here-0.005"), -0.505f);
  EXPECT_EQ(asked, 3);
  parse_assignments({"wall.position=0.1", "wall.stiffness=1"}, 0, here);
  EXPECT_EQ(asked, 3) << "nobody needs it";
  const auto refused = [&](const std::string& text, const HandlePosition& known) {
    return thrown_message<base::ValueError>([&] { parse_assignments({text}, 0, known); });
  };
  EXPECT_CONTAINS(refused("wall.position=here", {}), "needs a device");
  EXPECT_CONTAINS(refused("wall.position=here5mm", here), "write here, here+5mm or here-5mm");
  EXPECT_CONTAINS(refused("wall.position=here+", here), "'+' is not a number");
  EXPECT_CONTAINS(refused("wall.position=here+-5mm", here), "is not a number");
  EXPECT_CONTAINS(refused("wall.position=here+5kg", here), "'kg' is not one of its units");
  EXPECT_CONTAINS(refused("wall.stiffness=here", here), "only wall.position");
  EXPECT_CONTAINS(refused("wall.position=here+5000", here), "here+5000 = 4999.5 m is above the largest");
}

TEST(ValueText, UnknownNumbersOfAChoiceAreShownAsNumbers) {
  EXPECT_EQ(value_text(law, 77), "77");
}

// Whatever the device may hold, its text gives it back.
RC_GTEST_PROP(ValueText, EveryAllowedValueComesBack, (std::uint32_t pattern)) {
  const Parameter& parameter = all_parameters()[*rc::gen::inRange<std::size_t>(0, all_parameters().size())];
  const auto& descriptor = firmware::descriptors[parameter.entry()];
  std::uint32_t raw = pattern;
  const auto& values = parameter.definition().values;
  if (!values.empty()) raw = static_cast<std::uint32_t>(values[pattern % values.size()].value);
  if (firmware::check_value(descriptor, raw) != firmware::Refusal::none) raw = parameter.default_raw();
  RC_ASSERT(same_value(parameter, parse_value(parameter, value_text(parameter, raw)), raw));
  RC_ASSERT(same_value(parameter, parse_value(parameter, value_with_unit(parameter, raw)), raw));
}

// Floats over all magnitudes, most of them out of range: host and device agree which.
RC_GTEST_PROP(ParseValue, AgreesWithTheDeviceOnEveryFloat, (std::uint32_t pattern)) {
  const auto value = std::bit_cast<float>(pattern);
  RC_PRE(std::isfinite(value));
  const bool allowed =
      firmware::check_value(firmware::descriptors[position.entry()], pattern) == firmware::Refusal::none;
  std::string text(64, '\0');
  text.resize(
      static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.9g", static_cast<double>(value))));
  bool accepted = true;
  std::uint32_t raw = 0;
  try {
    raw = parse_value(position, text);
  } catch (const base::ValueError&) {
    accepted = false;
  }
  RC_ASSERT(accepted == allowed);
  if (accepted) RC_ASSERT(same_value(position, raw, pattern));
}

}  // namespace kmax::device::value_text_test
