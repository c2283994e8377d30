#pragma once

#include <vector>

#include "host_tools/selftest/recording.hpp"

namespace kmax::selftest {

/// What is between the legs and the two current sensors.
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

struct PhaseResponse {
  Circuit circuit = Circuit::unclear;
  double admittance = 0.0;         ///< of the winding, as a multiple of the one it was judged by
  double judged_resistance = 0.0;  ///< ohm
  double residual = 1.0;           ///< of the pattern that fits best: 0 exact, 1 not at all
  double runner_up = 1.0;          ///< of the next best
  /// Response of the sensors b and c to each pulse, as a multiple of the current along the pulse that the
  /// claimed winding would carry.
  std::vector<double> b{}, c{};
};

/// Finds the circuit by how the currents of B and C answer to voltages.
///
/// Synchronous motor: three recordings, pulses along 0, 120 and 240 degrees, the axes of the phases A, B, C.
/// Each sensor's answer is compared with the current that the claimed winding (first-order, resistance and
/// inductance) would carry under the voltage that was really given; that makes six numbers. Every hypothesis
/// predicts them up to a common factor, the admittance. For a star of three equal windings with y = 1:
///
///                 pulse on A       on B            on C
///   healthy       -1/2, -1/2       1, -1/2         -1/2, 1
///   A open        0, 0             3/4, -3/4       -3/4, 3/4
///   B open        0, -3/4          0, 0            0, 3/4
///   C open        -3/4, 0          3/4, 0          0, 0
///
/// A sensor that is inverted or dead changes its own numbers alone. A short between two phases that outweighs
/// the winding has the pattern of the third phase open, and several times the claimed admittance.
/// DC motor: one recording; healthy is 1, -1. An open lead, brush or cable all give 0, 0.
///
/// The hypothesis with the smallest residual counts if it leaves less than 0.2 of the square unexplained and
/// the next leaves twice as much. An answer below 5 % of the claimed current, or within three standard
/// deviations of the noise, counts as none.
PhaseResponse judge_phases(const std::vector<Recording>& recordings, const AxisFacts& facts);

}  // namespace kmax::selftest
