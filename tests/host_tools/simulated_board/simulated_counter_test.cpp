#include "host_tools/simulated_board/simulated_counter.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::simulated_counter_test {
namespace {

using simulation::Defect;

/// A motor without friction that a voltage turns, and a counter with parameters of its own.
class Encoder {
 public:
  explicit Encoder(const char* scene, double start = 0.0) : drives(turning(scene, start)) {
    set<"encoder.kind">(drives.encoder_kind(0) == simulation::EncoderKind::as5047p ? 1 : 0);
    set<"encoder.counts_per_turn">(turn());
  }

  template <firmware::FixedName name>
  void set(double value) {
    constexpr std::size_t entry = firmware::entry_of<name>();
    values.set_raw(firmware::slot_of(entry, 0),
                   firmware::raw_from_number(firmware::entry_at(entry).type, value));
    counter.configure(values, 0);
  }
  /// Lets the motor run forwards and reads it all the while.
  SimulatedCounter::Reading turn_for(double seconds, bool driving = false) {
    drives.set_bridge(0, {{{{true, 0.5}, {true, 0.53}, {true, 0.47}}}});
    SimulatedCounter::Reading reading;
    for (int n = 0; n < std::lround(seconds / 50e-6); ++n) {
      drives.advance(50e-6);
      reading = counter.read(drives, 0, driving);
    }
    return reading;
  }
  double turn() const { return drives.drive(0).encoder().config().counts_per_turn; }
  std::int64_t true_count() const {
    return static_cast<std::int64_t>(std::floor(drives.drive(0).disc_angle() / 6.283185307179586 * turn()));
  }

  simulation::SceneDrives drives;
  SimulatedCounter counter;
  firmware::ParameterValues values;

 private:
  static simulation::Scene turning(const char* name, double start) {
    simulation::Scene scene = open_scene(name);
    scene.axes[0].start.position = start;
    // A brushed motor turns under any voltage.
    scene.axes[0].motor = simulation::BrushedDcMotorConfig{};
    return scene;
  }
};

TEST(SimulatedCounter, CountsTheLines) {
  Encoder encoder("dc_coreless_a", 0.01);
  const auto reading = encoder.turn_for(0.05);
  EXPECT_TRUE(reading.valid);
  EXPECT_EQ(reading.count, static_cast<std::uint32_t>(encoder.true_count()));
  EXPECT_GT(encoder.true_count(), 700);
}

TEST(SimulatedCounter, TheSerialChipBeginsWithinATurn) {
  for (const double start : {0.0, 0.9, -0.02}) {
    Encoder encoder("gimbal_a", start);
    const std::int64_t first = encoder.true_count();
    const auto reading = encoder.counter.read(encoder.drives, 0, false);
    EXPECT_TRUE(reading.valid);
    EXPECT_LT(reading.count, 16384u);
    EXPECT_EQ((static_cast<std::int64_t>(reading.count) - first) % 16384, 0);
    const auto later = encoder.turn_for(0.05);
    EXPECT_EQ(later.count - reading.count, static_cast<std::uint32_t>(encoder.true_count() - first));
    EXPECT_NE(later.count, reading.count);
  }
}

TEST(SimulatedCounter, OnlyTheInterfaceThatIsNamedIsRead) {
  Encoder lines("dc_coreless_a");
  lines.set<"encoder.kind">(1);
  EXPECT_FALSE(lines.turn_for(0.02).valid) << "no chip answers";
  Encoder chip("gimbal_a");
  chip.set<"encoder.kind">(0);
  const auto reading = chip.turn_for(0.02);
  EXPECT_TRUE(reading.valid);
  EXPECT_EQ(reading.count, 0u) << "nothing on the lines";
}

TEST(SimulatedCounter, AnUnpluggedCableLooksLikeRestUnlessAnIndexIsWatched) {
  Encoder blind("dc_coreless_a");
  const auto before = blind.turn_for(0.02);
  blind.drives.plant(0, Defect::encoder_unplugged);
  const auto after = blind.turn_for(0.02);
  EXPECT_TRUE(after.valid);
  EXPECT_EQ(after.count, before.count);

  Encoder watched("dc_coreless_a", -0.001);
  watched.set<"encoder.index">(1);
  EXPECT_TRUE(watched.turn_for(0.05).valid);
  watched.drives.plant(0, Defect::encoder_unplugged);
  EXPECT_FALSE(watched.turn_for(50e-6).valid);

  Encoder serial("gimbal_a");
  EXPECT_TRUE(serial.turn_for(0.02).valid);
  serial.drives.plant(0, Defect::encoder_unplugged);
  EXPECT_FALSE(serial.turn_for(50e-6).valid);
}

TEST(SimulatedCounter, CountsAreReferredToTheIndexOnceAndNotWhileDriving) {
  // gimbal_b: index at 300, mounted the other way round, so that it is passed at -300 of the shaft.
  Encoder encoder("gimbal_b", -0.006);
  encoder.set<"encoder.index">(1);
  const auto driving = encoder.turn_for(0.1, true);
  EXPECT_FALSE(driving.referenced);
  EXPECT_EQ(driving.count, static_cast<std::uint32_t>(encoder.true_count()));
  const auto free = encoder.turn_for(50e-6);
  EXPECT_TRUE(free.referenced);
  EXPECT_EQ(free.reference_generation, driving.reference_generation + 1);
  EXPECT_EQ(free.count, static_cast<std::uint32_t>(encoder.true_count() - 300));
  EXPECT_EQ(encoder.turn_for(0.05).reference_generation, free.reference_generation);
}

TEST(SimulatedCounter, AnotherKindOfEncoderIsAnotherReference) {
  Encoder encoder("gimbal_b", -0.006);
  encoder.set<"encoder.index">(1);
  const auto referenced = encoder.turn_for(0.1);
  ASSERT_TRUE(referenced.referenced);
  encoder.set<"encoder.kind">(1);
  EXPECT_NE(encoder.turn_for(50e-6).reference_generation, referenced.reference_generation);
}

TEST(SimulatedCounter, WithoutTheIndexCountsAreFromTheStartAgain) {
  Encoder encoder("gimbal_b", -0.006);
  encoder.set<"encoder.index">(1);
  const auto referenced = encoder.turn_for(0.1);
  ASSERT_TRUE(referenced.referenced);
  encoder.set<"encoder.start">(1);
  const auto reading = encoder.turn_for(50e-6);
  EXPECT_FALSE(reading.referenced);
  EXPECT_EQ(reading.count, static_cast<std::uint32_t>(encoder.true_count()));
  EXPECT_NE(reading.reference_generation, referenced.reference_generation);
}

TEST(SimulatedCounter, AHandleThatStartsAtItsRestKeepsItsOrigin) {
  Encoder encoder("gimbal_b", -0.006);
  encoder.set<"encoder.start">(1);
  encoder.set<"encoder.index">(1);
  const auto reading = encoder.turn_for(0.1);
  EXPECT_FALSE(reading.referenced);
  EXPECT_EQ(reading.count, static_cast<std::uint32_t>(encoder.true_count()));
}

}  // namespace
}  // namespace kmax::simulated_board::simulated_counter_test
