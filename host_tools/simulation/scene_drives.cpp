#include "host_tools/simulation/scene_drives.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/as5047p_frames.hpp"

namespace kmax::simulation {

namespace {
constexpr double longest_step = 0.01;  // s, that a circuit takes at a time
constexpr double slipping_share = 1.0 / 3.0;
constexpr double low_supply = 0.5;  // of the source's voltage
constexpr double noticed = 50e-6;   // s without force, by a person

bool driven(const InverterCommand& command) {
  return std::any_of(command.legs.begin(), command.legs.end(),
                     [](const LegCommand& leg) { return leg.enabled; });
}
}  // namespace

SceneDrives::SceneDrives(const Scene& scene)
    : supply_(scene.make_supply()), source_voltage_(supply_.config().voltage) {
  if (scene.axes.size() > axes_.size())
    throw std::invalid_argument(
        fmt::format("a board has {} axes; the scene names {}", axes_.size(), scene.axes.size()));
  std::size_t serial_encoders = 0;
  for (std::size_t i = 0; i < scene.axes.size(); ++i) {
    const SceneAxis& named = scene.axes[i];
    if (!named.motor) continue;
    Axis& axis = axes_[i];
    axis.drive.emplace(scene.make_drive(i));
    axis.encoder_kind = named.encoder.kind;
    axis.encoder_reversed = named.encoder.reversed;
    axis.moves = named.motion.has_value();
    serial_encoders += axis.encoder_kind == EncoderKind::as5047p ? 1 : 0;
    if (!axis.drive->handle().has_operator()) axis.drive->hold(true);
    for (const Defect defect : named.defects) plant(i, defect);
  }
  if (serial_encoders > 1)
    throw std::invalid_argument(
        "encoder.kind = as5047p on several axes: this board has one chip select for it");
}

MotorDrive& SceneDrives::drive(std::size_t axis) {
  if (!has(axis)) throw std::out_of_range(fmt::format("axis {} of the scene has no motor", axis));
  return *axes_[axis].drive;
}

const MotorDrive& SceneDrives::drive(std::size_t axis) const {
  if (!has(axis)) throw std::out_of_range(fmt::format("axis {} of the scene has no motor", axis));
  return *axes_[axis].drive;
}

void SceneDrives::set_bridge(std::size_t index, const InverterCommand& command) {
  Axis& axis = axes_.at(index);
  const bool begins = driven(command) && axis.undriven > noticed;
  if (driven(command)) axis.undriven = 0.0;
  axis.command = command;
  if (!axis.drive || !begins) return;
  if (axis.drive->handle().has_operator()) {
    if (axis.moves) axis.drive->handle().begin_motion();
  } else if (!axis.let_go) {
    axis.let_go = true;
    axis.drive->hold(false);
  }
}

void SceneDrives::advance(double duration) {
  double left = duration;
  while (left > 0.0) {
    const double step = std::min(left, longest_step);
    for (Axis& axis : axes_) {
      if (!axis.drive) continue;
      axis.drive->current_sensor().set_driven(driven(axis.command));
      axis.drive->advance(step, axis.command, supply_);
      if (!driven(axis.command)) axis.undriven += step;
    }
    supply_.advance(step);
    if (supply_.config().part_ratings) look_at_parts();
    left -= step;
  }
}

void SceneDrives::look_at_parts() const {
  const auto variant = this->variant();
  if (!variant) return;
  const auto parts = board::odrive_v3::part_ratings(*variant);
  const double volts = supply_.voltage();
  if (volts <= static_cast<double>(parts.weakest())) return;
  const auto refuse = [&](std::string_view what, float rated, float borne) {
    throw PartBroken(fmt::format(
        "the supply reached {:.2f} V: the {} of the {:.0f} V board are rated for {:.0f} V and bear {:.4g} V; "
        "they are broken now (part_ratings = false in [supply] goes on)",
        volts, what, parts.supply, rated, borne));
  };
  if (parts.capacitor_surge() <= parts.mosfets)
    refuse("capacitors", parts.capacitors, parts.capacitor_surge());
  refuse("MOSFETs", parts.mosfets, parts.mosfets);
}

std::int64_t SceneDrives::serial_angle(std::size_t axis) const {
  constexpr double turn = 6.283185307179586476925;
  constexpr auto counts_per_turn = static_cast<double>(drivers::as5047p::counts_per_turn);
  return static_cast<std::int64_t>(std::floor(drive(axis).disc_angle() / turn * counts_per_turn));
}

void SceneDrives::set(std::size_t index, Defect defect, bool present) {
  MotorDrive& drive = this->drive(index);
  Axis& axis = axes_[index];
  bool& planted = axis.defects[static_cast<std::size_t>(defect)];
  if (planted == present) return;
  planted = present;
  using Channel = CurrentSensor::Channel;
  switch (defect) {
    case Defect::phase_a_open:
      return drive.open_terminal(terminal_a, present);
    case Defect::phase_b_open:
      return drive.open_terminal(terminal_b, present);
    case Defect::phase_c_open:
      return drive.open_terminal(terminal_c, present);
    case Defect::phases_swapped:
      return drive.swap_terminals(terminal_b, terminal_c);
    case Defect::encoder_unplugged:
      return drive.encoder().set_plugged(!present);
    case Defect::encoder_stuck:
      return drive.encoder_coupling().set_stuck(present);
    case Defect::encoder_reversed:
      return drive.encoder_coupling().set_reversed(present != axis.encoder_reversed);
    case Defect::encoder_slipping:
      return drive.encoder_coupling().set_slip(present ? slipping_share : 0.0);
    case Defect::supply_low:
      supply_.set_source(present ? low_supply * source_voltage_ : source_voltage_);
      // Nothing may be there that empties the capacitor.
      if (present) supply_.set_voltage(std::min(supply_.voltage(), supply_.config().voltage));
      return;
    case Defect::motor_blocked:
      return drive.block(present);
    case Defect::current_b_inverted:
      return drive.current_sensor().invert(Channel::b, present);
    case Defect::current_c_inverted:
      return drive.current_sensor().invert(Channel::c, present);
    case Defect::gate_driver_missing:
      return drive.current_sensor().set_floating(present);
    case Defect::index_loose:
      return drive.encoder().set_index_loose(present);
  }
}

}  // namespace kmax::simulation
