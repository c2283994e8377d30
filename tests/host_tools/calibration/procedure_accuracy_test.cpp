#include "tests/host_tools/calibration/procedure_accuracy.hpp"

namespace kmax::calibration_test::procedure_accuracy_test {
namespace {

class Accuracy : public testing::TestWithParam<const char*> {};

// Seeds of the sensors' noise; scripts that measure the worst of many use the same judge().
TEST_P(Accuracy, EverythingIsFoundWithinItsBounds) {
  for (const std::uint64_t seed : {1u, 2u}) {
    CalibratedDevice device(GetParam(), seed);
    const auto report = device.calibrate();
    ASSERT_TRUE(report.pass()) << seed << ": " << cause_of(report);
    EXPECT_TRUE(report.stored);
    for (const Judged& one : judge(device, report))
      EXPECT_TRUE(one.good()) << "seed " << seed << ", " << one.name << ": " << one.found << ", truth "
                              << one.truth;
  }
}

// The identified motor moves: what was set is what control needs.
TEST_P(Accuracy, TheCalibratedAxisCanBeArmedAndPushesTheRightWay) {
  CalibratedDevice device(GetParam(), 4);
  ASSERT_TRUE(device.calibrate().pass());
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

INSTANTIATE_TEST_SUITE_P(Scenes, Accuracy, testing::ValuesIn(scene_names));

}  // namespace
}  // namespace kmax::calibration_test::procedure_accuracy_test
