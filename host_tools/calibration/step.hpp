#pragma once
// What the steps of the calibration share: what is known of the axis, how a verdict is given, and what a step
// is.

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "board/description.hpp"
#include "firmware/drive/motor_control.hpp"
#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/bench/bench.hpp"
#include "host_tools/calibration/estimate.hpp"
#include "host_tools/calibration/procedure.hpp"

namespace kmax::calibration {

using bench::Bench;
using bench::CapturePlan;
using bench::ExcitationPlan;
using bench::StillLimits;
using bench::Trip;
using bench::Waveforms;

// What is known of the axis: at first what its parameters say, later what the steps have found.
struct MotorKnowledge {
  firmware::MotorKind kind = firmware::MotorKind::dc;
  const board::BoardDescription* electronics = nullptr;
  double tick = firmware::tick_interval;  // s
  double supply = 0.0;                    // V
  double current_limit = 0.0;             // A
  double transmission = 0.0;              // m per rad of the shaft
  double counts_per_turn = 0.0;
  int direction = 1;  // encoder.direction
  int pole_pairs = 1;
  double resistance = 0.0;          // ohm
  double resistance_error = 0.0;    // standard error; 0: not measured in this run
  double inductance = 0.0;          // H, along d
  double inductance_q = 0.0;        // H
  double dead_time = 0.0;           // s
  double compensation_limit = 0.0;  // N, before the calibration
  double dead_time_error = 0.0;     // s; 0: not measured in this run
  double electrical_offset = 0.0;   // rad
  double torque_constant = 0.0;     // N m/A
  double mass = 0.0;                // kg
  double friction = 0.0;            // N
  bool mass_known = false;          // found in this run, or by a calibration before
  bool calibrated = false;          // motor.calibrated: what the parameters say was measured
  bool searches_index = false;      // counts are referred to an index
  bool commutation_found = false;   // in this run
  bool hand_checked = false;        // a hand has shown that encoder.direction is right

  // What the excitation uses.
  double current = 0.0;         // A
  double search_voltage = 0.0;  // V, of the square wave that drives about `current`; 0: not known yet

  bool brushed() const { return kind == firmware::MotorKind::dc; }
  double count_length() const { return 2.0 * std::numbers::pi * transmission / counts_per_turn; }  // m
  double force_per_ampere() const { return torque_constant / transmission; }
  // Current that dies within the dead time, A: below it the dead time takes less.
  double dead_time_band() const {
    return inductance > 0.0 ? std::max(supply * dead_time / inductance, 0.01) : 0.01;
  }
  // Largest voltage that the bridge can give: between two legs, or the amplitude of a vector. What the
  // current controllers leave for their dead time and for rounding is left here too. An axis beside this one
  // with a larger limit lowers the amplifiers' gain, which allows more.
  double largest_voltage() const {
    const auto gain =
        drivers::gain_for_current(firmware::over_current_factor * static_cast<float>(current_limit),
                                  static_cast<float>(electronics->shunt));
    const auto share = static_cast<double>(electronics->modulation_limit[static_cast<std::size_t>(gain)]);
    return 0.97 * share * supply * (brushed() ? 1.0 : 0.5773502691896258);
  }
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

// A calibration under way.
struct Calibration {
  Bench& bench;
  const CalibrationSettings& settings;
  bench::Prompter* prompter;  // null: nobody can be asked
  MotorKnowledge known{};
  StepReport report{};                        // of the step that runs
  std::vector<std::string> results_at_end{};  // NAME=VALUE

  // Results that would disturb the steps to come: set when all have passed. A value that the device could not
  // hold is this step's failure (base::ValueError), not that of the end.
  void set_at_end(const std::vector<std::string>& texts);
};

// One thing that is identified. run() excites, fits, checks; it adds its values to the report, what later
// steps need to the knowledge, and the parameters it found to the bench (Bench::set_result). It throws
// StepFailed if its verdict is "no"; every other exception but the bench's AxisTripped and ArmingRefused is a
// failure of the device or the link and ends the calibration.
struct Step {
  std::string_view name;
  StepSet set;
  // Names of steps whose failure makes this one meaningless; steps that are not in the chosen sets do not
  // count.
  std::vector<std::string_view> needs;
  bool (*applies)(const Calibration&);  // whether there is anything to do on this axis
  std::array<int, 2> usual_s;           // by MotorKind, as StepStarted says
  void (*run)(Calibration&);
};

// The current sensors with the bridge off: no current, little noise.
void check_current_sensors(Calibration& run);

// Resistance and inductance of the winding and the bridge's dead time, after a look whether all phases and
// both current sensors are there.
//
// The voltage begins at a tenth of a volt and rises by half until the wanted current flows, as a square wave
// of a millisecond: it has no mean, so the handle trembles but does not travel. A synchronous motor is then
// held by a bias current, which turns it by up to half an electrical turn.
void find_winding(Calibration& run);

// Somebody moves the handle towards the end that is to be positive, without force: the count must grow, else
// encoder.direction is turned. With this known, a motor that turns the other way has two phases swapped; and
// an encoder that stands still under the hand is dead, whatever the motor does.
void find_direction_by_hand(Calibration& run);

// A brushed motor's direction: short pushes with a voltage, to and fro, each longer than the one before,
// until the encoder counts. The current says by itself whether the motor turns: it falls below voltage /
// resistance by what the turning shaft induces. So a motor that turns under an encoder that does not is
// distinguished from one that stands.
void find_direction_by_pushes(Calibration& run);

// Moves a synchronous motor's handle over the allowed travel until the encoder's index has been passed:
// counts are then referred to it, and the electrical offset means the same after every start.
void search_index(Calibration& run);

// Direction, pole pairs and electrical offset of a synchronous motor, from sweeps of the stator's field to
// and fro.
void find_field_angle(Calibration& run);

// The torque constant, from the voltage that the shaking handle induces: what turns current into force turns
// speed into voltage. It needs no force gauge.
void find_torque_constant(Calibration& run);

// Mass, damping and Coulomb friction felt at the handle, from shaking it hard, and with some five times the
// friction slowly and fast: one speed cannot tell damping from friction.
void find_motion(Calibration& run);

// Cogging, gravity and Coulomb friction over the handle's travel, from slow sweeps in both directions, for
// the compensation in the haptic loop. Its bound is set to a share (0.7) of the friction found, below which
// it cannot move a handle at rest.
void map_compensation(Calibration& run);

// What follows from a motor that does or does not turn the way the encoder counts. Turned against it, either
// the encoder is reversed or two of the motor's wires are swapped. The first is corrected by
// encoder.direction, and if nobody has shown where positive is, so is the second. If a hand has shown it, it
// is the wires: throws StepFailed.
//
// Sets encoder.direction as a result, adds it to the report and keeps it in the knowledge.
void settle_direction(Calibration& run, bool agrees, const std::string& evidence);

// A value that was measured several times: the mean, and how far a single measurement scatters around it. A
// fit that is less sure of itself than the scatter says is believed.
IdentifiedValue repeated_value(std::string name, std::span<const Estimate> repetitions, std::string unit,
                               std::optional<double> previous);

// Throws StepFailed if the measurements scatter by more than 15 % of the value, the bound for all that is
// taken as a parameter, and by more than `fine` (in the value's unit), below which it does not matter.
void require_repeatable(const IdentifiedValue& value, double fine, const std::string& cause);

// What an axis that tripped by itself says about the device, where the step knows nothing better.
Diagnosis diagnosis_of(const Trip& trip);

// Throws StepFailed with that if the axis tripped meanwhile.
void require_no_trip(const Waveforms& seen);

// An axis that was not armed; `supply` and its bounds in V.
Diagnosis diagnosis_of(firmware::Refusal refusal, double supply, double supply_min, double supply_max);

// StepFailed for an encoder that stands although the motor turns, and for a motor that does not turn;
// `evidence` first.
[[noreturn]] void throw_encoder_dead(const std::string& evidence);
[[noreturn]] void throw_motor_blocked(const std::string& evidence);

}  // namespace kmax::calibration
