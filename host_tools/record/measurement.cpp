#include "host_tools/record/measurement.hpp"

#include <bit>

namespace kmax::record {

using device::Parameter;

namespace {
constexpr std::size_t first = firmware::entry_of<"measured.tick">();
constexpr std::size_t last = firmware::entry_of<"measured.current">();
constexpr std::size_t values_per_axis = last - first + 1;
static_assert(firmware::entry_at(first).group.index == firmware::entry_at(last).group.index && first < last);

/// Where a value is among those of its axis.
template <firmware::FixedName name>
constexpr std::size_t place_of() {
  constexpr std::size_t entry = firmware::entry_of<name>();
  static_assert(first <= entry && entry <= last);
  return entry - first;
}
}  // namespace

std::vector<Measurement> read_measurements(device::Device& device, std::span<const std::size_t> axes) {
  std::vector<Parameter> parameters;
  for (const std::size_t axis : axes) {
    for (std::size_t entry = first; entry <= last; ++entry) parameters.emplace_back(entry, axis);
  }
  const std::vector<std::uint32_t> raw = device.read(parameters);
  std::vector<Measurement> measurements;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto own = std::span(raw).subspan(i * values_per_axis, values_per_axis);
    const auto real = [own](std::size_t place) { return std::bit_cast<float>(own[place]); };
    measurements.push_back({.tick = own[place_of<"measured.tick">()],
                            .position = real(place_of<"measured.position">()),
                            .velocity = real(place_of<"measured.velocity">()),
                            .force = real(place_of<"measured.force">()),
                            .current = real(place_of<"measured.current">()),
                            .flags = static_cast<std::uint16_t>(own[place_of<"measured.flags">()])});
  }
  return measurements;
}

}  // namespace kmax::record
