#include "host_tools/simulation/first_crossing.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

namespace kmax::simulation::first_crossing_test {

std::vector<double> times_root(const std::vector<double>& c, double root) {
  std::vector<double> product(c.size() + 1, 0.0);
  for (std::size_t n = 0; n < c.size(); ++n) {
    product[n + 1] += c[n];
    product[n] -= root * c[n];
  }
  return product;
}

double crossing(const std::vector<double>& c) {
  return first_crossing(c.data(), static_cast<int>(c.size()) - 1);
}

TEST(FirstCrossing, LineAndParabola) {
  EXPECT_NEAR(crossing({0.3, -1.0, 0.0}), 0.3, 1e-15);
  EXPECT_EQ(crossing({1.001, -1.0, 0.0}), no_crossing);
  EXPECT_NEAR(crossing({1.0, -1.0, 0.0}), 1.0, 1e-15);   // at the very end
  EXPECT_NEAR(crossing({0.12, -0.7, 1.0}), 0.3, 1e-15);  // zeros at 0.3 and 0.4: the first one
  EXPECT_EQ(crossing({0.0, 1.0, 0.0}), no_crossing);     // starts at zero and rises
  EXPECT_NEAR(crossing({0.0, 1.0, -2.0}), 0.5, 1e-15);   // rises from zero, comes back
  EXPECT_LT(crossing({0.0, -1.0, 0.0}), 1e-15);          // falls at once
  EXPECT_EQ(crossing({0.0, 0.0, 0.0}), no_crossing);
}

TEST(FirstCrossing, GrazeIsNoCrossingButAShallowDipIs) {
  EXPECT_EQ(crossing({0.25 + 1e-12, -1.0, 1.0}), no_crossing);
  const double dip = 1e-9;
  EXPECT_NEAR(crossing({0.25 - dip, -1.0, 1.0}), 0.5 - std::sqrt(dip), 1e-9);
}

TEST(FirstCrossing, TwoZerosCloseTogetherInsideALargeSwing) {
  // An even number of zeros between two positive ends: looking at the ends alone would miss them.
  std::vector<double> c{1.0};
  for (const double root : {0.7, 0.7001, 1.5, -0.2}) c = times_root(c, root);
  for (double& value : c) value = -value;
  ASSERT_GT(polynomial_at(c.data(), 4, 0.0), 0.0);
  ASSERT_GT(polynomial_at(c.data(), 4, 1.0), 0.0);
  EXPECT_NEAR(crossing(c), 0.7, 1e-11);
}

TEST(FirstCrossing, ClusterNearTheStartAmongZerosOfVeryDifferentSize) {
  std::vector<double> c{1.0};
  for (const double root : {0.0005, 0.001, 0.0205, 0.081, 0.188, 0.322}) c = times_root(c, root);
  ASSERT_GT(c[0], 0.0);  // 5e-11, and the first dip is 5e-12 deep
  EXPECT_NEAR(crossing(c), 0.0005, 1e-8);
}

RC_GTEST_PROP(FirstCrossing, FindsTheSmallestOfManyZeros, ()) {
  const int count = *rc::gen::inRange(1, 7);
  std::vector<double> roots;
  std::vector<double> c{1.0};
  double last = 0.0;
  for (int n = 0; n < count; ++n) {
    last += *rc::gen::inRange(20, 1000) / 1000.0;  // apart enough that rounding of c does not move them
    roots.push_back(last);
    c = times_root(c, last);
  }
  RC_PRE(std::abs(roots.front() - 1.0) > 1e-3);
  if (c[0] < 0.0) {
    for (double& value : c) value = -value;
  }
  const double found = crossing(c);
  if (roots.front() < 1.0) {
    RC_ASSERT(std::abs(found - roots.front()) < 1e-6);
  } else {
    RC_ASSERT(found == no_crossing);
  }
}

RC_GTEST_PROP(FirstCrossing, AgreesWithADenseScanForRandomCoefficients, ()) {
  std::vector<double> c;
  for (int n = 0; n < 9; ++n) c.push_back(*rc::gen::inRange(-1000, 1001) / 1000.0);
  c[0] = std::abs(c[0]) + 1e-3;
  const double found = crossing(c);
  double scanned = no_crossing;
  for (int n = 0; n <= 20000 && scanned == no_crossing; ++n) {
    if (polynomial_at(c.data(), 8, n / 20000.0) < 0.0) scanned = n / 20000.0;
  }
  if (scanned != no_crossing) {
    RC_ASSERT(found <= scanned);
    RC_ASSERT(std::abs(polynomial_at(c.data(), 8, found)) < 1e-13);
    RC_ASSERT(found > scanned - 1.0 / 20000.0 - 1e-12 || scanned > found);
  } else if (found != no_crossing) {
    RC_ASSERT(std::abs(polynomial_at(c.data(), 8, found)) < 1e-13);  // a dip between two points of the scan
  }
}

}  // namespace kmax::simulation::first_crossing_test
