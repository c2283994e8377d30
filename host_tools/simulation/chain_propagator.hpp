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
// Proofs (chain_coefficients.hpp), where J is the largest jerk that the energy of the derivative allows and h
// the interval:
//   no stop        both ends have the same sign and min(|v(0)|, |v(h)|) > J h^2 / 8: a curve deviates from
//                  its chord by no more; or ||v(h)| - |v(0)|| > J h^2 / 2: it rises from its smaller end from
//                  the start
//   one reversal   the ends have different signs and |v'(0)| > 2 J h, so v is monotone with its only zero at
//                  tau. The motion goes on backwards if m_0 |v'(tau)| > 2 f_c, and does not turn round again
//                  if the deceleration left, |v'(tau)| - 2 f_c/m_0, is above J (h - tau)/2. Friction then
//                  pushes the other way, and since everything is linear that adds 2 f_c times the step
//                  response over h - tau.
//   no break-away  (f_c - |net force|) > h * (fastest change of the net force)
//
// tau is found on the Taylor series of v about the centre of one of four parts of the interval, of degree 9:
// rests are below 1e-15 of the state as ||A|| h <= 1.25. These tables are built at the first reversal.
//
// For gains about one gain. The springs and dampers from one on are multiplied by a gain g; a propagator may
// serve a span of gains instead of one: every matrix M is then M(g_0) + (g - g_0) M'(g_0), of which the rest
// is (g - g_0)^2 / 2 M''; inputs and accelerations are those of g itself, bounds those of the span's highest
// gain, and at g_0 everything is as without a span.
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

// The gains that one propagator serves.
struct GainSpan {
  double centre = 1.0;  // g_0
  double lowest = 1.0;
  double highest = 1.0;
};

template <std::size_t masses>
class ChainPropagator {
 public:
  // Over `duration`, divided into steps() equal steps so that ||A|| h <= 1.25.
  ChainPropagator(const ChainDynamics& chain, double duration)
      : ChainPropagator(chain, masses, GainSpan{}, duration) {}
  // `chain`: at a gain of 1, which multiplies the springs and dampers from number `first_scaled` on.
  ChainPropagator(const ChainDynamics& chain, std::size_t first_scaled, const GainSpan& gains,
                  double duration);

  const GainSpan& gains() const { return gains_; }
  int steps() const { return steps_; }
  double step() const { return h_; }
  const ChainCoefficients<masses>& coefficients() const { return chain_; }  // at the centre

  // One step of a chain whose mass 0 moves, if it is proven that it goes on in its direction or reverses
  // once. False: nothing is done. `force`: on mass 0, without Coulomb's. `offset`: g - g_0, which is 0 unless
  // `off_centre`.
  template <bool off_centre = false>
  bool slide(ChainState& state, double force, double intended, double rate, double offset = 0.0) const;

  // One step of a chain whose mass 0 stands still, if it is proven that friction holds it. `held`: it is held
  // in any case.
  template <bool off_centre = false>
  bool rest(ChainState& state, double force, double intended, double rate, bool held,
            double offset = 0.0) const;

  // Asks for the memory that slide() and rest() read at the centre: it is a table's, and far away.
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
  // Of slopes; the rest, times g - g_0, is below that of the interpolation.
  static constexpr std::size_t slope_terms = 6;
  using Rows = std::array<DoublePair, masses>;  // (change of x_i, v_i)
  using Inputs = std::array<double, columns>;

  struct Reversals {
    // About the centre of each quarter, the variable -1 to 1 over it: v_0 per column, two terms in a pair,
    // and the response to a_0 = 1.
    std::array<std::array<std::array<DoublePair, terms / 2>, columns>, cells> velocity;
    std::array<std::array<Rows, terms>, cells> response;
  };
  using Slide = std::array<Rows, columns>;
  using Rest = std::array<std::array<DoublePair, rest_rows>, rest_columns>;
  struct Springs {
    std::array<double, masses> stiffness{}, damping{};
  };
  // Everything per gain.
  struct ReversalSlopes {
    std::array<std::array<std::array<DoublePair, slope_terms / 2>, columns>, cells> velocity;
    std::array<std::array<Rows, slope_terms>, cells> response;
  };
  struct Slopes {
    Slide slide;
    Rest rest;
    Springs springs;
    ChainDynamics chain;  // at a gain of 1
    std::size_t first_scaled;
    std::unique_ptr<ReversalSlopes> reversals;

    ChainCoefficients<masses> at(double gain) const {
      return ChainCoefficients<masses>(stiffened(chain, first_scaled, gain));
    }
  };

  static void build_matrices(const ChainCoefficients<masses>& chain, double h, Slide& slide, Rest& rest);
  void build_reversals() const;
  template <bool off_centre>
  [[gnu::always_inline]] Springs springs(double offset) const;
  [[gnu::noinline]] bool reverse(const Inputs& z, Rows& result, double direction, double acceleration,
                                 double energy, double offset) const;

  Slide slide_;
  Rest rest_;
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
  GainSpan gains_;
  std::unique_ptr<Slopes> slopes_;  // none without a span
};

template <std::size_t masses>
template <bool off_centre>
[[gnu::always_inline]] inline typename ChainPropagator<masses>::Springs ChainPropagator<masses>::springs(
    double offset) const {
  Springs springs{chain_.stiffness, chain_.damping};
  if constexpr (off_centre) {
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) {
      springs.stiffness[i] += offset * slopes_->springs.stiffness[i];
      springs.damping[i] += offset * slopes_->springs.damping[i];
    }
  }
  return springs;
}

template <std::size_t masses>
template <bool off_centre>
[[gnu::always_inline]] inline bool ChainPropagator<masses>::slide(ChainState& state, double force,
                                                                  double intended, double rate,
                                                                  double offset) const {
  constexpr std::size_t last = masses - 1;
  const double origin = state.position[0];
  const double direction = std::copysign(1.0, state.velocity[0]);
  const double push = (force - direction * chain_.friction) * chain_.per_mass[0];

  const Springs springs = this->springs<off_centre>(offset);
  Inputs z;
  z[0] = state.velocity[0];
#pragma GCC unroll 3
  for (std::size_t i = 1; i < masses; ++i) {
    z[2 * i - 1] = state.position[i] - origin;
    z[2 * i] = state.velocity[i];
  }
  z[push_column] = push;
  if constexpr (masses > 1) {
    const double pull_stiffness =
        off_centre ? springs.stiffness[last] * chain_.per_mass[last] : pull_stiffness_;
    const double pull_damping = off_centre ? springs.damping[last] * chain_.per_mass[last] : pull_damping_;
    z[columns - 2] = pull_stiffness * (intended - origin) + pull_damping * rate;
    z[columns - 1] = pull_stiffness * rate;
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
  if constexpr (off_centre) {
    Rows slope;
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) slope[i] = slopes_->slide[0][i] * z[0];
#pragma GCC unroll 8
    for (std::size_t c = 1; c < columns; ++c) {
#pragma GCC unroll 3
      for (std::size_t i = 0; i < masses; ++i) slope[i] += slopes_->slide[c][i] * z[c];
    }
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) result[i] += slope[i] * offset;
  }

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
        above = springs.stiffness[i] * stretch + springs.damping[i] * closing;
        energy += springs.stiffness[i] * (closing * closing);
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
        if (!reverse(inputs, reversed, direction, acceleration, energy, offset)) return false;
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
template <bool off_centre>
[[gnu::always_inline]] inline bool ChainPropagator<masses>::rest(ChainState& state, double force,
                                                                 double intended, double rate, bool held,
                                                                 double offset) const {
  if constexpr (masses == 1) {
    return held || std::abs(force) <= chain_.friction;
  } else {
    constexpr std::size_t last = masses - 1;
    const double origin = state.position[0];
    const Springs springs = this->springs<off_centre>(offset);
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
          springs.stiffness[i] * ((i < last ? state.position[next] : intended) - state.position[i]) +
          springs.damping[i] * closing;
      energy += springs.stiffness[i] * (closing * closing);
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
    const double pull_stiffness =
        off_centre ? springs.stiffness[last] * chain_.per_mass[last] : pull_stiffness_;
    const double pull_damping = off_centre ? springs.damping[last] * chain_.per_mass[last] : pull_damping_;
    z[rest_columns - 2] = pull_stiffness * (intended - origin) + pull_damping * rate;
    z[rest_columns - 1] = pull_stiffness * rate;
    std::array<DoublePair, rest_rows> result;
#pragma GCC unroll 2
    for (std::size_t i = 0; i < rest_rows; ++i) result[i] = rest_[0][i] * z[0];
#pragma GCC unroll 6
    for (std::size_t c = 1; c < rest_columns; ++c) {
#pragma GCC unroll 2
      for (std::size_t i = 0; i < rest_rows; ++i) result[i] += rest_[c][i] * z[c];
    }
    if constexpr (off_centre) {
#pragma GCC unroll 6
      for (std::size_t c = 0; c < rest_columns; ++c) {
        const double shift = offset * z[c];
#pragma GCC unroll 2
        for (std::size_t i = 0; i < rest_rows; ++i) result[i] += slopes_->rest[c][i] * shift;
      }
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
