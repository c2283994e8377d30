#pragma once
// Identification of the motor, the encoder and the handle of an axis.

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::calibration {

// Steps are chosen by these sets.
enum class StepSet : std::uint8_t { electrical, encoder, mechanical, compensation };
inline constexpr std::array step_set_names = {std::string_view("electrical"), std::string_view("encoder"),
                                              std::string_view("mechanical"),
                                              std::string_view("compensation")};

struct CalibrationSettings {
  std::size_t axis = 0;
  std::array<bool, step_set_names.size()> sets{true, true, true, false};  // by StepSet
  double travel = 0.02;           // m; the handle stays this near to where it is at the beginning
  std::optional<double> current;  // A; without it half of current.limit
  bool keep_pole_pairs = false;   // other pole pairs than motor.pole_pairs are a failure
  bool dry_run = false;           // everything is put back
  bool save = true;               // into the device's memory, if all steps pass
  int repetitions = 3;            // of each measurement, >= 2: their scatter is the spread

  bool has(StepSet set) const { return sets[static_cast<std::size_t>(set)]; }
};

// Something that is wrong with the device, under a name that stays the same: phase_b_open, motor_blocked, ...
// docs/calibration.md lists them.
struct Diagnosis {
  std::string cause;
  std::string words;   // what was measured, with its numbers
  std::string advice;  // what to do
};

struct IdentifiedValue {
  std::string name;  // of the parameter, or of a quantity that no parameter holds
  double value = 0.0;
  double spread =
      0.0;  // standard deviation over the repetitions, or the fit's standard error if that is larger
  std::string unit;
  std::optional<double> previous;  // what the device had
};

// `to_go`: what `step` and those that follow it usually take, on motors of the supplied scenes over a serial
// line of 115200 baud; over CAN it is about half of that. A motor that is much harder to shake, or a
// measurement that has to be repeated, takes longer. Time that a hand needs is not in it.
using StepStarted = std::function<void(std::string_view step, std::chrono::seconds to_go)>;

struct StepReport {
  std::string name;
  bool pass = false;
  bool skipped = false;  // not run, because a step that it needs has failed
  std::vector<IdentifiedValue> values;
  std::vector<Diagnosis> remarks;  // found and corrected, or worth a look: the step passes all the same
  std::optional<Diagnosis> failure;
};

// There is nothing that could be calibrated: the device has no motor that it knows of.
class NothingToCalibrate : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct CalibrationReport {
  std::vector<StepReport> steps;
  bool stored = false;  // in the device's memory
  bool kept = false;    // in RAM

  bool pass() const;
};

// Runs the steps of the chosen sets on one axis.
//
// What a step finds is set in the device's RAM for the next one. Unless every step passes all parameters are
// put back; so are they on a dry run, when `progress` throws, and when the device or the link fails. The axis
// is disarmed and drive.mode and excitation.* are put back however it ends. Only if all steps pass, the
// results are saved (unless settings.save is false), all in one record, and motor.calibrated becomes yes if
// electrical, encoder and mechanical steps were among them.
//
// `progress`: called a few times a second with a short text, or an empty one; throw bench::Interrupted from
// it to end the calibration. `started` (may be empty): a step begins. `prompter` may be null.
//
// Errors: NothingToCalibrate; whatever `progress` throws (a bench::Interrupted with what has become of the
// axis and its parameters added); base::DeviceError, device::LinkError. If the axis could not be disarmed or
// a parameter not put back: DeviceError or bench::Interrupted, saying so. A step's verdict is none.
CalibrationReport calibrate(device::Device& device, const CalibrationSettings& settings,
                            bench::Prompter* prompter,
                            const std::function<void(const std::string&)>& progress,
                            const StepStarted& started = {});

}  // namespace kmax::calibration
