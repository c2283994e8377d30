#include "firmware/canopen/pdo_settings.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::canopen::pdo_settings_test {
namespace {

struct Read {
  explicit Read(const ParameterValues& values, PdoKind kind = PdoKind::transmit, std::size_t pdo = 0) {
    good = read_pdo(kind, pdo, values, 5, settings);
  }
  bool good;
  PdoSettings settings;
};

TEST(PdoSettings, TheDefaultsAreAllUsable) {
  const ParameterValues values;
  for (std::size_t n = 0; n < rpdo_count; ++n) {
    const Read sent(values, PdoKind::transmit, n), received(values, PdoKind::receive, n);
    EXPECT_TRUE(sent.good && received.good) << n;
    EXPECT_TRUE(sent.settings.exists) << n;
    EXPECT_EQ(sent.settings.identifier, 0x185 + 0x100 * n);
    EXPECT_EQ(sent.settings.event_us, 10'000U);
    EXPECT_EQ(sent.settings.mapping.bytes(), 8);
    EXPECT_EQ(received.settings.exists, n < 2) << n;
    EXPECT_EQ(received.settings.identifier, n < 2 ? 0x205 + 0x100 * n : 0);
  }
  const Read states(values, PdoKind::transmit, 4);
  EXPECT_TRUE(states.good && states.settings.exists);
  EXPECT_EQ(states.settings.identifier, 0x505);
  EXPECT_EQ(states.settings.event_us, 0U);
  EXPECT_EQ(states.settings.inhibit_us, 20'000U);
  EXPECT_EQ(states.settings.mapping.bytes(), 6);
}

TEST(PdoSettings, TypesGoBySyncOrByTime) {
  for (std::uint32_t type = 0; type < 300; ++type) {
    EXPECT_EQ(transmission_type_allowed(type), type <= 240 || type == 254 || type == 255) << type;
    PdoSettings settings;
    settings.transmission_type = static_cast<std::uint8_t>(type);
    if (type < 256) {
      EXPECT_EQ(settings.synchronous(), type <= 240) << type;
    }
  }
}

TEST(PdoSettings, NothingGoesOftenerThanAMillisecondOfAMegabit) {
  EXPECT_EQ(least_period_us(1'000'000), 1'000U);
  EXPECT_EQ(least_period_us(2'000'000), 1'000U);
  EXPECT_EQ(least_period_us(500'000), 2'000U);
  EXPECT_EQ(least_period_us(125'000), 8'000U);
  EXPECT_EQ(least_period_us(1'000), 1'000'000U);
  EXPECT_EQ(least_period_us(0), 1'000'000U) << "no division by 0";
}

TEST(PdoSettings, TimesAreInMicroseconds) {
  ParameterValues values;
  values.set_whole<"tpdo1.inhibit_time">(65535);
  values.set_whole<"tpdo1.event_time">(65535);
  const Read read(values);
  EXPECT_EQ(read.settings.inhibit_us, 6'553'500U);
  EXPECT_EQ(read.settings.event_us, 65'535'000U);
}

TEST(PdoSettings, APdoThatBreaksTheRulesIsNotThere) {
  const auto broken = [](auto change) {
    ParameterValues values;
    change(values);
    const Read read(values);
    return !read.good && read.settings == PdoSettings{};
  };
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.transmission_type">(241); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.transmission_type">(253); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.cob_id">(0x601); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.cob_id">(1U << 29 | 0x200); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.cob_id">(0xA00); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.mapped_count">(0); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.mapped_count">(9); }));
  EXPECT_TRUE(broken([](auto& v) { v.template set_whole<"tpdo1.mapped_2">(0x12345678); }));
  EXPECT_FALSE(broken([](auto& v) { v.template set_whole<"tpdo1.mapped_3">(0x12345678); }));
}

TEST(PdoSettings, WhatDoesNotExistMayHoldAnything) {
  ParameterValues values;
  values.set_whole<"tpdo1.cob_id">(1U << 31);
  values.set_whole<"tpdo1.mapped_2">(0x12345678);
  values.set_whole<"tpdo1.transmission_type">(245);
  const Read read(values);
  EXPECT_TRUE(read.good);
  EXPECT_FALSE(read.settings.exists);
}

}  // namespace
}  // namespace kmax::firmware::canopen::pdo_settings_test
