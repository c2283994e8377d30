// The flashed image calibrated on the virtual board, by the tool that users have, against the truth of the
// simulated motors; and the self-test with what only this board has.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "host_tools/calibration/procedure.hpp"
#include "host_tools/selftest/selftest.hpp"
#include "tests/host_tools/calibration/calibrated_device.hpp"
#include "tests/host_tools/calibration/procedure_accuracy.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests::calibration_test {

/// A board with the motor of a scene that nobody has identified.
struct Bench {
  explicit Bench(const std::string& name, const ImageBench::Parameters& parameters = {})
      : image(parameters, 0.0, name), device(started(image)) {}

  selftest::Report test() {
    selftest::SelfTestSettings settings;
    return selftest::run_selftest(device, settings, [](const std::string&) {});
  }

  ImageBench image;
  device::Device device;

 private:
  static std::unique_ptr<device::Link> started(ImageBench& image) {
    image.start();
    return std::make_unique<virtual_board::BoardLink>(*image.board);
  }
};

std::string text_of(const selftest::Report& report) {
  std::string text;
  for (const selftest::CheckResult& check : report.checks)
    text += check.name + ": " + selftest::name_of(check.verdict) + " [" + check.part + "] " + check.message +
            "\n";
  return text;
}

class ImageCalibration : public testing::TestWithParam<const char*> {};

TEST_P(ImageCalibration, FindsTheMotorWithinItsBounds) {
  Bench bench(GetParam(), {{"modbus.baud_rate", std::int64_t{460800}}});
  std::string last;
  calibration::CalibrationSettings settings;
  settings.repetitions = 2;  // the fewest: natively all are made
  const auto report = calibration::calibrate(
      bench.device, settings, nullptr, [&](const std::string& text) { last = text.empty() ? last : text; });
  ASSERT_TRUE(report.pass()) << kmax::calibration_test::cause_of(report) << "; " << last;
  EXPECT_TRUE(report.stored);
  for (const kmax::calibration_test::Judged& one :
       kmax::calibration_test::judge(bench.image.scene.axes[0], report))
    EXPECT_TRUE(one.good()) << one.name << ": " << one.found << ", truth " << one.truth;
}

// A minute or more each: a soak takes all. Natively all run each time, and a calibration is in
// bring_up_test.cpp.
std::vector<const char*> scenes() {
  if (!in_a_soak()) return {};
  return {std::begin(kmax::calibration_test::motor_scenes), std::end(kmax::calibration_test::motor_scenes)};
}
INSTANTIATE_TEST_SUITE_P(Scenes, ImageCalibration, testing::ValuesIn(scenes()));
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ImageCalibration);

TEST(ImageSelfTest, AHealthyBoardPasses) {
  Bench bench("gimbal_a");
  const auto report = bench.test();
  EXPECT_TRUE(report.pass()) << text_of(report);
}

TEST(ImageSelfTest, NamesTheSupplyTheEmergencyStopAndAPhase) {
  {
    Bench bench("dc_coreless_a");
    bench.image.world.supply().set_source(9.0);
    bench.image.board->run_for(0.2);
    const auto report = bench.test();
    ASSERT_NE(report.first_failure(), nullptr) << text_of(report);
    EXPECT_NE(report.first_failure()->part.find("supply"), std::string::npos) << text_of(report);
  }
  {
    Bench bench("gimbal_a");
    bench.image.world.drives().plant(0, simulation::Defect::phase_b_open);
    const auto report = bench.test();
    ASSERT_NE(report.first_failure(), nullptr) << text_of(report);
    EXPECT_NE(report.first_failure()->part.find("phase B"), std::string::npos) << text_of(report);
  }
}

}  // namespace kmax::tests::calibration_test
