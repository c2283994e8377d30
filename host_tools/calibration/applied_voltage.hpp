#pragma once

#include "board/description.hpp"

// The voltage that the bridge gave for the voltage that was asked for: the PWM rounds each leg's duty to a
// whole number of the board's timer steps (half_period_ticks), which is 5.7 mV at 24 V on odrive_v3; for a
// motor of 0.05 ohm that is 0.1 A. Rounding follows the controllers' own arithmetic
// (dc_current_controller.hpp: legs at 1/2 +- v / 2 V; field_oriented_controller.hpp: min-max). Dead time is
// not in it.

namespace kmax::calibration {

struct VoltageVector {
  double d = 0.0;  // V along the frame's angle
  double q = 0.0;  // V a quarter turn ahead
};

// V between B and C.
double applied_brushed_voltage(const board::BoardDescription& board, double asked, double supply);

// In the frame at `angle` (rad, electrical) in which it was asked for.
VoltageVector applied_vector(const board::BoardDescription& board, const VoltageVector& asked, double angle,
                             double supply);

}  // namespace kmax::calibration
