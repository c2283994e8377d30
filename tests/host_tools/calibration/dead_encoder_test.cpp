#include "tests/host_tools/calibration/calibrated_device.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::calibration_test::dead_encoder_test {

using calibration::CalibrationSettings;
using simulation::Defect;

/// Where the handle really was while a defect came up, which a device with a dead encoder cannot know.
struct Course {
  std::string cause;
  double farthest = 0.0;    // m from the beginning
  double afterwards = 0.0;  // m from where the defect came up
};

/// `planted_at`: counted in reports of progress; 0: from the beginning.
Course course_of(const std::string& scene, const CalibrationSettings& settings, int planted_at) {
  CalibratedDevice device(scene);
  Course course;
  const auto& handle = device.drives().drive(0).handle();
  const double start = handle.position();
  double planted = start;
  const auto look = [&] {
    course.farthest = std::max(course.farthest, std::abs(handle.position() - start));
    course.afterwards = std::max(course.afterwards, std::abs(handle.position() - planted));
  };
  if (planted_at == 0) device.plant(Defect::encoder_stuck);
  device.on_progress = [&] {
    look();
    if (device.length.whole != planted_at) return;
    device.plant(Defect::encoder_stuck);
    planted = handle.position();
    course.afterwards = 0.0;
  };
  const auto report = device.calibrate(settings);
  // A handle that has been thrown still moves.
  for (int i = 0; i < 20; ++i) {
    device.link().wait(std::chrono::milliseconds(20));
    look();
  }
  course.cause = cause_of(report);
  return course;
}

class DeadEncoder : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, DeadEncoder, testing::ValuesIn(representative_scenes()));

TEST_P(DeadEncoder, FromTheBeginningThrowsTheHandleNowhere) {
  const CalibrationSettings settings;
  const Course course = course_of(GetParam(), settings, 0);
  EXPECT_EQ(course.cause, "encoder_dead");
  EXPECT_LE(course.farthest, 2.0 * settings.travel);
}

TEST_P(DeadEncoder, InTheMiddleThrowsTheHandleNowhere) {
  const CalibrationSettings settings;
  const int whole = length_of(GetParam()).whole;
  // Which report of progress it is decides what the handle was doing: a few points prove nothing. Three
  // found 90 mm where 200 found 317.
  const int points = in_a_soak() ? 200 : 16;
  // The trip level of the travel sees nothing: what bounds the motion is the plan of each excitation, and the
  // shorted winding after it.
  // 62 mm was the farthest of 600 moments of three synchronous motors' calibrations, with a travel of 20 mm.
  const double farthest = 4.0 * settings.travel;
  for (int point = 1; point < points; ++point) {
    const int at = whole * point / points;
    const Course course = course_of(GetParam(), settings, at);
    // A dead encoder cannot always be distinguished from a blocked motor or a slipping encoder by then. When
    // the last samples are fetched there is nothing left that it could spoil.
    if (course.afterwards > 0.002) {
      EXPECT_NE(course.cause, "") << "at " << at << " of " << whole;
    }
    EXPECT_LE(course.farthest, farthest) << course.cause << " at " << at << " of " << whole;
  }
}

}  // namespace kmax::calibration_test::dead_encoder_test
