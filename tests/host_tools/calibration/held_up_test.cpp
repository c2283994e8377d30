// A host that is not run for more than link.timeout finds its axis off. That is no finding about the axis,
// and no reason to throw away what has been measured.
#include "host_tools/bench/held_up.hpp"

#include <set>

#include "host_tools/base/errors.hpp"
#include "host_tools/bench/bench.hpp"
#include "tests/host_tools/calibration/procedure_accuracy.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/in_a_soak.hpp"
#include "tests/shared_beginning.hpp"

namespace kmax::calibration_test::held_up_test {

using calibration::CalibrationReport;
using calibration::CalibrationSettings;
using std::chrono::milliseconds;

constexpr milliseconds too_long{1100};  // link.timeout is 1 s

struct HeldUpDevice {
  explicit HeldUpDevice(const std::string& name)
      : scene(simulated_board::open_scene(name)),
        link(new host_tools_test::DisturbedLink(scene)),
        device(std::unique_ptr<device::Link>(link)) {
    device.apply(device::parse_assignments({"modbus.baud_rate=921600"}));
    link->wait(milliseconds(300));  // the power stage starts
    link->before_request = [this] {
      const auto& legs = link->sim.simulation().device().power().drives().bridge(0).legs;
      if (!held_up || !(legs[1].enabled || legs[2].enabled) || !held_up()) return;
      ++times;
      link->wait(too_long);
    };
  }
  std::vector<std::uint32_t> parameters() { return host_tools_test::all_settings(device); }

  simulation::Scene scene;
  host_tools_test::DisturbedLink* link;
  device::Device device;
  /// Called before every message that is sent while the bridge is on: whether the host is held up.
  std::function<bool()> held_up;
  int times = 0;
  std::string step;  ///< that has begun last
  int messages = 0;  ///< while its bridge was on

  CalibrationReport calibrate(const CalibrationSettings& settings) {
    return calibration::calibrate(
        device, settings, nullptr, [](const std::string&) {},
        [this](std::string_view begun, std::chrono::seconds) {
          step = begun;
          messages = 0;
        });
  }
};

CalibrationSettings all_steps() {
  CalibrationSettings settings;
  settings.sets.fill(true);
  settings.repetitions = 2;
  return settings;
}

class HeldUpCalibration : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, HeldUpCalibration, testing::ValuesIn(representative_scenes()));

// In each step once, at a place that differs from run to run; the values are as true as ever.
TEST_P(HeldUpCalibration, OnceInEveryStepFindsWhatIsTrue) {
  HeldUpDevice whole(GetParam());
  std::map<std::string, int> length;
  whole.held_up = [&] {
    ++length[whole.step];
    return false;
  };
  ASSERT_TRUE(whole.calibrate(all_steps()).pass());
  const int runs = in_a_soak() ? 2 : 1;
  for (int run = 0; run < runs; ++run) {
    HeldUpDevice tested(GetParam());
    tested.held_up = [&] { return tested.messages++ == length[tested.step] * (2 * run + 1) / (2 * runs); };
    const CalibrationReport report = tested.calibrate(all_steps());
    ASSERT_TRUE(report.pass()) << cause_of(report) << " in run " << run;
    EXPECT_EQ(tested.times, static_cast<int>(length.size())) << "run " << run;
    EXPECT_TRUE(report.stored);
    EXPECT_FALSE(device::Drive(tested.device, 0).status().faulty());
    for (const Judged& value : judge(tested.scene.axes[0], report))
      EXPECT_TRUE(value.good()) << value.name << " is " << value.found << " instead of " << value.truth
                                << " in run " << run;
  }
}

// Wherever that happens to fall, in a part that is measured again as well.
TEST_P(HeldUpCalibration, EveryNowAndThenFindsWhatIsTrue) {
  HeldUpDevice tested(GetParam());
  int message = 0;
  tested.held_up = [&] { return ++message % 997 == 0; };
  const CalibrationReport report = tested.calibrate(all_steps());
  ASSERT_TRUE(report.pass()) << cause_of(report);
  EXPECT_GT(tested.times, 5);
  for (const Judged& value : judge(tested.scene.axes[0], report))
    EXPECT_TRUE(value.good()) << value.name << " is " << value.found << " instead of " << value.truth;
}

TEST_P(HeldUpCalibration, AgainAndAgainItCannotBeCarriedOut) {
  SharedBeginning::run([this](SharedBeginning& beginning) {
    std::set<std::string> left{"winding", "torque_constant", "compensation_map"};
    std::string held;  // the step of this copy
    HeldUpDevice tested(GetParam());
    const auto before = tested.parameters();
    tested.held_up = [&] {
      if (left.erase(tested.step) != 0 && beginning.fork(tested.step)) held = tested.step;
      return beginning.in_copy() && tested.step == held;
    };
    std::string said;
    try {
      EXPECT_TRUE(tested.calibrate(all_steps()).pass()) << "nothing holds it up";
    } catch (const base::DeviceError& error) {
      said = error.what();
    }
    if (!beginning.in_copy()) {
      EXPECT_EQ(beginning.copies(), 3U);
      EXPECT_EQ(said, "");
      return;
    }
    EXPECT_CONTAINS(said, "3 times in a row the device heard nothing for 1 s and removed the force");
    EXPECT_EQ(tested.times, bench::most_silences);
    tested.held_up = {};
    EXPECT_EQ(tested.parameters(), before);
    const device::DriveStatus status = device::Drive(tested.device, 0).status();
    EXPECT_FALSE(status.armed() || status.faulty());
  });
}

}  // namespace kmax::calibration_test::held_up_test
