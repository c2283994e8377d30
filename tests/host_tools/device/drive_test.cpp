#include "host_tools/device/drive.hpp"

#include <gtest/gtest.h>

#include <regex>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::drive_test {

using firmware::DriveState;
using firmware::Fault;
using firmware::Refusal;
using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;
using host_tools_test::thrown_message;

class DriveTest : public testing::Test {
 protected:
  DriveState state(std::size_t axis = 1) const { return fake->machines[axis].state(); }

  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
  FakeLink* link = new FakeLink(fake);
  Device device{std::unique_ptr<device::Link>(link)};
  Drive drive{device, 1};
};

TEST_F(DriveTest, ArmsOnlyItsAxisAndDisarmsIt) {
  drive.arm();
  EXPECT_EQ(state(1), DriveState::operation_enabled);
  EXPECT_EQ(state(0), DriveState::switch_on_disabled);
  EXPECT_TRUE(drive.status().armed());
  drive.disarm();
  EXPECT_EQ(state(1), DriveState::switch_on_disabled);
}

TEST_F(DriveTest, ArmingWhatIsArmedSendsNothing) {
  drive.arm();
  fake->controlwords.clear();
  drive.arm();
  EXPECT_TRUE(fake->controlwords.empty());
}

TEST_F(DriveTest, ArmsFromEveryStateWithoutAFault) {
  for (const std::vector<std::uint16_t>& way :
       std::vector<std::vector<std::uint16_t>>{{}, {6}, {6, 7}, {6, 7, 15, 2}, {6, 7, 15, 7}}) {
    for (const std::uint16_t word : way)
      fake->machines[1].command(word, firmware::Link::serial, Refusal::none, false);
    drive.arm();
    EXPECT_EQ(state(), DriveState::operation_enabled);
    drive.disarm();
  }
}

TEST_F(DriveTest, ARefusalComesInWordsAndLeavesTheAxisDisabled) {
  fake->obstacle[1] = Refusal::handle_inside_wall;
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { drive.arm(); }), "inside the wall");
  EXPECT_EQ(state(), DriveState::switch_on_disabled);
  // The refusal of then is still shown by the device, and must not be taken for one of now.
  fake->obstacle[1] = Refusal::none;
  drive.arm();
  EXPECT_EQ(state(), DriveState::operation_enabled);
}

TEST_F(DriveTest, AHandleInsideTheWallIsShownTheWayOut) {
  fake->obstacle[1] = Refusal::handle_inside_wall;
  const auto words = [&](float position, float wall, int side) {
    fake->registers.values().set_real<"measured.position">(position, 1);
    fake->registers.values().set_real<"wall.position">(wall, 1);
    fake->registers.values().set_whole<"wall.side">(static_cast<std::uint32_t>(side), 1);
    return thrown_message<base::DeviceError>([&] { drive.arm(); });
  };
  EXPECT_CONTAINS(
      words(-0.0102f, 0.0031f, 1),
      "it is at -10.20 mm, the wall begins at 3.10 mm, so by more than 13.30 mm towards larger positions");
  EXPECT_CONTAINS(words(-0.0102f, 0.0031f, 1), "'kmax set axis1.wall.position=here-1mm'");
  EXPECT_CONTAINS(words(0.02f, 0.01f, -1), "by more than 10.00 mm towards smaller positions");
  EXPECT_CONTAINS(words(0.02f, 0.01f, -1), "here+1mm");
  EXPECT_EQ(words(0.02f, 0.01f, 1).find("it is at"), std::string::npos) << "it has been moved meanwhile";
}

TEST_F(DriveTest, AnOldRefusalIsNotTakenForTheAnswerThatIsStillToCome) {
  fake->obstacle[1] = Refusal::handle_inside_wall;
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { drive.arm(); }), "inside the wall");
  fake->obstacle[1] = Refusal::none;
  fake->judgement_us = 30'000;
  drive.arm();
  EXPECT_EQ(state(), DriveState::operation_enabled);
}

TEST_F(DriveTest, ADeviceThatDoesNotFollowIsReported) {
  fake->deaf_to_commands = true;
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { drive.arm(); }), "stays in 'Switch on disabled'");
}

// A program that is stopped just after it has asked for the state has an answer of then, whatever the time.
TEST_F(DriveTest, AProgramThatStoodStillLooksOnceMoreBeforeItComplains) {
  for (int stopped = 1; stopped < 25; ++stopped) {
    fake->judgement_us = 30'000;
    link->requests = 0;
    link->after_request = [&](int request) {
      if (request == stopped) fake->pass(3'000'000);
    };
    EXPECT_NO_THROW(drive.arm()) << "after request " << stopped;
    EXPECT_EQ(state(), DriveState::operation_enabled);
    EXPECT_NO_THROW(drive.disarm()) << "after request " << stopped;
    EXPECT_EQ(state(), DriveState::switch_on_disabled);
  }
}

TEST_F(DriveTest, AfterAStandstillAnOldRefusalIsNotTakenForTheAnswer) {
  for (int stopped = 1; stopped < 25; ++stopped) {
    link->after_request = nullptr;
    fake->judgement_us = 0;
    fake->obstacle[1] = Refusal::handle_inside_wall;
    EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { drive.arm(); }), "inside the wall");
    fake->obstacle[1] = Refusal::none;
    fake->judgement_us = 30'000;
    link->requests = 0;
    link->after_request = [&](int request) {
      if (request == stopped) fake->pass(3'000'000);
    };
    EXPECT_NO_THROW(drive.arm()) << "after request " << stopped;
    EXPECT_NO_THROW(drive.disarm()) << "after request " << stopped;
  }
}

TEST_F(DriveTest, AnArmedAxisThatDoesNotStopIsAnError) {
  drive.arm();
  fake->deaf_to_commands = true;
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { drive.disarm(); }), "cut its power");
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { drive.stop(); }), "cut its power");
}

TEST_F(DriveTest, AFaultIsToldWithItsNumbersAndWhatToCheck) {
  fake->trip(1, Fault::over_speed, 6.25f, 5.0f);
  const auto message = thrown_message<base::DeviceError>([&] { drive.arm(); });
  EXPECT_CONTAINS(message, "faster than velocity.limit");
  EXPECT_CONTAINS(message, "6.25 m/s, bound 5 m/s");
  EXPECT_CONTAINS(message, "encoder.counts_per_turn");
  EXPECT_CONTAINS(message, "kmax clear");
}

TEST_F(DriveTest, AFaultOfTheGateDriversIsToldWithWhatTheDriverSays) {
  fake->trip(1, Fault::gate_driver, 0, 0);
  EXPECT_CONTAINS(drive.status().fault_words(), "this axis' driver says: nothing");
  DriveStatus status = drive.status();
  status.gate_driver_faults = 0x404;
  EXPECT_CONTAINS(status.fault_words(), "this axis' driver says: phase B, low side: too much current");
  EXPECT_EQ(gate_driver_words(0x120),
            "phase A, high side: too much current; the motor supply is too low for it");
  EXPECT_EQ(gate_driver_words(0x400), "a fault, and no cause");
  EXPECT_EQ(gate_driver_words(0x1000), "it does not answer");
}

TEST_F(DriveTest, TheDictionaryNamesTheBitsOfTheGateDriverThatHaveWords) {
  const std::string help(firmware::entry_at(firmware::entry_of<"drive.gate_driver_faults">()).help);
  const std::regex number("[1-9][0-9]*");
  unsigned named = 0;
  for (std::sregex_iterator at(help.begin(), help.end(), number), end; at != end; ++at)
    named |= static_cast<unsigned>(std::stoul(at->str()));
  unsigned have_words = 0;
  for (unsigned bit = 1; bit <= 0x8000; bit <<= 1) {
    if (gate_driver_words(static_cast<std::uint16_t>(bit)) != "a fault, and no cause") have_words |= bit;
  }
  EXPECT_EQ(named, have_words);
}

TEST_F(DriveTest, AnUnknownErrorCodeIsShownAsANumber) {
  DriveStatus status;
  status.error_code = 0x7777;
  EXPECT_CONTAINS(status.fault_words(), "0x7777");
}

TEST_F(DriveTest, ClearsAFaultWhoseCauseIsGone) {
  EXPECT_FALSE(drive.clear());
  fake->trip(1, Fault::encoder, 0, 0);
  fake->machines[1].command(128, firmware::Link::serial, Refusal::none,
                            true);  // a reset bit that is held is no edge
  ASSERT_EQ(state(), DriveState::fault);
  EXPECT_TRUE(drive.clear());
  EXPECT_EQ(state(), DriveState::switch_on_disabled);
  EXPECT_EQ(fake->controlwords, (std::vector<std::uint16_t>{0, 128, 0}));
}

TEST_F(DriveTest, AFaultWhoseCauseRemainsIsNamed) {
  fake->trip(1, Fault::encoder, 0, 0);
  fake->cause_remains[1] = true;
  const auto message = thrown_message<base::DeviceError>([&] { drive.clear(); });
  EXPECT_CONTAINS(message, "remains");
  EXPECT_CONTAINS(message, "encoder");
}

TEST_F(DriveTest, StopRemovesTheForceAndKeepsItOff) {
  drive.arm();
  drive.stop();
  EXPECT_EQ(state(), DriveState::quick_stop_active);
  drive.stop();
  EXPECT_EQ(state(), DriveState::quick_stop_active);
}

TEST_F(DriveTest, StopAndDisarmAreFineWithAFault) {
  fake->trip(1, Fault::encoder, 0, 0);
  drive.stop();
  drive.disarm();
  EXPECT_EQ(state(), DriveState::fault);
}

// Whichever message is lost while arming, an error never leaves the axis armed behind the user's back.
TEST_F(DriveTest, ALostMessageWhileArmingLeavesNoForce) {
  for (const auto loss : {FakeLink::Loss::request, FakeLink::Loss::reply}) {
    for (int lost = 1; lost < 20; ++lost) {
      link->requests = 0;
      link->loss = loss;
      link->first_lost = link->last_lost = lost;
      bool failed = false;
      try {
        drive.arm();
      } catch (const device::LinkError&) {
        failed = true;
      }
      EXPECT_EQ(fake->machines[1].armed(), !failed) << "request " << lost;
      link->loss = FakeLink::Loss::none;
      drive.disarm();
    }
  }
}

DriveStatus status_in(DriveState state, std::uint16_t error_code) {
  DriveStatus status;
  status.statusword = firmware::statusword::base_of(state);
  status.error_code = error_code;
  return status;
}

TEST(FaultOf, IsTheOneWithTheErrorCode) {
  for (const firmware::FaultText& text : firmware::fault_texts) {
    EXPECT_EQ(fault_of(status_in(DriveState::fault, text.error_code)), text.fault) << text.name;
    EXPECT_EQ(fault_of(status_in(DriveState::fault_reaction_active, text.error_code)), text.fault);
  }
}

TEST(FaultOf, IsNoneWithoutAFaultOrForACodeThatIsNotKnown) {
  for (const DriveState state :
       {DriveState::switch_on_disabled, DriveState::operation_enabled, DriveState::quick_stop_active})
    EXPECT_EQ(fault_of(status_in(state, 0x8130)), Fault::none);
  EXPECT_EQ(fault_of(status_in(DriveState::fault, 0x1234)), Fault::none);
}

}  // namespace kmax::device::drive_test
