// A force that fades since its commander was lost (link.loss = ramp) only gets less, whatever anybody writes
// meanwhile: every value that there is, at its bounds, over both links, tried in both modes that make force.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "tests/board/canopen_host.hpp"

namespace kmax::board::fading_force_test {
namespace {

using firmware::Entry;
using firmware::Link;

class Fading : public CanOpenHost {
 public:
  Fading(bool torque, Link commander) {
    bench.set_up_plain_wall();
    bench.preset("force.limit", 2);
    bench.preset("link.timeout", 0.1);
    bench.preset("link.loss", 1);
    // All that a commander may set before it arms, so that it could be loosened afterwards.
    bench.preset("force.ceiling", 1000);
    bench.preset("wall.stiffness_ceiling", 1e6);
    bench.preset("wall.damping_ceiling", 1000);
    bench.preset("drive.mode", torque ? 2 : 0);
    bench.device.stand_at(1000);
    run_ms(5);
    for (const std::uint16_t word : std::array<std::uint16_t, 3>{0x00, 0x06, 0x0F}) say(commander, word);
    run_ms(2);
    EXPECT_TRUE(armed());
    // It bounds the soft start too, which is over at once.
    set_as_commander(commander, "force.ramp_time", 1.9);
    if (torque) set_as_commander(commander, "profile.target_force", 1);
    bench.device.stand_at(-1000);
    while (armed()) run_ms(1);
    EXPECT_TRUE(fades());
  }
  void say(Link commander, std::uint16_t word) {
    if (commander == Link::can)
      command(word);
    else
      EXPECT_EQ(bench.command(word), 0);
  }
  bool fades() { return bench.state() == DriveState::fault_reaction_active; }
  /// True: it was taken.
  bool try_to_set(const Entry& entry, std::size_t axis, double number, Link by) {
    if (by == Link::serial) return bench.set(entry.name, number, axis) == 0;
    const auto index = static_cast<std::uint16_t>(
        entry.index() + (entry.scope() == firmware::Scope::axis ? axis * firmware::axis_index_offset : 0));
    return write(index, entry.object_subindex(), firmware::raw_from_number(entry.type, number),
                 firmware::bytes_of(entry.type)) == 0;
  }

 private:
  void set_as_commander(Link commander, std::string_view name, double number) {
    EXPECT_TRUE(try_to_set(firmware::entry_at(firmware::entry_named(name)), 0, number, commander)) << name;
  }
};

class FadingForce : public testing::TestWithParam<std::tuple<bool, Link, Link>> {};

TEST_P(FadingForce, NoWriteFromAnywhereMakesItMore) {
  const auto [torque, commander, by] = GetParam();
  std::optional<Fading> node;
  int taken = 0;
  for (std::size_t i = 0; i < firmware::entry_count; ++i) {
    const Entry& entry = firmware::entry_at(i);
    if (entry.access == firmware::Access::read_only) continue;
    if (by == Link::serial && entry.access == firmware::Access::communication) continue;
    const std::size_t axes = entry.scope() == firmware::Scope::axis ? firmware::axis_count : 1;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      for (const double number : {entry.minimum, entry.maximum}) {
        // An end of it is no more force either; then another one is lost.
        if (!node || !node->fades() || node->bench.force() < 0.3f) node.emplace(torque, commander);
        const float before = std::abs(node->bench.force());
        EXPECT_GT(before, 0.25f);
        taken += node->try_to_set(entry, axis, number, by) ? 1 : 0;
        EXPECT_LE(std::abs(node->bench.force()), before)
            << entry.name << " = " << number << ", axis " << axis;
        if (::testing::Test::HasFailure()) return;
      }
    }
  }
  EXPECT_GT(taken, 30) << "of what stays open, and of the other axis";
}

TEST(FadingForceByWords, AHaltMeanwhileIsNotTakenBack) {
  for (const Link commander : {Link::serial, Link::can}) {
    Fading node(true, commander);
    node.say(commander, 0x10F);
    node.run_ms(5);
    ASSERT_TRUE(node.fades());
    EXPECT_EQ(node.bench.force(), 0.0f);
    for (int i = 0; i < 3; ++i) {
      node.say(commander, 0x0F);
      node.run_ms(5);
      ASSERT_TRUE(node.fades());
      EXPECT_EQ(node.bench.force(), 0.0f);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OverBothLinks, FadingForce,
                         testing::Combine(testing::Bool(), testing::Values(Link::serial, Link::can),
                                          testing::Values(Link::serial, Link::can)));

}  // namespace
}  // namespace kmax::board::fading_force_test
