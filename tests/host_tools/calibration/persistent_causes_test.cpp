#include <functional>

#include "tests/host_tools/calibration/calibrated_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::calibration_test::persistent_causes_test {
namespace {

using simulation::Defect;

struct Cause {
  const char* name;
  std::function<void(CalibratedDevice&)> happens;
};

const Cause causes[] = {
    {"supply_too_low", [](CalibratedDevice& device) { device.plant(Defect::supply_low); }},
    {"encoder_dead", [](CalibratedDevice& device) { device.plant(Defect::encoder_unplugged); }},
    {"emergency_stop",
     [](CalibratedDevice& device) {
       device.link().simulation().device().power().press_emergency_stop(true);
     }},
};

class Persistent : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, Persistent, testing::Values("dc_coreless_a", "gimbal_b"));

// The fault cannot be cleared afterwards: a verdict all the same, and everything is put back.
TEST_P(Persistent, ACauseThatStaysIsTheDiagnosisOfTheStepThatMeetsIt) {
  CalibratedDevice whole(GetParam());
  whole.calibrate();
  constexpr int points = 6;
  for (const Cause& cause : causes) {
    for (int point = 0; point < points; ++point) {
      CalibratedDevice device(GetParam());
      const auto before = device.parameters();
      const int at = 1 + whole.told * point / points;
      int told = 0;
      calibration::CalibrationReport report;
      ASSERT_NO_THROW(report = calibration::calibrate(device.device(), {}, nullptr,
                                                      [&](const std::string&) {
                                                        if (++told == at) cause.happens(device);
                                                      }))
          << cause.name << " at " << at;
      // A quadrature encoder that falls silent late is not always told from a handle that is held.
      const bool silent =
          std::string_view(cause.name) == "encoder_dead" && cause_of(report) == "motor_blocked";
      EXPECT_TRUE(silent || cause_of(report) == cause.name) << cause_of(report) << " at " << at;
      EXPECT_FALSE(report.stored);
      EXPECT_FALSE(device.armed());
      EXPECT_EQ(device.parameters(), before) << cause.name << " at " << at;
    }
  }
}

// A host that is killed leaves no force: link.timeout is on meanwhile, and off again afterwards.
TEST(LinkTimeout, IsOnDuringTheProcedureAndAsBeforeAfterwards) {
  for (const double before : {0.0, 60.0, 0.5}) {
    CalibratedDevice device("dc_coreless_a");
    device.device().apply(device::parse_assignments({"link.timeout=" + std::to_string(before)}));
    double within = -1.0;
    calibration::CalibrationSettings settings;
    settings.sets = {true, false, false, false};
    const auto report = calibration::calibrate(device.device(), settings, nullptr, [&](const std::string&) {
      if (within < 0.0) within = device.device().read_number("link.timeout");
    });
    EXPECT_TRUE(report.pass());
    EXPECT_EQ(within, before == 0.5 ? 0.5 : 1.0);
    EXPECT_EQ(device.device().read_number("link.timeout"), before);
  }
}

TEST(PutBack, AnInterruptionSaysSoWhenItIsDone) {
  CalibratedDevice device("dc_coreless_a");
  device.interrupt_at = 40;
  EXPECT_CONTAINS(
      host_tools_test::thrown_message<calibration::CalibrationInterrupted>([&] { device.calibrate(); }),
      "all parameters are as before");
}

}  // namespace
}  // namespace kmax::calibration_test::persistent_causes_test
