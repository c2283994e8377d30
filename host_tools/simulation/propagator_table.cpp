#include "host_tools/simulation/propagator_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace kmax::simulation {

constexpr int interpolated_bits = 6;

PropagatorTable::PropagatorTable(const DeviceModel& device, const OperatorModel& person)
    : PropagatorTable(device, person, interpolated_bits, false) {}

PropagatorTable::PropagatorTable(const DeviceModel& device, const OperatorModel& person, int gain_bits)
    : PropagatorTable(device, person, gain_bits, true) {}

PropagatorTable::PropagatorTable(const DeviceModel& device, const OperatorModel& person, int gain_bits,
                                 bool rounds)
    : device_(device), person_(person), grid_(std::clamp(gain_bits, 4, 16)), rounds_(rounds) {
  if (gain_bits < 4 || gain_bits > 16)
    throw std::invalid_argument(fmt::format("table of {} bits of gain: allowed are 4 to 16", gain_bits));
  validate(device);
  validate(person);
  if (device.structure) sheets_.emplace<std::deque<Sheet<3>>>();
}

bool PropagatorTable::fits(const DeviceModel& device, const OperatorModel& person) const {
  const ChainDynamics own = held_chain(device_, &person_, 1.0);
  const ChainDynamics other = held_chain(device, &person, 1.0);
  return own.masses == other.masses && own.mass == other.mass && own.stiffness == other.stiffness &&
         own.damping == other.damping && own.base_damping == other.base_damping &&
         own.friction == other.friction;
}

template <std::size_t masses>
PropagatorTable::Sheet<masses>* PropagatorTable::sheet(double duration) {
  auto* sheets = std::get_if<std::deque<Sheet<masses>>>(&sheets_);
  if (sheets == nullptr) return nullptr;
  for (Sheet<masses>& one : *sheets) {
    if (one.duration() == duration) return &one;
  }
  return sheets->size() < most_durations ? &sheets->emplace_back(*this, duration) : nullptr;
}

template <std::size_t masses>
void PropagatorTable::Sheet<masses>::build(std::size_t index, double gain) {
  if (index >= entries_.size()) entries_.resize(index + index / 4 + 16);
  const GainSpan gains = table_.rounds_ ? GainSpan{gain, gain, gain} : table_.grid_.nearest_to(gain);
  const std::size_t grip = masses - 2;
  entries_[index] = std::make_unique<ChainPropagator<masses>>(
      held_chain(table_.device_, &table_.person_, 1.0), grip, gains, duration_);
}

template PropagatorTable::Sheet<2>* PropagatorTable::sheet<2>(double);
template PropagatorTable::Sheet<3>* PropagatorTable::sheet<3>(double);
template class PropagatorTable::Sheet<2>;
template class PropagatorTable::Sheet<3>;

}  // namespace kmax::simulation
