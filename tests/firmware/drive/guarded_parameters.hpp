#pragma once

#include <gtest/gtest.h>

#include <string_view>

#include "firmware/drive/stability_guard.hpp"
#include "tests/firmware/register_words.hpp"

namespace kmax::firmware {

inline unsigned bit(control::Criterion criterion) {
  return 1U << static_cast<unsigned>(criterion);
}

/// A plain wall on axis 0 that passes everything: 1000 N/m, 2 kHz, steps of 10 um, a well damped device.
/// T/2 + Td = 250 us + 250 us + 32.5 us.
class Guard : public testing::Test {
 protected:
  Guard() {
    set("guard.mode", 1);
    set("wall.law", 1);
    set("wall.stiffness", 1000);
    set("haptic.rate", 2000);
    set("current.bandwidth", 4000);
    set("encoder.counts_per_turn", 1'000'000);
    set("device.transmission", 1.5915494309189535);
    set("guard.damping", 5.325);
    set("guard.friction", 1);
  }

  void set(std::string_view name, double number, std::size_t axis = 0) {
    const std::size_t entry = entry_named(name);
    const std::uint32_t raw = raw_from_number(entry_at(entry).type, number);
    ASSERT_EQ(check_value(descriptors[entry], raw), Refusal::none) << name << " = " << number;
    values.set_raw(slot_of(entry, axis), raw);
  }
  GuardFinding finding(std::size_t axis = 0) const { return guard_finding(values, axis); }
  void expect_pass() const {
    EXPECT_EQ(finding().verdict, GuardFinding::Verdict::pass);
    EXPECT_EQ(finding().failed, 0);
  }
  void expect_fail(unsigned failed) const {
    EXPECT_EQ(finding().verdict, GuardFinding::Verdict::fail);
    EXPECT_EQ(finding().failed, failed);
  }

  ParameterValues values;
};

}  // namespace kmax::firmware
