#include "host_tools/experiment/device_rig.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/device/value_text.hpp"

namespace kmax::experiment {
namespace {
std::vector<std::size_t> further_axes(const TouchLimits& limits, RigAxes axes) {
  return axes == RigAxes::wall ? std::vector<std::size_t>{} : std::vector{1 - limits.axis};
}

std::string force_text(const ForceChange& change) {
  return fmt::format("interference.{}={}",
                     change.of == ForceChange::Of::interference ? "force" : "background_force", change.force);
}
}  // namespace

std::vector<std::string> wall_assignments(const RigWall& wall, std::size_t axis, RigAxes axes) {
  const auto choice = [](const device::Parameter& parameter, auto value) {
    return device::value_text(parameter, static_cast<std::uint32_t>(value));
  };
  std::vector<std::string> all = {
      "wall.law=plain",
      "wall.damping=0",
      "interference.onset_time=0",
      fmt::format("wall.stiffness={}", wall.stiffness),
      fmt::format("haptic.rate={}", wall.haptic_rate),
      fmt::format("position.resolution={}", wall.resolution),
      "position.rounding=" + choice(device::Parameter::of<"position.rounding">(), wall.rounding),
      "interference.mode=" + choice(device::Parameter::of<"interference.mode">(), wall.interference),
      fmt::format("interference.force={}", wall.force),
      fmt::format("interference.background_force={}", wall.background_force)};
  if (axes == RigAxes::wall_along)
    for (const std::string& text :
         {std::string("wall.law=none"), std::string("position.resolution=0"),
          std::string("interference.mode=none"), fmt::format("haptic.rate={}", wall.haptic_rate)})
      all.push_back(fmt::format("axis{}.{}", 1 - axis, text));
  return all;
}

double touch_speed(const WatchedTouch& touch) {
  constexpr double span = 0.03;  // s
  const device::TraceSample* first = nullptr;
  const device::TraceSample* last = nullptr;
  for (const device::TraceSample& sample : touch.samples) {
    if (sample.time < -span || sample.time > 0.0) continue;
    if (first == nullptr) first = &sample;
    last = &sample;
  }
  if (first == nullptr || last->time <= first->time) return 0.0;
  return -touch.side * (last->position - first->position) / (last->time - first->time);
}

DeviceRig::DeviceRig(device::Device& device, const TouchLimits& limits, const TouchParty& party, RigAxes axes)
    : device_(device),
      limits_(limits),
      axes_(axes),
      notice_(party.notice),
      touches_(device, limits, wall_assignments({}, limits.axis, axes), party, further_axes(limits, axes)) {}

void DeviceRig::set(const RigWall& wall) {
  wall_ = wall;
  touches_.set(wall_assignments(wall, limits_.axis, axes_));
}

double DeviceRig::resolution_step() {
  return device_.read_number(fmt::format("axis{}.measured.resolution", limits_.axis));
}

void DeviceRig::note(const std::string& text) const {
  if (notice_) notice_(text);
}

RigTouch DeviceRig::hold(const TouchPlan& plan) {
  // The touch before has left its last forces behind.
  if (!plan.changes.empty()) set(wall_);
  touches_.ask(plan.request);
  if (axes_ == RigAxes::wall_along)
    return hold_on_two_axes(plan, watch_within(limits_, plan.name, plan.hold_time));
  const WatchedTouch watched = touches_.watch(plan.name, plan.hold_time);
  RigTouch touch;
  touch.touched = true;
  touch.speed = std::max(0.0, touch_speed(watched));
  touch.limited_share = watched.limited_share;
  touch.aborted = watched.aborted_at.has_value();
  touch.lost_records = watched.lost_records;
  if (plan.threshold > 0.0) touch.judgement = measure_touch(watched, plan.hold_time, plan.threshold);
  for (const device::TraceSample& sample : watched.samples)
    touch.samples.push_back(
        {sample.time, watched.side * (sample.position - watched.surface), sample.force, 0.0, 0.0});
  return touch;
}

RigTouch DeviceRig::hold_on_two_axes(const TouchPlan& plan, TouchWatch watch) {
  watch.hold_time += 0.1;  // a change comes at the link's pace
  std::vector<TimedChange> changes;
  for (const ForceChange& change : plan.changes)
    changes.push_back({change.time, {force_text(change)}, change.of == ForceChange::Of::background});
  TwoAxisTouch watched =
      watch_two_axes(device_, watch, changes, touches_.tell(), limits_.wall_abort_amplitude);
  RigTouch touch;
  touch.touched = true;
  touch.change_times = std::move(watched.change_times);
  touch.contact_share = watched.contact_share;
  touch.limited_share = watched.limited_share;
  touch.aborted = watched.aborted_at.has_value();
  touch.lost_records = watched.lost_records;
  for (const device::TraceSample& sample : watched.samples)
    touch.samples.push_back({sample.time, 0.0, 0.0, sample.position, sample.force});
  return touch;
}

}  // namespace kmax::experiment
