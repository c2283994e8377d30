#include "host_tools/device/drive.hpp"

#include <fmt/format.h>

#include <bit>
#include <utility>

#include "drivers/drv8301_registers.hpp"
#include "firmware/drive/fault.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/guard_words.hpp"

namespace kmax::device {

using firmware::DriveState;
using firmware::Refusal;
using std::chrono::milliseconds;

namespace {
// The controlwords of CiA 402's transitions.
namespace word {
using namespace firmware::controlword;
constexpr std::uint16_t disable_voltage = 0;
constexpr std::uint16_t quick_stop_now = enable_voltage;
constexpr std::uint16_t shutdown = enable_voltage | quick_stop;
constexpr std::uint16_t switch_on_now = shutdown | switch_on;
constexpr std::uint16_t enable_now = switch_on_now | enable_operation;
}  // namespace word

constexpr milliseconds transition_patience{1000};
constexpr milliseconds transition_poll_interval{10};
// The device keeps the last refusal until the next attempt has been judged, which takes it at most one
// haptic sample. A refusal that is shown for longer after the attempt is the attempt's own.
constexpr milliseconds judgement{50};

struct StateText {
  std::string_view name, text, words;
};
StateText text_of(DriveState state) {
  switch (state) {
    case DriveState::not_ready_to_switch_on:
      return {"not_ready_to_switch_on", "Not ready to switch on", "starting"};
    case DriveState::switch_on_disabled:
      return {"switch_on_disabled", "Switch on disabled", "disarmed"};
    case DriveState::ready_to_switch_on:
      return {"ready_to_switch_on", "Ready to switch on", "disarmed, being armed"};
    case DriveState::switched_on:
      return {"switched_on", "Switched on", "disarmed, being armed"};
    case DriveState::operation_enabled:
      return {"operation_enabled", "Operation enabled", "armed, force is on"};
    case DriveState::quick_stop_active:
      return {"quick_stop_active", "Quick stop active", "stopped"};
    case DriveState::fault_reaction_active:
      return {"fault_reaction_active", "Fault reaction active", "fault, its force is being removed"};
    case DriveState::fault:
      return {"fault", "Fault", "fault"};
  }
  return {"unknown", "Unknown", "in an unknown state"};
}
}  // namespace

std::string_view name_of(DriveState state) {
  return text_of(state).name;
}

std::string_view to_string(DriveState state) {
  return text_of(state).text;
}

std::string_view plain_words(DriveState state) {
  return text_of(state).words;
}

std::string DriveStatus::fault_words() const {
  const firmware::FaultText* text = firmware::fault_by_error_code(error_code);
  if (text == nullptr)
    return fmt::format("error code 0x{:04X}, which this program does not know", error_code);
  std::string words(text->what);
  if (!text->unit.empty())
    words += fmt::format(" ({} {}, bound {} {})", base::number_text(fault_value), text->unit,
                         base::number_text(fault_bound), text->unit);
  if (gate_driver_faults)
    words += fmt::format("; this axis' driver says: {}", gate_driver_words(*gate_driver_faults));
  if (!text->check.empty()) words += fmt::format("; {}", text->check);
  return words;
}

std::string presence_words(firmware::AxisPresence presence) {
  switch (presence) {
    case firmware::AxisPresence::present:
      return "present";
    case firmware::AxisPresence::no_answer:
      return "absent: its gate driver does not answer";
    case firmware::AxisPresence::declared_absent:
      return "absent: drive.declared_absent is yes";
  }
  return "unknown";
}

std::string gate_driver_words(std::uint16_t faults) {
  // Drv8301Fault::fault says only that there is one.
  using enum drivers::Drv8301Fault;
  constexpr std::pair<drivers::Drv8301Fault, std::string_view> texts[] = {
      {over_current_c_low, "phase C, low side: too much current"},
      {over_current_c_high, "phase C, high side: too much current"},
      {over_current_b_low, "phase B, low side: too much current"},
      {over_current_b_high, "phase B, high side: too much current"},
      {over_current_a_low, "phase A, low side: too much current"},
      {over_current_a_high, "phase A, high side: too much current"},
      {over_temperature_warning, "over-temperature warning"},
      {over_temperature, "over-temperature shut-down"},
      {supply_under_voltage, "the motor supply is too low for it"},
      {gate_supply_under_voltage, "its gate supply is too low"},
      {gate_supply_over_voltage, "its gate supply is too high"},
      {no_answer, "it does not answer"}};
  std::string words;
  for (const auto& [bit, text] : texts) {
    if ((faults & static_cast<unsigned>(bit)) != 0)
      words += fmt::format("{}{}", words.empty() ? "" : "; ", text);
  }
  if (!words.empty()) return words;
  return faults != 0 ? "a fault, and no cause" : "nothing, so it was another axis' driver or interference";
}

DriveStatus Drive::status() {
  const Parameter asked[] = {Parameter::of<"drive.statusword">(axis_),
                             Parameter::of<"drive.error_code">(axis_), Parameter::of<"drive.refusal">(axis_),
                             Parameter::of<"drive.fault_value">(axis_),
                             Parameter::of<"drive.fault_bound">(axis_)};
  const auto raw = device_.read(asked);
  DriveStatus status{static_cast<std::uint16_t>(raw[0]), static_cast<std::uint16_t>(raw[1]),
                     static_cast<Refusal>(raw[2]), std::bit_cast<float>(raw[3]),
                     std::bit_cast<float>(raw[4])};
  if (fault_of(status) == firmware::Fault::gate_driver)
    status.gate_driver_faults =
        static_cast<std::uint16_t>(device_.read(Parameter::of<"drive.gate_driver_faults">(axis_)));
  return status;
}

firmware::AxisPresence Drive::presence() {
  return static_cast<firmware::AxisPresence>(device_.read(Parameter::of<"drive.presence">(axis_)));
}

firmware::GuardFinding Drive::guard() {
  const Parameter asked[] = {Parameter::of<"guard.verdict">(axis_), Parameter::of<"guard.failed">(axis_),
                             Parameter::of<"guard.criterion">(axis_), Parameter::of<"guard.value">(axis_),
                             Parameter::of<"guard.bound">(axis_)};
  const auto raw = device_.read(asked);
  return {.verdict = static_cast<firmware::GuardFinding::Verdict>(raw[0]),
          .criterion = static_cast<control::Criterion>(raw[2]),
          .failed = static_cast<std::uint16_t>(raw[1]),
          .value = std::bit_cast<float>(raw[3]),
          .bound = std::bit_cast<float>(raw[4])};
}

void Drive::command(std::uint16_t controlword, bool idempotent) {
  try {
    device_.write(Parameter::of<"drive.controlword">(axis_), controlword, idempotent);
  } catch (const device::RefusedError& error) {
    throw base::DeviceError(fmt::format("axis {}: controlword {}: {}", axis_, controlword,
                                        refusal_words(device_.last_refusal().reason, error)));
  }
}

template <typename Predicate>
DriveStatus Drive::wait_until(Predicate done) {
  const auto start = device_.link().now();
  for (;;) {
    // The last look is asked for after the time is over: if this program stands still meanwhile, the device
    // has had all of it.
    const auto asked = device_.link().now();
    const DriveStatus seen = status();
    if (done(seen) || asked - start > transition_patience) return seen;
    device_.link().wait(transition_poll_interval);
  }
}

void Drive::advance(std::uint16_t controlword, DriveState wanted) {
  command(controlword, true);
  const auto seen = wait_until([wanted](const DriveStatus& s) { return s.state() == wanted || s.faulty(); });
  if (seen.faulty()) throw base::DeviceError(fmt::format("axis {}: {}", axis_, seen.fault_words()));
  if (seen.state() != wanted)
    throw base::DeviceError(
        fmt::format("axis {}: stays in '{}' instead of going to '{}'; look at 'kmax state'", axis_,
                    to_string(seen.state()), to_string(wanted)));
}

std::string Drive::way_out() {
  const Parameter asked[] = {Parameter::of<"measured.position">(axis_), Parameter::of<"wall.position">(axis_),
                             Parameter::of<"wall.side">(axis_)};
  const auto raw = device_.read(asked);
  const double position = 1e3 * static_cast<double>(std::bit_cast<float>(raw[0]));
  const double surface = 1e3 * static_cast<double>(std::bit_cast<float>(raw[1]));
  const bool free_above = static_cast<std::int32_t>(raw[2]) > 0;
  const double depth = free_above ? surface - position : position - surface;
  if (!(depth >= 0.0)) return {};  // it has been moved meanwhile
  return fmt::format(
      ": it is at {:.2f} mm, the wall begins at {:.2f} mm, so by more than {:.2f} mm towards {} positions; "
      "or put the wall behind it: 'kmax set {}wall.position=here{}1mm'",
      position, surface, depth, free_above ? "larger" : "smaller",
      axis_ == 0 ? "" : fmt::format("axis{}.", axis_), free_above ? '-' : '+');
}

void Drive::enable() {
  const auto start = device_.link().now();
  // Not repeated when its answer is lost: an axis is never armed by a second try the user did not make.
  command(word::enable_now, false);
  auto asked = start;  // or later: the look before
  const auto seen = wait_until([&](const DriveStatus& s) {
    const bool judged = asked - start > judgement;
    asked = device_.link().now();
    return s.armed() || s.faulty() || (judged && s.refusal != Refusal::none);
  });
  if (seen.armed()) return;
  if (seen.faulty()) throw base::DeviceError(fmt::format("axis {}: {}", axis_, seen.fault_words()));
  if (seen.refusal == Refusal::guard_refused) {
    // Empty if somebody has mended it meanwhile.
    if (const std::string words = guard_words(guard()); !words.empty())
      throw base::DeviceError(
          fmt::format("axis {} was not armed: refused: stability check: {}", axis_, words));
  }
  if (seen.refusal != Refusal::none)
    throw base::DeviceError(
        fmt::format("axis {} was not armed: {}{}", axis_, firmware::to_string(seen.refusal),
                    seen.refusal == Refusal::handle_inside_wall ? way_out() : std::string()));
  throw base::DeviceError(
      fmt::format("axis {} was not armed: it stays in '{}' and gives no reason; look at 'kmax state'", axis_,
                  to_string(seen.state())));
}

void Drive::arm() {
  const DriveStatus before = status();
  if (before.armed()) return;
  if (before.faulty())
    throw base::DeviceError(fmt::format("axis {} cannot be armed, it has a fault: {}; then 'kmax clear'",
                                        axis_, before.fault_words()));
  try {
    advance(word::disable_voltage, DriveState::switch_on_disabled);
    advance(word::shutdown, DriveState::ready_to_switch_on);
    advance(word::switch_on_now, DriveState::switched_on);
    enable();
  } catch (const std::exception&) {
    try {
      command(word::disable_voltage, true);
    } catch (const std::exception&) {
      // The first error is the one to tell; link.timeout removes the force of an axis nobody talks to.
    }
    throw;
  }
}

void Drive::disarm() {
  command(word::shutdown, true);
  command(word::disable_voltage, true);
  const auto seen = wait_until([](const DriveStatus& s) {
    return s.state() == DriveState::switch_on_disabled || s.state() == DriveState::fault;
  });
  if (seen.state() == DriveState::switch_on_disabled || seen.state() == DriveState::fault) return;
  throw base::DeviceError(fmt::format("axis {} is not disarmed: it stays in '{}'; cut its power", axis_,
                                      to_string(seen.state())));
}

void Drive::stop() {
  command(word::quick_stop_now, true);
  const auto stopped = [](const DriveStatus& s) {
    return s.state() == DriveState::quick_stop_active || s.state() == DriveState::switch_on_disabled ||
           s.state() == DriveState::fault;
  };
  const auto seen = wait_until(stopped);
  if (!stopped(seen))
    throw base::DeviceError(fmt::format("axis {} is not stopped: it stays in '{}'; cut its power", axis_,
                                        to_string(seen.state())));
}

bool Drive::clear() {
  // A reaction that is still running ends in "fault", from where alone there is a reset.
  const DriveStatus before =
      wait_until([](const DriveStatus& s) { return s.state() != DriveState::fault_reaction_active; });
  if (!before.faulty()) return false;
  // The reset is an edge: the bit must have been seen low, and must not stay high.
  command(word::disable_voltage, true);
  command(word::fault_reset, true);
  const auto seen = wait_until([](const DriveStatus& s) { return !s.faulty(); });
  command(word::disable_voltage, true);
  if (!seen.faulty()) return true;
  throw base::DeviceError(fmt::format("axis {}: the fault remains: {}", axis_, seen.fault_words()));
}

}  // namespace kmax::device
