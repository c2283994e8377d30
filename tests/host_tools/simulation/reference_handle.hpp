#pragma once
// The model of coupled_handle.hpp solved by brute force, to test it against: classical Runge-Kutta in long
// double with steps of a microsecond, events found by bisecting the step. Written from the equations, shares
// no code with the simulation. Slow: about 2000 steps per 2 ms.

#include <array>
#include <cmath>
#include <cstddef>

#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/intended_motion.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation {

class ReferenceHandle {
 public:
  using Real = long double;

  // At rest at the start of the motion, which begins now.
  ReferenceHandle(const DeviceModel& device, const OperatorModel& person, const IntendedMotionConfig& motion)
      : d_(device), p_(person), m_(motion), u_(motion.start_position), target_(motion.wall_position) {
    s_ = {u_, 0.0L, u_, 0.0L};
  }

  // At most 2 ms, as the activation is constant over it. Approach and hold only.
  void advance(double commanded, double background, double duration) {
    Real force = commanded;
    if (d_.force_limit > 0.0)
      force = std::fmin(std::fmax(force, -Real(d_.force_limit)), Real(d_.force_limit));
    const Real whole = duration;
    const Real b = std::fabs(Real(background));
    g_ = 1.0L + p_.activation_gain * (b + (a_ - b) * std::exp(-0.5L * whole / p_.activation_time));
    a_ = b + (a_ - b) * std::exp(-whole / p_.activation_time);
    lag_ = b + (lag_ - b) * std::exp(-whole / p_.push_lag);
    const Real series =
        1.0L / (1.0L / p_.grip_stiffness + 1.0L / p_.arm_stiffness) * (1.0L + p_.activation_gain * a_);
    const Real target_end = m_.wall_position - m_.wall_side * (m_.push_force + lag_) / series;
    const int steps = static_cast<int>(std::ceil(duration / longest_step - 1e-9));
    const Real h = Real(duration) / steps;
    for (int n = 0; n < steps; ++n) {
      const Real goal = target_ + (target_end - target_) * (n + 1) / steps;
      const Real reach = m_.approach_speed * h;
      const Real u_next = u_ + std::fmin(std::fmax(goal - u_, -reach), reach);
      tiny_step(force, h, (u_next - u_) / h);
      u_ = u_next;
    }
    target_ = target_end;
  }

  Real position() const { return s_[0]; }

 private:
  static constexpr double longest_step = 1e-6;  // s
  using State = std::array<Real, 4>;

  Real net(const State& s, Real force) const {
    return force + g_ * (p_.grip_stiffness * (s[2] - s[0]) + p_.grip_damping * (s[3] - s[1]));
  }

  State derivative(const State& s, Real force, Real u, Real du) const {
    State ds{};
    if (!stuck_) {
      ds[0] = s[1];
      ds[1] = (net(s, force) - d_.damping * s[1] - sign_ * d_.friction) / d_.mass;
    }
    const Real grip = g_ * (p_.grip_stiffness * (s[0] - s[2]) + p_.grip_damping * (s[1] - s[3]));
    const Real arm = g_ * (p_.arm_stiffness * (u - s[2]) + p_.arm_damping * (du - s[3]));
    ds[2] = s[3];
    ds[3] = (grip + arm) / p_.hand_mass;
    return ds;
  }

  State runge_kutta(const State& s, Real force, Real u, Real du, Real h) const {
    const auto plus = [](const State& a, const State& b, Real f) {
      State c{};
      for (std::size_t n = 0; n < 4; ++n) c[n] = a[n] + f * b[n];
      return c;
    };
    const State k1 = derivative(s, force, u, du);
    const State k2 = derivative(plus(s, k1, h / 2), force, u + du * h / 2, du);
    const State k3 = derivative(plus(s, k2, h / 2), force, u + du * h / 2, du);
    const State k4 = derivative(plus(s, k3, h), force, u + du * h, du);
    State result{};
    for (std::size_t n = 0; n < 4; ++n) result[n] = s[n] + h / 6 * (k1[n] + 2 * k2[n] + 2 * k3[n] + k4[n]);
    return result;
  }

  void tiny_step(Real force, Real h, Real du) {
    Real u = u_;
    for (int round = 0; round < 20 && h > 0.0L; ++round) {
      if (s_[1] == 0.0L && d_.friction > 0.0 && !leaving_) {
        stuck_ = std::fabs(net(s_, force)) <= Real(d_.friction) * (1.0L + 1e-16L);
        if (!stuck_) sign_ = net(s_, force) > 0.0L ? 1.0L : -1.0L;
      } else if (!leaving_) {
        stuck_ = false;
        if (s_[1] != 0.0L) sign_ = s_[1] > 0.0L ? 1.0L : -1.0L;
      }
      const bool left_now = leaving_;
      leaving_ = false;
      const auto over = [&](Real part) {
        const State s = runge_kutta(s_, force, u, du, part);
        if (stuck_) return std::fabs(net(s, force)) > Real(d_.friction) * (1.0L + 1e-16L);
        return d_.friction > 0.0 && s[1] * sign_ < 0.0L;
      };
      if (!over(h) || (left_now && !stuck_ && over(h * 1e-6L))) {
        s_ = runge_kutta(s_, force, u, du, h);
        return;
      }
      Real low = 0.0L;
      Real high = h;
      for (int n = 0; n < 80; ++n) {
        const Real middle = (low + high) / 2;
        (over(middle) ? high : low) = middle;
      }
      s_ = runge_kutta(s_, force, u, du, high);
      s_[1] = 0.0L;
      if (stuck_) {
        sign_ = net(s_, force) > 0.0L ? 1.0L : -1.0L;
        stuck_ = false;
        leaving_ = true;
      }
      u += du * high;
      h -= high;
    }
  }

  DeviceModel d_;
  OperatorModel p_;
  IntendedMotionConfig m_;
  bool stuck_ = false;
  bool leaving_ = false;
  Real sign_ = 1.0L;
  State s_{};
  Real u_;
  Real target_;
  Real a_ = 0.0L;
  Real lag_ = 0.0L;
  Real g_ = 1.0L;
};

}  // namespace kmax::simulation
