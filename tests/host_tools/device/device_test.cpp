#include "host_tools/device/device.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::device_test {

using firmware::Refusal;
using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;
using host_tools_test::thrown_message;

struct Connection {
  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
  FakeLink* link = nullptr;
  std::vector<std::string> notices;

  Device open() {
    auto owned = std::make_unique<FakeLink>(fake);
    link = owned.get();
    return Device(std::move(owned), [this](const std::string& text) { notices.push_back(text); });
  }
};

std::vector<Assignment> assignments(std::vector<std::string> texts) {
  return parse_assignments(texts);
}

class OpenDevice : public testing::Test {
 protected:
  Connection connection;
  Device device = connection.open();
};

TEST_F(OpenDevice, ReadsEverythingInOneRequestPerGroup) {
  connection.fake->registers.values().set_whole<"encoder.direction">(0xFFFFFFFFu, 1);
  connection.fake->registers.values().set_whole<"encoder.offset">(0x89ABCDEFu, 1);
  connection.link->requests = 0;
  const auto values = device.read(all_parameters());
  EXPECT_LE(connection.link->requests, 97);  // groups, each on its axes
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Parameter& parameter = all_parameters()[i];
    EXPECT_EQ(values[i],
              connection.fake->registers.values().raw(firmware::slot_of(parameter.entry(), parameter.axis())))
        << parameter.name();
  }
}

TEST(Device, AnotherDictionaryIsRefusedWithAdvice) {
  Connection connection;
  connection.fake->registers.values().set_whole<"info.dictionary_checksum">(0x12345678);
  const auto message = thrown_message<base::DeviceError>([&] { connection.open(); });
  EXPECT_CONTAINS(message, "firmware 0.1.0");
  EXPECT_CONTAINS(message, "12345678");
  EXPECT_CONTAINS(message, "flash");
}

TEST_F(OpenDevice, SetsManyValuesAtOnceAndReadsThemBack) {
  device.apply(
      assignments({"wall.stiffness=3.58N/mm", "wall.law=magnetic", "axis1.wall.side=-1", "link.timeout=2"}));
  const auto& values = connection.fake->registers.values();
  EXPECT_EQ(values.real<"wall.stiffness">(), 3580.0f);
  EXPECT_EQ(values.whole<"wall.law">(), 2);
  EXPECT_EQ(values.whole<"wall.side">(1), -1);
  EXPECT_EQ(values.real<"link.timeout">(), 2.0f);
  EXPECT_EQ(connection.fake->registers.changes(), 1u);  // one tick, not four
  EXPECT_FALSE(connection.fake->registers.transaction_open());
}

TEST_F(OpenDevice, NothingToSetSendsNothing) {
  connection.link->requests = 0;
  device.apply({});
  EXPECT_EQ(connection.link->requests, 0);
}

TEST_F(OpenDevice, AParameterGivenTwiceIsRefused) {
  const Assignment one{Parameter::of<"wall.stiffness">(), std::bit_cast<std::uint32_t>(5.0f)};
  const Assignment twice[] = {one, one};
  EXPECT_CONTAINS(thrown_message<base::ValueError>([&] { device.apply(twice); }), "twice");
}

TEST_F(OpenDevice, ATargetThatADisarmedAxisDropsIsExplainedAsThat) {
  for (const char* target : {"profile.target_force=1", "axis1.profile.target_torque=100"}) {
    connection.link->after_request = [this](int) {
      for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
        connection.fake->registers.values().set_real<"profile.target_force">(0.0f, axis);
        connection.fake->registers.values().set_whole<"profile.target_torque">(0, axis);
      }
    };
    const auto message = thrown_message<base::DeviceError>([&] { device.apply(assignments({target})); });
    EXPECT_CONTAINS(message, "only while the axis is armed");
    EXPECT_EQ(message.find("another program"), std::string::npos);
  }
}

struct RefusalCase {
  std::vector<Assignment> set;
  std::vector<std::string> said;
};

TEST(Device, EveryRefusalIsExplainedAndChangesNothing) {
  const auto raw = [](auto parameter, std::uint32_t value) { return Assignment{parameter, value}; };
  const std::uint32_t nan = 0x7FC00000, huge = std::bit_cast<std::uint32_t>(2e6f);
  const Assignment good = raw(Parameter::of<"wall.damping">(), std::bit_cast<std::uint32_t>(7.0f));
  const std::vector<RefusalCase> cases = {
      {{good, raw(Parameter::of<"wall.stiffness">(1), huge)},
       {"axis1.wall.stiffness", "2e6 N/m", "0 .. 1e6", "out of range"}},
      {{good, raw(Parameter::of<"wall.stiffness">(), nan)}, {"wall.stiffness", "not a finite"}},
      {{good, raw(Parameter::of<"wall.law">(), 9)},
       {"wall.law", "none, plain, magnetic, adaptive", "not one of the choices"}},
      {assignments({"wall.damping=7", "haptic.rate=333"}), {"haptic.rate = 333 Hz", "must divide"}},
      {assignments({"wall.damping=7", "axis1.wall.adaptive_force_min=5"}),
       {"axis1.wall.adaptive_force_min", "must not exceed"}},
      {assignments({"wall.damping=7", "supply.voltage_min=50"}), {"supply.voltage_min", "must be below"}},
  };
  for (const RefusalCase& one : cases) {
    Connection connection;
    Device device = connection.open();
    const auto before = connection.fake->settings();
    const auto message = thrown_message<base::ValueError>([&] { device.apply(one.set); });
    for (const std::string& part : one.said) EXPECT_CONTAINS(message, part);
    EXPECT_CONTAINS(message, "nothing was changed");
    EXPECT_EQ(connection.fake->settings(), before) << message;
    EXPECT_FALSE(connection.fake->registers.transaction_open()) << message;
    device.apply(std::span(&good, 1));  // and the next set works
  }
}

// A write of another program that succeeds in between clears the reason that the device shows.
TEST_F(OpenDevice, ARefusalWhoseReasonIsGoneIsToldInTheLinksWords) {
  connection.link->requests = 0;
  connection.link->after_request = [this](int request) {
    if (request != 2) return;  // the values; the first opened the transaction
    auto& registers = connection.fake->registers;
    EXPECT_EQ(registers.last_refusal().refusal, Refusal::out_of_range);
    const std::uint16_t drop = 0;
    registers.write(Parameter::of<"transaction.control">().address(), {&drop, 1}, false, 0);
    EXPECT_EQ(registers.last_refusal().refusal, Refusal::none);
  };
  const Assignment huge{Parameter::of<"wall.stiffness">(), std::bit_cast<std::uint32_t>(2e6f)};
  const auto message = thrown_message<base::DeviceError>([&] { device.apply({&huge, 1}); });
  EXPECT_CONTAINS(message, "the device refused function 16 at register");
  EXPECT_CONTAINS(message, "nothing was changed");
  EXPECT_EQ(message.find("not refused"), std::string::npos) << message;
}

TEST_F(OpenDevice, WhatMayNotChangeWhileArmedIsTheMomentsFaultNotTheValues) {
  for (const std::uint16_t word : std::initializer_list<std::uint16_t>{6, 7, 15})
    connection.fake->machines[1].command(word, firmware::Link::serial, Refusal::none, false);
  const auto before = connection.fake->settings();
  const auto message = thrown_message<base::DeviceError>([&] {
    device.apply(assignments({"wall.stiffness=7", "wall.law=magnetic"}));
  });
  EXPECT_CONTAINS(message, "wall.law = magnetic");
  EXPECT_CONTAINS(message, "disarm first");
  EXPECT_EQ(connection.fake->settings(), before);
  device.apply(assignments({"wall.stiffness=7"}));
}

TEST_F(OpenDevice, ABoundThatIsOnlyTightenedWhileArmedIsRefusedWithItsDirectionAndItsCeiling) {
  for (const std::uint16_t word : std::initializer_list<std::uint16_t>{6, 7, 15})
    connection.fake->machines[0].command(word, firmware::Link::serial, Refusal::none, false);
  const auto before = connection.fake->settings();
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { device.apply(assignments({"wall.damping=7"})); }),
                  "it can only be lowered from 0 N s/m, or raised up to wall.damping_ceiling (0 N s/m)");
  EXPECT_CONTAINS(
      thrown_message<base::DeviceError>([&] { device.apply(assignments({"force.ramp_time=0"})); }),
      "it can only be raised from 0.2 s");
  EXPECT_CONTAINS(
      thrown_message<base::DeviceError>([&] { device.apply(assignments({"interference.force=-1"})); }),
      "it can only be brought nearer to 0 from 0 N, or raised up to force.ceiling (0 N)");
  EXPECT_EQ(connection.fake->settings(), before);
}

TEST_F(OpenDevice, ATransactionLeftOpenIsWaitedFor) {
  device.write(Parameter::of<"transaction.control">(), 1, false);
  device.apply(assignments({"wall.stiffness=50"}));
  EXPECT_EQ(connection.fake->registers.values().real<"wall.stiffness">(), 50.0f);
  ASSERT_EQ(connection.notices.size(), 1u);
  EXPECT_CONTAINS(connection.notices[0], "waiting");
}

TEST_F(OpenDevice, ATransactionSomebodyKeepsOpenIsNotWaitedForForEver) {
  device.write(Parameter::of<"transaction.control">(), 1, false);
  connection.link->while_waiting = [&] {
    const std::uint16_t words[] = {0x3F80, 0};
    connection.fake->write_holding(Parameter::of<"wall.damping">().address(), words);
  };
  EXPECT_CONTAINS(
      thrown_message<base::DeviceError>([&] { device.apply(assignments({"wall.stiffness=50"})); }),
      "a transaction is open");
}

TEST_F(OpenDevice, AnotherWriterIsFoundOut) {
  connection.link->after_request = [&](int) {
    if (connection.fake->registers.values().real<"wall.stiffness">() == 3580.0f)
      connection.fake->registers.values().set_real<"wall.stiffness">(42.0f);
  };
  const auto message =
      thrown_message<base::DeviceError>([&] { device.apply(assignments({"wall.stiffness=3580"})); });
  EXPECT_CONTAINS(message, "wall.stiffness was set to 3580 N/m");
  EXPECT_CONTAINS(message, "42 N/m");
}

// The heart of it: whatever message is lost, and however many, the device has the old set or the new one.
class LostMessages : public testing::TestWithParam<std::tuple<FakeLink::Loss, int>> {};

TEST_P(LostMessages, LeaveTheOldSetOrTheNewOne) {
  const auto [loss, how_many] = GetParam();
  const auto wanted =
      assignments({"wall.stiffness=3580", "wall.damping=3", "force.limit=2", "axis1.wall.law=magnetic"});
  int last = 0, failures = 0, successes = 0;
  for (int lost = 1; last == 0 || lost <= last + 1; ++lost) {
    Connection connection;
    Device device = connection.open();
    const auto before = connection.fake->settings();
    connection.link->requests = 0;
    connection.link->loss = loss;
    connection.link->first_lost = lost;
    connection.link->last_lost = lost + how_many - 1;
    std::string message;
    try {
      device.apply(wanted);
    } catch (const device::LinkError& error) {
      message = error.what();
    }
    const int requests = connection.link->requests;
    connection.fake->pass(3'000'000);
    bool old_set = connection.fake->settings() == before, new_set = true;
    for (const Assignment& one : wanted)
      new_set = new_set && connection.fake->registers.values().raw(
                               firmware::slot_of(one.parameter.entry(), one.parameter.axis())) == one.raw;
    EXPECT_NE(old_set, new_set) << "request " << lost << ": " << message;
    EXPECT_FALSE(connection.fake->registers.transaction_open());
    const bool says_new = message.empty() || message.find("the values were set") != std::string::npos;
    const bool says_old = message.find("nothing was changed") != std::string::npos;
    EXPECT_FALSE(says_new && old_set) << "request " << lost << ": " << message;
    EXPECT_FALSE(says_old && new_set) << "request " << lost << ": " << message;
    message.empty() ? ++successes : ++failures;
    if (requests < lost) last = requests;  // beyond the end nothing is lost any more
    ASSERT_LT(lost, 100);
  }
  EXPECT_GT(successes, 0);
  // One lost message before the last step is made good; a line that stays dead is not.
  EXPECT_TRUE(how_many <= 3 || failures > 5);
}

INSTANTIATE_TEST_SUITE_P(RequestsAndReplies, LostMessages,
                         testing::Combine(testing::Values(FakeLink::Loss::request, FakeLink::Loss::reply),
                                          testing::Values(1, 2, 3, 1000)));

// If only the answer to its first message was lost, the program is the one that left the transaction open,
// and need not wait for the device to drop it.
TEST_F(OpenDevice, ItsOwnUnansweredTransactionIsNotWaitedFor) {
  connection.link->requests = 0;
  connection.link->loss = FakeLink::Loss::reply;
  connection.link->first_lost = connection.link->last_lost = 1;
  device.apply(assignments({"wall.stiffness=3580"}));
  EXPECT_TRUE(connection.notices.empty());
}

// A program that is suspended between two messages comes back when the device has dropped the transaction;
// what it would send then would act at once and alone.
TEST(Device, AProgramThatIsSuspendedOnceBeginsAnew) {
  for (int request = 1; request <= 5; ++request) {
    Connection connection;
    Device device = connection.open();
    const auto before = connection.fake->settings();
    std::optional<decltype(connection.fake->settings())> on_waking;
    connection.link->requests = 0;
    connection.link->after_request = [&](int number) {
      if (number == request) connection.fake->pass(5'000'000);
      if (number == request + 1) on_waking = connection.fake->settings();
    };
    device.apply(assignments({"wall.stiffness=3580", "force.limit=2", "axis1.wall.law=magnetic"}));
    const auto& values = connection.fake->registers.values();
    EXPECT_EQ(values.real<"wall.stiffness">(), 3580.0f) << "after request " << request;
    EXPECT_EQ(values.real<"force.limit">(), 2.0f) << "after request " << request;
    EXPECT_FALSE(connection.fake->registers.transaction_open());
    ASSERT_TRUE(on_waking);
    EXPECT_EQ(*on_waking == before, request < 5) << "after request " << request;
  }
}

TEST_F(OpenDevice, AProgramThatIsSuspendedAgainAndAgainGivesUp) {
  const auto before = connection.fake->settings();
  connection.link->requests = 0;
  connection.link->after_request = [&](int) { connection.fake->pass(5'000'000); };
  const auto set = assignments({"wall.stiffness=3580", "force.limit=2"});
  EXPECT_CONTAINS(thrown_message<base::StoodStill>([&] { device.apply(set); }), "too long");
  EXPECT_EQ(connection.link->requests, 6);  // begun and dropped three times
  EXPECT_EQ(connection.fake->settings(), before);
}

}  // namespace kmax::device::device_test
