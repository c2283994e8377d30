#include "firmware/canopen/emergency.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace kmax::firmware::canopen::emergency_test {
namespace {

using drivers::CanFrame;

constexpr std::uint32_t own_cob_id = 0x091;
constexpr auto pre_operational = NmtState::pre_operational;
constexpr auto operational = NmtState::operational;

const EmergencyError over_current{0x2310, error_register::current, {0, 1, 2, 3, 4}};
const EmergencyError under_voltage{0x3220, error_register::voltage, {0, 0xA5, 0, 0, 0}};
const EmergencyError over_current_of_axis_1{0x2310, error_register::current, {1, 0, 0, 0, 0}};
const EmergencyError heartbeat_lost{0x8130, error_register::communication, {5, 0, 0, 0, 0}};

Emergency configured(std::uint16_t inhibit_100us = 0) {
  Emergency emergency;
  emergency.configure(own_cob_id, inhibit_100us);
  return emergency;
}

std::optional<CanFrame> next_of(Emergency& emergency, std::uint32_t now_us = 0,
                                NmtState state = operational) {
  CanFrame frame;
  return emergency.next_frame(frame, state, now_us) ? std::optional(frame) : std::nullopt;
}

CanFrame message(const EmergencyError& error, std::uint8_t bits) {
  return {.identifier = own_cob_id,
          .length = 8,
          .data = {static_cast<std::uint8_t>(error.code), static_cast<std::uint8_t>(error.code >> 8), bits,
                   error.manufacturer[0], error.manufacturer[1], error.manufacturer[2], error.manufacturer[3],
                   error.manufacturer[4]}};
}

const CanFrame recovered{.identifier = own_cob_id, .length = 8};

EmergencyError numbered(unsigned number) {
  return {static_cast<std::uint16_t>(0xFF00 + number), error_register::manufacturer, {}};
}

struct EmergencyTest : testing::Test {
  std::optional<CanFrame> next(std::uint32_t now_us = 0, NmtState state = operational) {
    return next_of(emergency, now_us, state);
  }
  Emergency emergency = configured();
};

TEST_F(EmergencyTest, OneErrorComesAndGoes) {
  EXPECT_FALSE(next());
  EXPECT_EQ(emergency.error_register(), 0);
  EXPECT_TRUE(emergency.raise(over_current));
  EXPECT_EQ(emergency.error_register(), 0x03) << "bit 0 with every error";
  EXPECT_EQ(next(), message(over_current, 0x03));
  EXPECT_FALSE(next());
  emergency.clear(over_current.code);
  EXPECT_EQ(emergency.error_register(), 0);
  EXPECT_EQ(next(), recovered);
  EXPECT_FALSE(next());
}

TEST_F(EmergencyTest, TheSameErrorIsAnnouncedOnce) {
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(emergency.raise(over_current));
  EXPECT_TRUE(next());
  EXPECT_TRUE(emergency.raise(over_current));
  EXPECT_FALSE(next());
  EXPECT_EQ(emergency.history_count(), 1);
  emergency.clear(over_current.code);
  emergency.clear(over_current.code);
  EXPECT_TRUE(next());
  EXPECT_FALSE(next()) << "and recovered once";
}

TEST_F(EmergencyTest, ClearingWhatIsNotThereSendsNothing) {
  emergency.clear(0x2310);
  emergency.clear(0);
  EXPECT_FALSE(next());
  emergency.raise(over_current);
  next();
  emergency.clear(over_current.code, 1);
  emergency.clear(under_voltage.code);
  EXPECT_FALSE(next());
  EXPECT_EQ(emergency.present(), 1U);
}

TEST_F(EmergencyTest, TheSameCodeAtTwoPlacesIsTwoErrors) {
  emergency.raise(over_current);
  emergency.raise(over_current_of_axis_1);
  next();
  EXPECT_EQ(next(), message(over_current_of_axis_1, 0x03));
  emergency.clear(0x2310, 1);
  EXPECT_EQ(next(), message(over_current, 0x03));
  EXPECT_TRUE(emergency.present(0x2310, 0));
  EXPECT_FALSE(emergency.present(0x2310, 1));
}

// In whatever order three errors go, 0x0000 comes only with the last one.
TEST(Emergency, ClearedInAnyOrder) {
  std::vector<int> order{0, 1, 2};
  const std::vector<EmergencyError> errors{over_current, under_voltage, heartbeat_lost};
  do {
    Emergency emergency = configured();
    for (const EmergencyError& error : errors) emergency.raise(error);
    EXPECT_EQ(next_of(emergency), message(over_current, 0x03));
    EXPECT_EQ(next_of(emergency), message(under_voltage, 0x07));
    EXPECT_EQ(next_of(emergency), message(heartbeat_lost, 0x17));
    std::vector<int> left{0, 1, 2};
    for (const int gone : order) {
      const EmergencyError& error = errors[static_cast<std::size_t>(gone)];
      emergency.clear(error.code, error.manufacturer[0]);
      left.erase(std::find(left.begin(), left.end(), gone));
      std::uint8_t bits = left.empty() ? 0 : 1;
      for (const int i : left) bits |= errors[static_cast<std::size_t>(i)].register_bits;
      EXPECT_EQ(emergency.error_register(), bits);
      EXPECT_EQ(next_of(emergency),
                left.empty() ? recovered : message(errors[static_cast<std::size_t>(left.back())], bits));
    }
    EXPECT_FALSE(next_of(emergency));
    EXPECT_EQ(emergency.history_count(), 3) << "an error that is sent again is not a new one";
  } while (std::next_permutation(order.begin(), order.end()));
}

// Whichever byte of its code is not 0: an error that was reported is also reported to have gone.
TEST(Emergency, AnErrorThatWentWhileNobodyWasToldIsToldToHaveGone) {
  for (const std::uint16_t code : std::vector<std::uint16_t>{0x8100, 0x0010}) {
    Emergency emergency = configured();
    emergency.raise({code, error_register::communication, {}});
    ASSERT_TRUE(next_of(emergency));
    emergency.configure(own_cob_id | cob_id::invalid, 0);
    emergency.clear(code);
    emergency.configure(own_cob_id, 0);
    EXPECT_EQ(next_of(emergency), recovered) << code;
    EXPECT_FALSE(next_of(emergency));
    // One that came and went before it was reported is not.
    emergency.configure(own_cob_id | cob_id::invalid, 0);
    emergency.raise({code, error_register::communication, {}});
    emergency.clear(code);
    emergency.configure(own_cob_id, 0);
    EXPECT_FALSE(next_of(emergency)) << code;
  }
}

// CiA 301, object 0x1001, and docs/canopen.md.
TEST(Emergency, ItsNumbersAreTheProtocols) {
  EXPECT_EQ(error_register::generic, 0x01);
  EXPECT_EQ(error_register::current, 0x02);
  EXPECT_EQ(error_register::voltage, 0x04);
  EXPECT_EQ(error_register::temperature, 0x08);
  EXPECT_EQ(error_register::communication, 0x10);
  EXPECT_EQ(error_register::device_profile, 0x20);
  EXPECT_EQ(error_register::manufacturer, 0x80);
  EXPECT_EQ(bus_source, 127);
  EXPECT_EQ(watched_source, 128);
  EXPECT_EQ(present_error_count, 16U);
  EXPECT_EQ(emergency_queue_length, 8U);
  EXPECT_EQ(error_history_length, 8U);
}

TEST(Emergency, InhibitTimeAcrossTheWrap) {
  for (const std::uint16_t inhibit : std::vector<std::uint16_t>{1, 100, 65535}) {
    for (const std::uint32_t start : {0U, 0x7FFF'FFFFU, 0xFFFF'FFFFU, 0U - 50U}) {
      const std::uint32_t inhibit_us = inhibit * 100U;
      Emergency emergency = configured(inhibit);
      emergency.raise(over_current);
      ASSERT_EQ(next_of(emergency, start), message(over_current, 0x03)) << "the first one at once";
      emergency.raise(under_voltage);
      emergency.clear(over_current.code);
      EXPECT_FALSE(next_of(emergency, start));
      EXPECT_FALSE(next_of(emergency, start + inhibit_us - 1));
      EXPECT_EQ(next_of(emergency, start + inhibit_us), message(under_voltage, 0x07));
      EXPECT_FALSE(next_of(emergency, start + 2 * inhibit_us - 1));
      EXPECT_EQ(next_of(emergency, start + 2 * inhibit_us), message(under_voltage, 0x05));
      EXPECT_FALSE(next_of(emergency, start + 3 * inhibit_us));
      emergency.clear(under_voltage.code);
      EXPECT_EQ(next_of(emergency, start + 3 * inhibit_us), recovered);
    }
  }
}

TEST(Emergency, AnInhibitTimeThatIsOverStaysOverHoweverLongNothingIsSent) {
  Emergency emergency = configured(65535);
  emergency.raise(over_current);
  ASSERT_TRUE(next_of(emergency, 0));
  for (std::uint64_t t = 0; t < 0x1'0000'0000; t += 50'000'000) {
    ASSERT_FALSE(next_of(emergency, static_cast<std::uint32_t>(t)));
  }
  emergency.raise(under_voltage);
  EXPECT_TRUE(next_of(emergency, 10)) << "the clock has come round to where the last one was sent";
}

TEST(Emergency, AChangedInhibitTimeTakesEffectAtOnce) {
  Emergency emergency = configured(1000);
  emergency.raise(over_current);
  next_of(emergency, 0);
  emergency.raise(under_voltage);
  EXPECT_FALSE(next_of(emergency, 5000));
  emergency.configure(own_cob_id, 50);
  EXPECT_TRUE(next_of(emergency, 5000));
  emergency.raise(heartbeat_lost);
  emergency.configure(own_cob_id, 0);
  EXPECT_TRUE(next_of(emergency, 5000));
}

TEST_F(EmergencyTest, NoneInStoppedOrInitialising) {
  emergency.raise(over_current);
  EXPECT_FALSE(next(0, NmtState::initialising));
  EXPECT_FALSE(next(0, NmtState::stopped));
  emergency.raise(under_voltage);
  EXPECT_FALSE(next(0, NmtState::stopped));
  EXPECT_EQ(next(0, pre_operational), message(over_current, 0x03)) << "kept for later";
  EXPECT_EQ(next(0, operational), message(under_voltage, 0x07));
}

TEST(Emergency, AfterAnOverflowThePresentStateIsTold) {
  Emergency emergency = configured(10);
  for (unsigned i = 0; i < emergency_queue_length + 3; ++i) emergency.raise(numbered(i));
  EXPECT_EQ(emergency.overflows(), 3U);
  std::uint32_t now_us = 0;
  for (unsigned i = 0; i < emergency_queue_length; ++i) {
    EXPECT_EQ(next_of(emergency, now_us += 1000), message(numbered(i), 0x81)) << "the first ones stay";
  }
  EXPECT_EQ(next_of(emergency, now_us += 1000), message(numbered(10), 0x81)) << "the latest that is there";
  EXPECT_FALSE(next_of(emergency, now_us += 1000));
  EXPECT_EQ(emergency.present(), 11U);
}

TEST_F(EmergencyTest, AMessageThatFoundRoomAfterAnOverflowTellsTheState) {
  for (unsigned i = 0; i < emergency_queue_length + 1; ++i) emergency.raise(numbered(i));
  EXPECT_TRUE(next());
  emergency.raise(numbered(9));
  for (unsigned i = 1; i < emergency_queue_length; ++i) EXPECT_EQ(next(), message(numbered(i), 0x81));
  EXPECT_EQ(next(), message(numbered(9), 0x81));
  EXPECT_FALSE(next()) << "no need to tell it again";
}

TEST(Emergency, TheRecoveryIsToldEvenIfTheQueueWasFull) {
  Emergency emergency = configured(10);
  for (unsigned i = 0; i < emergency_queue_length; ++i) emergency.raise(numbered(i));
  for (unsigned i = 0; i < emergency_queue_length; ++i) emergency.clear(numbered(i).code);
  EXPECT_EQ(emergency.overflows(), emergency_queue_length);
  std::uint32_t now_us = 0;
  for (unsigned i = 0; i < emergency_queue_length; ++i) {
    EXPECT_EQ(next_of(emergency, now_us += 1000), message(numbered(i), 0x81));
  }
  EXPECT_EQ(next_of(emergency, now_us += 1000), recovered);
  EXPECT_FALSE(next_of(emergency, now_us += 1000));
}

TEST_F(EmergencyTest, MoreErrorsThanCanBeKeptAreRefusedNotForgotten) {
  for (unsigned i = 0; i < present_error_count; ++i) {
    EXPECT_TRUE(emergency.raise(numbered(i)));
    next();
  }
  EXPECT_FALSE(emergency.raise(over_current));
  EXPECT_TRUE(emergency.raise(numbered(3))) << "there already";
  EXPECT_FALSE(emergency.raise({0, error_register::current, {}})) << "code 0 is no error";
  EXPECT_FALSE(next());
  EXPECT_EQ(emergency.error_register(), 0x81);
  emergency.clear(numbered(0).code);
  EXPECT_TRUE(emergency.raise(over_current));
  EXPECT_EQ(emergency.error_register(), 0x83);
}

TEST(Emergency, HistoryHasTheNewestFirst) {
  Emergency emergency;  // not even configured
  EXPECT_EQ(emergency.history_count(), 0);
  EXPECT_EQ(emergency.history_at(0), 0U);
  emergency.raise(under_voltage);
  emergency.raise(heartbeat_lost);
  EXPECT_EQ(emergency.history_count(), 2);
  EXPECT_EQ(emergency.history_at(0), 0x0005'8130U);
  EXPECT_EQ(emergency.history_at(1), 0xA500'3220U);
  EXPECT_EQ(emergency.history_at(2), 0U);
  for (unsigned i = 0; i < 20; ++i) {
    emergency.raise(numbered(i));
    emergency.clear(numbered(i).code);
  }
  EXPECT_EQ(emergency.history_count(), error_history_length);
  for (unsigned i = 0; i < error_history_length; ++i) {
    EXPECT_EQ(emergency.history_at(i), 0xFF00U + 19 - i);
  }
  EXPECT_EQ(emergency.history_at(error_history_length), 0U);
  emergency.erase_history();
  EXPECT_EQ(emergency.history_count(), 0);
  EXPECT_EQ(emergency.history_at(0), 0U);
  EXPECT_EQ(emergency.present(), 2U) << "the errors themselves stay";
  emergency.raise(over_current);
  EXPECT_EQ(emergency.history_count(), 1);
  EXPECT_EQ(emergency.history_at(0), 0x0100'2310U);
}

TEST_F(EmergencyTest, NotValidSendsNothingAndTellsTheStateWhenItIsAgain) {
  emergency.raise(over_current);
  emergency.configure(cob_id::invalid | own_cob_id, 0);
  emergency.raise(under_voltage);
  EXPECT_FALSE(next());
  EXPECT_EQ(emergency.error_register(), 0x07);
  emergency.configure(own_cob_id + 1, 0);
  CanFrame expected = message(under_voltage, 0x07);
  expected.identifier = own_cob_id + 1;
  EXPECT_EQ(next(), expected);
  EXPECT_FALSE(next());
}

TEST_F(EmergencyTest, WhatWaitedWhenItBecameNotValidIsToldWhenItIsAgain) {
  emergency.raise(over_current);
  emergency.configure(cob_id::invalid | own_cob_id, 0);
  emergency.configure(cob_id::invalid | own_cob_id, 0);
  EXPECT_FALSE(next());
  emergency.configure(own_cob_id, 0);
  EXPECT_EQ(next(), message(over_current, 0x03));
  emergency.configure(cob_id::invalid | own_cob_id, 0);
  emergency.configure(own_cob_id, 0);
  EXPECT_FALSE(next()) << "nothing happened in between";
}

TEST(Emergency, NoRecoveryIsToldOfWhatWasNeverTold) {
  Emergency emergency;
  emergency.raise(over_current);
  emergency.clear(over_current.code);
  emergency.configure(own_cob_id, 0);
  EXPECT_FALSE(next_of(emergency));
  emergency.raise(over_current);
  next_of(emergency);
  emergency.configure(cob_id::invalid | own_cob_id, 0);
  emergency.clear(over_current.code);
  emergency.configure(own_cob_id, 0);
  EXPECT_EQ(next_of(emergency), recovered) << "but of what was";
}

TEST(Emergency, StartingAgainTellsTheLatestErrorThatIsThere) {
  Emergency emergency = configured(1000);
  emergency.start();
  EXPECT_FALSE(next_of(emergency)) << "no errors";
  emergency.raise(over_current);
  emergency.raise(under_voltage);
  next_of(emergency, 0);
  emergency.start();
  EXPECT_EQ(next_of(emergency, 10), message(under_voltage, 0x07));
  EXPECT_FALSE(next_of(emergency, 1'000'000)) << "what waited is dropped";
  emergency.clear(under_voltage.code);
  emergency.clear(over_current.code);
  emergency.start();
  EXPECT_FALSE(next_of(emergency, 2'000'000));
  EXPECT_EQ(emergency.history_count(), 2);
}

// Whatever comes and goes at whatever time: messages keep the inhibit time, 0x0000 is sent no oftener than
// all errors had gone, and in the end the bus knows the present state.
RC_GTEST_PROP(Emergency, InTheEndTheBusKnowsTheState, ()) {
  const auto inhibit = *rc::gen::element<std::uint16_t>(0, 1, 30);
  auto now_us = *rc::gen::element<std::uint32_t>(0, 0xFFFF'F000);
  Emergency emergency = configured(inhibit);
  std::vector<unsigned> model;
  std::optional<std::uint32_t> sent_us;
  CanFrame last = recovered;
  unsigned times_empty = 0, recoveries = 0;
  const auto step = [&](NmtState state) {
    const std::optional<CanFrame> frame = next_of(emergency, now_us, state);
    if (!frame) return false;
    RC_ASSERT(state == operational);
    RC_ASSERT((!sent_us || now_us - *sent_us >= inhibit * 100U));
    if (*frame == recovered) {
      RC_ASSERT(++recoveries <= times_empty);
    }
    sent_us = now_us;
    last = *frame;
    return true;
  };
  const auto events = *rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(0, 4), rc::gen::inRange(0, 12)));
  for (const auto& [what, which] : events) {
    const auto number = static_cast<unsigned>(which);
    const auto found = std::find(model.begin(), model.end(), number);
    if (what == 0) {
      if (found == model.end()) model.push_back(number);
      emergency.raise(numbered(number));
    } else if (what == 1) {
      if (found != model.end()) {
        model.erase(found);
        if (model.empty()) ++times_empty;
      }
      emergency.clear(numbered(number).code);
    } else {
      now_us += number * 100;
      step(what == 2 ? operational : NmtState::stopped);
    }
    RC_ASSERT(emergency.present() == model.size());
    RC_ASSERT(emergency.error_register() == (model.empty() ? 0x00 : 0x81));
  }
  for (unsigned i = 0; i < emergency_queue_length + 1; ++i) {
    now_us += 3000;
    step(operational);
  }
  now_us += 3000;
  RC_ASSERT(!step(operational));
  RC_ASSERT(last == (model.empty() ? recovered : message(numbered(model.back()), 0x81)));
}

}  // namespace
}  // namespace kmax::firmware::canopen::emergency_test
