#pragma once

#include "firmware/refusal.hpp"
#include "host_tools/calibration/recording.hpp"
#include "host_tools/calibration/step_report.hpp"

namespace kmax::calibration {

// What an axis that tripped by itself says about the device, where the step knows nothing better.
Diagnosis diagnosis_of(const Trip& trip);

// Throws StepFailed with that if the recording tripped.
void require_no_trip(const Recording& recording);

// An axis that was not armed; `supply` and its bounds in V.
Diagnosis diagnosis_of(firmware::Refusal refusal, double supply, double supply_min, double supply_max);

}  // namespace kmax::calibration
