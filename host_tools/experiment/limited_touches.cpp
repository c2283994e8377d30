#include "host_tools/experiment/limited_touches.hpp"

#include <fmt/format.h>

#include <utility>

namespace kmax::experiment {
namespace {
std::vector<std::string> protective_of(device::Device& device, const TouchLimits& limits,
                                       const std::vector<std::size_t>& further_axes) {
  std::vector<std::string> all = protective_assignments(device, limits.axis, limits.force_limit);
  for (const std::size_t axis : further_axes)
    for (const std::string& assignment : protective_assignments(device, axis, limits.force_limit))
      if (!assignment.starts_with("link.")) all.push_back(assignment);  // the first axis has asked for it
  return all;
}

template <typename Value>
std::vector<Value> both(std::vector<Value> first, const std::vector<Value>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}
}  // namespace

TouchWatch watch_within(const TouchLimits& limits, const std::string& name, double hold_time) {
  TouchWatch watch;
  watch.axis = limits.axis;
  watch.name = name;
  watch.hold_time = hold_time;
  watch.contact_patience = limits.patience;
  watch.abort_amplitude = limits.abort_amplitude;
  return watch;
}

RunJournal::Json touch_settings(const std::string& experiment, device::Device& device,
                                const TouchLimits& limits, const RunJournal::Json& own) {
  RunJournal::Json all = {{"experiment", experiment}};
  all.update(device_circumstances(device, limits.axis));
  all.update(own);
  all["force_limit_n"] = limits.force_limit;
  all["abort_amplitude_m"] = limits.abort_amplitude;
  return all;
}

LimitedTouches::LimitedTouches(device::Device& device, const TouchLimits& limits,
                               const std::vector<std::string>& changed, const TouchParty& party,
                               const std::vector<std::size_t>& further_axes)
    : device_(device),
      limits_(limits),
      protective_(protective_of(device, limits, further_axes)),
      restored_(device, limits.axis, both<std::string>(changed, protective_), party.notice),
      standstill_(device, both<std::size_t>({limits.axis}, further_axes), party.notice),
      session_{party.prompter, party.journal, party.tell, &standstill_} {
  set(protective_);
  force_limit_ = device.read_number(fmt::format("axis{}.force.limit", limits.axis));
}

void LimitedTouches::set(const std::vector<std::string>& assignments) {
  device_.apply(device::parse_assignments(assignments, limits_.axis));
}

void LimitedTouches::ask(const std::string& what_to_do) const {
  if (session_.prompter != nullptr) session_.prompter->ask(what_to_do);
}

WatchedTouch LimitedTouches::watch(const std::string& name, double hold_time) const {
  return watch_touch(device_, watch_within(limits_, name, hold_time), session_.tell);
}

}  // namespace kmax::experiment
