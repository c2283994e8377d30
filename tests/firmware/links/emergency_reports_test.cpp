#include "firmware/links/emergency_reports.hpp"

#include <gtest/gtest.h>

#include <map>
#include <optional>

namespace kmax::firmware::emergency_reports_test {
namespace {

using canopen::Emergency;
using Data = std::array<std::uint8_t, 8>;

class Reports : public testing::Test {
 protected:
  Reports() {
    emergency.configure(0x081, 0);
    causes.can_state = CanState::active;
    poll();
  }
  void poll(std::uint32_t us = 0) {
    now_us += us;
    reports.poll(causes, emergency, now_us);
  }
  /// The next frame's data.
  std::optional<Data> next() {
    drivers::CanFrame frame;
    return emergency.next_frame(frame, canopen::NmtState::operational, now_us) ? std::optional(frame.data)
                                                                               : std::nullopt;
  }

  EmergencyReports reports;
  Emergency emergency;
  EmergencyCauses causes;
  std::uint32_t now_us = 0xFFFF'0000;  // wraps soon
};

constexpr Data recovered{};

// CiA 301: the error register's bits by the group of the code; the source, then the number that tripped it.
TEST_F(Reports, AFaultIsReportedWithItsGroupItsAxisAndItsNumber) {
  const std::map<Fault, std::uint8_t> bits{
      {Fault::over_current, 0x03}, {Fault::current_sum, 0x03},      {Fault::under_voltage, 0x05},
      {Fault::phase_open, 0x05},   {Fault::over_temperature, 0x09}, {Fault::motor_too_hot, 0x09},
      {Fault::link_silent, 0x11},  {Fault::bus_off, 0x11},          {Fault::over_speed, 0x21},
      {Fault::encoder, 0x21},      {Fault::gate_driver, 0x21},      {Fault::main_loop, 0x21},
      {Fault::not_finite, 0x81},   {Fault::unstable_wall, 0x81}};
  for (std::uint8_t axis = 0; axis < axis_count; ++axis) {
    for (const auto& [fault, register_bits] : bits) {
      causes.faults[axis] = fault;
      causes.fault_values[axis] = 1.5f;  // 0x3FC0'0000
      poll();
      const std::uint16_t code = error_code_of(fault);
      EXPECT_EQ(next(), (Data{static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8),
                              register_bits, axis, 0x00, 0x00, 0xC0, 0x3F}))
          << text_of(fault).name;
      poll();
      EXPECT_FALSE(next()) << "reported once";
      causes.faults[axis] = Fault::none;
      poll();
      EXPECT_EQ(next(), recovered);
    }
  }
}

TEST_F(Reports, NothingHasHappenedAtFirst) {
  EXPECT_EQ(causes.identity_conflicts, 0U);
  EXPECT_EQ(causes.frames_lost, 0U);
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    EXPECT_EQ(causes.faults[axis], Fault::none);
    EXPECT_EQ(causes.fault_values[axis], 0.0f);
  }
  EXPECT_EQ(emergency.present(), 0U);
  EXPECT_FALSE(next());
}

TEST_F(Reports, AnotherFaultTakesThePlaceOfTheOneBeforeAndAxesHaveTheirOwn) {
  causes.faults[0] = Fault::over_speed;
  poll();
  causes.faults[0] = Fault::encoder;
  causes.faults[1] = Fault::over_speed;
  poll();
  EXPECT_FALSE(emergency.present(0x8480, 0));
  EXPECT_TRUE(emergency.present(0x7305, 0));
  EXPECT_TRUE(emergency.present(0x8480, 1));
  EXPECT_EQ(emergency.present(), 2U);
  causes.faults[1] = Fault::none;
  poll();
  EXPECT_EQ(emergency.present(), 1U);
}

TEST_F(Reports, AnErrorPassiveControllerIsAnErrorAndBusOffIsToldWhenItIsOver) {
  causes.can_state = CanState::error_passive;
  poll();
  EXPECT_EQ(next(), (Data{0x20, 0x81, 0x11, 127}));
  causes.can_state = CanState::bus_off;
  poll();
  EXPECT_FALSE(emergency.present(0x8120, 127));
  EXPECT_FALSE(emergency.present(0x8140, 127));
  next();
  causes.can_state = CanState::joining;
  poll();
  EXPECT_EQ(next(), (Data{0x40, 0x81, 0x11, 127}));
  poll();
  EXPECT_TRUE(emergency.present(0x8140, 127)) << "until it is active";
  causes.can_state = CanState::active;
  poll();
  EXPECT_TRUE(emergency.present(0x8140, 127)) << "for a poll, so that it is reported";
  poll();
  EXPECT_EQ(emergency.present(), 0U);
}

TEST_F(Reports, WhatIsCountedIsOverWhenItHasNotRisenForAWhile) {
  poll(10'000'000);
  EXPECT_EQ(emergency.present(), 0U);
  ++causes.identity_conflicts;
  poll();
  EXPECT_EQ(next(), (Data{0x00, 0x81, 0x11, 127}));
  ++causes.frames_lost;
  poll(1'000);
  EXPECT_EQ(next(), (Data{0x10, 0x81, 0x11, 127}));
  poll(1'000'000);
  EXPECT_TRUE(emergency.present(0x8110, 127));
  poll(1);
  EXPECT_FALSE(emergency.present(0x8110, 127));
  poll(5'000'000 - 1'000'000 - 1'000 - 1);
  EXPECT_TRUE(emergency.present(0x8100, 127));
  poll(1);
  EXPECT_FALSE(emergency.present(0x8100, 127));
  ++causes.frames_lost;
  poll();
  poll(999'999);
  ++causes.frames_lost;
  poll();
  poll(1'000'000);
  EXPECT_TRUE(emergency.present(0x8110, 127)) << "it has risen since";
  poll(1);
  EXPECT_EQ(emergency.present(), 0U);
}

}  // namespace
}  // namespace kmax::firmware::emergency_reports_test
