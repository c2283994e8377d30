#pragma once
// Moves a chain of masses (chain_dynamics.hpp) through time: by the matrices of chain_propagator.hpp where
// they apply, by the Taylor series of chain_series.hpp with a search for events everywhere else.
//
// Events. Every event happens at x_0' = 0. Break-away needs a net force of f_c plus 1e-13 of the forces
// involved, so it always has a direction and coinciding events resolve one after the other. After 64 events
// in one step of the series mass 0 is held for the rest of that step; that can only remove energy, and is
// counted.
//
// Which intervals get a matrix: with a table those of a duration met before; without one those of a duration
// and a gain that stay the same, for longer and longer each time that a matrix is given up for another. Each
// of `durations` slots remembers one duration and belongs to the caller, who tells when it begins to mean
// another.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include "host_tools/simulation/chain_coefficients.hpp"
#include "host_tools/simulation/chain_dynamics.hpp"
#include "host_tools/simulation/chain_propagator.hpp"
#include "host_tools/simulation/propagator_table.hpp"

namespace kmax::simulation {

struct MovingChain {
  ChainState state;
  bool sticking = false;   // mass 0 rests, held by friction or blocked
  bool blocked = false;    // mass 0 is held against any force
  double direction = 1.0;  // of mass 0, the last one while it rests
  std::uint64_t event_limit_hits = 0;
};

template <std::size_t masses>
class ChainMotion {
 public:
  // On the virtual board a PWM period of two drives falls into about ten pieces of recurring lengths. With 4
  // slots each was forgotten before it came again, and the matrices built for it: a fifth of the board's
  // time.
  static constexpr std::size_t durations = 16;

  // `chain`: at a gain of 1, which multiplies the springs and dampers from number `first_scaled` on.
  ChainMotion(const ChainDynamics& chain, std::size_t first_scaled);

  // From now on matrices come from there. nullptr: own ones, for a gain that stays the same.
  void share(PropagatorTable* table);

  // The slot's next piece has another duration than its last one.
  void forget(std::size_t slot) { slots_[slot] = Slot{}; }

  // A piece of the slot's duration.
  [[gnu::always_inline]] void move(MovingChain& moving, double force, double intended, double rate,
                                   double duration, double gain, std::size_t slot) {
    // With a table that interpolates, the matrices of the piece before nearly always serve again: the
    // processor then reads them before the gain is known.
    Slot& known = slots_[slot];
    const ChainPropagator<masses>* propagator = known.propagator;
    bool found = false;
    double offset = 0.0;
    if constexpr (masses > 1) {
      found = rounds_ && known.sheet != nullptr;
      if (found) propagator = &known.sheet->at(gain);
    }
    if (!found && !(gain >= known.lowest_gain && gain <= known.highest_gain)) {
      propagator = find(known, duration, gain);
      if (propagator == nullptr) [[unlikely]]
        return move_by_series(moving, {force, intended, rate}, duration, gain);
    }
    if constexpr (masses > 1) {
      if (!found) offset = gain - known.centre_gain;
    }
    if (propagator->steps() != 1) [[unlikely]]
      return move_in_steps(*propagator, moving, {force, intended, rate}, gain);
    if (!one_step(*propagator, moving, force, intended, rate, offset)) [[unlikely]]
      search_events(*propagator, moving, {force, intended, rate}, duration, gain);
  }

  // The gain that the slot's next piece will probably have, with a table that rounds.
  [[gnu::always_inline]] void expect(double gain, std::size_t slot) const {
    if constexpr (masses > 1) {
      if (slots_[slot].sheet != nullptr) slots_[slot].sheet->prefetch(gain);
    }
  }

  // A piece of any duration.
  void move_by_series(MovingChain& moving, const ChainInput& input, double duration, double gain);

 private:
  using Sheet = PropagatorTable::Sheet<masses>;
  struct Slot {
    const ChainPropagator<masses>* propagator = nullptr;
    // Of the propagator, if there is one.
    double lowest_gain = std::numeric_limits<double>::quiet_NaN();
    double highest_gain = std::numeric_limits<double>::quiet_NaN();
    double centre_gain = 1.0;
    double last_gain = std::numeric_limits<double>::quiet_NaN();  // of the piece before, without a table
    int repetitions = 0;                                          // of it
    int patience = 1;                                             // repetitions that are worth a matrix
    Sheet* sheet = nullptr;
    bool used = false;
    std::shared_ptr<const ChainPropagator<masses>> own;

    const ChainPropagator<masses>* take(const ChainPropagator<masses>& one) {
      lowest_gain = one.gains().lowest;
      highest_gain = one.gains().highest;
      centre_gain = one.gains().centre;
      return propagator = &one;
    }
  };

  [[gnu::always_inline]] static bool one_step(const ChainPropagator<masses>& propagator, MovingChain& moving,
                                              double force, double intended, double rate, double offset) {
    const bool standing =
        moving.state.velocity[0] == 0.0 && (moving.blocked || propagator.coefficients().friction > 0.0);
    moving.sticking = standing;
    if (masses == 1 || offset == 0.0) {
      return standing ? propagator.rest(moving.state, force, intended, rate, moving.blocked)
                      : propagator.slide(moving.state, force, intended, rate);
    }
    return standing
               ? propagator.template rest<true>(moving.state, force, intended, rate, moving.blocked, offset)
               : propagator.template slide<true>(moving.state, force, intended, rate, offset);
  }
  void move_in_steps(const ChainPropagator<masses>& propagator, MovingChain& moving, const ChainInput& input,
                     double gain);
  // A step that the propagator leaves alone.
  void search_events(const ChainPropagator<masses>& propagator, MovingChain& moving, const ChainInput& input,
                     double h, double gain);
  const ChainPropagator<masses>* find(Slot& slot, double duration, double gain);
  static void step(MovingChain& moving, const ChainCoefficients<masses>& chain, const ChainInput& input,
                   double h);
  void set_gain(double gain);

  ChainDynamics chain_;
  std::size_t first_scaled_;
  double gain_ = 1.0;  // of the coefficients
  ChainCoefficients<masses> unscaled_;
  ChainCoefficients<masses> coefficients_;
  PropagatorTable* table_ = nullptr;
  bool rounds_ = false;  // the table has a matrix for every gain that occurs
  std::array<Slot, durations> slots_;
};

extern template class ChainMotion<1>;
extern template class ChainMotion<2>;
extern template class ChainMotion<3>;

}  // namespace kmax::simulation
