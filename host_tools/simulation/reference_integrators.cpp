#include "host_tools/simulation/reference_integrators.hpp"

#include <algorithm>
#include <cmath>

#include <boost/numeric/odeint/algebra/array_algebra.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

#include "host_tools/simulation/chain_equations.hpp"

namespace kmax::simulation {

namespace {

// The new velocity of mass 0. The friction opposes the motion; where it would turn the mass round, friction
// holds it, or the rest of the step runs the other way.
template <std::size_t masses>
double next_velocity(const ChainEquations<masses>& equations,
                     const typename ChainEquations<masses>::Vector& s, double force, double h) {
  const double velocity = s[masses];
  const double per_mass = equations.per_mass(0);
  const double friction = equations.friction();
  if (velocity == 0.0) {
    if (equations.holds(s, force)) return 0.0;
    return h * per_mass * (force - std::copysign(friction, force));
  }
  const double opposed = std::copysign(friction, velocity);
  const double next = velocity + h * per_mass * (force - opposed);
  if (next == 0.0 || std::signbit(next) == std::signbit(velocity)) return next;
  if (equations.holds(s, force)) return 0.0;
  const double left = h * (next / (next - velocity));  // after the instant of rest
  return left * per_mass * (force + opposed);
}

template <std::size_t masses>
void step(const ChainEquations<masses>& equations, typename ChainEquations<masses>::Vector& s, double t,
          double h) {
  const auto force = equations.forces(s, t);
  s[masses] = next_velocity(equations, s, force[0], h);
  for (std::size_t i = 1; i < masses; ++i) s[masses + i] += h * equations.per_mass(i) * force[i];
  for (std::size_t i = 0; i < masses; ++i) s[i] += h * s[masses + i];
}

}  // namespace

void integrate_semi_implicit_euler(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input,
                                   double duration, double longest_step) {
  require_sound(dynamics, state, input, duration);
  const long steps = equal_steps(duration, longest_step);
  const double h = duration / static_cast<double>(steps);
  with_equations(dynamics, input, [&](const auto& equations) {
    auto s = equations.vector_of(state);
    for (long n = 0; n < steps; ++n) step(equations, s, h * static_cast<double>(n), h);
    equations.store(s, state);
  });
}

namespace {

template <std::size_t masses>
class Rk4 {
 public:
  using Vector = typename ChainEquations<masses>::Vector;

  explicit Rk4(const ChainEquations<masses>& equations) : equations_(equations) {}

  // A step from t over h, divided where mass 0 comes to rest.
  void advance(Vector& s, double t, double h) const {
    for (int divisions = 0; divisions < most_divisions; ++divisions) {
      const Contact contact = equations_.contact(s, t);
      const Vector whole = next(s, t, h, contact);
      if (contact == Contact::sticking || equations_.friction() == 0.0 || forward(whole, contact) >= 0.0) {
        s = whole;
        return;
      }
      const auto velocity = [&](double part) { return forward(next(s, t, part, contact), contact); };
      const double low = forward(s, contact) > 0.0 ? 0.0 : moving_start(velocity, h);
      if (low < 0.0) break;
      const double rest = falling_zero_of(velocity, low, h);
      s = next(s, t, rest, contact);
      s[masses] = 0.0;
      t += rest;
      h -= rest;
      if (!(h > 0.0)) return;
    }
    // It trembles: held for the rest of the step, which can only remove energy.
    s[masses] = 0.0;
    s = next(s, t, h, Contact::sticking);
  }

 private:
  static constexpr int most_divisions = 16;

  static double forward(const Vector& s, Contact contact) { return static_cast<double>(contact) * s[masses]; }

  static Vector along(const Vector& s, const Vector& rate, double h) {
    Vector moved;
    for (std::size_t i = 0; i < s.size(); ++i) moved[i] = s[i] + h * rate[i];
    return moved;
  }

  Vector next(const Vector& s, double t, double h, Contact contact) const {
    const double half = 0.5 * h;
    const Vector k1 = equations_.derivative(s, t, contact);
    const Vector k2 = equations_.derivative(along(s, k1, half), t + half, contact);
    const Vector k3 = equations_.derivative(along(s, k2, half), t + half, contact);
    const Vector k4 = equations_.derivative(along(s, k3, h), t + h, contact);
    Vector end;
    for (std::size_t i = 0; i < s.size(); ++i)
      end[i] = s[i] + h * (1.0 / 6.0) * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    return end;
  }

  const ChainEquations<masses>& equations_;
};

template <std::size_t masses>
Rk4(const ChainEquations<masses>&) -> Rk4<masses>;

}  // namespace

void integrate_rk4(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input, double duration,
                   double longest_step) {
  require_sound(dynamics, state, input, duration);
  const long steps = equal_steps(duration, longest_step);
  const double h = duration / static_cast<double>(steps);
  with_equations(dynamics, input, [&](const auto& equations) {
    const Rk4 method(equations);
    auto s = equations.vector_of(state);
    for (long n = 0; n < steps; ++n) method.advance(s, h * static_cast<double>(n), h);
    equations.store(s, state);
  });
}

namespace {

namespace odeint = boost::numeric::odeint;

constexpr double absolute_share = 1e-3;  // of the tolerance, in m and m/s
constexpr int points = 8;                // of the dense output that are looked at per step
constexpr long most_integrator_steps = 1'000'000;
constexpr int most_events = 64;

template <std::size_t masses>
class AdaptiveRun {
 public:
  using Vector = typename ChainEquations<masses>::Vector;

  AdaptiveRun(const ChainEquations<masses>& equations, double duration, double tolerance, double first_step)
      : equations_(equations),
        duration_(duration),
        dense_(odeint::make_dense_output(absolute_share * tolerance, tolerance, Method())),
        step_(std::min(first_step, duration)) {}

  void integrate(Vector& s) {
    contact_ = equations_.contact(s, 0.0);
    while (t_ < duration_) {
      if (!slide_or_stick(s)) return;
      if (++events_ >= most_events) {
        contact_ = Contact::sticking;  // it trembles: held for the rest, which can only remove energy
        s[masses] = 0.0;
      }
    }
  }

 private:
  using Method = odeint::runge_kutta_dopri5<Vector, double, Vector, double, odeint::array_algebra>;
  using Dense = typename odeint::result_of::make_dense_output<Method>::type;

  // From t_ to the next event, which is set up for what follows it (true), or to the end (false).
  bool slide_or_stick(Vector& s) {
    const auto system = [this](const Vector& at, Vector& rate, double t) {
      rate = equations_.derivative(at, t, contact_);
    };
    const bool may_change = equations_.friction() > 0.0 && events_ < most_events;
    dense_.initialize(s, t_, std::min(step_, duration_ - t_));
    while (t_ < duration_) {
      if (dense_.current_time_step() >= duration_ - t_) {
        const Vector current = dense_.current_state();
        dense_.initialize(current, t_, duration_ - t_);
      }
      if (++steps_ > most_integrator_steps) {
        throw std::runtime_error(fmt::format(
            "the adaptive integrator needs more than {} steps: choose a larger tolerance", most_integrator_steps));
      }
      const auto [begin, end] = dense_.do_step(system);
      if (may_change) {
        if (const Bracket bracket = find_event(begin, end); bracket.low >= 0.0) {
          step_ = end - begin;
          finish(s, begin, bracket, system);
          return true;
        }
      }
      // The last step was made to fit: what rounding leaves of it is no time.
      t_ = duration_ - end <= 1e-15 * duration_ ? duration_ : end;
      step_ = std::max(step_, end - begin);
    }
    s = dense_.current_state();
    return false;
  }

  // Above zero as long as the contact stays what it is.
  double margin(const Vector& s, double t) const {
    if (contact_ == Contact::sticking)
      return equations_.stick_limit(s) - std::abs(equations_.forces(s, t)[0]);
    return static_cast<double>(contact_) * s[masses];
  }

  struct Bracket {
    double low, high;  // the event is between them; low < 0: there is none
  };

  // The first of the step's points at which the margin is used up, and the one before it. Between the points
  // a parabola through three of them tells where the margin is smallest: a short dip is seen there.
  Bracket find_event(double begin, double end) const {
    const double spacing = (end - begin) / points;
    const auto margin_at = [&](double t) {
      Vector s;
      dense_.calc_state(t, s);
      return margin(s, t);
    };
    double before = 0.0, last = margin_at(begin);
    for (int n = 1; n <= points; ++n) {
      const double t = n == points ? end : begin + spacing * n;
      const double present = margin_at(t);
      const double curvature = before - 2.0 * last + present;
      if (n > 1 && curvature > 0.0) {
        const double lowest = 0.5 * (before - present) / curvature;  // spacings after the middle point
        const double place = t + spacing * (lowest - 1.0);
        if (std::abs(lowest) < 1.0 && margin_at(place) < 0.0)
          return {lowest > 0.0 ? t - spacing : t - 2.0 * spacing, place};
      }
      if (present < 0.0) return {t - spacing, t};
      before = last;
      last = present;
    }
    return {-1.0, 0.0};
  }

  // Ends at the event in the bracket, which is part of the last step; that one began at `begin`. The step is
  // repeated up to the instant: the dense output has an order less.
  template <typename System>
  void finish(Vector& s, double begin, const Bracket& bracket, const System& system) {
    const double high = bracket.high - begin;
    const Vector start = dense_.previous_state();
    const Vector rate = equations_.derivative(start, begin, contact_);
    Vector end, rate_after;
    Method method;
    const auto go_to = [&](double part) {
      if (part > 0.0) {
        method.do_step(system, start, rate, begin, end, rate_after, part);
      } else {
        end = start;
      }
    };
    const auto margin_after = [&](double part) {
      go_to(part);
      return margin(end, begin + part);
    };
    double from = std::max(0.0, bracket.low - begin);
    const bool from_rest = from == 0.0 && contact_ != Contact::sticking && start[masses] == 0.0;
    if (from_rest) from = std::max(0.0, moving_start(margin_after, high));
    const double instant = from_rest && from == 0.0 ? 0.0 : falling_zero_of(margin_after, from, high);
    go_to(instant);
    s = end;
    s[masses] = 0.0;
    t_ = begin + instant;
    // After a break-away it slides, even if rounding puts the net force just below the limit; after a start
    // that did not get away it sticks.
    if (contact_ == Contact::sticking) {
      contact_ = equations_.pulled(equations_.forces(s, t_)[0]);
    } else if (from_rest && from == 0.0) {
      contact_ = Contact::sticking;
    } else {
      contact_ = equations_.contact(s, t_);
    }
  }

  const ChainEquations<masses>& equations_;
  double duration_;
  Dense dense_;
  double step_;  // s, the first one to try
  double t_ = 0.0;
  Contact contact_ = Contact::sticking;
  int events_ = 0;
  long steps_ = 0;
};

// A step that Dormand and Prince's method is likely to accept, s.
double likely_step(const ChainDynamics& dynamics, double tolerance) {
  double rate = 1e-3;
  for (std::size_t i = 0; i < dynamics.masses; ++i) {
    const double stiffness = dynamics.stiffness[i] + (i > 0 ? dynamics.stiffness[i - 1] : 0.0);
    const double damping = dynamics.damping[i] + (i > 0 ? dynamics.damping[i - 1] : dynamics.base_damping);
    rate = std::max(rate, std::sqrt(stiffness / dynamics.mass[i]) + damping / dynamics.mass[i]);
  }
  return 2.0 * std::pow(tolerance, 0.2) / rate;
}

}  // namespace

void integrate_adaptive(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input,
                        double duration, double tolerance) {
  require_sound(dynamics, state, input, duration);
  if (!(tolerance >= 1e-14 && tolerance <= 1e-2)) {
    throw std::invalid_argument(
        fmt::format("integrator tolerance = {}: allowed is a number from 1e-14 to 0.01", tolerance));
  }
  with_equations(dynamics, input, [&]<std::size_t masses>(const ChainEquations<masses>& equations) {
    auto s = equations.vector_of(state);
    AdaptiveRun<masses> run(equations, duration, tolerance, likely_step(dynamics, tolerance));
    try {
      run.integrate(s);
    } catch (const odeint::odeint_error&) {
      throw std::runtime_error(
          fmt::format("the adaptive integrator cannot meet a tolerance of {} (rounding is larger, or the "
                      "chain is extreme): choose a larger one",
                      tolerance));
    }
    equations.store(s, state);
  });
}

}  // namespace kmax::simulation
