#include "host_tools/simulation/chain_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host_tools/simulation/chain_series.hpp"

namespace kmax::simulation {
namespace {

constexpr int max_events = 64;

// The spring and damper above mass 0 pull it with this force.
template <std::size_t masses>
double pull_on_base(const ChainCoefficients<masses>& chain, const ChainState& state) {
  if constexpr (masses == 1) return 0.0;
  return chain.stiffness[0] * (state.position[1] - state.position[0]) +
         chain.damping[0] * (state.velocity[1] - state.velocity[0]);
}

template <std::size_t masses>
double stick_limit(const MovingChain& moving, const ChainCoefficients<masses>& chain, double force) {
  if (moving.blocked) return std::numeric_limits<double>::infinity();
  double sum = chain.friction + std::abs(force);
  if constexpr (masses > 1) {
    const ChainState& s = moving.state;
    sum += chain.stiffness[0] * (std::abs(s.position[0]) + std::abs(s.position[1])) +
           chain.damping[0] * std::abs(s.velocity[1]);
  }
  return chain.friction + 1e-13 * sum;
}

template <std::size_t masses>
bool leaves_stick(MovingChain& moving, const ChainCoefficients<masses>& chain, double force) {
  if (chain.friction == 0.0 && !moving.blocked) return true;
  const double net = force + pull_on_base(chain, moving.state);
  moving.direction = std::copysign(1.0, net);
  return std::abs(net) > stick_limit(moving, chain, force);
}

}  // namespace

template <std::size_t masses>
ChainMotion<masses>::ChainMotion(const ChainDynamics& chain, std::size_t first_scaled)
    : chain_(chain), first_scaled_(first_scaled), unscaled_(chain), coefficients_(chain) {}

template <std::size_t masses>
void ChainMotion<masses>::share(PropagatorTable* table) {
  table_ = table;
  rounds_ = table != nullptr && table->rounds();
  slots_.fill(Slot{});
}

template <std::size_t masses>
void ChainMotion<masses>::set_gain(double gain) {
  if (gain == gain_) return;
  gain_ = gain;
  coefficients_.scale(unscaled_, first_scaled_, gain);
}

template <std::size_t masses>
const ChainPropagator<masses>* ChainMotion<masses>::find(Slot& slot, double duration, double gain) {
  if constexpr (masses > 1) {
    if (slot.sheet != nullptr) return slot.take(slot.sheet->at(gain));
  }
  slot.propagator = nullptr;
  slot.lowest_gain = slot.highest_gain = std::numeric_limits<double>::quiet_NaN();
  if (table_ != nullptr) {
    if constexpr (masses > 1) {
      // A duration that occurs once is not worth a table.
      if (std::exchange(slot.used, true)) slot.sheet = table_->sheet<masses>(duration);
      if (slot.sheet != nullptr) return slot.take(slot.sheet->at(gain));
    }
    return nullptr;
  }
  // Nor is a gain that changes. An activation that settles repeats itself for longer and longer.
  slot.repetitions = slot.last_gain == gain ? slot.repetitions + 1 : 0;
  slot.last_gain = gain;
  if (slot.repetitions < slot.patience) return nullptr;
  slot.patience = std::min(2 * slot.patience, 1024);
  auto own =
      std::make_shared<ChainPropagator<masses>>(chain_, first_scaled_, GainSpan{gain, gain, gain}, duration);
  if (chain_.friction > 0.0) own->prepare_reversals();  // copies of the handle may go to other threads
  slot.own = std::move(own);
  return slot.take(*slot.own);
}

template <std::size_t masses>
void ChainMotion<masses>::move_in_steps(const ChainPropagator<masses>& propagator, MovingChain& moving,
                                        const ChainInput& input, double gain) {
  const double offset = gain - propagator.gains().centre;
  const double h = propagator.step();
  ChainInput part = input;
  for (int n = 0; n < propagator.steps(); ++n) {
    part.intended = input.intended + input.intended_rate * (h * n);
    if (!one_step(propagator, moving, part.force, part.intended, part.intended_rate, offset))
      search_events(propagator, moving, part, h, gain);
  }
}

template <std::size_t masses>
void ChainMotion<masses>::search_events(const ChainPropagator<masses>& propagator, MovingChain& moving,
                                        const ChainInput& input, double h, double gain) {
  if (gain == propagator.gains().centre) return step(moving, propagator.coefficients(), input, h);
  move_by_series(moving, input, h, gain);
}

template <std::size_t masses>
void ChainMotion<masses>::move_by_series(MovingChain& moving, const ChainInput& input, double duration,
                                         double gain) {
  set_gain(gain);
  const double z = coefficients_.largest_rate() * duration;
  if (z <= largest_series_step) return step(moving, coefficients_, input, duration);
  const int steps = static_cast<int>(std::ceil(z / largest_series_step));
  const double h = duration / steps;
  ChainInput part = input;
  for (int n = 0; n < steps; ++n) {
    part.intended = input.intended + input.intended_rate * (h * n);
    step(moving, coefficients_, part, h);
  }
}

template <std::size_t masses>
void ChainMotion<masses>::step(MovingChain& moving, const ChainCoefficients<masses>& chain,
                               const ChainInput& input, double h) {
  ChainSeries<masses> series;
  ChainState& state = moving.state;
  double intended = input.intended;
  double left = h;
  int events = 0;
  bool breaking_away = false;
  while (left > 0.0) {
    if (state.velocity[0] == 0.0 && events >= max_events) {
      moving.sticking = true;
      ++moving.event_limit_hits;
    } else if (state.velocity[0] == 0.0 && !breaking_away) {
      moving.sticking = !leaves_stick(moving, chain, input.force);
    }
    double end = no_crossing;
    int order = 0;
    if (moving.sticking) {
      if (masses == 1) return;  // constant force: nothing can change within the interval
      order = chain_series::order_for(chain.stuck_rate * left);
      series.expand_stuck(chain, state, left, order, intended, input.intended_rate);
      if (events < max_events) {
        end = series.break_away_time(chain, order, input.force + pull_on_base(chain, state),
                                     stick_limit(moving, chain, input.force), moving.direction);
      }
    } else {
      if (state.velocity[0] != 0.0) moving.direction = std::copysign(1.0, state.velocity[0]);
      order = chain_series::order_for(chain.sliding_rate * left);
      series.expand_sliding(chain, state, left, order, input.force - moving.direction * chain.friction,
                            intended, input.intended_rate);
      if (chain.friction > 0.0) end = series.stop_time(order, moving.direction);
    }
    if (end == no_crossing) {
      state = series.end();
      return;
    }
    series.stop_at(end, order, moving.sticking ? 1 : 0, state);
    ++events;
    // After a break-away the next round must slide even if rounding puts the net force just below the limit.
    breaking_away = moving.sticking;
    moving.sticking = false;
    intended += input.intended_rate * (left * end);
    left -= left * end;
  }
}

template class ChainMotion<1>;
template class ChainMotion<2>;
template class ChainMotion<3>;

}  // namespace kmax::simulation
