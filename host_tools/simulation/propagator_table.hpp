#pragma once
// The matrices of chain_propagator.hpp for one person with one device, over the activation g and for every
// duration in use, built as they are needed, at gains of a grid: numbers with so many bits after the leading
// one. The next handle of the same person that is given the table (CoupledHandle::share) finds them ready.
// g = 1 is on the grid: without a background force nothing is approximated.
//
// Between the grid's gains a table either interpolates or rounds.
//
// Interpolating, the usual way: 6 bits, and matrices that are linear in g about the nearest gain of the grid
// (chain_propagator.hpp). The few matrices of a trial stay in the processor's nearest caches, and the next
// piece mostly needs those of the one before. Error in a contact at 500 Hz with a field of 1 N: 0.005 um RMS,
// where 12 bits, rounded, give 0.09 um.
//
// Rounding g to a grid of `gain_bits` bits: g is wrong by at most 2^-(gain_bits + 1) of g, of either sign as
// g passes through the grid. The largest stable stiffness of the default person rises by about 4 N/mm per
// unit of g (3.6 N/mm at g = 1, 8.4 at 2.15), so even a g that stayed at the edge of its cell would shift it
// by at most 0.001 N/mm with 12 bits (a relative spacing of 2.4e-4), and by 0.004 N/mm with 10. Fewer bits
// are faster: more of the table stays in the processor's caches. The published numbers of the experiments are
// those of a table that rounds (host_tools/experiment/simulated_touch.hpp).
//
// Memory: about 0.5 kB per gain of the grid that occurred (2^bits per octave), and 3.2 kB more for those at
// which the handle reversed: up to 16 MB for a person pushed from 0 to 2 N, rounded to 12 bits. Interpolated
// 0.9 and 5 kB, in all 0.5 MB. At most 16 durations are kept; others are integrated without a table. Not for
// several threads at once: a table belongs to one.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <variant>
#include <vector>

#include "host_tools/simulation/chain_dynamics.hpp"
#include "host_tools/simulation/chain_propagator.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation {

// The chain of masses that a device, its structure and the person who holds it make (chain_dynamics.hpp).

// `person`: nullptr if nobody holds it. `gain`: the activation g, by which grip and arm are multiplied.
inline ChainDynamics held_chain(const DeviceModel& device, const OperatorModel* person, double gain) {
  ChainDynamics chain;
  chain.mass[0] = device.mass;
  chain.base_damping = device.damping;
  chain.friction = device.friction;
  if (device.structure) {
    chain.stiffness[0] = device.structure->stiffness;
    chain.damping[0] = device.structure->damping;
    chain.mass[chain.masses++] = device.structure->handle_mass;
  }
  if (person != nullptr) {
    const std::size_t grip = chain.masses - 1;
    chain.stiffness[grip] = person->grip_stiffness * gain;
    chain.damping[grip] = person->grip_damping * gain;
    chain.mass[chain.masses++] = person->hand_mass;
    chain.stiffness[grip + 1] = person->arm_stiffness * gain;
    chain.damping[grip + 1] = person->arm_damping * gain;
  }
  return chain;
}

// Gains from 1 on, 2^bits to an octave.
class GainGrid {
 public:
  explicit GainGrid(int bits = 12) : dropped_(52 - bits), half_(std::uint64_t{1} << (51 - bits)) {}
  // `gain` >= 1, < 1e300.
  double nearest(double gain) const {
    return std::bit_cast<double>((std::bit_cast<std::uint64_t>(gain) + half_) >> dropped_ << dropped_);
  }
  // All gains that are nearest to a gain of the grid.
  GainSpan nearest_to(double gain_of_grid) const {
    const auto centre = std::bit_cast<std::uint64_t>(gain_of_grid);
    return {gain_of_grid, std::bit_cast<double>(centre - half_), std::bit_cast<double>(centre + half_ - 1)};
  }
  // The place of a gain of the grid, counted from 1.
  std::size_t index(double gain_of_grid) const {
    constexpr auto one = std::bit_cast<std::uint64_t>(1.0);
    return static_cast<std::size_t>((std::bit_cast<std::uint64_t>(gain_of_grid) - one) >> dropped_);
  }

 private:
  int dropped_;
  std::uint64_t half_;
};

class PropagatorTable {
 public:
  static constexpr std::size_t most_durations = 16;

  // Interpolates. Throws std::invalid_argument.
  PropagatorTable(const DeviceModel& device, const OperatorModel& person);
  // Rounds. `gain_bits`: 4 to 16. Throws std::invalid_argument.
  PropagatorTable(const DeviceModel& device, const OperatorModel& person, int gain_bits);

  const GainGrid& grid() const { return grid_; }
  bool rounds() const { return rounds_; }

  // Whether the table serves this device and this person: same masses, springs, dampers and friction. Force
  // limit, delay, activation and push lag do not matter.
  bool fits(const DeviceModel& device, const OperatorModel& person) const;

  // All gains for one duration.
  template <std::size_t masses>
  class Sheet {
   public:
    Sheet(const PropagatorTable& table, double duration) : table_(table), duration_(duration) {}
    double duration() const { return duration_; }
    // The one that serves `gain`: of the grid if the table rounds, else any.
    const ChainPropagator<masses>& at(double gain) {
      const double gain_of_grid = table_.grid_.nearest(gain);
      const std::size_t index = table_.grid_.index(gain_of_grid);
      if (index >= entries_.size() || !entries_[index]) [[unlikely]]
        build(index, gain_of_grid);
      return *entries_[index];
    }

    // A piece with this gain may follow.
    void prefetch(double gain_of_grid) const {
      const std::size_t index = table_.grid_.index(gain_of_grid);
      if (index < entries_.size() && entries_[index]) entries_[index]->prefetch();
    }

   private:
    void build(std::size_t index, double gain);

    const PropagatorTable& table_;
    double duration_;
    std::vector<std::unique_ptr<ChainPropagator<masses>>> entries_;  // by index of the gain
  };

  // nullptr if there are too many durations already. Valid as long as the table. `masses`: 2, or 3 with a
  // structure.
  template <std::size_t masses>
  Sheet<masses>* sheet(double duration);

 private:
  PropagatorTable(const DeviceModel& device, const OperatorModel& person, int gain_bits, bool rounds);

  DeviceModel device_;
  OperatorModel person_;
  GainGrid grid_;
  bool rounds_;
  std::variant<std::deque<Sheet<2>>, std::deque<Sheet<3>>> sheets_;
};

}  // namespace kmax::simulation
