#pragma once
// What a step of the calibration says about itself.

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace kmax::calibration {

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

struct StepReport {
  std::string name;
  bool pass = false;
  bool skipped = false;  // not run, because a step that it needs has failed
  std::vector<IdentifiedValue> values;
  std::vector<Diagnosis> remarks;  // found and cured, or worth a look: the step passes all the same
  std::optional<Diagnosis> failure;
};

// The step's verdict is "no".
class StepFailed : public std::runtime_error {
 public:
  explicit StepFailed(Diagnosis diagnosis)
      : std::runtime_error(diagnosis.cause + ": " + diagnosis.words), diagnosis_(std::move(diagnosis)) {}
  const Diagnosis& diagnosis() const { return diagnosis_; }

 private:
  Diagnosis diagnosis_;
};

// There is nothing that could be calibrated: the device has no motor that it knows of.
class NothingToCalibrate : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The user asked for the end.
class CalibrationInterrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kmax::calibration
