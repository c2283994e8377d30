#include "host_tools/view/parameter_mirror.hpp"

#include <algorithm>

#include "host_tools/check/judgement.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

using device::Parameter;

namespace {
/// What the page shows, and what its verdict and curve are made of: those of one group, which may be one
/// request, beside each other.
const std::vector<Parameter>& followed() {
  static const std::vector<Parameter> all = [] {
    std::vector<Parameter> some = shown_parameters();
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      for (const Parameter& judged : check::parameters_of_case(axis)) some.push_back(judged);
    }
    const auto by_slot = [](const Parameter& parameter) { return parameter.slot(); };
    std::ranges::sort(some, {}, by_slot);
    const auto twice = std::ranges::unique(some, {}, by_slot);
    some.erase(twice.begin(), twice.end());
    return some;
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
