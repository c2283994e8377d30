#pragma once
// The motion of a chain of masses over one step as its Taylor series. Between events the equations are linear
// with constant coefficients and inputs that are polynomials of time, so with s' = A s + f the coefficients
// follow from c[n+1] = h (A c[n] + f[n]) / (n + 1) over a step h. The order is chosen from ||A|| h so that
// the truncated rest is below 1e-13 of the state; a step has ||A|| h <= 1.25. Nothing is approximated but
// rounding. The series also is x_0'(t), and the net force on a stuck mass 0 as a polynomial, in which events
// are located (first_crossing.hpp).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "host_tools/simulation/chain_coefficients.hpp"
#include "host_tools/simulation/chain_dynamics.hpp"
#include "host_tools/simulation/first_crossing.hpp"

namespace kmax::simulation {

inline constexpr double largest_series_step = 1.25;  // ||A|| h

namespace chain_series {

// Taylor order for ||A|| h <= (index + 1) / 64. Terms beyond order N of the homogeneous solution sum to less
// than 2 z^(N+1)/(N+1)! for z <= 1.25; the input terms, constant and linear in time, need two orders more.
inline constexpr int order_bins = 80;
inline constexpr std::array<int, order_bins> orders = [] {
  std::array<int, order_bins> table{};
  for (int bin = 0; bin < order_bins; ++bin) {
    const double z = (bin + 1) / 64.0;
    double term = z;
    int order = 1;
    while (2.0 * term * z / (order + 1) > 1e-13) term *= z / ++order;
    table[static_cast<std::size_t>(bin)] = order + 2;
  }
  return table;
}();
static_assert(orders[order_bins - 1] <= 20);

inline constexpr std::array<double, 24> reciprocals = [] {
  std::array<double, 24> values{};
  for (std::size_t n = 1; n < values.size(); ++n) values[n] = 1.0 / static_cast<double>(n);
  return values;
}();

inline int order_for(double z) {
  return orders[static_cast<std::size_t>(std::min(order_bins - 1, static_cast<int>(z * 64.0)))];
}

inline double sum_of_magnitudes(const double* c, int order) {
  double sum = 0.0;
  for (int n = 1; n <= order; ++n) sum += std::abs(c[n]);
  return sum;
}

}  // namespace chain_series

template <std::size_t masses>
class ChainSeries {
 public:
  static constexpr int max_order = 22;
  using Coefficients = std::array<double, max_order + 1>;

  // `force`: on mass 0, Coulomb's included.
  void expand_sliding(const ChainCoefficients<masses>& chain, const ChainState& state, double h, int order,
                      double force, double intended, double rate) {
    expand<0>(chain, state, h, order, force, intended, rate);
  }
  // Mass 0 rests. Not for a chain of one mass, which has nothing left to move.
  void expand_stuck(const ChainCoefficients<masses>& chain, const ChainState& state, double h, int order,
                    double intended, double rate) {
    if constexpr (masses > 1) expand<1>(chain, state, h, order, 0.0, intended, rate);
  }

  // The state at the end of the step.
  const ChainState& end() const { return end_; }
  // At `t`, a part of the step; mass 0 is then at rest. `first`: 1 if it was stuck.
  void stop_at(double t, int order, std::size_t first, ChainState& state) const {
    for (std::size_t i = first; i < masses; ++i) {
      state.position[i] = polynomial_at(x_[i].data(), order, t);
      state.velocity[i] = polynomial_at(v_[i].data(), order, t);
    }
    state.velocity[0] = 0.0;
  }

  // Where the velocity of mass 0, which is in the given direction, reaches zero, as a part of the step.
  double stop_time(int order, double direction) const {
    const Coefficients& v = v_[0];
    if (std::abs(v[0]) > chain_series::sum_of_magnitudes(v.data(), order)) return no_crossing;
    Coefficients forward;
    for (std::size_t n = 0; n <= static_cast<std::size_t>(order); ++n) forward[n] = direction * v[n];
    if (forward[0] > 0.0) return first_crossing(forward.data(), order);
    // Starting from rest: the zero at t = 0 is the start itself, so it is divided out. The first coefficient
    // is positive, because break-away needs a little more than the friction force.
    return first_crossing(forward.data() + 1, order - 1);
  }

  // Where the net force on the stuck mass 0, now `net`, leaves -limit to limit, as a part of the step; sets
  // the direction.
  double break_away_time(const ChainCoefficients<masses>& chain, int order, double net, double limit,
                         double& direction) const {
    if constexpr (masses == 1) {
      return no_crossing;
    } else {
      const double k = chain.stiffness[0];
      const double b = chain.damping[0];
      const double variation = k * chain_series::sum_of_magnitudes(x_[1].data(), order) +
                               b * chain_series::sum_of_magnitudes(v_[1].data(), order);
      if (std::abs(net) + variation < limit) return no_crossing;
      Coefficients margin;
      for (std::size_t n = 1; n <= static_cast<std::size_t>(order); ++n)
        margin[n] = -(k * x_[1][n] + b * v_[1][n]);
      margin[0] = std::max(0.0, limit - net);
      const double upwards = first_crossing(margin.data(), order);
      for (std::size_t n = 1; n <= static_cast<std::size_t>(order); ++n) margin[n] = -margin[n];
      margin[0] = std::max(0.0, limit + net);
      const double downwards = first_crossing(margin.data(), order);
      if (upwards == no_crossing && downwards == no_crossing) return no_crossing;
      direction = upwards <= downwards ? 1.0 : -1.0;
      return std::min(upwards, downwards);
    }
  }

 private:
  // The factor h/(n + 1) is multiplied into the coefficients first, and the inputs (constant and linear in
  // time, so they enter the first two terms only) stay out of the rest: the chain of dependent operations is
  // the cost.
  template <std::size_t first>
  void expand(const ChainCoefficients<masses>& chain, const ChainState& state, double h, int order,
              double force, double intended, double rate) {
    constexpr std::size_t last = masses - 1;
    std::array<double, masses> x;
    std::array<double, masses> v;
    std::array<double, masses> up_k;
    std::array<double, masses> up_b;
    std::array<double, masses> down_k{};
    std::array<double, masses> down_b{};
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) {
      x[i] = state.position[i];
      v[i] = state.velocity[i];
      up_k[i] = chain.stiffness[i] * chain.per_mass[i];
      up_b[i] = chain.damping[i] * chain.per_mass[i];
      if (i > 0) {
        down_k[i] = chain.stiffness[i - 1] * chain.per_mass[i];
        down_b[i] = chain.damping[i - 1] * chain.per_mass[i];
      }
    }
    const double base = chain.base_damping * chain.per_mass[0];
    if constexpr (first == 1) v[0] = 0.0;
    std::array<double, masses> end_x = x;
    std::array<double, masses> end_v = v;
#pragma GCC unroll 3
    for (std::size_t i = first; i < masses; ++i) {
      x_[i][0] = x[i];
      v_[i][0] = v[i];
    }
    const auto term = [&](std::size_t n, double input_0, double input_last) __attribute__((always_inline)) {
      const double f = h * chain_series::reciprocals[n + 1];
      std::array<double, masses> next_x;
      std::array<double, masses> next_v;
#pragma GCC unroll 3
      for (std::size_t i = first; i < masses; ++i) {
        next_x[i] = f * v[i];
        double springs =
            i == last ? -(f * up_k[i]) * x[i] : (f * up_k[i]) * (x[i + 1 < masses ? i + 1 : i] - x[i]);
        double dampers =
            i == last ? -(f * up_b[i]) * v[i] : (f * up_b[i]) * (v[i + 1 < masses ? i + 1 : i] - v[i]);
        if (i > 0) {
          springs += (f * down_k[i]) * (x[i > 0 ? i - 1 : 0] - x[i]);
          dampers += (f * down_b[i]) * (v[i > 0 ? i - 1 : 0] - v[i]);
        } else {
          dampers -= (f * base) * v[0];
        }
        next_v[i] = springs + dampers;
      }
      if (n < 2) {
        if constexpr (first == 0) next_v[0] += f * input_0;
        next_v[last] += f * input_last;
      }
#pragma GCC unroll 3
      for (std::size_t i = first; i < masses; ++i) {
        end_x[i] += x_[i][n + 1] = x[i] = next_x[i];
        end_v[i] += v_[i][n + 1] = v[i] = next_v[i];
      }
      if constexpr (first == 1) x[0] = 0.0;  // a constant: only its first coefficient is not 0
    };
    term(0, force * chain.per_mass[0], chain.pull(intended, rate));
    term(1, 0.0, chain.pull_rate(rate) * h);
    for (std::size_t n = 2; n < static_cast<std::size_t>(order); ++n) term(n, 0.0, 0.0);
    end_ = state;
#pragma GCC unroll 3
    for (std::size_t i = first; i < masses; ++i) {
      end_.position[i] = end_x[i];
      end_.velocity[i] = end_v[i];
    }
    if constexpr (first == 1) end_.velocity[0] = 0.0;
  }

  std::array<Coefficients, masses> x_;
  std::array<Coefficients, masses> v_;
  ChainState end_;
};

}  // namespace kmax::simulation
