#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_tools/calibration/calibration_settings.hpp"
#include "host_tools/calibration/step.hpp"
#include "host_tools/calibration/step_report.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::calibration {

struct CalibrationReport {
  std::vector<StepReport> steps;
  bool stored = false;  // in the device's memory
  bool kept = false;    // in RAM

  bool pass() const;
};

// All steps in their order.
std::vector<std::unique_ptr<Step>> calibration_steps();

// Runs the steps of the chosen sets on one axis.
//
// What a step finds is set in the device's RAM for the next one. Unless every step passes all parameters are
// put back; so are they on a dry run, when `tell` throws, and when the device or the link fails. The axis is
// disarmed and drive.mode and excitation.* are put back however it ends. Only if all steps pass, the results
// are saved (unless settings.save is false), all in one record, and motor.calibrated becomes yes if
// electrical, encoder and mechanical steps were among them.
//
// `tell`: called a few times a second with a short text, or an empty one; throw CalibrationInterrupted from
// it to end the calibration. `started` (may be empty): a step begins. `prompter` may be null.
//
// Errors: NothingToCalibrate; whatever `tell` throws (a CalibrationInterrupted with what has become of the
// axis and its parameters added); device::DeviceError, link::LinkError. If the axis could not be disarmed or
// a parameter not put back: DeviceError or CalibrationInterrupted, saying so. A step's verdict is none.
CalibrationReport calibrate(device::Device& device, const CalibrationSettings& settings, Prompter* prompter,
                            const std::function<void(const std::string&)>& tell,
                            const std::function<void(std::string_view step)>& started = {});

}  // namespace kmax::calibration
