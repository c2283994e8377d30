#include <functional>

#include "tests/host_tools/calibration/calibrated_device.hpp"
#include "tests/shared_beginning.hpp"

namespace kmax::calibration_test::persistent_causes_test {

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
INSTANTIATE_TEST_SUITE_P(Scenes, Persistent, testing::ValuesIn(representative_scenes()));

// In the middle of each step. The fault cannot be cleared afterwards: a verdict all the same, and everything
// is put back.
TEST_P(Persistent, ACauseThatStaysIsTheDiagnosisOfTheStepThatMeetsIt) {
  const std::map<std::string, int>& lengths = length_of(GetParam()).in_step;
  SharedBeginning::run([&](SharedBeginning& beginning) {
    CalibratedDevice device(GetParam());
    const auto before = device.parameters();
    const Cause* there = nullptr;
    device.on_progress = [&] {
      if (there != nullptr || device.length.in_step[device.step] != 1 + lengths.at(device.step) / 2) return;
      for (const Cause& cause : causes) {
        if (!beginning.fork(std::string(cause.name) + " in " + device.step)) continue;
        there = &cause;
        return cause.happens(device);
      }
    };
    const calibration::CalibrationReport report = device.calibrate();
    if (there == nullptr) {
      EXPECT_TRUE(report.pass()) << cause_of(report);
      EXPECT_EQ(beginning.copies(), std::size(causes) * lengths.size());
      return;
    }
    // A quadrature encoder that falls silent late is not always distinguished from a handle that is held.
    const bool silent =
        std::string_view(there->name) == "encoder_dead" && cause_of(report) == "motor_blocked";
    EXPECT_TRUE(silent || cause_of(report) == there->name) << cause_of(report);
    EXPECT_FALSE(report.stored);
    EXPECT_FALSE(device.armed());
    EXPECT_EQ(device.parameters(), before);
  });
}

// A host that is killed leaves no force: link.timeout is on meanwhile, and off again afterwards.
TEST(LinkTimeout, IsOnDuringTheProcedureAndAsBeforeAfterwards) {
  for (const double before : {0.0, 60.0, 0.5}) {
    CalibratedDevice device("dc_coreless_a");
    device.set({"link.timeout=" + std::to_string(before)});
    double within = -1.0;
    device.on_progress = [&] {
      if (within < 0.0) within = device.device().read_number("link.timeout");
    };
    calibration::CalibrationSettings settings;
    settings.sets = {true, false, false, false};
    EXPECT_TRUE(device.calibrate(settings).pass());
    EXPECT_EQ(within, before == 0.5 ? 0.5 : 1.0);
    EXPECT_EQ(device.device().read_number("link.timeout"), before);
  }
}

}  // namespace kmax::calibration_test::persistent_causes_test
