#pragma once
// The motors, handles, people and the supply of a scene behind the power stage of a board:
// what the native board and the virtual board have in common.
//
// Time passes in advance() only, under the legs set last. An axis that the scene does not have, or has
// without a motor, is an open connector.
//
// A person who has a motion begins the approach whenever the axis begins to be driven, as one would who was
// told "now"; a pause of microseconds is none. A handle that nobody holds stays at its start until its axis
// is driven for the first time, and is let go then.
//
// Defects may be planted and mended at any time; finer ones (a share of slip, edges lost in the cable) are
// set on the parts themselves: drive(axis).encoder_coupling(), supply(), temperature(axis).

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>

#include "board/odrive_v3/description.hpp"
#include "board/odrive_v3/voltage_variant.hpp"
#include "firmware/object_dictionary/entry.hpp"
#include "host_tools/simulation/defect.hpp"
#include "host_tools/simulation/scene.hpp"
#include "host_tools/simulation/temperature_sensor.hpp"

namespace kmax::simulation {

class PartBroken : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class SceneDrives {
 public:
  // Throws what the parts of the scene throw; std::invalid_argument for more axes than a board has, or a
  // second AS5047P: a board has one chip select for it.
  explicit SceneDrives(const Scene& scene);

  bool has(std::size_t axis) const { return axis < axes_.size() && axes_[axis].drive.has_value(); }
  bool any() const {
    return std::any_of(axes_.begin(), axes_.end(), [](const Axis& axis) { return axis.drive.has_value(); });
  }
  // Throw std::out_of_range for an axis without a motor.
  MotorDrive& drive(std::size_t axis);
  const MotorDrive& drive(std::size_t axis) const;
  Supply& supply() { return supply_; }
  const Supply& supply() const { return supply_; }
  // Of the board behind them; none for a divider that no board has.
  std::optional<board::odrive_v3::VoltageVariant> variant() const {
    return board::odrive_v3::variant_with_divider(supply_.config().divider_ratio);
  }
  TemperatureSensor& temperature(std::size_t axis) { return axes_.at(axis).temperature; }
  const TemperatureSensor& temperature(std::size_t axis) const { return axes_.at(axis).temperature; }

  // The bridge of an axis, from now on. An axis without a motor takes it without effect.
  void set_bridge(std::size_t axis, const InverterCommand& command);
  const InverterCommand& bridge(std::size_t axis) const { return axes_.at(axis).command; }

  // s, above 0; in steps of at most 10 ms. Throws PartBroken when the supply exceeds what a part of the board
  // bears, whose variant the supply's divider tells (board/odrive_v3/voltage_variant.hpp).
  void advance(double duration);

  // If EN_GATE rises now.
  bool gate_driver_starts(std::size_t axis) const {
    return !has(axis) || axes_[axis].drive->gate_driver_starts();
  }

  EncoderKind encoder_kind(std::size_t axis) const { return axes_.at(axis).encoder_kind; }
  // The AS5047P of an axis: what its angle would be without wrapping at the turn.
  std::int64_t serial_angle(std::size_t axis) const;

  // Throws std::out_of_range for an axis without a motor. Planting what is there already changes nothing.
  void plant(std::size_t axis, Defect defect) { set(axis, defect, true); }
  void mend(std::size_t axis, Defect defect) { set(axis, defect, false); }
  bool planted(std::size_t axis, Defect defect) const {
    return axes_.at(axis).defects[static_cast<std::size_t>(defect)];
  }

 private:
  struct Axis {
    std::optional<MotorDrive> drive;
    InverterCommand command;
    EncoderKind encoder_kind = EncoderKind::quadrature;
    bool encoder_reversed = false;  // as it is mounted
    TemperatureSensor temperature{board::odrive_v3::description.thermistor};
    std::array<bool, defect_names.size()> defects{};
    bool moves = false;  // somebody holds it who has a motion
    bool let_go = false;
    double undriven = 1.0;  // s
  };

  void set(std::size_t axis, Defect defect, bool present);
  void look_at_parts() const;

  std::array<Axis, firmware::axis_count> axes_;
  Supply supply_;
  double source_voltage_;  // V, without defect
};

}  // namespace kmax::simulation
