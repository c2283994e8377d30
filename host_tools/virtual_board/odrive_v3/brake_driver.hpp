#pragma once

#include <cstdint>

#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// The high side of the brake's half-bridge: an LM5109B whose floating supply is a bootstrap capacitor of 100
/// nF (schematic of v3.5). While the high side is on, the capacitor is drained; while it is off, the brake
/// resistor pulls the middle to ground and the capacitor fills through the driver's diode. Below its
/// threshold the driver switches the high side off, whatever its input says, until the capacitor has
/// recovered.
///
/// Thresholds, and what the driver itself drains: data sheet SNVS477C, electrical characteristics (rising 6.6
/// V typical, hysteresis 0.4 V, 0.06 mA typical, 0.2 mA at most). Guesses: what else drains it (a resistor
/// from gate to source of 10 kohm), the FET's gate charge of 50 nC at 10 V, the time in which it fills,
/// the 10.3 V that are left of GVDD behind the diode.
struct BootstrapConfig {
  double capacitance = 100e-9;            // F
  double full = 10.3;                     // V
  double rising = 6.6, hysteresis = 0.4;  // V
  double drain = 0.2e-3;                  // A, the driver's own
  double gate_resistance = 10e3;          // ohm; guess
  double gate_capacitance = 5e-9;         // F, filled at each switching on; guess
  double fills_within = 1e-6;             // s, the time constant; guess
};

class BrakeDriver {
 public:
  explicit BrakeDriver(const BootstrapConfig& config = {}) : config_(config), voltage_(config.full) {}

  /// The input, and whether the driver has its supply.
  void drive(bool on, bool supplied, BoardTime now);
  /// What the FET does.
  bool on() const { return on_; }

  BoardTime next_event() const { return next_; }
  /// Passes the thresholds up to `now`; true when on() has changed.
  bool advance(BoardTime now);

  /// Since power-up: the lowest voltage of the capacitor, and how often the driver switched off for want of
  /// it.
  double lowest() const { return lowest_; }
  std::uint64_t drop_outs() const { return drop_outs_; }
  /// The longest time for which the high side was on without a pause.
  double longest_on() const { return longest_on_; }

 private:
  double at(BoardTime now) const;
  void settle(BoardTime now);
  void look_ahead();
  void switch_on(BoardTime now);

  BootstrapConfig config_;
  double voltage_;  ///< at since_
  BoardTime since_ = 0, on_since_ = 0, next_ = never;
  bool wanted_ = false, on_ = false, starved_ = false;
  double lowest_ = 1e9, longest_on_ = 0.0;
  std::uint64_t drop_outs_ = 0;
};

}  // namespace kmax::virtual_board
