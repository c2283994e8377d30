#include "host_tools/experiment/device_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "host_tools/device/parameter.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/experiment/touch_journal.hpp"

namespace kmax::experiment {

namespace {
/// The device's own in each experiment: where its surface is, and what a person has allowed at most.
constexpr std::array kept{"wall.position", "wall.side", "wall.stiffness_ceiling", "wall.damping_ceiling"};

bool sets(const std::vector<std::string>& assignments, std::string_view name) {
  return std::any_of(assignments.begin(), assignments.end(), [&](const std::string& one) {
    return one.starts_with(name) && one.substr(name.size()).starts_with('=');
  });
}

bool is_in_group(const device::Parameter& parameter, std::string_view group) {
  return std::string_view(parameter.definition().name).starts_with(group);
}

/// Settings of the wall and the interference that `assignments` leaves open. The defaults are paper 1's
/// constants, no damping and no growth.
std::vector<device::Parameter> left_open(const std::vector<std::string>& assignments) {
  std::vector<device::Parameter> all;
  for (const device::Parameter& parameter : device::all_parameters()) {
    const std::string_view name = parameter.definition().name;
    const bool of_wall = is_in_group(parameter, "wall.") || is_in_group(parameter, "interference.");
    const bool is_kept = std::find(kept.begin(), kept.end(), name) != kept.end();
    if (of_wall && parameter.axis() == 0 && parameter.writable() && !is_kept && !sets(assignments, name))
      all.push_back(parameter);
  }
  return all;
}

/// The wall's last, as TouchWatch has them.
std::vector<std::size_t> axes_of(const TouchLimits& limits, RigAxes axes) {
  if (axes == RigAxes::wall) return {limits.axis};
  return {along(limits.axis), limits.axis};
}

std::vector<std::string> protective_of(device::Device& device, const TouchLimits& limits, RigAxes axes) {
  std::vector<std::string> all;
  for (const std::size_t axis : axes_of(limits, axes))
    for (const std::string& one : protective_assignments(device, axis, limits.force_limit))
      if (std::find(all.begin(), all.end(), one) == all.end()) all.push_back(one);
  return all;
}

std::string force_text(const ForceChange& change) {
  return fmt::format("interference.{}={}",
                     change.of == ForceChange::Of::interference ? "force" : "background_force", change.force);
}
}  // namespace

std::vector<std::string> wall_assignments(const RigWall& wall, std::size_t axis, RigAxes axes) {
  const auto text = [](const device::Parameter& parameter, std::uint32_t raw) {
    return fmt::format("{}={}", parameter.definition().name, device::value_text(parameter, raw));
  };
  const auto choice = [&text](const device::Parameter& parameter, auto value) {
    return text(parameter, static_cast<std::uint32_t>(value));
  };
  std::vector<std::string> all = {fmt::format("wall.stiffness={}", wall.stiffness)};
  const auto add = [&all](std::initializer_list<std::string> more) { all.insert(all.end(), more); };
  if (!wall.as_set)
    add({fmt::format("haptic.rate={}", wall.haptic_rate),
         fmt::format("position.resolution={}", wall.resolution),
         choice(device::Parameter::of<"position.rounding">(), wall.rounding)});
  add({choice(device::Parameter::of<"interference.mode">(), wall.interference),
       fmt::format("interference.force={}", wall.force),
       fmt::format("interference.background_force={}", wall.background_force)});
  if (!wall.as_set) {
    add({choice(device::Parameter::of<"wall.law">(), wall.law),
         fmt::format("wall.magnetic_coefficient={}", wall.magnetic_coefficient),
         choice(device::Parameter::of<"wall.adaptive_mode">(), wall.mode)});
    for (const device::Parameter& parameter : left_open(all))
      all.push_back(text(parameter, parameter.default_raw()));
  }
  for (const std::string& change : wall.changes) {
    const std::string name = change.substr(0, change.find('=') + 1);
    std::erase_if(all, [&](const std::string& one) { return one.starts_with(name); });
    all.push_back(change);
  }
  if (axes == RigAxes::wall_along)
    for (const std::string& one :
         {std::string("wall.law=none"), std::string("position.resolution=0"),
          std::string("interference.mode=none"), fmt::format("haptic.rate={}", wall.haptic_rate)})
      all.push_back(fmt::format("axis{}.{}", along(axis), one));
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

RunJournal::Json touch_settings(const std::string& experiment, device::Device& device,
                                const TouchLimits& limits, const RunJournal::Json& own) {
  RunJournal::Json all = {{"experiment", experiment}};
  all.update(device_circumstances(device, limits.axis));
  all.update(own);
  all["force_limit_n"] = limits.force_limit;
  all["abort_amplitude_m"] = limits.abort_amplitude;
  return all;
}

DeviceRig::DeviceRig(device::Device& device, const TouchLimits& limits, const TouchParty& party, RigAxes axes)
    : device_(device),
      limits_(limits),
      axes_(axes),
      notice_(party.notice),
      before_(device, limits.axis, party.notice),
      standstill_(device, axes_of(limits, axes), party.notice),
      session_{party.prompter, party.journal, party.report, &standstill_} {
  const std::vector<std::string> protective = protective_of(device, limits, axes);
  std::vector<std::string> changed = wall_assignments({}, limits.axis, axes);
  changed.insert(changed.end(), protective.begin(), protective.end());
  before_.note(changed);
  apply(protective);
  force_limit_ = device.read_number(fmt::format("axis{}.force.limit", limits.axis));
}

void DeviceRig::apply(const std::vector<std::string>& assignments) {
  before_.note(assignments);
  device_.apply(device::parse_assignments(assignments, limits_.axis));
}

void DeviceRig::set(const RigWall& wall) {
  wall_ = wall;
  apply(wall_assignments(wall, limits_.axis, axes_));
}

void DeviceRig::set_with_limits(const RigWall& wall) {
  wall_ = wall;
  std::vector<std::string> assignments = wall_assignments(wall, limits_.axis, axes_);
  for (const std::string& one : protective_of(device_, limits_, axes_)) assignments.push_back(one);
  apply(assignments);
  const device::Parameter estimator(firmware::entry_of<"velocity.estimator">(), limits_.axis);
  velocity_estimator_ = device::value_text(estimator, device_.read(estimator));
}

double DeviceRig::resolution_step() {
  return device_.read_number(fmt::format("axis{}.measured.resolution", limits_.axis));
}

void DeviceRig::note(const std::string& text) const {
  if (notice_) notice_(text);
}

RigTouch DeviceRig::hold(const TouchPlan& plan) {
  // The touch before has left its last forces behind.
  if (!plan.changes.empty()) {
    set(plan.wall.value_or(wall_));
    // These changes come while the axis is armed, when forces are raised no farther than this.
    double largest = 0.0;
    for (const ForceChange& change : plan.changes) largest = std::max(largest, std::abs(change.force));
    apply({fmt::format("force.ceiling={}", largest)});
  }
  if (session_.prompter != nullptr) {
    session_.prompter->ask(plan.request);
  } else if (plan.pause > 0.0) {
    device_.link().wait(std::chrono::microseconds(std::llround(plan.pause * 1e6)));
  }
  if (plan.wall) set_with_limits(*plan.wall);
  const bool two_axes = axes_ == RigAxes::wall_along;
  TouchWatch watch;
  watch.axes = axes_of(limits_, axes_);
  watch.name = plan.name;
  watch.hold_time = plan.hold_time;
  watch.contact_patience = limits_.patience;
  watch.abort_amplitude = limits_.abort_amplitude;
  if (two_axes) {
    watch.hold_time += 0.1;  // a change comes at the link's pace
    watch.release = 0.0;
    watch.trace_rate = 100.0;
    watch.wall_abort_amplitude = limits_.wall_abort_amplitude;
  }
  for (const ForceChange& change : plan.changes)
    watch.changes.push_back({change.time, {force_text(change)}, change.of == ForceChange::Of::background});
  WatchedTouch watched = watch_touch(device_, watch, session_.report);
  RigTouch touch;
  touch.touched = true;
  touch.change_times = std::move(watched.change_times);
  touch.contact_share = watched.contact_share;
  touch.limited_share = watched.limited_share;
  touch.aborted_at = watched.aborted_at;
  touch.lost_records = watched.lost_records;
  if (two_axes) {
    for (const device::TraceSample& sample : watched.samples)
      touch.samples.push_back({sample.time, 0.0, 0.0, sample.position, sample.force, 0.0});
    return touch;
  }
  touch.speed = std::max(0.0, touch_speed(watched));
  touch.surface = watched.surface;
  touch.side = watched.side;
  if (plan.threshold > 0.0) touch.judgement = measure_touch(watched, plan.hold_time, plan.threshold);
  for (const device::TraceSample& sample : watched.samples)
    touch.samples.push_back({sample.time, watched.side * (sample.position - watched.surface), sample.force,
                             0.0, 0.0, sample.magnetic_coefficient});
  return touch;
}

RunJournal::Json device_circumstances(device::Device& device, std::size_t axis) {
  RunJournal::Json all = {{"device", device.identify()}, {"axis", axis}};
  const auto note = [&](const device::Parameter& parameter) {
    all[parameter.definition().name] = device::value_text(parameter, device.read(parameter));
  };
  for (const char* name :
       {"force.slew_limit", "force.ramp_time", "device.transmission", "encoder.counts_per_turn"})
    note(device::resolve(name, axis));
  for (const char* name : kept) note(device::resolve(name, axis));
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (!parameter.writable() || !parameter.belongs_to_axis() || parameter.axis() != axis) continue;
    for (const std::string_view group : {"velocity.", "instability.", "compensation."})
      if (is_in_group(parameter, group)) note(parameter);
  }
  return all;
}

}  // namespace kmax::experiment
