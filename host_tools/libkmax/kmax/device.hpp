#pragma once

#include <kmax/command.hpp>
#include <kmax/errors.hpp>
#include <kmax/export.hpp>
#include <kmax/samples.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace kmax {

namespace library {
class OpenDevice;
}

/// A parameter's value.
struct Value {
  double number = 0;     ///< SI; of a choice its number
  std::string choice{};  ///< of a parameter with choices: "magnetic"; else empty
  std::string unit{};    ///< "N/m"; empty: a pure number
  bool whole = false;    ///< an integer
};

/// The state of an axis.
struct Status {
  std::string state{};  ///< CiA 402: "operation_enabled", "switch_on_disabled", "fault", ...
  bool armed = false;   ///< it makes force
  bool faulty = false;
  std::string words{};  ///< what is wrong; empty if nothing is
};

struct DeviceOptions {
  /// Called at least every 50 ms in the threads that wait for a device, without a lock of the library held.
  /// What it throws, a std::exception, ends the waiting; an armed axis is then disarmed.
  std::function<void()> poll{};
  /// Gets what the user should know while waiting, one line each; without it standard error does.
  std::function<void(const std::string&)> notice{};
};

struct ForceLoopOptions {
  std::size_t axis = 0;
  /// Hz; none: 1000 over CAN of 1 Mbit/s and less in proportion, over a serial line what that can carry.
  std::optional<double> rate{};
  std::optional<double> seconds{};  ///< of the loop's time; none: until the function ends it
  /// s that the function may take. After that the axis is disarmed by a thread of its own, which needs
  /// neither the function's thread nor a lock that it holds.
  double watchdog = 0.1;
  /// As many of the last cycles are in the record, 64 bytes each: of 17 minutes at 1000 Hz.
  std::size_t keep = 1'000'000;
};

/// A haptic device with its controller.
///
/// Calls are safe from any number of threads; they take turns. One force loop, recording or capture goes on
/// at a time, and a second one waits for it, or is a RefusedError in the first one's function; settings and
/// readings go on beside it. A device belongs to the process that opened it: a fork's child gets an Error.
/// Other programs can use the link in between, to stop it for instance: whenever this one has nothing to say,
/// and for a moment every 500 ms while it talks without a pause. Errors of all calls: LinkError,
/// RefusedError, ValueError, and Error for a closed device.
class KMAX_API Device {
 public:
  /// "usb[:SERIAL]", "can:IFACE[?node=1]", "can:/PATH/OF/A/BUS", "serial:PATH[?unit=1&baud=115200]", or
  /// "sim", a simulated device in this process, whose time passes in calls only. Empty: KMAX_DEVICE, which
  /// must then be set.
  explicit Device(const std::string& address = {}, DeviceOptions options = {});
  /// close(); errors go to the notice.
  ~Device();
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;

  /// Disarms what it armed and gives the link back. Again does nothing. Calls that other threads are in end
  /// with an Error, and are waited for; it is an Error in the function of one of the device's own calls.
  void close();
  bool is_open() const;
  std::string address() const;

  /// By name, as `kmax list` has them: "wall.stiffness", "axis1.wall.law".
  Value get(const std::string& name) { return get(std::vector<std::string>{name}).front(); }
  std::vector<Value> get(const std::vector<std::string>& names);
  /// A value is text as on the command line: "0.5 N/mm", "plain"; a number without a unit is SI. All of them
  /// are set in one tick or none.
  void set(const std::string& name, const std::string& value) { set({{name, value}}); }
  void set(const std::vector<std::pair<std::string, std::string>>& values);

  Status status(std::size_t axis = 0);
  /// Lets the axis make force. `keep_alive`: a thread says every now and then that this process lives;
  /// without it only calls do, and the device removes the force after link.timeout without one.
  void arm(std::size_t axis = 0, bool keep_alive = true);
  /// Takes it away, in every state. Returns what took it away before; empty if nothing did.
  std::string disarm(std::size_t axis = 0);
  /// Quick stop.
  void stop(std::size_t axis = 0);
  /// Resets a fault; false if there was none.
  bool clear(std::size_t axis = 0);
  /// Lets time pass. RefusedError if an axis that this program armed loses its force meanwhile.
  void wait(double seconds);

  /// Over CAN the device's PDOs, 1000 a second; over other links as fast as they go. `more` gets each block
  /// of samples as it comes, about ten a second; false ends the recording.
  Recording record(double seconds, std::size_t axis = 0,
                   const std::function<bool(const std::vector<Sample>&)>& more = {});
  /// Full-rate capture of up to four channels. `armed` is called when the device looks for the trigger.
  Capture capture(const CaptureRequest& request, const std::function<void()>& armed = {});

  /// The force at the handle, N along +x: given the sample of each cycle, or nothing to end the loop.
  using ForceFunction = std::function<std::optional<double>(const Sample&)>;
  /// Sets drive.mode to torque, arms, calls the function in each cycle in the calling thread, and disarms and
  /// puts drive.mode back however it ends. The device's own limits hold: force.limit, force.slew_limit,
  /// force.ramp_time, velocity.limit. If this process dies or hangs, link.timeout removes the force; a device
  /// where that is 0 is refused. Errors also: WatchdogError, and what the function throws.
  ForceRecord force_loop(const ForceLoopOptions& options, const ForceFunction& function);

  /// run_command() on this device: {"check", "--hand", "subject_1"}, {"experiment", "contact"}.
  CommandResult command(const std::vector<std::string>& arguments);

 private:
  std::unique_ptr<library::OpenDevice> open_;
};

/// An axis makes force while this exists.
class Armed {
 public:
  explicit Armed(Device& device, std::size_t axis = 0) : device_(device), axis_(axis) { device_.arm(axis_); }
  ~Armed() {
    try {
      device_.disarm(axis_);
    } catch (const std::exception&) {
      // link.timeout removes the force of an axis that nobody can reach.
    }
  }
  Armed(const Armed&) = delete;
  Armed& operator=(const Armed&) = delete;

 private:
  Device& device_;
  std::size_t axis_;
};

}  // namespace kmax
