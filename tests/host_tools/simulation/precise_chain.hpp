#pragma once
// The chain of chain_dynamics.hpp in numbers of 50 digits, to test against: Taylor series of order 40 over
// steps of the fastest time constant, events bracketed at 16 points of each step and bisected to 1e-30 of it.
// Written from the equations, shares no code with the simulation. Slow: about 0.1 ms per step.

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <cstddef>

#include "host_tools/simulation/chain_dynamics.hpp"

namespace kmax::simulation {

class PreciseChain {
 public:
  using Real = boost::multiprecision::cpp_bin_float_50;

  PreciseChain(const ChainDynamics& chain, double position, double velocity, std::size_t moving_masses)
      : c_(chain), n_(chain.masses) {
    for (std::size_t i = 0; i < n_; ++i) {
      x_[i] = position;
      v_[i] = i < moving_masses ? velocity : 0.0;
    }
    double fastest = 0.0;
    for (std::size_t i = 0; i < n_; ++i) {
      const double k = c_.stiffness[i] + (i > 0 ? c_.stiffness[i - 1] : 0.0);
      const double b = c_.damping[i] + (i > 0 ? c_.damping[i - 1] : c_.base_damping);
      fastest = std::max(fastest, std::sqrt(2.0 * k / c_.mass[i]) + 2.0 * b / c_.mass[i]);
    }
    longest_step_ = 1.0 / std::max(fastest, 1.0);
  }

  // Other springs and dampers of the same masses, from now on.
  void change(const ChainDynamics& chain) { c_ = chain; }

  // A held force, u from `intended` with `rate`.
  void advance(const Real& force, const Real& intended, const Real& rate, const Real& duration) {
    const int steps = static_cast<int>(std::ceil(static_cast<double>(duration) / longest_step_));
    const Real h = duration / steps;
    for (int n = 0; n < steps; ++n) step(force, intended + rate * h * n, rate, h);
  }

  const Real& position(std::size_t i) const { return x_[i]; }
  const Real& velocity(std::size_t i) const { return v_[i]; }
  int stops() const { return stops_; }
  int break_aways() const { return break_aways_; }

 private:
  static constexpr std::size_t order = 40;
  using Series = std::array<Real, order + 1>;

  Real net(const Real& force) const {
    if (n_ == 1) return force;
    return force + c_.stiffness[0] * (x_[1] - x_[0]) + c_.damping[0] * (v_[1] - v_[0]);
  }

  void expand(const Real& force, const Real& u, const Real& rate, const Real& h) {
    const std::size_t first = stuck_ ? 1 : 0;
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t n = 0; n <= order; ++n) sx_[i][n] = sv_[i][n] = 0;
      sx_[i][0] = x_[i];
      sv_[i][0] = v_[i];
    }
    for (std::size_t n = 0; n < order; ++n) {
      const Real f = h / static_cast<unsigned>(n + 1);
      for (std::size_t i = first; i < n_; ++i) {
        Real sum = 0;
        if (i + 1 < n_) {
          sum += c_.stiffness[i] * (sx_[i + 1][n] - sx_[i][n]) + c_.damping[i] * (sv_[i + 1][n] - sv_[i][n]);
        } else {
          const Real goal = n == 0 ? u : n == 1 ? Real(rate * h) : Real(0);
          const Real speed = n == 0 ? rate : Real(0);
          sum += c_.stiffness[i] * (goal - sx_[i][n]) + c_.damping[i] * (speed - sv_[i][n]);
        }
        if (i > 0) {
          sum += c_.stiffness[i - 1] * (sx_[i - 1][n] - sx_[i][n]) +
                 c_.damping[i - 1] * (sv_[i - 1][n] - sv_[i][n]);
        } else {
          sum -= c_.base_damping * sv_[0][n];
          if (n == 0) sum += force - sign_ * c_.friction;
        }
        sx_[i][n + 1] = f * sv_[i][n];
        sv_[i][n + 1] = f * sum / c_.mass[i];
      }
    }
  }

  static Real at(const Series& s, const Real& t) {
    Real sum = s[order];
    for (std::size_t n = order; n-- > 0;) sum = sum * t + s[n];
    return sum;
  }

  // Sliding: negative once the mass has turned round. Stuck: negative once the friction is not enough.
  Real margin(const Real& force, const Real& t) const {
    if (!stuck_) return sign_ * at(sv_[0], t);
    const Real pull =
        n_ == 1 ? force
                : Real(force + c_.stiffness[0] * (at(sx_[1], t) - x_[0]) + c_.damping[0] * at(sv_[1], t));
    return c_.friction - abs(pull);
  }

  void step(const Real& force, Real u, const Real& rate, Real left) {
    for (int round = 0; round < 200 && left > 0; ++round) {
      if (v_[0] != 0) {
        stuck_ = false;
        sign_ = v_[0] > 0 ? 1 : -1;
      } else if (!leaving_) {
        stuck_ = c_.friction > 0.0 && abs(net(force)) <= c_.friction;
        sign_ = net(force) >= 0 ? 1 : -1;
      }
      const bool began_at_rest = v_[0] == 0 && !stuck_;
      leaving_ = false;
      expand(force, u, rate, left);
      Real low = 0;
      Real high = 0;
      bool found = false;
      if (c_.friction > 0.0) {
        for (int n = 1; n <= 16 && !found; ++n) {
          low = high;
          high = Real(n) / 16;
          found = margin(force, high) < 0;
        }
        // From rest it leaves in the direction of the force, whatever rounding says of the first instant.
        if (found && began_at_rest && low == 0 && margin(force, Real(1e-20)) < 0) found = false;
      }
      const Real end = !found ? Real(1) : [&] {
        for (int n = 0; n < 110; ++n) {
          const Real middle = (low + high) / 2;
          (margin(force, middle) < 0 ? high : low) = middle;
        }
        return high;
      }();
      for (std::size_t i = 0; i < n_; ++i) {
        x_[i] = at(sx_[i], end);
        v_[i] = at(sv_[i], end);
      }
      if (!found) return;
      v_[0] = 0;
      if (stuck_) {
        ++break_aways_;
        sign_ = net(force) >= 0 ? 1 : -1;
        stuck_ = false;
        leaving_ = true;
      } else {
        ++stops_;
      }
      u += rate * left * end;
      left -= left * end;
    }
  }

  ChainDynamics c_;
  std::size_t n_;
  double longest_step_ = 0.0;
  std::array<Real, most_masses> x_{};
  std::array<Real, most_masses> v_{};
  std::array<Series, most_masses> sx_{};
  std::array<Series, most_masses> sv_{};
  bool stuck_ = false;
  bool leaving_ = false;
  int sign_ = 1;
  int stops_ = 0;
  int break_aways_ = 0;
};

}  // namespace kmax::simulation
