#pragma once
// What can be started from the page besides arming: the procedures of `kmax selftest`, `kmax calibrate` and
// `kmax experiment contact`, by the library's same calls. The experiments that take hours are not here: they
// keep a journal in a folder, with which the command goes on where it was interrupted.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::view {

/// For whoever is about to start it.
struct ProcedureText {
  std::string_view name;    ///< in messages
  std::string_view title;   ///< for people
  std::string_view before;  ///< that it arms the axis, what it does with the handle, what it needs
  std::string_view hand;    ///< what the person's hand adds; empty: there is no choice
  std::size_t trials;       ///< touches of each wall unless others are asked for; 0: it has none
};
std::span<const ProcedureText> procedure_texts();
/// Throws device::ValueError with the names that are allowed.
const ProcedureText& procedure_named(std::string_view name);

struct ProcedureSettings {
  std::string name{};  ///< in procedure_texts()
  std::size_t axis = 0;
  bool hand = false;  ///< the person takes part: `--hand` of the commands
  std::size_t trials = 3;
};

/// A check, a step, a wall.
struct Finding {
  std::string name{}, verdict{};  ///< "pass", "fail" or "not judged"
  std::string words{};            ///< what was found and, if need be, what to do
};

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
