#include "host_tools/selftest/linear_fit.hpp"

#include <gtest/gtest.h>

namespace kmax::selftest::linear_fit_test {
namespace {

TEST(LinearFit, FindsWhatItWasMadeOfWhateverTheUnits) {
  LinearFit<3> fit;
  for (int k = 0; k < 50; ++k) {
    const double x = 1e-6 * k, y = 1e5 * std::sin(k);
    fit.add({x, y, 1.0}, 2e6 * x - 3e-5 * y + 0.5 + (k % 2 == 0 ? 0.01 : -0.01));
  }
  const auto found = fit.solve();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->value[0], 2e6, 5 * found->deviation[0]);
  EXPECT_NEAR(found->value[1], -3e-5, 5 * found->deviation[1]);
  EXPECT_NEAR(found->value[2], 0.5, 5 * found->deviation[2]);
  EXPECT_NEAR(found->residual, 0.01, 0.001);
  EXPECT_LT(found->deviation[2], 0.005);
}

TEST(LinearFit, HasNoAnswerWhereThereIsNone) {
  LinearFit<2> few;
  few.add({1.0, 2.0}, 1.0);
  few.add({2.0, 1.0}, 1.0);
  EXPECT_FALSE(few.solve());
  LinearFit<2> dependent;
  for (int k = 0; k < 10; ++k) dependent.add({1.0 * k, 2.0 * k}, k);
  EXPECT_FALSE(dependent.solve());
  LinearFit<1> nothing;
  for (int k = 0; k < 10; ++k) nothing.add({0.0}, k);
  EXPECT_FALSE(nothing.solve());
}

}  // namespace
}  // namespace kmax::selftest::linear_fit_test
