#include "host_tools/device/register_plan.hpp"

#include <algorithm>
#include <numeric>

namespace kmax::device {

std::vector<RegisterRange> plan_registers(std::span<const Parameter> parameters, std::uint16_t count_max) {
  std::vector<std::size_t> order(parameters.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Parameter &first = parameters[a], &second = parameters[b];
    return std::pair(first.table(), first.address()) < std::pair(second.table(), second.address());
  });

  std::vector<RegisterRange> ranges;
  for (const std::size_t position : order) {
    const Parameter& parameter = parameters[position];
    if (!ranges.empty() && ranges.back().table == parameter.table()) {
      RegisterRange& range = ranges.back();
      if (parameters[range.members.back()] == parameter) {
        range.members.push_back(position);
        continue;
      }
      const bool follows = parameter.address() == range.address + range.count;
      if (follows && range.count + parameter.words() <= count_max) {
        range.count = static_cast<std::uint16_t>(range.count + parameter.words());
        range.members.push_back(position);
        continue;
      }
    }
    ranges.push_back({parameter.table(), parameter.address(), parameter.words(), {position}});
  }
  return ranges;
}

}  // namespace kmax::device
