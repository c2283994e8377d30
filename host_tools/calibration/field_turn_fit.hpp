#pragma once
// Direction, pole pairs and electrical offset of a synchronous motor with its encoder, from a current vector
// that turns slowly forwards and back and drags the rotor along.
//
//   commanded angle = direction x pole_pairs x shaft angle + offset + lag x (sign of turning) + ripple
//
// The rotor lags by what friction needs; forwards and backwards by the same, so the mean of both directions
// is free of it. Cogging makes a ripple that repeats with the electrical angle (its periods per shaft turn
// are a multiple of the pole pairs, lcm(slots, poles)); the mean over whole electrical turns is free of it. A
// constant torque (gravity) is not separated: it shifts both directions by asin(torque / (k I)); drag with
// more current, or compensate it.
//
// offset is what the firmware adds: electrical angle = pole_pairs x shaft angle + offset, with the shaft
// angle counted in the direction found (count x direction x 2 pi / counts_per_turn), 0 .. 2 pi. It belongs to
// counts as they are, rounded down: it contains half a count, pole_pairs x 180 / counts_per_turn electrical
// degrees.
//
// What it needs: 3 whole electrical turns each way after `settle_angle` (1 suffices for a value; slipping and
// the standard error show from 2 on), at 1 to 2 turns per second, 100 samples or more per turn, the current
// up and the rotor aligned before. Current: torque 5 times friction plus cogging; below, the lag grows and
// the rotor slips in the end. Found on three simulated motors, worst of 20 seeds, 4.3 turns at 2 turns per
// second: 0.2 electrical degrees, of which 0.15 are the half count. Standard error: the scatter of the single
// electrical turns' means; it does not know of gravity.

#include <span>

#include "host_tools/calibration/estimate.hpp"

namespace kmax::calibration {

// One sweep in one direction; the commanded angle runs monotonically (0..2 pi wrapped or not).
struct FieldTurn {
  std::span<const double> electrical_angle;  // rad, commanded
  std::span<const double> count;             // encoder counts, as captured (no offset or direction needed)
};

struct FieldTurnConfig {
  double counts_per_turn = 4000.0;
  int claimed_pole_pairs = 0;  // 0: unknown
  double settle_angle = 1.0;   // rad of the field at a sweep's beginning that are left out: the rotor starts
  double still_share = 0.05;   // of the turning expected for 64 pole pairs; below it the motor stands
  double whole_tolerance = 0.1;    // how far pole pairs may be from a whole number
  double slip_tolerance = 0.02;    // share by which counts per electrical turn may differ
  double meeting_tolerance = 1.0;  // rad electrical, of the lag; beyond pi/2 a rotor slips
};

enum class FieldTurnCause {
  none,
  too_little_data,    // found: electrical turns of the shorter sweep
  not_finite,         // found: index
  field_still,        // the commanded angle does not turn as it should; found: rad
  motor_still,        // no counts: motor blocked, phase open, encoder dead; found: counts
  not_whole,          // pole pairs not whole: counts per turn wrong, or steps lost; found: pole pairs
  slipping,           // counts per electrical turn differ between the sweeps or drift; found: share
  not_meeting,        // forwards and backwards do not meet; found: rad electrical
  direction_differs,  // the shaft turned the same way in both sweeps; found: ratio
  pole_pairs_differ,  // whole, but not what was claimed; found: pole pairs
};
std::string_view to_string(FieldTurnCause cause);

struct FieldTurnFit {
  Estimate pole_pairs{.unit = ""};  // not rounded
  int whole_pole_pairs = 0;         // rounded; 0: none
  int direction = 0;                // +1, or -1: phases swapped or encoder reversed; set encoder.direction
  Estimate offset{.unit = "rad"};   // electrical, 0 .. 2 pi, with the direction applied
  Estimate lag{.unit = "rad"};      // electrical; sin(lag) = friction torque / (k I)
  double ripple = 0.0;              // rad electrical, rms around the mean of a sweep
  double counts_per_electrical_turn = 0.0;
  Finding<FieldTurnCause> finding;  // direction -1 alone is none
};

FieldTurnFit fit_field_turn(const FieldTurn& forwards, const FieldTurn& backwards,
                            const FieldTurnConfig& config);

}  // namespace kmax::calibration
