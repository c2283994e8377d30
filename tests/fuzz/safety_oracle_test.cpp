// Each rule of the oracle is broken once, by a device that does not exist, and kept once.
#include "tests/fuzz/safety_oracle.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::safety_oracle_test {
namespace {

using testing::Test;

/// What a host sends, and what a device that need not be sound makes of it.
class SafetyOracleRule : public Test {
 protected:
  void serial_controlword(std::uint16_t word, std::uint8_t unit = 1) {
    const std::uint16_t place = modbus_address(entry_of<"drive.controlword">(), 0);
    request({6, static_cast<std::uint8_t>(place >> 8), static_cast<std::uint8_t>(place),
             static_cast<std::uint8_t>(word >> 8), static_cast<std::uint8_t>(word)},
            unit);
  }
  void request(const modbus::Bytes& pdu, std::uint8_t unit = 1) {
    now_us_ += 10'000;
    for (const std::uint8_t byte : modbus::adu(unit, pdu)) {
      now_us_ += 100;
      oracle_.take_byte(byte, now_us_, 115200);
    }
  }
  /// A number of 32 bits.
  void write_serial(std::size_t entry, std::uint32_t number) {
    const std::uint16_t place = modbus_address(entry, 0);
    modbus::Bytes pdu{16, static_cast<std::uint8_t>(place >> 8), static_cast<std::uint8_t>(place), 0, 2, 4};
    for (int shift = 24; shift >= 0; shift -= 8) pdu.push_back(static_cast<std::uint8_t>(number >> shift));
    request(pdu);
  }
  void write_can(std::size_t entry, std::uint32_t number) {
    const Entry& e = entry_at(entry);
    drivers::CanFrame frame{.identifier = 0x601,
                            .length = 8,
                            .data = {0x23, static_cast<std::uint8_t>(e.index()),
                                     static_cast<std::uint8_t>(e.index() >> 8), e.object_subindex()}};
    for (unsigned byte = 0; byte < 4; ++byte)
      frame.data[4 + byte] = static_cast<std::uint8_t>(number >> 8 * byte);
    oracle_.take_frame(frame);
  }
  void can_controlword(std::uint16_t word) {
    oracle_.take_frame({.identifier = 0x601,
                        .length = 8,
                        .data = {0x2B, 0x40, 0x60, 0, static_cast<std::uint8_t>(word),
                                 static_cast<std::uint8_t>(word >> 8), 0, 0}});
  }
  /// The first axis is in `state` from here on; the other one never does anything.
  void poll(DriveState state, std::uint64_t later_us = 2'000) {
    now_us_ += later_us;
    states_[0] = state;
    oracle_.take_poll(now_us_, values_, states_);
  }
  void poll() { poll(states_[0]); }
  /// As a device that an owner has locked.
  void lock() {
    oracle_.expect_secret(code);
    write_serial(lock_code, code);
    poll();
    set<"lock.state">(2);
    settle();
    ASSERT_EQ(oracle_.complaint(), "");
  }
  void open() {
    set<"lock.state">(1);
    poll();
  }
  void arm() {
    serial_controlword(0x06);
    poll(DriveState::ready_to_switch_on);
    serial_controlword(0x0F);
    poll(DriveState::operation_enabled);
    ASSERT_EQ(oracle_.complaint(), "");
  }
  template <FixedName name>
  void set(double number) {
    constexpr std::size_t entry = entry_of<name>();
    values_.set_raw(slot_of(entry, 0), raw_from_number(entry_at(entry).type, number));
  }
  /// The settings of a start are those that were set until here.
  void start() { oracle_ = SafetyOracle(values_); }
  /// What was sent until here has been read.
  void settle() {
    for (int i = 0; i < 10; ++i) poll();
  }
  void tick(float force, bool enabled = true, bool count_valid = true, Fault condition = Fault::none) {
    oracle_.take_tick(0, {.count = 0, .count_valid = count_valid, .condition = condition},
                      {.force = force, .enabled = enabled});
  }
  void expect_complaint(const std::string& what) {
    EXPECT_EQ(oracle_.complaint().substr(0, what.size()), what) << oracle_.complaint();
  }

  static constexpr std::uint32_t code = 0x1234'5678;
  static constexpr std::size_t lock_code = entry_of<"lock.code">(), lock_key = entry_of<"lock.key">();

  ParameterValues values_;
  SafetyOracle oracle_{values_};
  SafetyOracle::States states_ = [] {
    SafetyOracle::States states;
    states.fill(DriveState::switch_on_disabled);
    return states;
  }();
  std::uint64_t now_us_ = 1'000'000;
};

constexpr auto without_words = "armed without the controlwords for it, axis 0";

TEST_F(SafetyOracleRule, ArmedInOrderIsRight) {
  arm();
}
TEST_F(SafetyOracleRule, ArmedInOrderOverCanIsRight) {
  can_controlword(0x06);
  poll(DriveState::ready_to_switch_on);
  can_controlword(0x0F);
  poll(DriveState::operation_enabled);
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, ArmedWithoutAnyWord) {
  poll(DriveState::operation_enabled);
  expect_complaint(without_words);
}
TEST_F(SafetyOracleRule, ArmedWithoutShutdown) {
  serial_controlword(0x0F);
  poll(DriveState::operation_enabled);
  expect_complaint(without_words);
}
TEST_F(SafetyOracleRule, ArmedInTheWrongOrder) {
  can_controlword(0x0F);
  can_controlword(0x06);
  poll(DriveState::operation_enabled);
  expect_complaint(without_words);
}
TEST_F(SafetyOracleRule, ArmedByAWordForTheOtherAxis) {
  serial_controlword(0x06);
  serial_controlword(0x0F);
  states_[axis_count - 1] = DriveState::operation_enabled;
  poll();
  expect_complaint("armed without the controlwords for it, axis 1");
}
TEST_F(SafetyOracleRule, ArmedByABroadcast) {
  serial_controlword(0x06);
  poll(DriveState::ready_to_switch_on);
  serial_controlword(0x0F, 0);
  poll(DriveState::operation_enabled);
  expect_complaint(without_words);
}
TEST_F(SafetyOracleRule, ArmedAgainWithoutANewShutdown) {
  arm();
  poll(DriveState::fault);
  for (int i = 0; i < 10; ++i) poll();
  serial_controlword(0x0F);
  poll(DriveState::operation_enabled);
  expect_complaint(without_words);
}

TEST_F(SafetyOracleRule, ArmedByAWordThatIsHeld) {
  arm();
  settle();
  can_controlword(0x06);
  poll(DriveState::ready_to_switch_on);
  serial_controlword(0x0F);
  poll(DriveState::operation_enabled);
  expect_complaint("armed by a word that was held, axis 0");
}
TEST_F(SafetyOracleRule, ArmedAgainByAnotherWordOfEitherLinkIsRight) {
  arm();
  settle();
  can_controlword(0x06);
  poll(DriveState::ready_to_switch_on);
  can_controlword(0x0F);
  poll(DriveState::operation_enabled);
  settle();
  serial_controlword(0x07);
  poll(DriveState::switched_on);
  serial_controlword(0x0F);
  poll(DriveState::operation_enabled);
  EXPECT_EQ(oracle_.complaint(), "");
}

TEST_F(SafetyOracleRule, ArmedBeyondTheTimeOut) {
  arm();
  poll(DriveState::operation_enabled, 990'000);
  EXPECT_EQ(oracle_.complaint(), "");
  poll(DriveState::operation_enabled, 20'000);
  expect_complaint("armed for longer than link.timeout without a sign of life, axis 0");
}
TEST_F(SafetyOracleRule, ARequestIsASignOfLifeUntilItIsRead) {
  arm();
  serial_controlword(0x0F);
  poll(DriveState::operation_enabled, 1'000);
  poll(DriveState::operation_enabled, 5'000);
  poll(DriveState::operation_enabled, 1'000'000);
  EXPECT_EQ(oracle_.complaint(), "");
  poll(DriveState::operation_enabled, 1'000);
  expect_complaint("armed for longer than link.timeout without a sign of life, axis 0");
}
TEST_F(SafetyOracleRule, AnotherLinkIsNoSignOfLife) {
  arm();
  poll(DriveState::operation_enabled, 990'000);
  can_controlword(0x0F);
  poll(DriveState::operation_enabled, 20'000);
  expect_complaint("armed for longer than link.timeout without a sign of life, axis 0");
}
TEST_F(SafetyOracleRule, AnOwnSyncIsASignOfLifeWhileAPdoMayWaitForIt) {
  set<"canopen.sync_cob_id">(0x4000'0080);
  set<"canopen.sync_period">(1000);
  start();
  const auto pdo = [this](std::uint8_t word) {
    oracle_.take_frame({.identifier = 0x201, .length = 2, .data = {word, 0}});
    poll();
  };
  pdo(0x06);
  pdo(0x0F);
  poll(DriveState::operation_enabled, 100'000);
  EXPECT_EQ(oracle_.complaint(), "");
  poll(DriveState::operation_enabled, 990'000);
  EXPECT_EQ(oracle_.complaint(), "");
  poll(DriveState::operation_enabled, 20'000);
  expect_complaint("armed for longer than link.timeout without a sign of life, axis 0");
}
TEST_F(SafetyOracleRule, TheSecondServerCommandsIfThereIsOne) {
  set<"sdo_server_2.request_cob_id">(0x6A1);
  set<"sdo_server_2.response_cob_id">(0x6B1);
  start();
  for (int i = 0; i < 2; ++i) {
    oracle_.take_frame({.identifier = 0x6A1, .length = 8, .data = {0x0D}});
    poll();
  }
  poll(DriveState::operation_enabled);
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, WithoutATimeOutNothingIsLate) {
  set<"link.timeout">(0);
  start();
  arm();
  poll(DriveState::operation_enabled, 100'000'000);
  EXPECT_EQ(oracle_.complaint(), "");
}

TEST_F(SafetyOracleRule, ForceWithinItsLimitIsRight) {
  arm();
  tick(3.3f);
  tick(-3.3f);
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, ForceBeyondItsLimit) {
  arm();
  tick(-3.31f);
  expect_complaint("force beyond force.limit, axis 0");
}
TEST_F(SafetyOracleRule, ForceBeyondALoweredLimitIsRightUntilTheNextHapticSample) {
  set<"haptic.rate">(4000);
  start();
  arm();
  tick(3.3f);
  set<"force.limit">(1);
  poll();
  for (int i = 0; i < 5; ++i) tick(3.3f);
  EXPECT_EQ(oracle_.complaint(), "");
  tick(3.3f);
  expect_complaint("force beyond force.limit, axis 0");
}
TEST_F(SafetyOracleRule, ForceThatIsNotFinite) {
  arm();
  tick(std::numeric_limits<float>::quiet_NaN());
  expect_complaint("force that is not finite, axis 0");
}
TEST_F(SafetyOracleRule, DrivenWhileDisarmed) {
  tick(0.0f);
  expect_complaint("driven, and not armed, axis 0");
}
TEST_F(SafetyOracleRule, FadingAsTheOwnerChoseIsNoForceWithoutArming) {
  set<"link.loss">(1);
  start();
  arm();
  poll(DriveState::fault_reaction_active);
  tick(1.0f);
  poll(DriveState::fault_reaction_active, 1'900'000);
  tick(0.1f);
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, FadingForEver) {
  set<"link.loss">(2);
  start();
  arm();
  poll(DriveState::fault_reaction_active);
  poll(DriveState::fault_reaction_active, 2'100'000);
  tick(0.1f);
  expect_complaint("driven, and not armed, axis 0");
}
TEST_F(SafetyOracleRule, FadingWhereTheOwnerChoseLimp) {
  arm();
  poll(DriveState::fault_reaction_active);
  tick(0.1f);
  expect_complaint("driven, and not armed, axis 0");
}
TEST_F(SafetyOracleRule, ForceWithoutBeingDriven) {
  tick(0.1f, false);
  expect_complaint("force without being driven, axis 0");
}
TEST_F(SafetyOracleRule, DrivenWithoutAnEncoder) {
  arm();
  tick(0.0f, true, false);
  expect_complaint("driven, and its inputs are not sound, axis 0");
}
TEST_F(SafetyOracleRule, DrivenWithAFaultOfTheBoard) {
  arm();
  tick(0.0f, true, true, Fault::over_current);
  expect_complaint("driven, and its inputs are not sound, axis 0");
}

TEST_F(SafetyOracleRule, OutOfRangeIsStored) {
  set<"force.limit">(1000.5);
  poll();
  expect_complaint("out of range: force.limit, axis 0");
}
TEST_F(SafetyOracleRule, OutOfRangeAtAStart) {
  set<"force.limit">(-1);
  start();
  expect_complaint("out of range: force.limit, axis 0");
}
TEST_F(SafetyOracleRule, NotANumberIsStored) {
  values_.set_real<"wall.stiffness">(std::numeric_limits<float>::quiet_NaN());
  poll();
  expect_complaint("out of range: wall.stiffness, axis 0");
}
TEST_F(SafetyOracleRule, NoChoiceIsStored) {
  set<"can.bit_rate">(999'999);
  poll();
  expect_complaint("not a choice: can.bit_rate, axis 0");
}

TEST_F(SafetyOracleRule, TightenedWhileArmedIsRight) {
  arm();
  set<"force.limit">(1);
  poll();
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, LoosenedWhileArmed) {
  arm();
  set<"force.limit">(3.4);
  poll();
  expect_complaint("loosened while armed: force.limit, axis 0");
}
TEST_F(SafetyOracleRule, LoosenedWhileArmedBySwitchingALimitOff) {
  arm();
  set<"velocity.limit">(0);
  poll();
  expect_complaint("loosened while armed: velocity.limit, axis 0");
}
TEST_F(SafetyOracleRule, LoosenedWhileArmedByWhatIsOnlyToRise) {
  arm();
  set<"force.ramp_time">(0);
  poll();
  expect_complaint("loosened while armed: force.ramp_time, axis 0");
}
TEST_F(SafetyOracleRule, LoosenedAsFarAsACeiling) {
  set<"force.ceiling">(5);
  start();
  arm();
  set<"force.limit">(5);
  poll();
  EXPECT_EQ(oracle_.complaint(), "");
  set<"force.limit">(5.1);
  poll();
  expect_complaint("loosened while armed: force.limit, axis 0");
}
TEST_F(SafetyOracleRule, ChangedWhileArmed) {
  arm();
  set<"link.timeout">(2);
  poll();
  expect_complaint("changed while armed: link.timeout, axis 0");
}
TEST_F(SafetyOracleRule, ChangedByAnotherThanItsCommander) {
  arm();
  settle();
  can_controlword(0x0F);
  set<"wall.adaptive_gain">(1);
  poll();
  expect_complaint("changed by another than its commander: wall.adaptive_gain, axis 0");
}
TEST_F(SafetyOracleRule, ChangedByItsCommanderOrByAnybodyWhereThatIsAllowedIsRight) {
  arm();
  settle();
  serial_controlword(0x0F);
  set<"wall.adaptive_gain">(1);
  poll();
  settle();
  can_controlword(0x0F);
  set<"force.limit">(1);
  poll();
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, ChangedWhileDisarmedIsRight) {
  set<"link.timeout">(2);
  set<"force.limit">(5);
  poll();
  EXPECT_EQ(oracle_.complaint(), "");
}

TEST_F(SafetyOracleRule, ChangedWhileLocked) {
  lock();
  set<"force.limit">(1);
  poll();
  expect_complaint("changed while locked: force.limit, axis 0");
}
TEST_F(SafetyOracleRule, CanopensSettingChangedWhileLocked) {
  lock();
  set<"rpdo1.cob_id">(0x8000'0201);
  poll();
  expect_complaint("changed while locked: rpdo1.cob_id, axis 0");
}
TEST_F(SafetyOracleRule, TheBitRateChangedWhileLocked) {
  set<"can.bit_rate_in_use">(1'000'000);
  start();
  lock();
  set<"can.bit_rate_in_use">(500'000);
  poll();
  expect_complaint("changed while locked: can.bit_rate_in_use, axis 0");
}
TEST_F(SafetyOracleRule, TheNodeIdChangedWhileLocked) {
  set<"can.node_in_use">(1);
  start();
  lock();
  set<"can.node_in_use">(2);
  poll();
  expect_complaint("changed while locked: can.node_in_use, axis 0");
}
TEST_F(SafetyOracleRule, TheLogErasedWhileLocked) {
  set<"log.newest">(3);
  start();
  lock();
  set<"log.newest">(0);
  poll();
  expect_complaint("changed while locked: log.newest, axis 0");
}
TEST_F(SafetyOracleRule, WhatIsUsedWhileLockedIsRight) {
  lock();
  set<"profile.target_force">(100);
  set<"profile.max_torque">(100);
  set<"trace.axis">(1);
  set<"capture.interval">(7);
  set<"log.newest">(1);
  set<"wall.position">(0);
  poll();
  oracle_.take_frame({.identifier = 0, .length = 2, .data = {0x82, 1}});
  set<"rpdo1.cob_id">(0x8000'0201);
  set<"can.node_in_use">(2);
  poll();
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, OpenedByItsCodeAndThenChangedIsRight) {
  lock();
  write_serial(lock_key, code);
  open();
  settle();
  set<"force.limit">(1);
  poll();
  write_can(lock_key, 0);
  set<"lock.state">(2);
  poll();
  settle();
  write_can(lock_key, code);
  set<"force.limit">(2);
  open();
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, OpenedByAnotherCode) {
  lock();
  write_serial(lock_key, code + 1);
  write_can(lock_key, 0);
  write_can(lock_code, 5);  // refused
  write_can(lock_key, 5);
  open();
  expect_complaint("opened without its code, axis 0");
}
TEST_F(SafetyOracleRule, OpenedByItsCodeForSomethingElse) {
  lock();
  write_can(entry_of<"force.limit">(), code);
  open();
  expect_complaint("opened without its code, axis 0");
}
TEST_F(SafetyOracleRule, OpenedLongAfterItsCode) {
  lock();
  write_can(lock_key, code);
  settle();
  open();
  expect_complaint("opened without its code, axis 0");
}
TEST_F(SafetyOracleRule, OpenedByACodeThatWasSetWhileItWasOpenIsRight) {
  lock();
  write_serial(lock_key, code);
  write_can(lock_code, 5);
  open();
  settle();
  set<"lock.state">(2);
  poll();
  settle();
  write_can(lock_key, 5);
  open();
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, OpenedWhileArmed) {
  lock();
  arm();
  write_serial(lock_key, code);
  open();
  expect_complaint("opened while armed, axis 0");
}
TEST_F(SafetyOracleRule, NotLockedAfterAStart) {
  lock();
  oracle_.take_memory(0, false);
  write_serial(lock_key, code);
  open();
  oracle_.restart(values_, true);
  expect_complaint("not locked after a start, axis 0");
}
TEST_F(SafetyOracleRule, AStartWithoutACodeIsRightIfItWasRemovedOrTheMemoryIsDamaged) {
  lock();
  oracle_.restart(ParameterValues(), false);
  EXPECT_EQ(oracle_.complaint(), "");
  lock();
  write_serial(lock_key, code);
  open();
  write_serial(lock_code, 0);
  poll();
  write_serial(lock_key, 0);
  set<"lock.state">(2);
  settle();
  set<"lock.state">(0);
  poll();
  oracle_.restart(values_, true);
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, TheCodeOpensAfterARestartToo) {
  lock();
  oracle_.restart(values_, true);
  write_can(lock_key, code);
  open();
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, KeptWhileLocked) {
  oracle_.take_memory(5, true);
  lock();
  oracle_.take_memory(7, false);
  poll();
  oracle_.take_memory(7, false);
  EXPECT_EQ(oracle_.complaint(), "") << "begun before";
  poll();
  oracle_.take_memory(8, true);
  expect_complaint("kept while locked, axis 0");
}
TEST_F(SafetyOracleRule, TheCodeIsTold) {
  for (const bool high_first : {false, true}) {
    start();
    lock();
    oracle_.take_sent(std::array<std::uint8_t, 5>{0x12, 0x34, 0x56, 0x79, 0x12});
    EXPECT_EQ(oracle_.complaint(), "");
    if (high_first)
      oracle_.take_sent(std::array<std::uint8_t, 5>{1, 0x12, 0x34, 0x56, 0x78});
    else
      oracle_.take_sent(std::array<std::uint8_t, 5>{0x78, 0x56, 0x34, 0x12, 1});
    expect_complaint("the code was told, axis 0");
  }
}
TEST_F(SafetyOracleRule, ToRepeatWhatAHostTellsIsRight) {
  const std::array<std::uint8_t, 4> told{0x12, 0x34, 0x56, 0x78};
  lock();
  request({8, 0, 0, 0x12, 0x34, 0x56, 0x78});
  oracle_.take_sent(told);
  start();
  lock();
  write_can(entry_of<"force.limit">(), code);
  oracle_.take_sent(told);
  start();
  lock();
  oracle_.take_frame({.identifier = 0x201, .length = 4, .data = {0x12, 0x34, 0x56, 0x78}});
  oracle_.take_sent(told);
  EXPECT_EQ(oracle_.complaint(), "");
}
TEST_F(SafetyOracleRule, TheCodeIsAValue) {
  set<"lock.code">(code);
  poll();
  expect_complaint("the code is a value, axis 0");
}

}  // namespace
}  // namespace kmax::firmware::safety_oracle_test
