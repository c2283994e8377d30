#include "host_tools/experiment/rate_hardness.hpp"

#include <algorithm>

namespace kmax::experiment {

std::optional<double> rate_hardness(std::span<const ContactForce> trace, double speed) {
  const auto contact = std::ranges::find_if(
      trace, [](double time) { return time >= 0.0; }, &ContactForce::time);
  const auto end = std::find_if(contact, trace.end(),
                                [](const ContactForce& sample) { return sample.time >= rate_hardness_time; });
  if (contact == trace.begin() || contact == end || end == trace.end() || !(speed > 0.0)) return std::nullopt;
  if (!std::all_of(contact, end, [](const ContactForce& sample) { return sample.distance <= 0.0; }))
    return std::nullopt;
  const ContactForce &before = contact[-1], &last = end[-1];
  return (last.force - before.force) / (last.time - before.time) / speed;
}

}  // namespace kmax::experiment
