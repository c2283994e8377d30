// kmax state, arm, disarm, stop, clear.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <thread>

#include "firmware/drive/fault.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/disarm_failure.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/guard_words.hpp"
#include "host_tools/json/drive_json.hpp"
#include "host_tools/kmax/commands.hpp"

namespace kmax::cli {

using base::DeviceError;
using device::Device;
using device::Drive;
using device::DriveStatus;
using firmware::AxisPresence;
using firmware::DriveState;
using firmware::GuardFinding;
using firmware::Refusal;
using std::chrono::milliseconds;

namespace {
std::string status_line(std::size_t axis, const DriveStatus& status, const GuardFinding& guard) {
  std::string line = fmt::format("axis {}: {} ({})", axis, device::plain_words(status.state()),
                                 device::to_string(status.state()));
  if (status.state() == DriveState::quick_stop_active) line += "; 'kmax disarm' leaves this state";
  if (status.faulty()) line += fmt::format(": {}; then 'kmax clear --axis {}'", status.fault_words(), axis);
  const std::string check = device::guard_words(guard);
  if (!status.armed() && status.refusal == Refusal::guard_refused && !check.empty())
    return line + fmt::format("; the last attempt to arm was refused: stability check: {}", check);
  if (!status.armed() && status.refusal != Refusal::none)
    line += fmt::format("; the last attempt to arm was refused: {}", firmware::to_string(status.refusal));
  if (!check.empty()) line += fmt::format("; stability check: {}", check);
  return line;
}

std::string absence_line(Device& device, std::size_t axis, AxisPresence presence) {
  std::string line = fmt::format("axis {}: {}", axis, device::presence_words(presence));
  // The fault line is common: one that is left alone may hold up the others.
  const auto faults =
      static_cast<std::uint16_t>(device.read(device::Parameter::of<"drive.gate_driver_faults">(axis)));
  if (faults != 0) line += fmt::format("; its gate driver has said: {}", device::gate_driver_words(faults));
  return line;
}

int print_states(Context& context, Device& device, const std::vector<std::size_t>& axes) {
  Json list = Json::array();
  for (const std::size_t axis : axes) {
    Drive drive(device, axis);
    const AxisPresence presence = drive.presence();
    const DriveStatus status = drive.status();
    if (context.json) {
      list.push_back(json::status_json(axis, presence, status, drive.guard()));
    } else {
      const std::string words = presence == AxisPresence::present ? status_line(axis, status, drive.guard())
                                                                  : absence_line(device, axis, presence);
      context.say(words);
    }
  }
  if (context.json) context.print({{"axes", list}});
  return base::done;
}

int run_state(Context& context) {
  Device device = context.connect();
  return print_states(context, device, context.axes());
}

/// Carries `act` out on every axis even if one fails; the first failure is then the command's.
template <typename Act>
int run_on_axes(Context& context, Act act) {
  Device device = context.connect_to_change();
  std::exception_ptr first_error;
  for (const std::size_t axis : context.axes()) {
    try {
      act(Drive(device, axis));
    } catch (const std::exception& error) {
      if (first_error) context.note(error.what());
      if (!first_error) first_error = std::current_exception();
    }
  }
  if (first_error) std::rethrow_exception(first_error);
  return print_states(context, device, context.axes());
}

/// Whatever went wrong, the force must not outlast the program that asked for it.
void disarm_after_failure(Context& context, Drive& drive, double link_timeout) {
  try {
    drive.disarm();
    context.note("disarmed");
  } catch (const std::exception&) {
    context.note(device::words_for_disarm_failure(link_timeout));
  }
}

/// Keeps talking to the device until the user interrupts or the axis loses its force.
void hold(Context& context, Device& device, Drive& drive, double timeout,
          const base::Interruption& interruption) {
  const auto interval = timeout > 0
                            ? std::min(milliseconds(200), milliseconds(static_cast<int>(timeout * 250)))
                            : milliseconds(200);
  context.note("holding; Ctrl-C disarms");
  const auto start = device.link().now();
  const auto real_start = std::chrono::steady_clock::now();
  while (!interruption.requested()) {
    const DriveStatus status = drive.status();
    if (!status.armed()) {
      // Never re-armed: whoever took the force away had a reason.
      throw DeviceError(fmt::format("the force is off: {}", status_line(drive.axis(), status, {})));
    }
    device.link().wait(interval);
    // A simulated device's time may pass faster than the user's.
    std::this_thread::sleep_until(real_start + (device.link().now() - start));
  }
  drive.disarm();
  context.note("disarmed");
}

/// What is worth saying of an axis that makes force and is left alone.
void note_what_ends_the_force(Context& context, double link_timeout) {
  if (link_timeout > 0)
    context.note(fmt::format(
        "the force is removed, with a fault, after {} s (link.timeout) without a command; --hold keeps it "
        "alive",
        base::number_text(static_cast<float>(link_timeout))));
  if (link_timeout == 0)
    context.note("link.timeout is 0: the force stays on until it is disarmed, even if the host dies");
}

/// An axis that is armed although its check fails: guard.mode is warn.
void note_a_warning(Context& context, Drive& drive) {
  if (const std::string words = device::guard_words(drive.guard()); !words.empty())
    context.note(fmt::format("armed with a warning: stability check: {}", words));
}

struct ArmOptions {
  bool holding = false;

  void declare(CLI::App& command) {
    command.add_flag("--hold", holding,
                     "Keep the link alive until Ctrl-C, then disarm; ends with code 1 on a fault");
  }
};

int run_arm(Context& context, const ArmOptions& options) {
  const bool holding = options.holding;
  const base::Interruption interruption;
  Device device = context.connect_to_change();
  Drive drive(device, context.axis());
  const double timeout = device.read_number("link.timeout");
  drive.arm();
  try {
    if (!context.json) context.say(status_line(drive.axis(), drive.status(), {}));
    context.out.flush();
    note_a_warning(context, drive);
    if (!holding) note_what_ends_the_force(context, timeout);
    if (holding) hold(context, device, drive, timeout, interruption);
    const DriveStatus status = drive.status();
    // Ctrl-C while it was being armed was meant to end that.
    if (!holding && interruption.requested()) throw std::runtime_error("interrupted");
    if (context.json)
      context.print({{"axes", Json::array({json::status_json(drive.axis(), AxisPresence::present, status,
                                                             drive.guard())})}});
  } catch (const std::exception&) {
    disarm_after_failure(context, drive, timeout);
    throw;
  }
  return base::done;
}

int run_disarm(Context& context) {
  return run_on_axes(context, [](Drive drive) { drive.disarm(); });
}

int run_stop(Context& context) {
  return run_on_axes(context, [](Drive drive) { drive.stop(); });
}

int run_clear(Context& context) {
  Device device = context.connect_to_change();
  Drive drive(device, context.axis());
  if (!drive.clear()) context.note(fmt::format("axis {} has no fault", drive.axis()));
  return print_states(context, device, {drive.axis()});
}
}  // namespace

void add_drive_commands(CLI::App& app, Context& context) {
  add_command(
      app, context,
      {"state",
       "Shows whether each axis is armed, and its fault in words; in brackets the state's name in CiA 402.",
       "  kmax state\n  kmax state --axis 1 --json"},
      Takes::device_and_axis, run_state);

  add_command<ArmOptions>(
      app, context,
      {"arm", "Arms an axis: from then on it makes force.",
       "  kmax arm --hold           until Ctrl-C\n  kmax arm --axis 1\n\n"
       "The device removes the force, with a fault, when the host has been silent for link.timeout.\n"
       "Refused while the handle is inside the wall, while a fault is present, and, with guard.mode=refuse,\n"
       "when the stability check fails ('kmax check' explains it)."},
      Takes::device_and_axis, run_arm);

  add_command(app, context,
              {"disarm", "Disarms: takes the force away in order, on every axis unless --axis names one.",
               "  kmax disarm\n  kmax disarm --axis 1"},
              Takes::device_and_axis, run_disarm);

  add_command(app, context,
              {"stop", "Stops: the force is gone at once, on every axis unless --axis names one.",
               "  kmax stop                 then 'kmax disarm' before arming again"},
              Takes::device_and_axis, run_stop);

  add_command(app, context,
              {"clear", "Resets an axis' fault; says what remains if its cause does.",
               "  kmax clear\n  kmax clear --axis 1"},
              Takes::device_and_axis, run_clear);
}

}  // namespace kmax::cli
