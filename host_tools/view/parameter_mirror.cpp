#include "host_tools/view/parameter_mirror.hpp"

#include <algorithm>

#include "host_tools/check/judgement.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

using device::Parameter;

namespace {
/// Whole groups, which may be one request each: those of what the page shows, and of what its verdict is made
/// of. Its curve has no others.
const std::vector<Parameter>& followed() {
  static const std::vector<Parameter> all = [] {
    std::vector<Parameter> seeds = shown_parameters();
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      for (const Parameter& judged : check::parameters_of_judgement(axis)) seeds.push_back(judged);
    }
    std::vector<Parameter> groups;
    for (const Parameter& one : device::persistent_parameters()) {
      const auto index = one.index();
      if (std::ranges::any_of(seeds, [index](const Parameter& seed) { return seed.index() == index; }))
        groups.push_back(one);
    }
    std::ranges::stable_sort(groups, {}, [](const Parameter& parameter) { return parameter.index(); });
    return groups;
  }();
  return all;
}
}  // namespace

void ParameterMirror::read_all(device::Device& device) {
  const std::vector<Parameter> all = device::persistent_parameters();
  const auto raw = device.read(all);
  for (std::size_t i = 0; i < all.size(); ++i) values_.set_raw(all[i].slot(), raw[i]);
  if (!found_) found_ = values_;
}

bool ParameterMirror::read_some(device::Device& device) {
  const std::vector<Parameter>& all = followed();
  std::size_t end = next_ + 1;
  while (end < all.size() && all[end].index() == all[next_].index()) ++end;
  const auto some = std::span(all).subspan(next_, end - next_);
  const auto raw = device.read(some);
  next_ = end % all.size();
  bool changed = false;
  for (std::size_t i = 0; i < some.size(); ++i) {
    changed |= !device::same_value(some[i], raw[i], values_.raw(some[i].slot()));
    values_.set_raw(some[i].slot(), raw[i]);
  }
  return changed;
}

void ParameterMirror::set(std::span<const device::Assignment> assignments) {
  for (const auto& [parameter, raw] : assignments) values_.set_raw(parameter.slot(), raw);
}

std::vector<device::Assignment> ParameterMirror::way_back() const {
  std::vector<device::Assignment> back;
  for (const Parameter& one : shown_parameters()) {
    const std::uint32_t before = found_->raw(one.slot());
    if (!device::same_value(one, before, values_.raw(one.slot()))) back.push_back({one, before});
  }
  return back;
}

}  // namespace kmax::view
