#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/bring_up/report.hpp"

namespace kmax::bring_up {

struct Settings {
  std::size_t axis = 0;
  std::optional<Stage> only;     ///< this one, again; without it all from the first that has not passed
  std::optional<double> supply;  ///< V, as the supply's own meter shows it
  bool has_button = true;        ///< an emergency stop that can be pressed; else a wire
  std::optional<double> brake;   ///< ohm between the terminals of AUX, by a meter, supply off; 0: none
  double patience = 30.0;        ///< s for a hand to do what it was asked for
  double stiffness = 2000.0;     ///< N/m, of the last stage's wall at most
};

/// Whoever is at the board, and who hears of it.
struct Party {
  bench::Prompter& person;                           ///< shown what to connect, asked to do it
  std::function<void(const std::string&)> progress;  ///< often; what it throws ends the stage
  std::function<void(const StageText&)> begins;      ///< a stage, after the person has agreed
  std::function<void(const StageResult&)> ended;     ///< a stage; its result is in the report
};

/// A stage was asked for before its turn.
class OutOfTurn : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Leads through the stages, one after the other, until one fails or all have passed. Before each the person
/// reads what to connect and what will be done, and agrees. `keep` gets the report after each.
///
/// A stage ends with the axis disarmed and every parameter as it was; what the calibration found is saved,
/// and the walls' stages leave the wall's place and stiffness that they ended with, unsaved.
///
/// True: all passed. Errors: OutOfTurn; base::DeviceError, device::LinkError, and what progress or the person
/// throw: the stage under way then has no result.
bool bring_up(device::Device& device, Report& report, const Settings& settings, const Party& party,
              const std::function<void(const Report&)>& keep);

/// The self-test of a handle that nobody holds, with everything put back. Once or twice more if the handle
/// has moved by itself: one that friction held beside a detent of the motor's cogging is shaken loose by the
/// pulses, and finds its place.
selftest::Evidence test_free_handle(device::Device& device, const Settings& settings, const Party& party);

/// The current amplifiers' offsets with the board's temperature beside them, as a cold board has them.
selftest::CheckResult check_cold_offsets(device::Device& device, std::size_t axis);
/// The same of a warm one; and how they drift, if `cold` has them from another temperature. Else that is not
/// judged.
selftest::CheckResult check_offsets(device::Device& device, std::size_t axis, const Report& cold);

// The stages, each of which looks at one thing more.
StageResult try_logic(device::Device& device, const Settings& settings, const Party& party);
StageResult try_gate_drivers(device::Device& device, const Settings& settings, const Party& party);
StageResult try_load(device::Device& device, const Settings& settings, const Party& party);
StageResult try_motor(device::Device& device, const Settings& settings, const Party& party);
StageResult try_calibration(device::Device& device, const Settings& settings, const Party& party);
StageResult try_wall(device::Device& device, const Settings& settings, const Party& party);
StageResult try_stiffer(device::Device& device, const Settings& settings, const Party& party);

}  // namespace kmax::bring_up
