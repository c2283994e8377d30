#include "host_tools/experiment/design/design_task.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host_tools/experiment/report_words.hpp"

namespace kmax::experiment {
namespace {

using Velocity = control::VelocityEstimatorConfig<float>;
using Kind = control::VelocityEstimatorKind;

void require(bool allowed, const std::string& message) {
  if (!allowed) throw std::invalid_argument(message);
}

std::vector<Velocity> estimators_for(double rate) {
  std::vector<Velocity> all{{Kind::difference}};
  for (const Kind kind : {Kind::low_pass, Kind::tracking}) {
    for (const float bandwidth : {30.0F, 100.0F, 300.0F, 1000.0F})
      // Beyond a quarter of the rate it filters nothing that the difference has.
      if (static_cast<double>(bandwidth) <= 0.25 * rate) all.push_back({kind, Velocity{}.window, bandwidth});
  }
  for (const Kind kind : {Kind::foaw, Kind::foaw_end_fit})
    for (const int window : {4, 8, 16}) all.push_back({kind, window});
  return all;
}

}  // namespace

double stiffness_of(int rung) {
  return first_rung * std::pow(rung_ratio, rung);
}

void validate(const DesignTask& task) {
  simulation::validate(task.set.device);
  require(task.protocol.touches() > 0 && !task.set.subjects.empty(),
          "nobody touches: name people and touches");
  require(task.rate >= 100.0 && task.rate <= 1e5,
          fmt::format("loop of {} Hz: allowed is 100 to 100000 Hz", task.rate));
  require(
      task.growth_time >= 0.0 && task.growth_time <= 1.0,
      fmt::format(
          "growth time of {:g} s: allowed is 0 (walls do not grow) to 1 s; a touch is held for 3 s, by whose "
          "end a wall must have come to its stiffness",
          task.growth_time));
  require(task.margin >= 0.0 && task.margin < 1.0,
          fmt::format("margin of {:g} %: allowed is 0 to below 100 %", 100.0 * task.margin));
  const double limit = task.set.device.force_limit;
  require(task.field >= 0.0 && (limit == 0.0 || task.field < limit),
          fmt::format(
              "field of {:g} N on a device that makes {:g} N: nothing would be left for the wall; allowed is "
              "0 to below the device's force limit",
              task.field, limit));
}

std::string name_of(const WallFamily& family) {
  const Velocity& velocity = family.velocity;
  std::string name = estimator_name(velocity.kind);
  if (velocity.kind == Kind::low_pass || velocity.kind == Kind::tracking)
    name += fmt::format(" of {:g} Hz", velocity.bandwidth);
  if (velocity.kind == Kind::foaw || velocity.kind == Kind::foaw_end_fit)
    name += fmt::format(" of {} samples", velocity.window);
  if (family.grows()) name = fmt::format("grows from {:g} %", 100.0 * family.touch_share);
  if (family.coefficient > 0.0)
    name += fmt::format(", field of {:g} N over {:g} mm", family.coefficient, family.length * 1e3);
  return name;
}

std::vector<WallFamily> families_of(const DesignTask& task) {
  std::vector<WallFamily> families;
  for (const Velocity& velocity : estimators_for(task.rate)) families.push_back({velocity});
  if (task.growth_time > 0.0)
    for (const double share : {0.15, 0.25, 0.4}) families.push_back({Velocity{}, 0.0, 1e-3, share});
  if (task.field == 0.0) return families;
  const std::size_t without = families.size();
  for (const double share : {0.5, 1.0})
    for (const double length : {1e-3, 3e-3})
      for (std::size_t n = 0; n < without; ++n)
        families.push_back({families[n].velocity, share * task.field, length, families[n].touch_share});
  return families;
}

std::vector<double> dampings_of(const DesignTask& task) {
  constexpr int steps = 24;
  const simulation::DeviceModel& device = task.set.device;
  const double mass = device.mass + (device.structure ? device.structure->handle_mass : 0.0);
  const double most = std::min(2.0 * mass * task.rate, most_damping);
  std::vector<double> dampings{0.0};
  for (int n = steps - 1; n >= 0; --n) dampings.push_back(most * std::pow(damping_ratio, -n));
  return dampings;
}

TouchCase case_of(const DesignTask& task, std::size_t number) {
  const TouchProtocol& protocol = task.protocol;
  const std::size_t pushes = protocol.pushes.size(), each = protocol.approach_speeds.size() * pushes;
  return {number / each, protocol.approach_speeds[number % each / pushes], protocol.pushes[number % pushes]};
}

TouchSetup touch_of(const DesignTask& task, const DesignedWall& wall, const TouchCase& touch) {
  TouchSetup setup;
  setup.device = task.set.device;
  setup.person = task.set.subjects[touch.person].person;
  setup.wall = touched_wall(task.rate, task.count_length, task.set.device.force_limit);
  setup.wall.velocity = wall.family.velocity;
  setup.wall.wall.kind =
      wall.family.coefficient > 0.0 ? control::WallKind::magnetic : control::WallKind::plain;
  setup.wall.wall.magnetic_coefficient = static_cast<float>(wall.family.coefficient);
  setup.wall.wall.magnetic_length = static_cast<float>(wall.family.length);
  setup.wall.wall.damping = static_cast<float>(wall.damping);
  setup.wall.wall.stiffness = static_cast<float>(wall.stiffness);
  if (wall.family.grows()) {
    setup.wall.damping_window = 1;
    setup.wall.wall.growing.touch_stiffness = static_cast<float>(wall.family.touch_share * wall.stiffness);
    setup.wall.wall.growing.growth_time = static_cast<float>(task.growth_time);
  }
  setup.motion.approach_speed = touch.speed;
  setup.motion.push_force = touch.push;
  setup.threshold = task.protocol.threshold;
  setup.force_threshold = task.protocol.force_threshold;
  setup.judges_both = true;
  return setup;
}

}  // namespace kmax::experiment
