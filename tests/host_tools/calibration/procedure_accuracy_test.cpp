#include "tests/host_tools/calibration/procedure_accuracy.hpp"

namespace kmax::calibration_test::procedure_accuracy_test {

class Accuracy : public testing::TestWithParam<const char*> {};

void expect_accurate(const CalibratedDevice& device, const calibration::CalibrationReport& report) {
  ASSERT_TRUE(report.pass()) << cause_of(report);
  EXPECT_TRUE(report.stored);
  for (const Judged& one : judge(device, report))
    EXPECT_TRUE(one.good()) << one.name << ": " << one.found << ", truth " << one.truth;
}

/// The identified motor moves: what was set is what control needs.
void expect_push_in_the_right_direction(CalibratedDevice& device) {
  device.set({"wall.law=plain", "wall.position=-1", "drive.mode=haptic"});
  device::Drive drive(device.device(), 0);
  drive.arm();
  EXPECT_TRUE(drive.status().armed());
  drive.disarm();
  // More than friction and cogging hold.
  const double current = 0.15 * device.device().read_number("current.limit");
  const std::string bias = "excitation.bias=" + std::to_string(current);
  device.set({"drive.mode=excitation", "excitation.kind=torque", bias, "excitation.duration=0.02",
              "excitation.ramp=0", "excitation.travel=0.1"});
  const double before = device.device().read_number("measured.position");
  drive.arm();
  const auto run = static_cast<int>(device.device().read_number("excitation.run"));
  device.set({"excitation.run=" + std::to_string(run == 1 ? 2 : 1)});
  device.link().wait(std::chrono::milliseconds(60));
  EXPECT_GT(device.device().read_number("measured.position"), before);
  drive.disarm();
}

// Seeds of the sensors' noise; tests/benchmarks measures the worst of many by the same judge().
TEST_P(Accuracy, EverythingIsFoundWithinItsBoundsAndTheAxisPushesTheRightWay) {
  for (const std::uint64_t seed : {1u, 2u}) {
    SCOPED_TRACE(seed);
    CalibratedDevice device(GetParam(), seed);
    ASSERT_NO_FATAL_FAILURE(expect_accurate(device, device.calibrate()));
    if (seed == 2) expect_push_in_the_right_direction(device);
  }
}

// A share of the travel that is always lost looks like another torque constant; only what was found before
// shows it.
TEST_P(Accuracy, LostTravelIsSeenAgainstTheCalibrationBefore) {
  CalibratedDevice device(GetParam());
  ASSERT_TRUE(device.calibrate().pass());
  EXPECT_EQ(device.records(), 1u);
  const auto before = device.parameters();
  device.plant(simulation::Defect::encoder_slipping);
  EXPECT_EQ(cause_of(device.calibrate()), "encoder_slipping");
  EXPECT_EQ(device.parameters(), before);
}

// What pulls it back to the middle leaves it swinging past it.
TEST(CalibrationAccuracy, AHandleOfLittleFrictionOnCoarseDetentsStaysWithinItsTravel) {
  simulation::Scene scene = simulated_board::open_scene("gimbal_b");
  scene.axes[0].device = {.mass = 0.094, .damping = 0.49, .friction = 0.05, .force_limit = 0.0};
  std::get<simulation::SynchronousMotorConfig>(*scene.axes[0].motor).cogging_torque = 1.5e-3;
  CalibratedDevice device(scene);
  const auto report = device.calibrate();
  EXPECT_TRUE(report.pass()) << cause_of(report);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Accuracy, testing::ValuesIn(motor_scenes));

}  // namespace kmax::calibration_test::procedure_accuracy_test
