#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "host_tools/simulation/spikes.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"

namespace kmax::virtual_board {

/// An axis' encoder as the board's connector sees it.
struct EncoderSignals {
  std::int64_t edges = 0;  ///< of A and B since some origin, upwards when A leads
  bool index = false;      ///< level of Z
};

/// The AS5047P on the bus.
struct SerialEncoderState {
  bool fitted = false;
  std::int64_t angle = 0;  ///< counts of 1/16384 turn
};

/// What is plugged into the board: motors, encoders, supply. All times are absolute and never go back.
class BoardWorld {
 public:
  virtual ~BoardWorld() = default;

  /// The bridge of an axis changes what it does, from `now` on.
  virtual void set_bridge(std::size_t axis, const std::array<PwmLegOutput, 3>& legs, BoardTime now) = 0;
  /// The gate driver's shunt amplifiers: V/V, and whether their inputs are shorted to show the offset.
  virtual void set_amplifiers(std::size_t axis, double gain, bool shorted, BoardTime now) = 0;
  /// The axis' gate driver is on the board.
  virtual bool has_gate_driver(std::size_t /*axis*/) const { return true; }
  /// It starts if EN_GATE rises now: its SH pins are low enough.
  virtual bool gate_driver_starts(std::size_t /*axis*/, BoardTime /*now*/) { return true; }
  /// V at the motor supply's terminals, which also feeds the gate drivers.
  virtual double supply_voltage() const = 0;
  /// The brake resistor is switched.
  virtual void set_brake(bool on, BoardTime now) = 0;
  /// The counter of this axis' PWM is at its underflow, the other's at its overflow: until the next call the
  /// low sides of the one conduct, the high sides of the other, as far as they are driven.
  virtual void set_low_sides(std::size_t /*axis*/) {}
  /// Volts at an analogue pin, by the number of its ADC channel.
  virtual double analogue(unsigned channel, BoardTime now) = 0;
  /// Asked after every sampling instant of the axis and whenever else the board likes.
  virtual EncoderSignals encoder(std::size_t axis, BoardTime now) = 0;
  /// Interference on the lines.
  virtual std::optional<simulation::SpikesConfig> spikes() const { return std::nullopt; }
  /// The AS5047P's select passes the filter of GPIO7: its solder jumper is open.
  virtual bool select_filtered() const { return true; }
  virtual SerialEncoderState serial_encoder(BoardTime /*now*/) { return {}; }
};

}  // namespace kmax::virtual_board
