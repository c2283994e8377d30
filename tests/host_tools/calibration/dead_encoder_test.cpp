#include <fmt/format.h>

#include <set>
#include <utility>

#include "tests/host_tools/calibration/calibrated_device.hpp"
#include "tests/in_a_soak.hpp"
#include "tests/shared_beginning.hpp"

namespace kmax::calibration_test::dead_encoder_test {

using calibration::CalibrationSettings;
using simulation::Defect;

/// Where the handle really was while a defect came up, which a device with a dead encoder cannot know.
struct Course {
  std::string cause;
  bool planted = false;
  double farthest = 0.0;    // m from the beginning
  double afterwards = 0.0;  // m from where the defect came up
};

/// Asked before the calibration and at each report of progress until it says that the defect comes up now.
using Moment = std::function<bool(CalibratedDevice&)>;

Course course_of(const std::string& scene, const CalibrationSettings& settings, const Moment& comes_up) {
  CalibratedDevice device(scene);
  Course course;
  const auto& handle = device.drives().drive(0).handle();
  const double start = handle.position();
  double planted = start;
  const auto look = [&] {
    course.farthest = std::max(course.farthest, std::abs(handle.position() - start));
    course.afterwards = std::max(course.afterwards, std::abs(handle.position() - planted));
  };
  const auto plant_in_time = [&] {
    if (course.planted || !comes_up(device)) return;
    course.planted = true;
    device.plant(Defect::encoder_stuck);
    planted = handle.position();
    course.afterwards = 0.0;
  };
  device.on_progress = [&] {
    look();
    plant_in_time();
  };
  plant_in_time();
  const auto report = device.calibrate(settings);
  // A handle that has been thrown still moves.
  for (int i = 0; i < 20; ++i) {
    device.link().wait(std::chrono::milliseconds(20));
    look();
  }
  course.cause = cause_of(report);
  return course;
}

/// The record is complete and its excitation still runs.
bool runs_after_its_record(CalibratedDevice& device) {
  firmware::Application& application = device.link().simulation().board().application();
  application.refresh_readings();
  const auto capture = static_cast<firmware::CaptureState>(application.values().whole<"capture.state">());
  const firmware::AxisReport report = application.ISR_report(0);
  return capture == firmware::CaptureState::complete && report.enabled && !report.motor.excitation_finished &&
         application.values().whole<"drive.mode">(0) ==
             static_cast<std::uint32_t>(firmware::DriveMode::excitation);
}

/// The beginnings of the tails, into which reports of progress fall, of the waves that shake a handle.
class BeginningOfTail {
 public:
  bool operator()(CalibratedDevice& device) {
    const bool shakes = device.step == "torque_constant" || device.step == "motion";
    const bool inside = shakes && runs_after_its_record(device);
    const bool before = std::exchange(inside_, inside);
    return inside && !before;
  }

 private:
  bool inside_ = false;
};

/// The defect comes up at each of `moments` of one calibration, in a copy of the process, where `judge` is
/// told of the course and of the report of progress; without it everything passes. Returns how many moments
/// there were.
std::size_t plant_at_each(const std::string& scene, const Moment& moments,
                          const std::function<void(const Course&, int)>& judge) {
  std::size_t copies = 0;
  SharedBeginning::run([&](SharedBeginning& beginning) {
    int report = 0;
    const Course course = course_of(scene, {}, [&](CalibratedDevice& device) {
      report = device.length.whole;
      return moments(device) && beginning.fork(fmt::format("at report {}", report));
    });
    if (beginning.in_copy()) return judge(course, report);
    EXPECT_EQ(course.cause, "") << "nothing is planted";
    copies = beginning.copies();
  });
  return copies;
}

class DeadEncoder : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, DeadEncoder, testing::ValuesIn(representative_scenes()));

TEST_P(DeadEncoder, FromTheBeginningThrowsTheHandleNowhere) {
  const CalibrationSettings settings;
  const Course course = course_of(GetParam(), settings, [](CalibratedDevice&) { return true; });
  EXPECT_EQ(course.cause, "encoder_dead");
  EXPECT_LE(course.farthest, 2.0 * settings.travel);
}

TEST_P(DeadEncoder, InTheMiddleThrowsTheHandleNowhere) {
  const CalibrationSettings settings;
  const int whole = length_of(GetParam()).whole;
  // Which report of progress it is decides what the handle was doing: a few points prove nothing. Three
  // found 90 mm where 200 found 317.
  const int points = in_a_soak() ? 200 : 16;
  std::set<int> reports;
  for (int point = 1; point < points; ++point) reports.insert(whole * point / points);
  const auto due = [&](CalibratedDevice& device) { return reports.contains(device.length.whole); };
  // The trip level of the travel sees nothing: what bounds the motion is the plan of each excitation, and the
  // shorted winding after it.
  // 62 mm was the farthest of 600 moments of three synchronous motors' calibrations, with a travel of 20 mm.
  const double farthest = 4.0 * settings.travel;
  const std::size_t planted = plant_at_each(GetParam(), due, [&](const Course& course, int at) {
    // A dead encoder cannot always be distinguished from a blocked motor or a slipping encoder by then. When
    // the last samples are fetched there is nothing left that it could spoil.
    if (course.afterwards > 0.002) {
      EXPECT_NE(course.cause, "") << "at " << at << " of " << whole;
    }
    EXPECT_LE(course.farthest, farthest) << course.cause << " at " << at << " of " << whole;
  });
  EXPECT_EQ(planted, points - 1U);
}

// What was recorded is sound, and the next wave begins under a dead encoder.
TEST_P(DeadEncoder, BetweenARecordAndTheEndOfItsExcitationThrowsTheHandleNowhere) {
  const CalibrationSettings settings;
  const std::size_t tails = plant_at_each(GetParam(), BeginningOfTail(), [&](const Course& course, int at) {
    if (course.afterwards > 0.002) {
      EXPECT_NE(course.cause, "") << "in the tail at report " << at;
    }
    EXPECT_LE(course.farthest, 4.0 * settings.travel) << course.cause << " in the tail at report " << at;
  });
  EXPECT_GT(tails, 5U);
}

}  // namespace kmax::calibration_test::dead_encoder_test
