#include "control/handle_transition.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

#include "tests/control/drawn_loop.hpp"

namespace kmax::control::handle_transition_test {

using Model = HandleModel<double>;
using Transition = HandleTransition<double>;

Eigen::MatrixXd exact(const Model& model, double duration) {
  const auto n = static_cast<Eigen::Index>(model.order);
  Eigen::MatrixXd rate = Eigen::MatrixXd::Zero(n + 1, n + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      rate(i, j) = model.rate[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  }
  rate(1, n) = 1.0;
  return (rate * duration).exp() - Eigen::MatrixXd::Identity(n + 1, n + 1);
}

double largest_difference(const Model& model, const Transition& transition, double duration) {
  const Eigen::MatrixXd expected = exact(model, duration);
  double worst = 0.0;
  for (std::size_t i = 0; i < model.order; ++i) {
    const auto row = static_cast<Eigen::Index>(i), n = static_cast<Eigen::Index>(model.order);
    worst = std::max(worst, std::abs(transition.input[i] - expected(row, n)));
    for (std::size_t j = 0; j < model.order; ++j)
      worst =
          std::max(worst, std::abs(transition.change[i][j] - expected(row, static_cast<Eigen::Index>(j))));
  }
  return worst;
}

TEST(HandleModel, HasTheOrderOfWhatMoves) {
  const Hand<double> hand{0.2, 500, 2, 150, 9};
  EXPECT_EQ(Model(0.05, 0.1, 1e-3, {}).order, 2u);
  EXPECT_EQ(Model(0.05, 0.1, 1e-3, hand).order, 4u);
  EXPECT_EQ(Model(0.05, 0.1, 1e-3, {0.0, 500, 2, 150, 9}).order, 2u);  // nobody
  EXPECT_EQ(Model(0.05, 0.1, 1e-3, {0.2, 0, 0, 150, 9}).order, 2u);    // no grip
  EXPECT_EQ(Model(0.05, 0.1, 1e-3, {0.2, 0, 2, 150, 9}).order, 4u);
  EXPECT_EQ(Model(0.05, 0.1, 1e-3, {0.2, 0, 2, 0, 9}).order, 3u);
  const auto free_position = [](const Hand<double>& h) { return Model(0.05, 0.1, 1e-3, h).free_position; };
  EXPECT_TRUE(free_position({}));
  EXPECT_FALSE(free_position(hand));
  EXPECT_TRUE(free_position({0.2, 500, 2, 0, 9}));
  EXPECT_TRUE(free_position({0.2, 0, 2, 150, 9}));
  EXPECT_FALSE(Model(0.05, 0.1, 1e-3, {}).free_momentum);
  EXPECT_TRUE(Model(0.05, 0.0, 1e-3, {}).free_momentum);
  EXPECT_TRUE(Model(0.05, 0.0, 1e-3, {0.2, 500, 2, 0, 0}).free_momentum);
  EXPECT_FALSE(Model(0.05, 0.0, 1e-3, {0.2, 500, 2, 0, 9}).free_momentum);
  EXPECT_FALSE(Model(0.05, 0.0, 1e-3, {0.2, 500, 2, 150, 0}).free_momentum);
}

// Without a hand there is a formula.
TEST(HandleTransition, OfTheDeviceAlone) {
  for (const double r : {1e-9, 1e-3, 0.3, 2.0, 40.0}) {  // b T/m
    const Transition t(Model(1.0, r, 1.0, {}), 1.0);
    const double lost = -std::expm1(-r);
    EXPECT_EQ(t.change[0][0], 0.0);
    EXPECT_EQ(t.change[1][0], 0.0);
    EXPECT_NEAR(t.change[0][1], lost / r, 1e-14);
    EXPECT_NEAR(t.change[1][1], -lost, 1e-14 * std::max(lost, 1e-6));
    EXPECT_NEAR(t.input[1], lost / r, 1e-14);
    EXPECT_NEAR(t.input[0], r < 1e-2 ? 0.5 - r / 6 + r * r / 24 - r * r * r / 120 : (r - lost) / (r * r),
                1e-13);
  }
  const Transition undamped(Model(1.0, 0.0, 1.0, {}), 0.5);
  EXPECT_EQ(undamped.input[0], 0.125);
  EXPECT_EQ(undamped.change[0][1], 0.5);
}

TEST(HandleTransition, IsTheMatrixExponential) {
  LoopDraw draw(21);
  for (int i = 0; i < 1000; ++i) {
    Hand<double> hand = draw.hand();
    if (i % 5 == 1) hand = {};
    if (i % 5 == 2) hand.grip_stiffness = hand.arm_stiffness = 0.0;
    if (i % 5 == 3) hand.arm_stiffness = 0.0;
    const Model model(draw.log_uniform(1e-3, 1.0), draw.log_uniform(1e-2, 10.0), draw.log_uniform(1e-5, 1e-2),
                      hand);
    const double duration = draw.uniform(0.0, 1.0);
    EXPECT_LT(largest_difference(model, Transition(model, duration), duration), 1e-12) << i;
  }
}

TEST(HandleTransition, SplitsAnywhere) {
  LoopDraw draw(22);
  for (int i = 0; i < 300; ++i) {
    const Model model(draw.log_uniform(1e-3, 1.0), draw.log_uniform(1e-2, 10.0), draw.log_uniform(1e-5, 1e-2),
                      draw.hand());
    const double first = draw.uniform(0.0, 1.0);
    Transition both(model, first);
    both.append(Transition(model, 1.0 - first), model.order);
    EXPECT_LT(largest_difference(model, both, 1.0), 1e-12);
  }
}

// 1 g, held by 1 kN s/m and 1 MN/m at 10 ms: rates of 10^4 and 10^5 per sample.
TEST(HandleTransition, StiffHandsOnLightDevices) {
  const Model model(1e-3, 0.1, 1e-2, {0.5, 1e6, 1000.0, 100.0, 1.0});
  const Transition t(model, 1.0);
  EXPECT_LT(largest_difference(model, t, 1.0), 1e-9);
}

TEST(HandleTransition, NoTimeIsNoChange) {
  const Transition t(Model(0.05, 0.1, 1e-3, {0.2, 500, 2, 150, 9}), 0.0);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(t.input[i], 0.0);
    for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(t.change[i][j], 0.0);
  }
}

}  // namespace kmax::control::handle_transition_test
