#pragma once
// The solution of a chain of masses over one interval as a matrix, for intervals that are proven to hold no
// event or a single reversal of mass 0: a matrix exponential computed once for these springs, dampers and
// this duration, and then used again and again. What cannot be proven is left to the Taylor series with its
// search for events (chain_series.hpp); both solve the same equations to rounding.
//
// Positions are taken relative to mass 0, so they are small numbers wherever the device stands. Coordinates:
//
//   sliding   (v_0, r_1, v_1, ...; a_0, e, e')     r_i = x_i - x_0
//   sticking  (r_1, v_1, ...; e, e')
//
// with the inputs a_0 (held force and Coulomb friction, per mass) and e + e' t (spring and damper to u, per
// last mass, for a last mass at the place of mass 0). Results are the changes of position and the new
// velocities.
//
// Proofs (chain_coefficients.hpp; J: the largest jerk that the energy of the derivative allows, h: the
// interval):
//   no stop        both ends have the same sign and min(|v(0)|, |v(h)|) > J h^2 / 8: a curve deviates from
//   its chord
//                  by no more; or ||v(h)| - |v(0)|| > J h^2 / 2: it rises from its smaller end from the start
//   one reversal   the ends have different signs and |v'(0)| > 2 J h, so v is monotone with its only zero at
//   tau. The
//                  motion goes on backwards if m_0 |v'(tau)| > 2 f_c, and does not turn round again if the
//                  deceleration left, |v'(tau)| - 2 f_c/m_0, is above J (h - tau)/2. Friction then pushes the
//                  other way, and since everything is linear that adds 2 f_c times the step response over h -
//                  tau.
//   no break-away  (f_c - |net force|) > h * (fastest change of the net force)
//
// tau is found on the Taylor series of v about the centre of one of four parts of the interval, of degree 9:
// rests are below 1e-15 of the state as ||A|| h <= 1.25. These tables are built at the first reversal.
//
// Cost, one core of an AMD EPYC: see coupled_handle.hpp. Building: about 4 us, and 4 us for the tables of
// reversals.

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>

#include "host_tools/simulation/chain_coefficients.hpp"
#include "host_tools/simulation/chain_dynamics.hpp"

namespace kmax::simulation {

// Two doubles in one register of the x86-64 baseline (SSE2).
typedef double DoublePair __attribute__((vector_size(16)));

template <std::size_t masses>
class ChainPropagator {
 public:
  // Over `duration`, divided into steps() equal steps so that ||A|| h <= 1.25.
  ChainPropagator(const ChainDynamics& chain, double duration);

  int steps() const { return steps_; }
  double step() const { return h_; }
  const ChainCoefficients<masses>& coefficients() const { return chain_; }

  // One step of a chain whose mass 0 moves, if it is proven that it goes on in its direction or reverses
  // once. False: nothing is done. `force`: on mass 0, without Coulomb's.
  bool slide(ChainState& state, double force, double intended, double rate) const;

  // One step of a chain whose mass 0 stands still, if it is proven that friction holds it. `held`: it is held
  // in any case.
  bool rest(ChainState& state, double force, double intended, double rate, bool held) const;

  // Asks for the memory that slide() and rest() read: it is a table's, and far away.
  void prefetch() const {
    const char* begin = static_cast<const char*>(static_cast<const void*>(this));
#pragma GCC unroll 16
    for (std::size_t n = 0; n < sizeof(*this); n += 64) __builtin_prefetch(begin + n);
  }

  // The tables of reversals now instead of at the first one: for an object that several threads read.
  void prepare_reversals() const {
    if (!reversals_) build_reversals();
  }

 private:
  static constexpr std::size_t columns = masses == 1 ? 2 : 2 * masses + 2;
  static constexpr std::size_t push_column = 2 * masses - 1;
  static constexpr std::size_t rest_columns = masses == 1 ? 1 : 2 * masses;
  static constexpr std::size_t rest_rows = masses == 1 ? 1 : masses - 1;
  static constexpr std::size_t cells = 4;
  static constexpr std::size_t terms = 10;
  using Rows = std::array<DoublePair, masses>;  // (change of x_i, v_i)
  using Inputs = std::array<double, columns>;

  struct Reversals {
    // About the centre of each quarter, the variable -1 to 1 over it: v_0 per column, two terms in a pair,
    // and the response to a_0 = 1.
    std::array<std::array<std::array<DoublePair, terms / 2>, columns>, cells> velocity;
    std::array<std::array<Rows, terms>, cells> response;
  };

  void build_reversals() const;
  [[gnu::noinline]] bool reverse(const Inputs& z, Rows& result, double direction, double acceleration,
                                 double energy) const;

  std::array<Rows, columns> slide_;
  std::array<std::array<DoublePair, rest_rows>, rest_columns> rest_;
  ChainCoefficients<masses> chain_;
  double pull_stiffness_ = 0.0;  // of the last spring and damper, per last mass
  double pull_damping_ = 0.0;
  double h_ = 0.0;
  double friction_rate_ = 0.0;  // f_c / m_0
  double slope_scale_ = 0.0;    // 1/s: from the variable over a quarter to time
  double no_stop_ = 0.0;        // per 2 E': (J h^2/8)^2
  double jerk_ = 0.0;           // per 2 E': (J h)^2
  double no_break_away_ = 0.0;  // per 2 E': (fastest change of net force times h)^2
  int steps_ = 1;
  mutable std::unique_ptr<Reversals> reversals_;
};

namespace chain_propagator {

// c[0] + c[1] t + ... + c[9] t^9, arranged for a short chain of dependent operations.
template <typename Value>
inline Value polynomial(const std::array<Value, 10>& c, double t) {
  const double t2 = t * t;
  const double t4 = t2 * t2;
  return ((c[0] + c[1] * t) + (c[2] + c[3] * t) * t2) +
         (((c[4] + c[5] * t) + (c[6] + c[7] * t) * t2) + (c[8] + c[9] * t) * t4) * t4;
}

}  // namespace chain_propagator

template <std::size_t masses>
[[gnu::always_inline]] inline bool ChainPropagator<masses>::slide(ChainState& state, double force,
                                                                  double intended, double rate) const {
  constexpr std::size_t last = masses - 1;
  const double origin = state.position[0];
  const double direction = std::copysign(1.0, state.velocity[0]);
  const double push = (force - direction * chain_.friction) * chain_.per_mass[0];

  Inputs z;
  z[0] = state.velocity[0];
#pragma GCC unroll 3
  for (std::size_t i = 1; i < masses; ++i) {
    z[2 * i - 1] = state.position[i] - origin;
    z[2 * i] = state.velocity[i];
  }
  z[push_column] = push;
  if constexpr (masses > 1) {
    z[columns - 2] = pull_stiffness_ * (intended - origin) + pull_damping_ * rate;
    z[columns - 1] = pull_stiffness_ * rate;
  }

  // The force comes last: it is what the caller has computed just now.
  Rows result;
#pragma GCC unroll 3
  for (std::size_t i = 0; i < masses; ++i) result[i] = slide_[0][i] * z[0];
#pragma GCC unroll 8
  for (std::size_t c = 1; c < columns; ++c) {
    if (c == push_column) continue;
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) result[i] += slide_[c][i] * z[c];
  }
#pragma GCC unroll 3
  for (std::size_t i = 0; i < masses; ++i) result[i] += slide_[push_column][i] * push;

  if (chain_.friction > 0.0) {
    // The accelerations, and the energy of the derivative.
    double energy = 0.0;
    double below = chain_.base_damping * z[0];
    double acceleration = 0.0;
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) {
      double above = 0.0;
      if constexpr (masses > 1) {
        const std::size_t next = i < last ? i + 1 : i;
        const double stretch = (i < last ? state.position[next] : intended) - state.position[i];
        const double closing = (i < last ? state.velocity[next] : rate) - state.velocity[i];
        above = chain_.stiffness[i] * stretch + chain_.damping[i] * closing;
        energy += chain_.stiffness[i] * (closing * closing);
      }
      double a = (above - below) * chain_.per_mass[i];
      if (i == 0) acceleration = a = a + push;
      energy += chain_.mass[i] * (a * a);
      below = above;
    }
    const double speed = direction * z[0];
    const double final_speed = direction * result[0][1];
    const double slower = speed < final_speed ? speed : final_speed;
    if (!(slower > 0.0 && slower * slower > no_stop_ * energy)) {
      if (slower > 0.0) {
        const double change = final_speed - speed;
        if (!(change * change > 16.0 * no_stop_ * energy)) return false;
      } else {
        // Copies: what reverse() does not see stays in registers.
        const Inputs inputs = z;
        Rows reversed = result;
        if (!reverse(inputs, reversed, direction, acceleration, energy)) return false;
        result = reversed;
      }
    }
  }
#pragma GCC unroll 3
  for (std::size_t i = 0; i < masses; ++i) {
    state.position[i] += result[i][0];
    state.velocity[i] = result[i][1];
  }
  return true;
}

template <std::size_t masses>
bool ChainPropagator<masses>::reverse(const Inputs& z, Rows& result, double direction, double acceleration,
                                      double energy) const {
  const double deceleration = -direction * acceleration;
  const double speed = direction * z[0];
  if (!(speed > 0.0 && deceleration > 0.0 && deceleration * deceleration > 4.0 * jerk_ * energy))
    return false;
  if (!reversals_) [[unlikely]]
    build_reversals();

  // A parabola through both ends and the first slope says in which quarter the zero is; a neighbour will do.
  const double fall = deceleration * h_;
  const double curve = direction * result[0][1] - speed + fall;
  std::size_t cell = 0;
#pragma GCC unroll 3
  for (std::size_t n = 1; n < cells; ++n) {
    const double part = static_cast<double>(n) / static_cast<double>(cells);
    cell += speed - part * (fall - part * curve) > 0.0 ? 1 : 0;
  }
  const auto& table = reversals_->velocity[cell];
  std::array<DoublePair, terms / 2> sums;
#pragma GCC unroll 5
  for (std::size_t n = 0; n < terms / 2; ++n) sums[n] = table[0][n] * z[0];
#pragma GCC unroll 8
  for (std::size_t c = 1; c < columns; ++c) {
#pragma GCC unroll 5
    for (std::size_t n = 0; n < terms / 2; ++n) sums[n] += table[c][n] * z[c];
  }
  std::array<double, terms> c;
#pragma GCC unroll 5
  for (std::size_t n = 0; n < terms / 2; ++n) {
    c[2 * n] = sums[n][0];
    c[2 * n + 1] = sums[n][1];
  }

  // The inverse series to order 6, then Newton steps, of which one is nearly always enough. |a2| <= 1/16, as
  // the slope never halves.
  const double per_slope = 1.0 / c[1];
  const double u = -c[0] * per_slope;
  const double a2 = c[2] * per_slope;
  const double a3 = c[3] * per_slope;
  const double a4 = c[4] * per_slope;
  const double a5 = c[5] * per_slope;
  const double b2 = a2 * a2;
  const double u2 = u * u;
  const double r3 = 2.0 * b2 - a3;
  const double r4 = 5.0 * a2 * (a3 - b2) - a4;
  const double r5 = 14.0 * b2 * b2 - 21.0 * b2 * a3 + 3.0 * a3 * a3 + 6.0 * a2 * a4 - a5;
  double t = (u - a2 * u2) + (u * u2) * ((r3 + r4 * u) + r5 * u2);
  double newton_step = 1.0;
  for (int round = 0; round < 4 && std::abs(newton_step) > 1e-7; ++round) {
    // 1 over the slope to its sixth order in what the slope differs from c[1]: at most 1/8.
    const double steeper = t * (2.0 * a2 + t * (3.0 * a3 + t * (4.0 * a4 + t * (5.0 * a5))));
    const double steeper2 = steeper * steeper;
    const double per_slope_there =
        per_slope * ((1.0 - steeper) * ((1.0 + steeper2) * (1.0 + steeper2 * steeper2)));
    newton_step = chain_propagator::polynomial(c, t) * per_slope_there;
    t -= newton_step;
  }
  if (!(std::abs(t) <= 1.5 && std::abs(newton_step) <= 1e-7)) return false;

  const auto& after = reversals_->response[cells - 1 - cell];
  Rows response;
#pragma GCC unroll 3
  for (std::size_t i = 0; i < masses; ++i) {
    std::array<DoublePair, terms> row;
#pragma GCC unroll 10
    for (std::size_t n = 0; n < terms; ++n) row[n] = after[n][i];
    response[i] = chain_propagator::polynomial(row, -t);
  }
  constexpr double per_cells = 1.0 / static_cast<double>(cells);
  const double part = per_cells * (static_cast<double>(cell) + 0.5 + 0.5 * t);  // tau / h
  if (!(part > 0.0 && part < 1.0)) return false;
  const double t2 = t * t;
  const double slope_there =
      (c[1] + 2.0 * c[2] * t) + t2 * ((3.0 * c[3] + 4.0 * c[4] * t) + t2 * (5.0 * c[5] + 6.0 * c[6] * t));
  const double slope = -direction * slope_there * slope_scale_;
  const double jump = 2.0 * friction_rate_;
  const double onwards = slope - jump;
  const double rest = 1.0 - part;
  if (!(onwards > 1e-6 * slope && onwards * onwards > 0.25 * jerk_ * energy * (rest * rest))) return false;
#pragma GCC unroll 3
  for (std::size_t i = 0; i < masses; ++i) result[i] += response[i] * (direction * jump);
  return true;
}

template <std::size_t masses>
[[gnu::always_inline]] inline bool ChainPropagator<masses>::rest(ChainState& state, double force,
                                                                 double intended, double rate,
                                                                 bool held) const {
  if constexpr (masses == 1) {
    return held || std::abs(force) <= chain_.friction;
  } else {
    constexpr std::size_t last = masses - 1;
    const double origin = state.position[0];
    std::array<double, rest_columns> z;
    double energy = 0.0;
    double below = 0.0;
    double net = 0.0;
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) {
      if (i > 0) {
        z[2 * i - 2] = state.position[i] - origin;
        z[2 * i - 1] = state.velocity[i];
      }
      const double velocity = i == 0 ? 0.0 : state.velocity[i];
      const std::size_t next = i < last ? i + 1 : i;
      const double closing = i < last ? state.velocity[next] - velocity : rate - velocity;
      const double above =
          chain_.stiffness[i] * ((i < last ? state.position[next] : intended) - state.position[i]) +
          chain_.damping[i] * closing;
      energy += chain_.stiffness[i] * (closing * closing);
      if (i == 0) {
        net = force + above;
      } else {
        const double a = (above - below) * chain_.per_mass[i];
        energy += chain_.mass[i] * (a * a);
      }
      below = above;
    }
    if (!held) {
      const double slack = chain_.friction - std::abs(net);
      if (!(slack > 0.0 && slack * slack > no_break_away_ * energy)) return false;
    }
    z[rest_columns - 2] = pull_stiffness_ * (intended - origin) + pull_damping_ * rate;
    z[rest_columns - 1] = pull_stiffness_ * rate;
    std::array<DoublePair, rest_rows> result;
#pragma GCC unroll 2
    for (std::size_t i = 0; i < rest_rows; ++i) result[i] = rest_[0][i] * z[0];
#pragma GCC unroll 6
    for (std::size_t c = 1; c < rest_columns; ++c) {
#pragma GCC unroll 2
      for (std::size_t i = 0; i < rest_rows; ++i) result[i] += rest_[c][i] * z[c];
    }
#pragma GCC unroll 2
    for (std::size_t i = 0; i < rest_rows; ++i) {
      state.position[i + 1] += result[i][0];
      state.velocity[i + 1] = result[i][1];
    }
    return true;
  }
}

extern template class ChainPropagator<1>;
extern template class ChainPropagator<2>;
extern template class ChainPropagator<3>;

}  // namespace kmax::simulation
