#include "board/odrive_v3/voltage_variant.hpp"

#include <gtest/gtest.h>

#include <array>

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::board::odrive_v3::voltage_variant_test {
namespace {

class Otp {
 public:
  Otp() { bytes_.fill(0xFF); }
  Otp& record(std::size_t index, std::uint8_t magic, std::uint8_t major, std::uint8_t voltage,
              std::uint8_t minor = 6) {
    bytes_[16 * index] = magic;
    bytes_[16 * index + 3] = major;
    bytes_[16 * index + 4] = minor;
    bytes_[16 * index + 5] = voltage;
    return *this;
  }
  std::optional<VoltageVariant> variant() const {
    return voltage_variant_from_otp([this](std::size_t i) { return bytes_.at(i); });
  }
  bool boot_loader_is_safe() const {
    return odrive_v3::boot_loader_is_safe([this](std::size_t i) { return bytes_.at(i); });
  }

 private:
  std::array<std::uint8_t, drivers::stm32f4::otp_bytes> bytes_{};
};

TEST(VoltageVariant, BlankAreaSaysNothing) {
  EXPECT_EQ(Otp().variant(), std::nullopt);
}

TEST(VoltageVariant, ReadsTheMakersRecord) {
  EXPECT_EQ(Otp().record(0, 0xFE, 3, 24).variant(), VoltageVariant::v24);
  EXPECT_EQ(Otp().record(0, 0xFE, 3, 48).variant(), VoltageVariant::v56);
  EXPECT_EQ(Otp().record(0, 0xFE, 3, 56).variant(), VoltageVariant::v56);
}

TEST(VoltageVariant, AVoidRecordIsFollowedByTheNext) {
  EXPECT_EQ(Otp().record(0, 0x00, 3, 24).record(1, 0xFE, 3, 56).variant(), VoltageVariant::v56);
  EXPECT_EQ(Otp().record(0, 0x00, 3, 24).variant(), std::nullopt);
  Otp all_void;
  for (std::size_t i = 0; i < 32; ++i) all_void.record(i, 0x00, 3, 24);
  EXPECT_EQ(all_void.variant(), std::nullopt) << "and the search ends with the area";
}

TEST(VoltageVariant, WhatIsNotUnderstoodIsNotGuessed) {
  EXPECT_EQ(Otp().record(0, 0xFE, 4, 24).variant(), std::nullopt);
  EXPECT_EQ(Otp().record(0, 0xFE, 3, 12).variant(), std::nullopt);
  EXPECT_EQ(Otp().record(0, 0x7E, 3, 24).variant(), std::nullopt);
}

TEST(BootLoader, IsNotEnteredBefore3Point5) {
  for (const std::uint8_t minor : std::to_array<std::uint8_t>({0, 1, 3, 4}))
    EXPECT_FALSE(Otp().record(0, 0xFE, 3, 24, minor).boot_loader_is_safe()) << int{minor};
  for (const std::uint8_t minor : std::to_array<std::uint8_t>({5, 6, 7}))
    EXPECT_TRUE(Otp().record(0, 0xFE, 3, 24, minor).boot_loader_is_safe()) << int{minor};
  EXPECT_FALSE(Otp().record(0, 0x00, 3, 24, 6).record(1, 0xFE, 3, 24, 4).boot_loader_is_safe());
  EXPECT_TRUE(Otp().boot_loader_is_safe()) << "blank: the v3.6 of the build";
  EXPECT_FALSE(Otp().record(0, 0x7E, 3, 24).boot_loader_is_safe()) << "damaged";
  EXPECT_FALSE(Otp().record(0, 0xFE, 4, 24).boot_loader_is_safe()) << "another board";
}

TEST(VoltageVariant, BlankBoardsGetTheDividerThatReadsHigh) {
  EXPECT_EQ(variant_of_blank_board, VoltageVariant::v56);
  EXPECT_FLOAT_EQ(supply_divider_ratio(VoltageVariant::v24), 11.0f);
  EXPECT_FLOAT_EQ(supply_divider_ratio(VoltageVariant::v56), 19.0f);
}

}  // namespace
TEST(VoltageVariant, TheCeilingIsWhereTheVendorTripsAndBelowTheWeakestPart) {
  EXPECT_NEAR(supply_ceiling(VoltageVariant::v24), 25.68f, 1e-4f);
  EXPECT_NEAR(supply_ceiling(VoltageVariant::v56), 58.0f, 1e-4f) << "its MOSFETs bear 60 V";
  for (const VoltageVariant variant : {VoltageVariant::v24, VoltageVariant::v56}) {
    EXPECT_GE(supply_ceiling(variant), 1.03f * part_ratings(variant).supply) << "a supply's tolerance";
    EXPECT_GE(supply_ceiling(variant), firmware::ParameterValues{}.real<"supply.voltage_max">())
        << "no board refuses the default";
    EXPECT_EQ(variant_with_divider(static_cast<double>(supply_divider_ratio(variant))), variant);
  }
  EXPECT_EQ(variant_with_divider(15.0), std::nullopt);
}

}  // namespace kmax::board::odrive_v3::voltage_variant_test
