#include "firmware/parameters/parameter_values.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

namespace kmax::firmware::parameter_values_test {
namespace {

std::uint32_t bits(float value) {
  return std::bit_cast<std::uint32_t>(value);
}

TEST(ParameterValues, StartAsTheDefaultsOnBothAxes) {
  const ParameterValues values;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const Entry& entry = entry_at(owner_of(slot).entry);
    EXPECT_EQ(values.raw(slot), raw_from_number(entry.type, entry.default_value)) << entry.name;
  }
  EXPECT_EQ(values.real<"wall.stiffness">(1), 1000.0f);
  EXPECT_EQ(values.whole<"wall.side">(1), 1);
}

TEST(ParameterValues, AxesAndDeviceAreApart) {
  ParameterValues values;
  values.set_real<"wall.stiffness">(123.0f, 1);
  values.set_whole<"wall.side">(static_cast<std::uint32_t>(-1), 0);
  values.set_real<"link.timeout">(9.0f);
  EXPECT_EQ(values.real<"wall.stiffness">(0), 1000.0f);
  EXPECT_EQ(values.real<"wall.stiffness">(1), 123.0f);
  EXPECT_EQ(values.whole<"wall.side">(0), -1);
  EXPECT_EQ(values.whole<"wall.side">(1), 1);
  EXPECT_EQ(values.real<"link.timeout">(0), 9.0f);
}

TEST(CheckValue, EveryEntryTakesItsBoundsAndItsDefaultAndNothingBeyond) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    const SlotDescriptor& d = descriptors[i];
    const auto check = [&](double number) { return check_value(d, raw_from_number(e.type, number)); };
    EXPECT_EQ(check(e.default_value), Refusal::none) << e.name;
    if (!e.values.empty()) continue;
    EXPECT_EQ(check(e.minimum), Refusal::none) << e.name;
    EXPECT_EQ(check(e.maximum), Refusal::none) << e.name;
    if (e.type == Type::float32) {
      const auto low = static_cast<float>(e.minimum), high = static_cast<float>(e.maximum);
      const float infinity = std::numeric_limits<float>::infinity();
      const float below = std::nextafter(low, -infinity), above = std::nextafter(high, infinity);
      if (std::isfinite(below)) {
        EXPECT_EQ(check_value(d, bits(below)), Refusal::out_of_range) << e.name;
      }
      if (std::isfinite(above)) {
        EXPECT_EQ(check_value(d, bits(above)), Refusal::out_of_range) << e.name;
      }
      EXPECT_EQ(check_value(d, bits(infinity)), Refusal::not_finite) << e.name;
      EXPECT_EQ(check_value(d, bits(-infinity)), Refusal::not_finite) << e.name;
      for (const std::uint32_t nan : {0x7FC00000u, 0xFFC00000u, 0x7F800001u, 0xFFFFFFFFu, 0x7FFFFFFFu})
        EXPECT_EQ(check_value(d, nan), Refusal::not_finite) << e.name;
    } else {
      const bool is_signed =
          e.type == Type::integer32 || e.type == Type::integer16 || e.type == Type::integer8;
      const double least = is_signed ? -2147483648.0 : 0.0, most = is_signed ? 2147483647.0 : 4294967295.0;
      if (e.minimum > least) {
        EXPECT_EQ(check(e.minimum - 1), Refusal::out_of_range) << e.name;
      }
      if (e.maximum < most) {
        EXPECT_EQ(check(e.maximum + 1), Refusal::out_of_range) << e.name;
      }
      if (!is_signed && e.maximum < most) {
        EXPECT_EQ(check_value(d, 0xFFFFFFFFu), Refusal::out_of_range) << e.name;
      }
    }
  }
}

TEST(CheckValue, ChoicesAreTheListedOnesAndNothingBetween) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    if (e.values.empty()) continue;
    for (std::int32_t number = -300; number <= 300; ++number) {
      bool listed = false;
      for (const NamedValue& v : e.values) listed = listed || v.value == number;
      EXPECT_EQ(check_value(descriptors[i], static_cast<std::uint32_t>(number)),
                listed ? Refusal::none : Refusal::not_a_choice)
          << e.name << " = " << number;
    }
    for (const NamedValue& v : e.values) {
      EXPECT_EQ(check_value(descriptors[i], static_cast<std::uint32_t>(v.value)), Refusal::none) << e.name;
      EXPECT_EQ(check_value(descriptors[i], static_cast<std::uint32_t>(v.value) + 0x10000u),
                Refusal::not_a_choice);
    }
  }
}

// A pattern of 16 bits whose sign was not extended is another, far number.
TEST(CheckValue, SignedNumbersOf16BitsAreTakenWithTheirSignExtended) {
  const SlotDescriptor& target = descriptors[entry_of<"profile.target_torque">()];
  EXPECT_EQ(check_value(target, static_cast<std::uint32_t>(-32768)), Refusal::none);
  EXPECT_EQ(check_value(target, static_cast<std::uint32_t>(-1)), Refusal::none);
  EXPECT_EQ(check_value(target, 0x7FFF), Refusal::none);
  EXPECT_EQ(check_value(target, 0x8000), Refusal::out_of_range);
  EXPECT_EQ(check_value(target, 0xFFFF), Refusal::out_of_range);
  EXPECT_EQ(check_value(target, static_cast<std::uint32_t>(-32769)), Refusal::out_of_range);
}

RC_GTEST_PROP(CheckValue, AcceptsExactlyTheFiniteNumbersInRange, (std::uint32_t raw)) {
  const auto i = *rc::gen::inRange<std::size_t>(0, entry_count);
  const Entry& e = entry_at(i);
  const double number = number_from_raw(e.type, raw);
  bool allowed = std::isfinite(number);
  if (e.values.empty()) {
    // Bounds as float32 sees them.
    const auto bound = [&](double b) { return number_from_raw(e.type, raw_from_number(e.type, b)); };
    allowed = allowed && bound(e.minimum) <= number && number <= bound(e.maximum);
  } else {
    allowed = false;
    for (const NamedValue& v : e.values) allowed = allowed || static_cast<std::int32_t>(raw) == v.value;
  }
  RC_ASSERT((check_value(descriptors[i], raw) == Refusal::none) == allowed);
}

TEST(RegisterAddress, IsTheTables) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (std::size_t axis = 0; axis < axis_count; ++axis)
      EXPECT_EQ(register_address(i, axis), modbus_address(i, axis)) << entry_at(i).name;
  }
}

}  // namespace
}  // namespace kmax::firmware::parameter_values_test
