#pragma once
// The matrices of chain_propagator.hpp for one person with one device, over the activation g and for every
// duration in use, built as they are needed. A handle that is given a table (CoupledHandle::share) rounds g
// to the nearest number with `gain_bits` bits after the leading one, so that the same matrices serve again;
// the next handle of the same person finds them ready. g = 1 is on the grid: without a background force
// nothing is rounded.
//
// Error of the rounding: at most 2^-(gain_bits + 1) of g, of either sign as g passes through the grid. The
// largest stable stiffness of the default person rises by about 4 N/mm per unit of g (3.6 N/mm at g = 1, 8.4
// at 2.15), so even a g that stayed at the edge of its cell would shift it by at most 0.001 N/mm with 12 bits
// (a relative spacing of 2.4e-4), and by 0.004 N/mm with 10. Fewer bits are faster: more of the table stays
// in the processor's caches.
//
// Memory: about 0.5 kB per value of g that occurred (2^gain_bits per octave), and 3.2 kB more for those at
// which the handle reversed: up to 16 MB for a person pushed from 0 to 2 N with 12 bits. At most 16 durations
// are kept; others are integrated without a table. Not for several threads at once: a table belongs to one.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <variant>
#include <vector>

#include "host_tools/simulation/chain_propagator.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/held_chain.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation {

// Gains from 1 on, 2^bits to an octave.
class GainGrid {
 public:
  explicit GainGrid(int bits = 12) : dropped_(52 - bits), half_(std::uint64_t{1} << (51 - bits)) {}
  // `gain` >= 1, < 1e300.
  double nearest(double gain) const {
    return std::bit_cast<double>((std::bit_cast<std::uint64_t>(gain) + half_) >> dropped_ << dropped_);
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

  // `gain_bits`: 4 to 16. Throws std::invalid_argument.
  PropagatorTable(const DeviceModel& device, const OperatorModel& person, int gain_bits = 12);

  const GainGrid& grid() const { return grid_; }

  // Whether the table serves this device and this person: same masses, springs, dampers and friction. Force
  // limit, delay, activation and push lag do not matter.
  bool fits(const DeviceModel& device, const OperatorModel& person) const;

  // All gains for one duration.
  template <std::size_t masses>
  class Sheet {
   public:
    Sheet(const PropagatorTable& table, double duration) : table_(table), duration_(duration) {}
    double duration() const { return duration_; }
    const ChainPropagator<masses>& at(double gain_of_grid) {
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
  DeviceModel device_;
  OperatorModel person_;
  GainGrid grid_;
  std::variant<std::deque<Sheet<2>>, std::deque<Sheet<3>>> sheets_;
};

}  // namespace kmax::simulation
