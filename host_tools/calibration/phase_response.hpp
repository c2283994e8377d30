#pragma once
// What the two current sensors say to a square-wave voltage along two directions of the stator, and which
// defect of phases and sensors that is.
//
// Along the angle 0 (the axis of phase A) a healthy motor's currents are -1/2 in B and C, at 90 degrees +0.87
// and -0.87. An open phase leaves the circuit of the two others; an inverted sensor turns a sign. All of
// these patterns differ, so the nearest in angle is taken: a unit vector of four numbers, bounds of the
// cosine in the code. Saliency of 1.4 turns a pattern by less than 10 degrees, the nearest two patterns stand
// 30 degrees apart.

#include <optional>
#include <span>

#include "host_tools/calibration/step_report.hpp"

namespace kmax::calibration {

// Half the difference of a sensor's current at the ends of the positive and of the negative half waves, A.
struct PhaseResponse {
  double b = 0.0;
  double c = 0.0;
};

// `voltage`: along the wave's direction, as captured at every tick; voltage[k] acts from k + 1/2 on.
// `half_period` ticks. The samples before `from` are left out.
PhaseResponse phase_response(std::span<const double> voltage, std::span<const double> current_b,
                             std::span<const double> current_c, int half_period, std::size_t from);

// Largest magnitude of the motor's current that these responses can belong to, A.
double magnitude_of(const PhaseResponse& along_0, const PhaseResponse& along_90);

// None: all is well. `along_90` is ignored for a brushed motor.
std::optional<Diagnosis> diagnose_phases(bool brushed, const PhaseResponse& along_0,
                                         const PhaseResponse& along_90);

}  // namespace kmax::calibration
