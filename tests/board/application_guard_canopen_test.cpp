// The stability guard as a host on the CAN bus sees it: the same numbers, the same refusals.
#include <gtest/gtest.h>

#include <bit>

#include "firmware/canopen/abort_code.hpp"
#include "firmware/drive/stability_guard.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::application_guard_canopen_test {
namespace {

using firmware::canopen::Abort;

class GuardOnCan : public testing::Test, public CanOpenHost {
 protected:
  GuardOnCan() {
    bench.set_up_plain_wall();
    bench.device.stand_at(1000);
    bench.preset("current.bandwidth", 4000);
    bench.preset("guard.damping", 1.23);
    bench.preset("guard.friction", 1);
    bench.preset("guard.mode", 2);
    bench.preset("wall.stiffness_ceiling", 1e6);  // room for the guard to refuse in
    run_ms(5);
  }
  std::uint32_t write_real(std::uint16_t index, std::uint8_t subindex, float value) {
    return write(index, subindex, std::bit_cast<std::uint32_t>(value), 4);
  }
  float read_real(std::uint16_t index, std::uint8_t subindex) {
    return std::bit_cast<float>(read(index, subindex));
  }
  bool arm() {
    command(0);
    command(6);
    command(15);
    run_ms(2);
    return armed();
  }
  static constexpr std::uint16_t wall = 0x2000, guard = 0x2007, drive_status = 0x2011, finding = 0x201A,
                                 refusal = 0x5813;
  static constexpr std::uint8_t stiffness = 4;
};

TEST_F(GuardOnCan, RefusesToArmWithTheNumbersInObjectsAndArmsWhenItIsMended) {
  EXPECT_EQ(write_real(wall, stiffness, 5500.0f), 0U);
  EXPECT_EQ(read(finding, 1), 2U) << "at once, whether or not the settings have been taken over";
  EXPECT_FALSE(arm());
  EXPECT_EQ(read(drive_status, 3), 31U);
  EXPECT_EQ(read(finding, 2), 1U);
  EXPECT_EQ(read(finding, 3), 0U);
  EXPECT_EQ(read_real(finding, 4), 5500.0f);
  EXPECT_NEAR(read_real(finding, 5), 4000.0f, 0.01f);
  EXPECT_EQ(write_real(guard, 2, 1.8f), 0U);
  EXPECT_EQ(read(finding, 1), 1U);
  EXPECT_TRUE(arm());
  EXPECT_EQ(read(drive_status, 3), 0U);
}

TEST_F(GuardOnCan, RefusesATransferThatWouldBreakACriterionOfAnArmedAxis) {
  ASSERT_TRUE(arm());
  EXPECT_EQ(write_real(wall, stiffness, 4001.0f), static_cast<std::uint32_t>(Abort::incompatible));
  EXPECT_EQ(read(refusal, 1), 31U);
  EXPECT_EQ(read(refusal, 2), firmware::address_of("wall.stiffness"));
  EXPECT_EQ(read_real(wall, stiffness), 1000.0f);
  EXPECT_EQ(write_real(guard, 6, 0.01f), static_cast<std::uint32_t>(Abort::incompatible));
  EXPECT_EQ(write(guard, 1, 0, 1), static_cast<std::uint32_t>(Abort::device_state)) << "guard.mode";
  EXPECT_TRUE(armed());
  EXPECT_EQ(write_real(wall, stiffness, 3999.0f), 0U);
  EXPECT_TRUE(armed());
}

TEST_F(GuardOnCan, RefusesAPdoThatWouldBreakACriterionOfAnArmedAxis) {
  EXPECT_EQ(write(0x1401, 1, 0x80000000U | 0x301, 4), 0U);
  EXPECT_EQ(write(0x1601, 0, 0, 1), 0U);
  EXPECT_EQ(write(0x1601, 1, std::uint32_t{wall} << 16 | std::uint32_t{stiffness} << 8 | 32U, 4), 0U);
  EXPECT_EQ(write(0x1601, 0, 1, 1), 0U);
  EXPECT_EQ(write(0x1401, 2, 255, 1), 0U);
  EXPECT_EQ(write(0x1401, 1, 0x301, 4), 0U);
  nmt(1);
  ASSERT_TRUE(arm());
  const auto send_stiffness = [&](float value) {
    const auto raw = std::bit_cast<std::uint32_t>(value);
    send({.identifier = 0x301,
          .length = 4,
          .data = {static_cast<std::uint8_t>(raw), static_cast<std::uint8_t>(raw >> 8),
                   static_cast<std::uint8_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 24)}},
         5);
  };
  send_stiffness(3500.0f);
  EXPECT_EQ(read_real(wall, stiffness), 3500.0f) << "the PDO arrives";
  const double refused = bench.get("can.rpdo_refused");
  send_stiffness(5500.0f);
  EXPECT_EQ(read_real(wall, stiffness), 3500.0f);
  EXPECT_EQ(bench.get("can.rpdo_refused"), refused + 1);
  EXPECT_EQ(read(refusal, 1), 31U);
  EXPECT_TRUE(armed());
}

TEST_F(GuardOnCan, AWarningIsBit7OfTheStatusword) {
  EXPECT_EQ(write(guard, 1, 1, 1), 0U);
  EXPECT_EQ(read(0x6041, 0) & 0x80U, 0U);
  EXPECT_EQ(write_real(wall, stiffness, 5500.0f), 0U);
  EXPECT_EQ(read(0x6041, 0) & 0x80U, 0x80U);
  ASSERT_TRUE(arm());
  EXPECT_EQ(read(0x6041, 0) & 0x80U, 0x80U);
  EXPECT_EQ(write_real(wall, stiffness, 1000.0f), 0U);
  EXPECT_EQ(read(0x6041, 0) & 0x80U, 0U);
}

}  // namespace
}  // namespace kmax::board::application_guard_canopen_test
