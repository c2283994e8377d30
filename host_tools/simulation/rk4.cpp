#include <cmath>

#include "host_tools/simulation/chain_equations.hpp"
#include "host_tools/simulation/event_search.hpp"
#include "host_tools/simulation/reference_integrators.hpp"

namespace kmax::simulation {
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

}  // namespace kmax::simulation
