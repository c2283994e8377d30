#pragma once
// What can be started from the page besides arming: the procedures of `kmax selftest`, `kmax calibrate` and
// `kmax experiment contact`, by the library's same calls. The experiments that take hours are not here: they
// keep a journal in a folder, with which the command goes on where it was interrupted.

#include <functional>
#include <string>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/view/server/procedure_text.hpp"

namespace kmax::view {

struct ProcedureResult {
  bool pass = false;
  std::string words{};
  /// Parameters were changed, until the next restart unless they are saved.
  bool changed = false;
};

/// Who takes part. What they throw ends the procedure.
struct ProcedureParty {
  bench::Prompter& prompter;
  bool asks_before_touches = true;                     ///< a simulated person needs no asking
  std::function<void(const std::string&)> progress{};  ///< a few times a second
  std::function<void(const std::string&)> instruct{};  ///< what to do, without waiting for an answer
  std::function<void(const std::string&)> note{};      ///< what went wrong and was lived with
  std::function<void(const Finding&)> found{};         ///< as soon as it is known
};

/// Leaves the axis disarmed, and every parameter as it was unless the result says otherwise. Errors: those of
/// selftest::run_selftest(), calibration::calibrate() and experiment::DeviceRig.
ProcedureResult run_procedure(device::Device& device, const ProcedureSettings& settings,
                              const ProcedureParty& party);

}  // namespace kmax::view
