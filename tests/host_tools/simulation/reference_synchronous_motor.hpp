#pragma once
// A permanent-magnet synchronous motor integrated by brute force, to test synchronous_motor.hpp against: flux
// linkages of the three phases, with the inductances of a salient rotor written phase by phase, classical
// Runge-Kutta in long double. Written from the machine's equations in the stator; shares no code with the
// simulation. A floating star point, or one phase open, enters through the constraint on the currents.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "host_tools/simulation/synchronous_motor.hpp"

namespace kmax::simulation {

class ReferenceSynchronousMotor {
 public:
  using Real = long double;

  explicit ReferenceSynchronousMotor(const SynchronousMotorConfig& config) : c_(config) {}

  Real currents[3] = {0, 0, 0};
  Real torque_integral = 0;
  Real charge[3] = {0, 0, 0};

  // `open`: the terminal without current, or 3.
  void advance(const double (&u)[3], std::size_t open, Real angle, Real speed, Real duration, int steps) {
    const Real h = duration / steps;
    // The independent currents: two loops, or one.
    for (int n = 0; n < steps; ++n) {
      const Real t = angle + speed * h * n;
      State s = state();
      const State k1 = slope(s, u, open, t, speed);
      const State k2 = slope(add(s, k1, h / 2), u, open, t + speed * h / 2, speed);
      const State k3 = slope(add(s, k2, h / 2), u, open, t + speed * h / 2, speed);
      const State k4 = slope(add(s, k3, h), u, open, t + speed * h, speed);
      for (std::size_t i = 0; i < s.size(); ++i) s[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
      store(s);
    }
  }

  Real torque(Real angle) const {
    // Half the current-weighted change of the inductances with the angle, and the magnet's part.
    Real sum = 0;
    const Real e = electrical(angle);
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) sum += currents[j] * currents[k] * inductance_slope(j, k, e) / 2;
      sum += currents[j] * magnet_slope(j, e);
    }
    return sum * c_.pole_pairs;
  }

 private:
  using State = std::array<Real, 7>;  // currents, charges, integral of the torque
  static constexpr Real turn = 6.283185307179586476925286766559L;

  Real electrical(Real angle) const { return c_.pole_pairs * angle + c_.electrical_offset; }
  static Real axis(std::size_t k) { return turn / 3 * static_cast<Real>(k); }
  Real magnet() const { return 2 * static_cast<Real>(c_.torque_constant) / (3 * c_.pole_pairs); }
  Real magnet_slope(std::size_t k, Real e) const { return -magnet() * std::sin(e - axis(k)); }

  // Phase inductances of a salient rotor: (L_d + L_q)/3 and (L_d - L_q)/3 of the second harmonic.
  Real inductance(std::size_t j, std::size_t k, Real e) const {
    const Real mean = (Real(c_.inductance_d) + c_.inductance_q) / 3;
    const Real salient = (Real(c_.inductance_d) - c_.inductance_q) / 3;
    return mean * std::cos(axis(j) - axis(k)) + salient * std::cos(2 * e - axis(j) - axis(k));
  }
  Real inductance_slope(std::size_t j, std::size_t k, Real e) const {
    const Real salient = (Real(c_.inductance_d) - c_.inductance_q) / 3;
    return -2 * salient * std::sin(2 * e - axis(j) - axis(k));
  }

  State state() const {
    return {currents[0], currents[1], currents[2], charge[0], charge[1], charge[2], torque_integral};
  }
  void store(const State& s) {
    for (std::size_t k = 0; k < 3; ++k) {
      currents[k] = s[k];
      charge[k] = s[3 + k];
    }
    torque_integral = s[6];
  }
  static State add(State s, const State& k, Real h) {
    for (std::size_t i = 0; i < s.size(); ++i) s[i] += h * k[i];
    return s;
  }

  State slope(const State& s, const double (&u)[3], std::size_t open, Real angle, Real speed) {
    store(s);
    const Real e = electrical(angle), w = c_.pole_pairs * speed;
    // u_k - star = R i_k + sum_j (L_kj di_j/dt + w L'_kj i_j) + w magnet'_k
    Real rest[3];
    for (std::size_t k = 0; k < 3; ++k) {
      rest[k] = u[k] - c_.resistance * s[k] - w * magnet_slope(k, e);
      for (std::size_t j = 0; j < 3; ++j) rest[k] -= w * inductance_slope(k, j, e) * s[j];
    }
    State out{};
    if (open < 3) {
      const std::size_t x = (open + 1) % 3, y = (open + 2) % 3;
      const Real loop = inductance(x, x, e) - 2 * inductance(x, y, e) + inductance(y, y, e);
      out[x] = (rest[x] - rest[y]) / loop;
      out[y] = -out[x];
    } else {
      // Currents of A and B free, C's is what is left; differences to C remove the star point.
      Real m[2][2], r[2];
      for (std::size_t k = 0; k < 2; ++k) {
        for (std::size_t j = 0; j < 2; ++j) {
          m[k][j] = inductance(k, j, e) - inductance(k, 2, e) - inductance(2, j, e) + inductance(2, 2, e);
        }
        r[k] = rest[k] - rest[2];
      }
      const Real determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
      out[0] = (r[0] * m[1][1] - r[1] * m[0][1]) / determinant;
      out[1] = (m[0][0] * r[1] - m[1][0] * r[0]) / determinant;
      out[2] = -out[0] - out[1];
    }
    std::copy_n(s.begin(), 3, out.begin() + 3);
    out[6] = torque(angle);
    return out;
  }

  SynchronousMotorConfig c_;
};

}  // namespace kmax::simulation
