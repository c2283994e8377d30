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

// c[0] + c[1] t + ... + c[9] t^9, arranged for a short chain of dependent operations.
template <typename Value>
Value polynomial(const std::array<Value, 10>& c, double t) {
  const double t2 = t * t;
  const double t4 = t2 * t2;
  return ((c[0] + c[1] * t) + (c[2] + c[3] * t) * t2) +
         (((c[4] + c[5] * t) + (c[6] + c[7] * t) * t2) + (c[8] + c[9] * t) * t4) * t4;
}

// Slopes are differences over this part of the gain to either side: the third derivative adds 1e-7 of itself.
constexpr double slope_step = 0x1p-10;

// `table` becomes (above - below) / (2 d), for pairs of numbers in arrays of any depth.
void slope_of(DoublePair& table, const DoublePair& above, const DoublePair& below, double per_2d) {
  table = (above - below) * per_2d;
}
template <typename Table>
void slope_of(Table& table, const Table& above, const Table& below, double per_2d) {
  for (std::size_t n = 0; n < table.size(); ++n) slope_of(table[n], above[n], below[n], per_2d);
}

}  // namespace

template <std::size_t masses>
ChainPropagator<masses>::ChainPropagator(const ChainDynamics& chain, std::size_t first_scaled,
                                         const GainSpan& gains, double duration)
    : chain_(stiffened(chain, first_scaled, gains.centre)), gains_(gains) {
  static_assert(cells == quarters && terms == terms_kept);
  const ChainCoefficients<masses> stiffest(stiffened(chain, first_scaled, gains.highest));
  steps_ = std::max(1, static_cast<int>(std::ceil(stiffest.largest_rate() * duration / largest_series_step)));
  h_ = duration / steps_;
  pull_stiffness_ = chain_.pull_rate(1.0);
  pull_damping_ = chain_.pull(0.0, 1.0);
  friction_rate_ = chain_.friction * chain_.per_mass[0];
  slope_scale_ = 2.0 * static_cast<double>(cells) / h_;
  jerk_ = stiffest.jerk_factor() * h_ * h_;
  no_stop_ = jerk_ * h_ * h_ / 64.0;
  no_break_away_ = stiffest.force_rate_factor() * h_ * h_;
  build_matrices(chain_, h_, slide_, rest_);
  if (gains.lowest == gains.highest) return;
  slopes_ = std::make_unique<Slopes>();
  slopes_->chain = chain;
  slopes_->first_scaled = first_scaled;
  const double d = slope_step * gains.centre;
  Slide slide_above{}, slide_below{};
  Rest rest_above{}, rest_below{};
  build_matrices(slopes_->at(gains.centre + d), h_, slide_above, rest_above);
  build_matrices(slopes_->at(gains.centre - d), h_, slide_below, rest_below);
  slope_of(slopes_->slide, slide_above, slide_below, 0.5 / d);
  slope_of(slopes_->rest, rest_above, rest_below, 0.5 / d);
  for (std::size_t i = first_scaled; i < masses; ++i) {
    slopes_->springs.stiffness[i] = chain.stiffness[i];
    slopes_->springs.damping[i] = chain.damping[i];
  }
}

template <std::size_t masses>
void ChainPropagator<masses>::build_matrices(const ChainCoefficients<masses>& chain, double h, Slide& slide,
                                             Rest& rest) {
  for (std::size_t c = 0; c < columns; ++c) {
    const UnitMotion<masses> motion = sliding_motion(chain, h, c);
    for (std::size_t i = 0; i < masses; ++i)
      slide[c][i] = DoublePair{change(motion.x[i]), value(motion.v[i])};
  }
  if constexpr (masses > 1) {
    for (std::size_t c = 0; c < rest_columns; ++c) {
      UnitMotion<masses> motion;
      for (std::size_t i = 1; i < masses; ++i) {
        if (c == 2 * i - 2) motion.x[i][0] = 1;
        if (c == 2 * i - 1) motion.v[i][0] = 1;
      }
      motion.expand(chain, h, 1, 0, c == rest_columns - 2 ? 1 : 0, c == rest_columns - 1 ? 1 : 0);
      for (std::size_t i = 1; i < masses; ++i)
        rest[c][i - 1] = DoublePair{change(motion.x[i]), value(motion.v[i])};
    }
  }
}

template <std::size_t masses>
void ChainPropagator<masses>::build_reversals() const {
  auto tables = std::make_unique<Reversals>();
  const auto fill = [this](const ChainCoefficients<masses>& chain, auto& velocity, auto& response) {
    for (std::size_t c = 0; c < columns; ++c) {
      const UnitMotion<masses> motion = sliding_motion(chain, h_, c);
      for (std::size_t cell = 0; cell < cells; ++cell) {
        for (std::size_t n = 0; n < response[cell].size(); ++n) {
          velocity[cell][c][n / 2][n % 2] = recentred(motion.v[0], cell, n);
          if (c != 2 * masses - 1) continue;
          for (std::size_t i = 0; i < masses; ++i) {
            response[cell][n][i] =
                DoublePair{recentred(motion.x[i], cell, n), recentred(motion.v[i], cell, n)};
          }
        }
      }
    }
  };
  fill(chain_, tables->velocity, tables->response);
  if (slopes_) {
    const double d = slope_step * gains_.centre;
    auto slopes = std::make_unique<ReversalSlopes>();
    auto above = *slopes, below = *slopes;
    fill(slopes_->at(gains_.centre + d), above.velocity, above.response);
    fill(slopes_->at(gains_.centre - d), below.velocity, below.response);
    slope_of(slopes->velocity, above.velocity, below.velocity, 0.5 / d);
    slope_of(slopes->response, above.response, below.response, 0.5 / d);
    slopes_->reversals = std::move(slopes);
  }
  reversals_ = std::move(tables);
}

template <std::size_t masses>
bool ChainPropagator<masses>::reverse(const Inputs& z, Rows& result, double direction, double acceleration,
                                      double energy, double offset) const {
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
  if (offset != 0.0) {
    const auto& slopes = slopes_->reversals->velocity[cell];
    std::array<DoublePair, slope_terms / 2> slope{};
#pragma GCC unroll 8
    for (std::size_t c = 0; c < columns; ++c) {
#pragma GCC unroll 3
      for (std::size_t n = 0; n < slope_terms / 2; ++n) slope[n] += slopes[c][n] * z[c];
    }
#pragma GCC unroll 3
    for (std::size_t n = 0; n < slope_terms / 2; ++n) sums[n] += slope[n] * offset;
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
    newton_step = polynomial(c, t) * per_slope_there;
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
    if (offset != 0.0) {
      const auto& slopes = slopes_->reversals->response[cells - 1 - cell];
#pragma GCC unroll 6
      for (std::size_t n = 0; n < slope_terms; ++n) row[n] += slopes[n][i] * offset;
    }
    response[i] = polynomial(row, -t);
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

template class ChainPropagator<1>;
template class ChainPropagator<2>;
template class ChainPropagator<3>;

}  // namespace kmax::simulation
