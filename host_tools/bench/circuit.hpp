#pragma once
// What lies between the legs of the bridge and the two current sensors, by how the sensors answer to voltages
// along known directions of the stator.

#include <span>

namespace kmax::bench {

enum class Circuit {
  healthy,
  nothing_flows,  ///< no current anywhere
  open_a,
  open_b,
  open_c,
  short_ab,
  short_bc,
  short_ca,
  short_circuit,  ///< far more current than the winding allows, in its usual pattern
  sense_b_inverted,
  sense_c_inverted,
  both_inverted,
  sense_b_dead,
  sense_c_dead,
  unclear,
};

/// What the sensors of B and C show, A or in any common unit.
struct SensorAnswer {
  double b = 0.0, c = 0.0;
};

struct CircuitMatch {
  Circuit circuit = Circuit::unclear;  ///< the one that fits best; unclear if none has its sign
  double factor = 0.0;                 ///< of the answers, by a winding with an admittance of 1
  double residual = 1.0;               ///< share of their square that it leaves unexplained: 0 exact, 1 all
  double runner_up = 1.0;              ///< of the next best
};

/// `seen`: the answers to a voltage of 1 along each of `directions` (rad, electrical; 0 is the axis of phase
/// A). Every circuit predicts them up to a common factor, the admittance of its winding. For a star of three
/// equal windings:
///
///                 along 0          along 120        along 240 degrees
///   healthy       -1/2, -1/2       1, -1/2          -1/2, 1
///   A open        0, 0             3/4, -3/4        -3/4, 3/4
///   B open        0, -3/4          0, 0             0, 3/4
///   C open        -3/4, 0          3/4, 0           0, 0
///
/// A sensor that is inverted or dead changes its own numbers alone. A brushed motor has one direction, with
/// 1, -1, and shows only its sensors' defects: an open lead gives nothing. All patterns differ: two
/// directions at a right angle keep the nearest two 30 degrees apart, and a saliency of 1.4 turns one by less
/// than 10. Considered are healthy, open_* and what the sensors can have; never nothing_flows or a short.
CircuitMatch match_circuit(bool brushed, std::span<const double> directions,
                           std::span<const SensorAnswer> seen);

}  // namespace kmax::bench
