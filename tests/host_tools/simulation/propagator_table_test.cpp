#include "host_tools/simulation/propagator_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "host_tools/simulation/coupled_handle.hpp"

namespace kmax::simulation::propagator_table_test {

TEST(GainGrid, RoundsToTheNearestOfItsNumbers) {
  for (const int bits : {4, 10, 12, 16}) {
    const GainGrid grid(bits);
    double worst = 0.0;
    for (double gain = 1.0; gain < 1e8; gain *= 1.00003) {
      const double nearest = grid.nearest(gain);
      worst = std::max(worst, std::abs(nearest / gain - 1.0));
      ASSERT_EQ(grid.nearest(nearest), nearest);
    }
    EXPECT_LE(worst, std::ldexp(1.0, -bits - 1));
    EXPECT_GT(worst, std::ldexp(0.9, -bits - 1));
    EXPECT_EQ(grid.nearest(1.0), 1.0);
    EXPECT_EQ(grid.index(1.0), 0u);
    EXPECT_EQ(grid.index(2.0), std::size_t{1} << bits);
    EXPECT_EQ(grid.index(grid.nearest(1.0 + std::ldexp(1.0, -bits))), 1u);
  }
}

TEST(GainGrid, EveryGainLiesInTheSpanOfTheNearestOfItsNumbers) {
  const GainGrid grid(6);
  for (double gain = 1.0; gain < 9.0; gain *= 1.0003) {
    const double nearest = grid.nearest(gain);
    const GainSpan span = grid.nearest_to(nearest);
    ASSERT_EQ(span.centre, nearest);
    ASSERT_LE(span.lowest, gain);
    ASSERT_GE(span.highest, gain);
    ASSERT_EQ(grid.nearest(span.lowest), nearest);
    ASSERT_EQ(grid.nearest(span.highest), nearest);
    ASSERT_GT(grid.nearest(std::nextafter(span.highest, 10.0)), nearest);
  }
}

TEST(PropagatorTable, BuildsOnceAndKeeps) {
  PropagatorTable table(DeviceModel{}, OperatorModel{});
  auto* sheet = table.sheet<2>(0.002);
  ASSERT_NE(sheet, nullptr);
  EXPECT_EQ(table.sheet<2>(0.002), sheet);
  EXPECT_NE(table.sheet<2>(0.001), sheet);
  const auto* entry = &sheet->at(table.grid().nearest(1.5));
  for (double gain = 1.0; gain < 3.0; gain += 0.01) sheet->at(table.grid().nearest(gain));
  EXPECT_EQ(&sheet->at(table.grid().nearest(1.5)), entry);
  EXPECT_NEAR(entry->coefficients().stiffness[0], 1.5 * OperatorModel{}.grip_stiffness, 0.2);
  EXPECT_EQ(table.sheet<3>(0.002), nullptr);
  EXPECT_EQ(&sheet->at(1.503), entry);
  EXPECT_LT(entry->gains().lowest, 1.5);
}

TEST(PropagatorTable, OneThatRoundsHasAMatrixForEachGain) {
  PropagatorTable table(DeviceModel{}, OperatorModel{}, 9);
  const GainSpan gains = table.sheet<2>(0.002)->at(1.5).gains();
  EXPECT_EQ(gains.centre, 1.5);
  EXPECT_EQ(gains.lowest, 1.5);
  EXPECT_EQ(gains.highest, 1.5);
}

TEST(PropagatorTable, KeepsSixteenDurations) {
  PropagatorTable table(DeviceModel{}, OperatorModel{});
  for (int n = 1; n <= 16; ++n) EXPECT_NE(table.sheet<2>(n * 1e-4), nullptr);
  EXPECT_EQ(table.sheet<2>(17 * 1e-4), nullptr);
  EXPECT_NE(table.sheet<2>(3 * 1e-4), nullptr);
}

TEST(PropagatorTable, ServesOnePersonWithOneDevice) {
  const PropagatorTable table(DeviceModel{}, OperatorModel{});
  EXPECT_TRUE(table.fits({}, {}));
  EXPECT_TRUE(table.fits({.force_limit = 0.0, .delay = 0.001}, {}));
  EXPECT_TRUE(table.fits({}, {.activation_gain = 0.0}));
  const DeviceModel heavy{.mass = 0.05};
  EXPECT_FALSE(table.fits(heavy, {}));
  EXPECT_FALSE(table.fits({.structure = StructureModel{}}, {}));
  EXPECT_FALSE(table.fits({}, {.grip_damping = 2.0}));
  const auto shared = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{});
  CoupledHandle other(heavy, OperatorModel{}, IntendedMotionConfig{});
  EXPECT_THROW(other.share(shared), std::invalid_argument);
  EXPECT_THROW(other.share(nullptr), std::invalid_argument);
  CoupledHandle alone{DeviceModel{}};
  EXPECT_THROW(alone.share(shared), std::logic_error);
  EXPECT_THROW(PropagatorTable(DeviceModel{}, OperatorModel{}, 3), std::invalid_argument);
  EXPECT_THROW(PropagatorTable(DeviceModel{}, OperatorModel{}, 17), std::invalid_argument);
}

struct Trace {
  std::vector<double> positions;
  double last_gain = 1.0;
};

Trace contact(const std::shared_ptr<PropagatorTable>& table, double coefficient, double stiffness,
              double interval, const DeviceModel& device = {}) {
  CoupledHandle handle(device, OperatorModel{}, IntendedMotionConfig{});
  if (table) handle.share(table);
  handle.begin_motion();
  Trace trace;
  for (int n = 0; n * interval < 1.0; ++n) {
    const double depth = -handle.position();
    const double field = depth >= 0.0 ? coefficient : coefficient / std::pow(1.0 - depth / 1e-3, 2);
    handle.advance(field + std::max(0.0, stiffness * depth), field, interval);
    trace.positions.push_back(handle.position());
  }
  trace.last_gain = handle.gain();
  return trace;
}

TEST(PropagatorTable, WithoutABackgroundForceChangesNothingButRounding) {
  const auto table = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{});
  const Trace with = contact(table, 0.0, 2500.0, 0.002);
  const Trace without = contact(nullptr, 0.0, 2500.0, 0.002);
  for (std::size_t n = 0; n < with.positions.size(); ++n)
    ASSERT_NEAR(with.positions[n], without.positions[n], 1e-12) << n;
}

TEST(PropagatorTable, OthersWhoUsedItBeforeMakeNoDifference) {
  const auto fresh = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{});
  const auto used = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{});
  contact(used, 1.0, 5500.0, 0.002);
  contact(used, 2.0, 9000.0, 50e-6);
  EXPECT_EQ(contact(fresh, 2.0, 5500.0, 0.002).positions, contact(used, 2.0, 5500.0, 0.002).positions);
}

double largest_difference(const Trace& one, const Trace& other) {
  double largest = 0.0;
  for (std::size_t n = 0; n < one.positions.size(); ++n)
    largest = std::max(largest, std::abs(one.positions[n] - other.positions[n]));
  return largest;
}

TEST(PropagatorTable, InterpolatesOverTheGainOfAField) {
  DeviceModel bending{.structure = StructureModel{}};
  for (const DeviceModel& device : {DeviceModel{}, bending}) {
    for (const double interval : {0.002, 50e-6}) {
      const Trace exact = contact(nullptr, 2.0, 5500.0, interval, device);
      const auto table = std::make_shared<PropagatorTable>(device, OperatorModel{});
      const Trace interpolated = contact(table, 2.0, 5500.0, interval, device);
      const auto fine = std::make_shared<PropagatorTable>(device, OperatorModel{}, 12);
      const Trace rounded = contact(fine, 2.0, 5500.0, interval, device);
      const double error = largest_difference(interpolated, exact);
      EXPECT_GT(error, 0.0);  // the table was in use
      EXPECT_LT(error, 0.1 * largest_difference(rounded, exact)) << interval;
      EXPECT_NEAR(interpolated.last_gain / exact.last_gain, 1.0, 1e-6);
    }
  }
}

TEST(PropagatorTable, RoundsTheGainOfAFieldAndNothingElse) {
  const auto table = std::make_shared<PropagatorTable>(DeviceModel{}, OperatorModel{}, 12);
  const Trace with = contact(table, 2.0, 5500.0, 0.002);
  const Trace without = contact(nullptr, 2.0, 5500.0, 0.002);
  EXPECT_GT(without.last_gain, 1.9);
  EXPECT_NEAR(with.last_gain / without.last_gain, 1.0, 1.3e-4);
  EXPECT_EQ(with.last_gain, table->grid().nearest(with.last_gain));
  // The force of a hand that is 1e-4 stiffer: 0.1 um at 3 N on 5.5 N/mm while it moves through.
  for (std::size_t n = 0; n < with.positions.size(); ++n)
    ASSERT_NEAR(with.positions[n], without.positions[n], 2e-6) << n;
}

}  // namespace kmax::simulation::propagator_table_test
