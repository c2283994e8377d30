#include "host_tools/json/value_json.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>

namespace kmax::json::value_json_test {

using device::Parameter;

constexpr Parameter position = Parameter::of<"wall.position">();

std::string text_of(float value) {
  return value_json(position, std::bit_cast<std::uint32_t>(value)).dump();
}

TEST(ValueJson, CountersKeepAllTheirBits) {
  EXPECT_EQ(value_json(Parameter::of<"info.tick">(), 0xFFFFFFFFu).dump(), "4294967295");
  EXPECT_EQ(value_json(Parameter::of<"encoder.offset">(), 0x80000000u).dump(), "-2147483648");
}

TEST(ValueJson, ChoicesAreTheirNames) {
  EXPECT_EQ(value_json(Parameter::of<"wall.law">(), 3).dump(), "\"adaptive\"");
  EXPECT_EQ(value_json(Parameter::of<"wall.side">(), 0xFFFFFFFFu).dump(), "\"-1\"");
}

// JSON has no NaN; a document with one would be no document.
TEST(ValueJson, WhatIsNoNumberIsNull) {
  EXPECT_EQ(text_of(std::nanf("")), "null");
}

}  // namespace kmax::json::value_json_test
