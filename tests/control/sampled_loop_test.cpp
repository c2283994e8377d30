#include "control/sampled_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

#include "tests/control/drawn_loop.hpp"

namespace kmax::control::sampled_loop_test {

using Complex = std::complex<double>;

Complex value_of(const LoopPolynomial<double>& p, Complex s) {
  Complex sum = 0.0;
  for (std::size_t i = p.degree + 1; i > 0; --i) sum = sum * s + p.coefficient[i - 1];
  return sum;
}

TEST(LoopPolynomial, MultipliesAndAdds) {
  LoopPolynomial<double> p;
  p.coefficient[0] = 2.0;
  p.multiply(1.0, 1.0);
  p.multiply(3.0, -1.0);  // 2 (1 + s)(3 - s) = 6 + 4 s - 2 s^2
  EXPECT_EQ(p.degree, 2u);
  EXPECT_EQ(p.coefficient[0], 6.0);
  EXPECT_EQ(p.coefficient[1], 4.0);
  EXPECT_EQ(p.coefficient[2], -2.0);
  LoopPolynomial<double> q;
  q.coefficient[0] = 1.0;
  q.add(p, 0.5);
  EXPECT_EQ(q.degree, 2u);
  EXPECT_EQ(q.coefficient[0], 4.0);
  EXPECT_EQ(q.coefficient[2], -1.0);
}

TEST(LoopEquation, DegreeCountsTheStates) {
  const auto degree = [](double delay, double wall_damping, const Hand<double>& hand) {
    return LoopEquation<double>({0.05, 0.1, wall_damping, 1e-3, delay, hand}).degree();
  };
  const Hand<double> hand{0.2, 500, 2, 150, 9};
  EXPECT_EQ(degree(0.0, 0.0, {}), 2u);
  EXPECT_EQ(degree(0.0, 0.1, {}), 3u);
  EXPECT_EQ(degree(0.3e-3, 0.0, {}), 3u);
  EXPECT_EQ(degree(1e-3, 0.0, {}), 3u);
  EXPECT_EQ(degree(1.5e-3, 0.0, {}), 4u);
  EXPECT_EQ(degree(0.0, 0.0, hand), 4u);
  EXPECT_EQ(degree(7.5e-3, 0.1, hand), 13u);
  EXPECT_EQ(degree(8e-3, 0.1, hand), 13u);
  EXPECT_EQ(degree(8.5e-3, 0.1, hand), 13u);  // beyond the longest delay: the longest
  EXPECT_LT(13u, LoopPolynomial<double>().coefficient.size());
}

// m x'' = -K x_k, nothing else: z^2 - (2 - kappa/2) z + 1 + kappa/2 = 0.
TEST(LoopEquation, OfABareMassByHand) {
  const LoopEquation<double> equation({2.0, 0.0, 0.0, 0.5, 0.0, {}});
  for (const double kappa : {0.1, 1.0, 5.0}) {
    const auto p = equation.half_plane_polynomial(kappa);
    ASSERT_EQ(p.degree, 2u);
    // z = (1 + s)/(1 - s), times (1 - s)^2: kappa + s (-kappa) + s^2 4.
    EXPECT_NEAR(p.coefficient[0], kappa, 1e-14);
    EXPECT_NEAR(p.coefficient[1], -kappa, 1e-14);
    EXPECT_NEAR(p.coefficient[2], 4.0, 1e-14);
  }
}

// Against a time simulation of the same loop: a motion z^k that solves the recurrence solves the equation.
// The recurrence is run from states; its eigenvalues are those of the equation if the equation, as a
// polynomial in the shift, annihilates every trajectory (Cayley and Hamilton).
TEST(LoopEquation, AnnihilatesEveryTrajectory) {
  LoopDraw draw(31);
  for (int i = 0; i < 300; ++i) {
    SampledLoop<double> loop = draw.loop();
    const double samples = loop.delay / loop.period;
    loop.period = draw.log_uniform(1e-3, 1e-2);  // coarse, so that powers of the shift are well conditioned
    loop.delay = std::min(samples, 7.999) * loop.period;
    const double kappa = draw.uniform(0.01, 1.0);
    const LoopEquation<double> equation(loop);
    const auto degree = equation.degree();
    // Coefficients of z^j from the values at the roots of unity.
    std::array<Complex, 32> at_roots{};
    const double pi = std::acos(-1.0);
    for (std::size_t r = 0; r < 32; ++r) {
      const Complex z = std::polar(1.0, 2.0 * pi * (static_cast<double>(r) + 0.5) / 32.0);
      const Complex s = (z - 1.0) / (z + 1.0);
      at_roots[r] =
          value_of(equation.half_plane_polynomial(kappa), s) / std::pow(1.0 - s, static_cast<double>(degree));
    }
    std::array<double, 32> shift{};
    for (std::size_t j = 0; j <= degree; ++j) {
      for (std::size_t r = 0; r < 32; ++r)
        shift[j] += std::real(at_roots[r] * std::polar(1.0, -2.0 * pi * (static_cast<double>(r) + 0.5) /
                                                                32.0 * static_cast<double>(j))) /
                    32.0;
    }
    EXPECT_NEAR(shift[degree], 1.0, 1e-9);

    // The trajectory, in the units of one sample, with the force under way kept by hand.
    const HandleModel<double> model(loop.mass, loop.damping, loop.period, loop.hand);
    const double beta = loop.wall_damping * loop.period / loop.mass, late = std::min(samples, 7.999);
    const int whole = static_cast<int>(late);
    const HandleTransition<double> early(model, late - whole), after(model, 1.0 - (late - whole));
    std::array<double, 4> x{1.0, -0.3, 0.2, 0.4};
    std::array<double, 10> force{};
    std::array<double, 40> positions{};
    const auto move = [&](const HandleTransition<double>& t, double u) {
      std::array<double, 4> next = x;
      for (std::size_t a = 0; a < model.order; ++a) {
        next[a] += t.input[a] * u;
        for (std::size_t b = 0; b < model.order; ++b) next[a] += t.change[a][b] * x[b];
      }
      x = next;
    };
    double last = 1.0;
    for (double& position : positions) {
      position = x[0];
      for (std::size_t k = 9; k > 0; --k) force[k] = force[k - 1];
      force[0] = -kappa * x[0] - beta * (x[0] - last);
      last = x[0];
      move(early, force[static_cast<std::size_t>(whole) + 1]);
      move(after, force[static_cast<std::size_t>(whole)]);
    }
    for (std::size_t k = 10; k + degree < 40; ++k) {
      double sum = 0.0, size = 0.0;
      for (std::size_t j = 0; j <= degree; ++j) {
        sum += shift[j] * positions[k + j];
        size += std::abs(shift[j] * positions[k + j]);
      }
      EXPECT_LT(std::abs(sum), 1e-8 * size) << i;
    }
  }
}

// The values on the circle, by a path of their own, are those of the polynomial.
TEST(LoopEquation, OnTheCircleIsThePolynomial) {
  LoopDraw draw(32);
  for (int i = 0; i < 1000; ++i) {
    const SampledLoop<double> loop = draw.loop();
    const LoopEquation<double> equation(loop);
    const double omega = draw.log_uniform(1e-3, 1e3);
    const Complex s(0.0, omega);
    const Complex scale = std::pow(1.0 - s, static_cast<double>(equation.degree()));
    const Complex open = value_of(equation.half_plane_polynomial(0.0), s) / scale;
    const Complex closed = value_of(equation.half_plane_polynomial(1.0), s) / scale;
    const Complex feedback = closed - open;
    const auto found = equation.at(omega);
    const Complex expected = open * std::conj(feedback);
    EXPECT_NEAR(found.real, expected.real(), 1e-9 * (1.0 + std::abs(expected)));
    EXPECT_NEAR(found.imaginary, expected.imag(), 1e-9 * (1.0 + std::abs(expected)));
    EXPECT_NEAR(found.square, std::norm(feedback), 1e-9 * (1.0 + std::norm(feedback)));
  }
}

TEST(LoopEquation, KnowsWhatCannotBeComputed) {
  EXPECT_TRUE(LoopEquation<double>({0.05, 0.1, 0.0, 1e-3, 0.0, {}}).finite());
  EXPECT_FALSE(LoopEquation<double>({0.0, 0.1, 0.0, 1e-3, 0.0, {}}).finite());
  constexpr double infinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(LoopEquation<double>({0.05, infinite, 0.0, 1e-3, 0.0, {}}).finite());
  EXPECT_FALSE(LoopEquation<double>({0.05, 0.1, infinite, 1e-3, 0.0, {}}).finite());
  EXPECT_FALSE(LoopEquation<double>({0.05, 0.1, 0.0, 1e-3, 0.0, {1.0, infinite, 0, 0, 0}}).finite());
}

}  // namespace kmax::control::sampled_loop_test
