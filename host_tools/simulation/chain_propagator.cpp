#include "host_tools/simulation/chain_propagator.hpp"

#include <algorithm>

#include "host_tools/simulation/chain_series.hpp"

namespace kmax::simulation {
namespace {

constexpr std::size_t order = 24;  // 1.25^25 / 25! = 2e-23
using Real = long double;
using Series = std::array<Real, order + 1>;  // in the time divided by the step

// The chain's motion from a unit start, or under a unit input from rest. `first`: 1 with mass 0 held at 0.
template <std::size_t masses>
struct UnitMotion {
  std::array<Series, masses> x{};
  std::array<Series, masses> v{};

  void expand(const ChainCoefficients<masses>& chain, Real h, std::size_t first, Real push, Real pull,
              Real pull_rate) {
    for (std::size_t n = 0; n < order; ++n) {
      const Real f = h / static_cast<Real>(n + 1);
      for (std::size_t i = first; i < masses; ++i) {
        const bool top = i + 1 == masses;
        Real force = chain.stiffness[i] * ((top ? Real(0) : x[top ? i : i + 1][n]) - x[i][n]) +
                     chain.damping[i] * ((top ? Real(0) : v[top ? i : i + 1][n]) - v[i][n]);
        if (i > 0) {
          force += chain.stiffness[i - 1] * (x[i - 1][n] - x[i][n]) +
                   chain.damping[i - 1] * (v[i - 1][n] - v[i][n]);
        } else {
          force -= chain.base_damping * v[0][n];
        }
        Real a = force / chain.mass[i];
        if (n == 0 && i == 0) a += push;
        if (n == 0 && top) a += pull;
        if (n == 1 && top) a += pull_rate * h;
        x[i][n + 1] = f * v[i][n];
        v[i][n + 1] = f * a;
      }
    }
  }
};

// The column `c` of the sliding coordinates (v_0, r_1, v_1, ...; a_0, e, e').
template <std::size_t masses>
UnitMotion<masses> sliding_motion(const ChainCoefficients<masses>& chain, Real h, std::size_t c) {
  UnitMotion<masses> motion;
  if (c == 0) motion.v[0][0] = 1;
  for (std::size_t i = 1; i < masses; ++i) {
    if (c == 2 * i - 1) motion.x[i][0] = 1;
    if (c == 2 * i) motion.v[i][0] = 1;
  }
  motion.expand(chain, h, 0, c == 2 * masses - 1 ? 1 : 0, c == 2 * masses ? 1 : 0,
                c == 2 * masses + 1 ? 1 : 0);
  return motion;
}

// The sum without its first term: the change.
double change(const Series& c) {
  Real sum = 0;
  for (std::size_t n = order; n >= 1; --n) sum += c[n];
  return static_cast<double>(sum);
}
double value(const Series& c) {
  return static_cast<double>([&] {
    Real sum = 0;
    for (std::size_t n = order + 1; n-- > 0;) sum += c[n];
    return sum;
  }());
}

constexpr std::size_t quarters = 4;
constexpr std::size_t terms_kept = 10;

// p(t) on 0 to 1 becomes a polynomial of s in -1 to 1 over a quarter, t = (2 cell + 1 + s) / 8: coefficient
// of s^n = sum over m of c[m] binomial(m, n) centre^(m - n) / 8^n.
const auto recentre = [] {
  std::array<std::array<std::array<double, order + 1>, terms_kept>, quarters> table{};
  for (std::size_t cell = 0; cell < quarters; ++cell) {
    const Real centre = static_cast<Real>(2 * cell + 1) / (2 * quarters);
    for (std::size_t n = 0; n < terms_kept; ++n) {
      Real factor = 1;
      for (std::size_t k = 0; k < n; ++k) factor /= 2 * quarters;
      for (std::size_t m = n; m <= order; ++m) {
        table[cell][n][m] = static_cast<double>(factor);
        factor *= centre * static_cast<Real>(m + 1) / static_cast<Real>(m + 1 - n);
      }
    }
  }
  return table;
}();

double recentred(const Series& c, std::size_t cell, std::size_t n) {
  double sum = 0.0;
  for (std::size_t m = order + 1; m-- > n;) sum += recentre[cell][n][m] * static_cast<double>(c[m]);
  return sum;
}

}  // namespace

template <std::size_t masses>
ChainPropagator<masses>::ChainPropagator(const ChainDynamics& dynamics, double duration) : chain_(dynamics) {
  static_assert(cells == quarters && terms == terms_kept);
  steps_ = std::max(1, static_cast<int>(std::ceil(chain_.largest_rate() * duration / largest_series_step)));
  h_ = duration / steps_;
  pull_stiffness_ = chain_.pull_rate(1.0);
  pull_damping_ = chain_.pull(0.0, 1.0);
  friction_rate_ = chain_.friction * chain_.per_mass[0];
  slope_scale_ = 2.0 * static_cast<double>(cells) / h_;
  jerk_ = chain_.jerk_factor() * h_ * h_;
  no_stop_ = jerk_ * h_ * h_ / 64.0;
  no_break_away_ = chain_.force_rate_factor() * h_ * h_;
  for (std::size_t c = 0; c < columns; ++c) {
    const UnitMotion<masses> motion = sliding_motion(chain_, h_, c);
    for (std::size_t i = 0; i < masses; ++i)
      slide_[c][i] = DoublePair{change(motion.x[i]), value(motion.v[i])};
  }
  if constexpr (masses > 1) {
    for (std::size_t c = 0; c < rest_columns; ++c) {
      UnitMotion<masses> motion;
      for (std::size_t i = 1; i < masses; ++i) {
        if (c == 2 * i - 2) motion.x[i][0] = 1;
        if (c == 2 * i - 1) motion.v[i][0] = 1;
      }
      motion.expand(chain_, h_, 1, 0, c == rest_columns - 2 ? 1 : 0, c == rest_columns - 1 ? 1 : 0);
      for (std::size_t i = 1; i < masses; ++i)
        rest_[c][i - 1] = DoublePair{change(motion.x[i]), value(motion.v[i])};
    }
  }
}

template <std::size_t masses>
void ChainPropagator<masses>::build_reversals() const {
  auto tables = std::make_unique<Reversals>();
  for (std::size_t c = 0; c < columns; ++c) {
    const UnitMotion<masses> motion = sliding_motion(chain_, h_, c);
    for (std::size_t cell = 0; cell < cells; ++cell) {
      for (std::size_t n = 0; n < terms; ++n) {
        tables->velocity[cell][c][n / 2][n % 2] = recentred(motion.v[0], cell, n);
        if (c != 2 * masses - 1) continue;
        for (std::size_t i = 0; i < masses; ++i) {
          tables->response[cell][n][i] =
              DoublePair{recentred(motion.x[i], cell, n), recentred(motion.v[i], cell, n)};
        }
      }
    }
  }
  reversals_ = std::move(tables);
}

template class ChainPropagator<1>;
template class ChainPropagator<2>;
template class ChainPropagator<3>;

}  // namespace kmax::simulation
