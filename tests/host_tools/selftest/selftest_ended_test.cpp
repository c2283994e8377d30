// What the self-test does when it cannot go on as planned, and what it leaves behind.
#include "host_tools/base/errors.hpp"
#include "host_tools/selftest/selftest.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/shared_beginning.hpp"

namespace kmax::selftest::selftest_ended_test {

using host_tools_test::thrown_message;

bool force_is_possible(TestedAxis& tested) {
  const auto& legs = tested.drives().bridge(tested.axis).legs;
  return legs[1].enabled || legs[2].enabled;
}

TEST(SelfTestLeaves, WhereverItIsInterruptedTheAxisIsDisarmedAndTheParametersAreAsBefore) {
  SharedBeginning::run([](SharedBeginning& beginning) {
    TestedAxis tested("gimbal_b");
    const auto before = tested.settings();
    int messages = 0;
    SelfTestSettings settings;
    settings.link_exchanges = 10;
    try {
      run_selftest(*tested.device, settings, [&](const std::string& text) {
        if (++messages % 3 == 1 && beginning.fork(text)) throw std::runtime_error("interrupted");
      });
      EXPECT_FALSE(beginning.in_copy());
      EXPECT_GT(beginning.copies(), 8U);
    } catch (const SelfTestEnded& error) {
      const std::string text = error.what();
      EXPECT_TRUE(text == "interrupted; the axis is disarmed; every parameter is as it was" ||
                  text == "interrupted; nothing was changed in the device")
          << text;
      EXPECT_TRUE(beginning.in_copy());
    }
    EXPECT_TRUE(tested.disarmed());
    EXPECT_EQ(tested.settings(), before);
  });
}

TEST(SelfTestLeaves, WhatIsNoExceptionOfTheLibraryPassesThrough) {
  struct Stop {};
  TestedAxis tested("dc_coreless_a");
  const auto before = tested.settings();
  EXPECT_THROW(run_selftest(*tested.device, {},
                            [](const std::string& text) {
                              if (text.starts_with("a pulse")) throw Stop{};
                            }),
               Stop);
  EXPECT_TRUE(tested.disarmed());
  EXPECT_EQ(tested.settings(), before);
}

TEST(SelfTestLeaves, AfterAPulledCableTheDeviceRemovesTheForceByItself) {
  // These scenes have link.timeout = 0, with which the force would stay.
  for (const char* scene : {"dc_coreless_a", "gimbal_b"}) {
    TestedAxis tested(scene);
    ASSERT_EQ(tested.device->read_number("link.timeout"), 0.0);
    Probe probe(*tested.device, 0, [](const std::string&) {});
    ASSERT_TRUE(probe.arm_with_zero_volts());
    tested.link->wait(std::chrono::milliseconds(500));
    EXPECT_TRUE(force_is_possible(tested)) << scene;
    tested.link->wait(std::chrono::milliseconds(600));
    EXPECT_FALSE(force_is_possible(tested)) << scene;
    EXPECT_EQ(device::Drive(*tested.device, 0).status().error_code, 0x8130);
    const Restored restored = probe.restore();
    EXPECT_TRUE(restored.in_order) << restored.words;
    EXPECT_FALSE(device::Drive(*tested.device, 0).status().faulty());
    EXPECT_EQ(tested.device->read_number("link.timeout"), 0.0);
  }
}

TEST(SelfTestLeaves, ALostLinkIsToldWithWhatIsKnownOfTheAxis) {
  TestedAxis tested("gimbal_b");
  int pulses = 0;
  const std::string text = thrown_message<SelfTestEnded>([&] {
    run_selftest(*tested.device, {}, [&](const std::string& told_text) {
      if (told_text.starts_with("a pulse") && ++pulses == 3) {
        // In the pulse itself.
        tested.link->before_tick = [&tested] {
          if (force_is_possible(tested)) tested.link->cut();
        };
      }
    });
  });
  EXPECT_NE(text.find("the axis could not be disarmed"), std::string::npos) << text;
  EXPECT_NE(text.find("link.timeout"), std::string::npos) << text;
  EXPECT_NE(text.find("may still be as the test has set them"), std::string::npos) << text;
  EXPECT_EQ(text.find("as it was"), std::string::npos) << text;
  tested.link->before_tick = {};
  tested.link->wait(std::chrono::milliseconds(1100));
  EXPECT_FALSE(force_is_possible(tested));
}

TEST(SelfTestLeaves, AFaultThatWasThereBeforeIsReportedAndCleared) {
  TestedAxis tested("dc_coreless_a");
  device::Drive drive(*tested.device, 0);
  drive.arm();
  auto& power = tested.link->hardware().power();
  power.press_emergency_stop(true);
  tested.link->wait(std::chrono::milliseconds(10));
  ASSERT_TRUE(drive.status().faulty());
  {
    Probe probe(*tested.device, 0, [](const std::string&) {});
    const auto before = probe.clear_fault_at_start();
    ASSERT_TRUE(before.has_value());
    EXPECT_FALSE(before->cleared);
  }
  power.press_emergency_stop(false);
  tested.link->wait(std::chrono::milliseconds(100));
  const Report report = tested.run();
  EXPECT_TRUE(report.pass()) << text_of(report);
  ASSERT_TRUE(report.fault_at_start.has_value());
  EXPECT_EQ(report.fault_at_start->fault, firmware::Fault::emergency_stop);
  EXPECT_TRUE(report.fault_at_start->cleared);
  EXPECT_NE(report.fault_at_start->words.find(firmware::text_of(firmware::Fault::emergency_stop).what),
            std::string::npos);
  EXPECT_FALSE(drive.status().faulty());
  // And the next one has none.
  EXPECT_FALSE(tested.run().fault_at_start.has_value());
}

TEST(SelfTestLeaves, AHandThatMovesTheHandleIsAFailedCheck) {
  // The person of these scenes begins to move when the axis is armed. One board has no power stage.
  for (const char* name : {"motor_axes", "touch"}) {
    simulation::Scene scene = simulated_board::open_scene(name);
    scene.identified = true;
    TestedAxis tested(scene, 0);
    const auto before = tested.settings();
    const Report report = tested.run();
    EXPECT_EQ(faulty_part(report), "handle") << name << "\n" << text_of(report);
    EXPECT_NE(report.first_failure()->message.find("something else moved the handle; let go of it"),
              std::string::npos);
    EXPECT_TRUE(tested.disarmed());
    EXPECT_EQ(tested.settings(), before);
  }
}

}  // namespace kmax::selftest::selftest_ended_test
