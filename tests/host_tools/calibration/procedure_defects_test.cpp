#include <numbers>

#include "tests/host_tools/calibration/calibrated_device.hpp"

namespace kmax::calibration_test::procedure_defects_test {

using calibration::CalibrationSettings;
using simulation::Defect;

/// A hand that pushes the simulated handle, as seen from outside, towards its positive end.
class SimulatedHand final : public bench::Prompter {
 public:
  explicit SimulatedHand(CalibratedDevice& device) : device_(device) {}
  void ask(const std::string&) override {
    ++asked;
    simulation::CoupledHandle& handle = device_.drives().drive(0).handle();
    const double start = handle.position();
    constexpr double force = 2.0, speed = 0.03, step = 0.0002;
    for (int i = 0; i < 10000 && handle.position() < start + 0.008; ++i) {
      handle.advance(handle.velocity() < speed ? force : 0.0, 0.0, step);
      device_.link().wait(std::chrono::microseconds(200));
    }
    device_.link().wait(std::chrono::milliseconds(200));
  }
  int asked = 0;

 private:
  CalibratedDevice& device_;
};

struct Planted {
  const char* scene;
  Defect defect;
  const char* cause;
};

class Defects : public testing::TestWithParam<Planted> {};

TEST_P(Defects, ComeOutUnderTheirOwnNameAndNothingIsKept) {
  CalibratedDevice device(GetParam().scene);
  device.plant(GetParam().defect);
  const auto before = device.parameters();
  const auto report = device.calibrate();
  EXPECT_EQ(cause_of(report), GetParam().cause);
  EXPECT_FALSE(report.stored);
  EXPECT_EQ(device.parameters(), before);
  EXPECT_EQ(device.records(), 0u);
  EXPECT_FALSE(device.armed());
}

std::vector<Planted> planted() {
  std::vector<Planted> all;
  for (const char* scene : motor_scenes) {
    const bool brushed = std::string(scene).starts_with("dc");
    if (!brushed) all.push_back({scene, Defect::phase_a_open, "phase_a_open"});
    all.push_back({scene, Defect::phase_b_open, brushed ? "motor_open" : "phase_b_open"});
    all.push_back({scene, Defect::phase_c_open, brushed ? "motor_open" : "phase_c_open"});
    all.push_back({scene, Defect::encoder_unplugged, "encoder_dead"});
    all.push_back({scene, Defect::encoder_stuck, "encoder_dead"});
    if (!brushed) all.push_back({scene, Defect::encoder_slipping, "encoder_slipping"});
    all.push_back({scene, Defect::supply_low, "supply_too_low"});
    all.push_back({scene, Defect::motor_blocked, "motor_blocked"});
    all.push_back({scene, Defect::current_b_inverted, "current_b_inverted"});
    all.push_back({scene, Defect::current_c_inverted, "current_c_inverted"});
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Defects, testing::ValuesIn(planted()), [](const auto& planted_defect) {
  return std::string(planted_defect.param.scene) + "_" +
         std::string(simulation::name_of(planted_defect.param.defect));
});

class InEveryScene : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, InEveryScene, testing::ValuesIn(representative_scenes()));

// One turned sign against the other: the same remark, and the same cure.
TEST_P(InEveryScene, WithoutAHandSwappedPhasesAndATurnedEncoderAreCuredAlike) {
  for (const Defect defect : {Defect::phases_swapped, Defect::encoder_reversed}) {
    CalibratedDevice device(GetParam());
    const bool mounted_reversed = device.axis().encoder.reversed;
    device.plant(defect);
    const auto report = device.calibrate();
    EXPECT_TRUE(report.pass()) << cause_of(report);
    EXPECT_EQ(remarked(report, "encoder_reversed_or_phases_swapped"), !mounted_reversed);
    EXPECT_EQ(value_of(report, "encoder.direction")->value, mounted_reversed ? 1 : -1);
  }
}

TEST_P(InEveryScene, AHandTellsSwappedPhasesFromATurnedEncoder) {
  {
    CalibratedDevice device(GetParam());
    SimulatedHand hand(device);
    device.plant(Defect::phases_swapped);
    const auto before = device.parameters();
    const auto report = device.calibrate({}, &hand);
    EXPECT_EQ(hand.asked, 1);
    EXPECT_EQ(cause_of(report), "phases_swapped");
    EXPECT_EQ(device.parameters(), before);
  }
  {
    CalibratedDevice device(GetParam());
    SimulatedHand hand(device);
    const bool mounted_reversed = device.axis().encoder.reversed;
    device.plant(Defect::encoder_reversed);
    const auto report = device.calibrate({}, &hand);
    EXPECT_TRUE(report.pass()) << cause_of(report);
    EXPECT_EQ(remarked(report, "encoder_reversed"), !mounted_reversed);
    EXPECT_FALSE(remarked(report, "encoder_reversed_or_phases_swapped"));
  }
}

TEST_P(InEveryScene, AnEncoderThatStandsUnderTheHandIsDead) {
  CalibratedDevice device(GetParam());
  SimulatedHand hand(device);
  device.plant(Defect::encoder_stuck);
  CalibrationSettings settings;
  settings.sets = {false, true, false, false};
  EXPECT_EQ(cause_of(device.calibrate(settings, &hand)), "encoder_dead");
}

TEST(PolePairs, WrongOnesAreNamedAndCorrectedOrRefused) {
  for (const int claimed : {1, 5, 14}) {
    CalibratedDevice device("gimbal_b");
    device.set({"motor.pole_pairs=" + std::to_string(claimed)});
    const auto before = device.parameters();
    CalibrationSettings settings;
    settings.keep_pole_pairs = true;
    const auto refused = device.calibrate(settings);
    EXPECT_EQ(cause_of(refused), "pole_pairs_differ");
    EXPECT_EQ(device.parameters(), before);
    const auto report = device.calibrate();
    EXPECT_TRUE(report.pass()) << cause_of(report);
    EXPECT_TRUE(remarked(report, "pole_pairs_differ"));
    EXPECT_EQ(value_of(report, "motor.pole_pairs")->value, 7);
    EXPECT_EQ(value_of(report, "motor.pole_pairs")->previous, claimed);
  }
}

TEST(GainMismatch, IsMeasuredOfABrushedMotorAndRemarkedOnBeyondWhatIsAllowed) {
  for (const double error : {0.0, 0.04, -0.07}) {
    simulation::Scene scene = simulated_board::open_scene("dc_coreless_a");
    scene.axes[0].current_sensor.gain_error_b = error;
    CalibratedDevice device(scene);
    calibration::CalibrationSettings electrical;
    electrical.sets = {true};
    const auto report = device.calibrate(electrical);
    ASSERT_TRUE(report.pass()) << cause_of(report);
    EXPECT_NEAR(value_of(report, "current_b.mismatch")->value, error, 0.01);
    EXPECT_EQ(remarked(report, "current_mismatch"), error < -0.06);
  }
}

TEST(Travel, TooLittleIsNamedWithWhatIsNeeded) {
  CalibratedDevice device("gimbal_b");
  CalibrationSettings settings;
  settings.travel = 0.004;
  const auto report = device.calibrate(settings);
  EXPECT_EQ(cause_of(report), "travel_too_small");
}

TEST(IndexSearch, FindsTheIndexAndRefersTheOffsetToIt) {
  CalibratedDevice device("gimbal_b");
  device.set({"encoder.index=once_per_turn"});
  const auto report = device.calibrate();
  ASSERT_TRUE(report.pass()) << cause_of(report);
  EXPECT_NE(value_of(report, "measured.count"), nullptr);
  EXPECT_EQ(device.device().read_number("measured.commutation_known"), 1);
  // The count is now 0 at the index: where the shaft is at index_position, whose electrical angle the offset
  // is.
  const auto& motor = std::get<simulation::SynchronousMotorConfig>(*device.axis().motor);
  const auto& encoder = device.axis().encoder;
  const double shaft = device.drives().drive(0).handle().position() / encoder.transmission;
  const double counted = 2.0 * std::numbers::pi * device.device().read_number("measured.count") /
                         device.device().read_number("encoder.counts_per_turn");
  const double electrical = motor.pole_pairs * shaft + motor.electrical_offset;
  const double reported = motor.pole_pairs * counted + value_of(report, "motor.electrical_offset")->value;
  EXPECT_NEAR(std::remainder(reported - electrical, 2.0 * std::numbers::pi), 0.0, 0.02);
  // Referred to the index, and not to where the handle was at the start.
  EXPECT_GT(
      std::abs(std::remainder(value_of(report, "motor.electrical_offset")->value - motor.electrical_offset,
                              2.0 * std::numbers::pi)),
      0.02);
}

}  // namespace kmax::calibration_test::procedure_defects_test
