#pragma once
// What the two current sensors say to a square-wave voltage along two directions of the stator, and which
// defect of phases and sensors that is (host_tools/bench/circuit.hpp).

#include <optional>
#include <span>

#include "host_tools/bench/circuit.hpp"
#include "host_tools/calibration/procedure.hpp"

namespace kmax::calibration {

using bench::SensorAnswer;

// Half the difference of a sensor's current at the ends of the positive and of the negative half waves, A.
//
// `voltage`: along the wave's direction, as captured at every tick; voltage[k] acts from k + 1/2 on.
// `half_period` ticks. The samples before `from` are left out.
SensorAnswer phase_response(std::span<const double> voltage, std::span<const double> current_b,
                            std::span<const double> current_c, int half_period, std::size_t from);

// Largest magnitude of the motor's current that these responses can belong to, A.
double magnitude_of(const SensorAnswer& along_0, const SensorAnswer& along_90);

// None: all is well. `along_90` is ignored for a brushed motor.
std::optional<Diagnosis> diagnose_phases(bool brushed, const SensorAnswer& along_0,
                                         const SensorAnswer& along_90);

}  // namespace kmax::calibration
