#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/board_interface/board_readings.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/drive/fault.hpp"
#include "firmware/drive/stability_guard.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::device {

/// "operation_enabled" for programs, "Operation enabled" for people: the standard's own names.
std::string_view name_of(firmware::DriveState state);
std::string_view to_string(firmware::DriveState state);
/// For people who do not know the standard: "armed, force is on".
std::string_view plain_words(firmware::DriveState state);

/// What an axis says about itself; read in one request, so it belongs together.
struct DriveStatus {
  std::uint16_t statusword = 0;
  std::uint16_t error_code = 0;
  firmware::Refusal refusal = firmware::Refusal::none;  ///< of the last attempt to arm
  float fault_value = 0, fault_bound = 0;
  /// Of a fault of the gate drivers, see drive.gate_driver_faults.
  std::optional<std::uint16_t> gate_driver_faults = std::nullopt;

  firmware::DriveState state() const { return firmware::statusword::state_of(statusword); }
  bool armed() const { return state() == firmware::DriveState::operation_enabled; }
  bool faulty() const {
    return state() == firmware::DriveState::fault || state() == firmware::DriveState::fault_reaction_active;
  }
  /// Nothing is wrong, but something is to be looked at: derating, or a stability check that fails.
  bool warning() const { return (statusword & firmware::statusword::warning) != 0; }
  /// One or two sentences: what happened, the number that tripped it and its bound, what to check.
  std::string fault_words() const;
};

/// "absent: its gate driver does not answer"
std::string presence_words(firmware::AxisPresence presence);
/// "phase B, low side: too much current", from the bits of drive.gate_driver_faults
std::string gate_driver_words(std::uint16_t faults);

/// Fault::none also for an error code that this program does not know.
inline firmware::Fault fault_of(const DriveStatus& status) {
  const firmware::FaultText* text =
      status.faulty() ? firmware::fault_by_error_code(status.error_code) : nullptr;
  return text != nullptr ? text->fault : firmware::Fault::none;
}

/// The CiA 402 drive of one axis: force only while it is armed ("operation enabled").
///
/// Each call writes controlwords and waits, at most a second, until the statusword shows the state.
/// Errors: DeviceError with the reason in words, device::LinkError.
class Drive {
 public:
  Drive(Device& device, std::size_t axis) : device_(device), axis_(axis) {}

  DriveStatus status();
  firmware::AxisPresence presence();

  /// What the device's stability check says of the present parameters (guard_words.hpp says it in words).
  firmware::GuardFinding guard();

  /// Shutdown, switch on, enable operation. If the device refuses, the axis is left disabled. Already armed:
  /// nothing happens. A lost link ends in an attempt to disable.
  void arm();

  /// Shutdown, then disable voltage: from every state without a fault to "switch on disabled". Sends
  /// before it asks, since nothing is more urgent.
  void disarm();

  /// Quick stop: the force is gone at once, and the axis cannot be armed before it was disarmed.
  void stop();

  /// Resets the fault. Returns false if there was none. DeviceError if its cause remains.
  bool clear();

  std::size_t axis() const { return axis_; }

 private:
  void command(std::uint16_t controlword, bool idempotent);
  /// The first status that `done` accepts, or the last one before the time-out.
  template <typename Predicate>
  DriveStatus wait_until(Predicate done);
  void advance(std::uint16_t controlword, firmware::DriveState wanted);
  void enable();
  /// Of a handle inside the wall.
  std::string way_out();

  Device& device_;
  std::size_t axis_;
};

}  // namespace kmax::device
