#include "host_tools/device/sim/sim_link.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "firmware/capture/trace.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"
#include "host_tools/device/parameter.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::sim_link_test {

using device::Parameter;
using host_tools_test::thrown_message;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

class SimLinkTest : public testing::Test {
 protected:
  std::unique_ptr<SimLink> link = make_sim_link();

  /// Exception code, function and address of the refusal.
  template <typename Call>
  void expect_refused(Call call, int exception, int function, int address) {
    try {
      call();
      ADD_FAILURE() << "not refused";
    } catch (const RegisterRefused& error) {
      EXPECT_EQ(error.exception(), exception);
      EXPECT_EQ(error.function(), function);
      EXPECT_EQ(error.address(), address);
    }
  }
};

constexpr Parameter stiffness = Parameter::of<"wall.stiffness">();
constexpr Parameter unit = Parameter::of<"modbus.unit">();
constexpr Parameter baud = Parameter::of<"modbus.baud_rate">();

TEST_F(SimLinkTest, WritesAreReadBackWordForWord) {
  const std::vector<std::uint16_t> words = {0x4560, 0x1234};  // 3585.1377 N/m
  link->write_holding(stiffness.address(), words);
  EXPECT_EQ(link->read_holding(stiffness.address(), 2), words);
  link->write_holding_idempotent(stiffness.address(), std::vector<std::uint16_t>{0, 0});
  EXPECT_EQ(link->read_holding(stiffness.address(), 2), (std::vector<std::uint16_t>{0, 0}));
  EXPECT_EQ(link->description(), "sim");
}

TEST_F(SimLinkTest, LongestReadHasAllItsRegisters) {
  EXPECT_EQ(link->read_input(firmware::trace_window, RegisterLink::read_count_max).size(),
            RegisterLink::read_count_max);
}

TEST_F(SimLinkTest, RefusalsCarryTheException) {
  expect_refused([&] { link->read_holding(0x7000, 1); }, 2, 3, 0x7000);
  expect_refused([&] { link->read_input(0xC000, 1); }, 2, 4, 0xC000);
  // Nothing has been captured.
  expect_refused([&] { link->read_input(firmware::capture_window, 1); }, 6, 4, firmware::capture_window);
  expect_refused([&] { link->read_input(firmware::trace_window, 126); }, 3, 4, firmware::trace_window);
  expect_refused([&] { link->read_holding(0, 0); }, 3, 3, 0);
  const std::vector<std::uint16_t> nan = {0x7FC0, 0}, negative = {0xBF80, 0};
  expect_refused([&] { link->write_holding(stiffness.address(), nan); }, 3, 16, stiffness.address());
  expect_refused([&] { link->write_holding(stiffness.address(), negative); }, 3, 16, stiffness.address());
  expect_refused([&] { link->write_holding(0x7000, nan); }, 2, 16, 0x7000);
  expect_refused([&] { link->write_holding(stiffness.address(), {}); }, 3, 16, stiffness.address());
  EXPECT_EQ(link->read_holding(stiffness.address(), 2), (std::vector<std::uint16_t>{0x447A, 0}));
}

TEST_F(SimLinkTest, IdentifiesItselfAsTheNativeBoard) {
  const auto texts = link->identify();
  EXPECT_EQ(texts.at("vendor_name"), "Kmax");
  EXPECT_EQ(texts.at("model_name"), "native");
  EXPECT_EQ(texts.at("revision"), firmware::firmware_version_text);
}

TEST_F(SimLinkTest, FollowsAnotherUnit) {
  link->write_holding(unit.address(), std::vector<std::uint16_t>{17});
  link->follow_serial_settings(17, std::nullopt);
  EXPECT_EQ(link->read_holding(unit.address(), 1), std::vector<std::uint16_t>{17});
  EXPECT_EQ(link->identify().at("vendor_name"), "Kmax");
}

TEST_F(SimLinkTest, AWrongUnitIsAnsweredBySilence) {
  link->follow_serial_settings(9, std::nullopt);
  const auto before = link->now();
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { link->read_holding(0, 1); }), "did not answer within 1 s");
  EXPECT_GE(link->now() - before, seconds(1));
  EXPECT_THROW(link->identify(), LinkError);
  link->follow_serial_settings(1, std::nullopt);
  EXPECT_EQ(link->read_holding(unit.address(), 1), std::vector<std::uint16_t>{1});
}

TEST_F(SimLinkTest, AnotherBaudRateChangesHowLongRequestsTake) {
  const auto duration = [&] {
    const auto before = link->now();
    link->read_input(firmware::trace_window, 100);
    return link->now() - before;
  };
  const auto fast = duration();
  link->write_holding(baud.address(), std::vector<std::uint16_t>{0, 9600});
  link->follow_serial_settings(std::nullopt, 9600);
  // 213 characters of 10 or 11 bits at 9600 baud.
  EXPECT_GT(duration(), milliseconds(220));
  EXPECT_LT(fast, milliseconds(40));
}

TEST_F(SimLinkTest, TimePassesOnlyWhenAskedInWholeTicks) {
  EXPECT_EQ(link->now(), microseconds(0));
  link->wait(microseconds(1));
  EXPECT_EQ(link->now(), microseconds(50));
  link->wait(microseconds(50));
  EXPECT_EQ(link->now(), microseconds(100));
  link->wait(microseconds(0));
  link->wait(microseconds(-1'000'000));
  EXPECT_EQ(link->now(), microseconds(100));
  link->read_holding(0, 2);
  EXPECT_GT(link->now(), microseconds(500));
}

TEST_F(SimLinkTest, EveryLinkIsADeviceOfItsOwnFreshFromTheFactory) {
  link->write_holding(stiffness.address(), std::vector<std::uint16_t>{0, 0});
  const auto other = make_sim_link();
  EXPECT_EQ(other->read_holding(stiffness.address(), 2), (std::vector<std::uint16_t>{0x447A, 0}));
}

TEST(SimLinkScene, StartsWithTheScenesParameters) {
  simulation::Scene scene = simulated_board::factory_scene();
  scene.parameters = {{"modbus.unit", std::int64_t{33}, ""}, {"wall.stiffness", 0.0, ""}};
  SimLink link(scene);
  EXPECT_EQ(link.read_holding(stiffness.address(), 2), (std::vector<std::uint16_t>{0, 0}));
  scene.parameters = {{"haptic.rate", 333.0, ""}};
  EXPECT_CONTAINS(thrown_message<simulation::SceneError>([&] { SimLink refused(scene); }), "haptic.rate");
}

// Whatever is asked: an answer of the right size or a refusal, and the same again on another device.
RC_GTEST_PROP(SimLinkProperty, AnyReadIsAnsweredOrRefused, ()) {
  const auto address = *rc::gen::arbitrary<std::uint16_t>();
  const auto count = *rc::gen::inRange<std::uint16_t>(0, 300);
  const bool holding = *rc::gen::arbitrary<bool>();
  const auto ask = [&]() -> std::optional<std::vector<std::uint16_t>> {
    const auto link = make_sim_link();
    try {
      return holding ? link->read_holding(address, count) : link->read_input(address, count);
    } catch (const RefusedError&) {
      return std::nullopt;
    }
  };
  const auto first = ask();
  if (first) RC_ASSERT(first->size() == count);
  RC_ASSERT(first == ask());
}

}  // namespace kmax::device::sim_link_test
