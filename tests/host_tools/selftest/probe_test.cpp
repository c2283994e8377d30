#include "host_tools/selftest/probe.hpp"

#include "tests/host_tools/selftest/tested_axis.hpp"

namespace kmax::selftest::probe_test {

/// A, largest true current of any leg in every tick until it is told to begin again.
class TrueCurrent {
 public:
  explicit TrueCurrent(TestedAxis& tested) : tested_(tested) {
    tested_.link->before_tick = [this] {
      for (const double current : tested_.drives().drive(tested_.axis).leg_currents())
        largest_ = std::max(largest_, std::abs(current));
    };
  }
  ~TrueCurrent() { tested_.link->before_tick = {}; }
  TrueCurrent(const TrueCurrent&) = delete;
  TrueCurrent& operator=(const TrueCurrent&) = delete;
  double largest() const { return largest_; }

 private:
  TestedAxis& tested_;
  double largest_ = 0.0;
};

/// Armed without a run under way, with what the parameters say.
double current_after_arming(TestedAxis& tested, const std::string& kind) {
  tested.device->apply(device::parse_assignments(
      {"drive.mode=excitation", "excitation.kind=" + kind, "excitation.travel=0.0008"}, 0));
  device::Drive drive(*tested.device, 0);
  const TrueCurrent current(tested);
  try {
    drive.arm();
    tested.link->wait(std::chrono::milliseconds(100));
  } catch (const base::DeviceError&) {
    // It trips.
  }
  drive.disarm();
  return current.largest();
}

TEST(Probe, AnInvertedSensorDrivesNoCurrentFromArmingOn) {
  for (const char* scene : host_tools_test::motor_scenes) {
    for (const auto defect :
         {simulation::Defect::current_b_inverted, simulation::Defect::current_c_inverted}) {
      TestedAxis tested(scene);
      tested.plant(defect);
      tested.link->wait(std::chrono::milliseconds(100));
      Probe probe(*tested.device, 0, [](const std::string&) {});
      const TrueCurrent current(tested);
      EXPECT_TRUE(probe.try_arming().armed) << scene;
      ASSERT_TRUE(probe.arm_with_zero_volts()) << scene;
      tested.link->wait(std::chrono::milliseconds(300));
      EXPECT_EQ(probe.bench().drive().status().armed(), true);
      EXPECT_LT(current.largest(), 0.05) << scene;
    }
  }
}

TEST(Probe, WithACurrentControllerThatSensorWouldDriveTheCurrentUp) {
  // Shows that the test above can fail.
  TestedAxis tested("gimbal_b");
  tested.plant(simulation::Defect::current_b_inverted);
  EXPECT_LT(current_after_arming(tested, "voltage"), 0.05);
  EXPECT_GT(current_after_arming(tested, "current"), 0.5);
}

TEST(Probe, WithAnInvertedSensorTheWholeTestStaysBelowTheTestCurrent) {
  for (const char* scene : host_tools_test::motor_scenes) {
    TestedAxis tested(scene);
    tested.plant(simulation::Defect::current_b_inverted);
    const double limit = tested.device->read_number("axis0.current.limit");
    const TrueCurrent current(tested);
    const Report report = tested.run();
    EXPECT_EQ(faulty_part(report), "current sensor B") << text_of(report);
    EXPECT_LT(current.largest(), 0.6 * limit) << scene;
    EXPECT_GT(current.largest(), 0.1 * limit) << scene;
  }
}

TEST(Probe, ArmsWithTheRunThatWasThereAndStartsPulsesByChangingIt) {
  TestedAxis tested("dc_coreless_a");
  const auto run = device::Parameter::of<"excitation.run">(0);
  const std::uint32_t before = tested.device->read(run);
  Probe probe(*tested.device, 0, [](const std::string&) {});
  // What is left in the parameters is not begun by arming.
  probe.bench().journal().set_temporary(
      {"excitation.alternation=5", "excitation.half_period=20", "excitation.duration=1"});
  ASSERT_TRUE(probe.arm_with_zero_volts());
  EXPECT_EQ(tested.device->read(run), before);
  Pulse pulse;
  pulse.voltage = 0.3;
  pulse.half_period = 10;
  pulse.duration = 20;
  const PulseResponse response = probe.give(pulse);
  EXPECT_EQ(tested.device->read(run), before + 1);
  EXPECT_FALSE(response.tripped());
  EXPECT_EQ(response.voltage.at(response.before - 1), 0.0);
  EXPECT_NEAR(response.voltage.at(response.before), 0.3, 1e-6);
  EXPECT_TRUE(probe.restore().in_order);
  EXPECT_EQ(tested.device->read(run), before);
}

}  // namespace kmax::selftest::probe_test
