#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/axis.hpp"
#include "firmware/axis_state_machine.hpp"
#include "firmware/capture.hpp"
#include "firmware/commutation.hpp"
#include "firmware/crash_record.hpp"
#include "firmware/device_registers.hpp"
#include "firmware/handover.hpp"
#include "firmware/interrupt_queue.hpp"
#include "firmware/modbus/rtu_port.hpp"
#include "firmware/parameter_keeper.hpp"
#include "firmware/snapshot.hpp"
#include "firmware/thermal_supervisor.hpp"
#include "firmware/trace.hpp"

namespace kmax::firmware {

/// What a board tells the application about itself.
struct BoardIdentity {
  std::string_view board_name = "unnamed";
  std::uint32_t serial_number = 0;
  std::uint32_t core_clock_hz = 0;
  std::uint8_t clock_source = 0;  ///< as info.clock_source says
  ResetCause reset_cause = ResetCause::unknown;
  CrashRecord crash{};  ///< what is left of the run before
};

inline constexpr std::uint32_t firmware_version = 0x000100;  ///< 0.1.0
inline constexpr std::string_view firmware_version_text = "0.1.0";
inline constexpr std::uint32_t product_code = 1;

using AxisInput = Axis::Input;
using AxisOutput = Axis::Output;
struct TickInput {
  std::array<AxisInput, axis_count> axis;
};
struct TickOutput {
  std::array<AxisOutput, axis_count> axis;
};

struct SerialSettings {
  std::uint32_t baud_rate;
  friend constexpr bool operator==(const SerialSettings&, const SerialSettings&) = default;
};

/// What a board measures slowly and counts, for a host to read and for the main loop's trips.
struct BoardReadings {
  std::array<float, axis_count> power_stage_temperature{25.0f, 25.0f};  ///< degC
  float supply_voltage = 0.0f;                                          ///< V; 0: not measured
  std::uint32_t missed_ticks = 0;
  bool has_power_stage = false;     ///< false: forces are ideal, and nothing is commutated
  bool ticks_have_stopped = false;  ///< no tick for a while: nobody else could say so
};

/// The whole firmware, free of any chip. A board owns one, calls ISR_tick() for each axis at 20 kHz from the
/// interrupt that follows the axis' current sample, ISR_serial_byte() from its serial receive interrupt, and
/// everything else from its main loop.
///
/// The two axes' ticks never interrupt each other, and axis 0's comes first: it takes over new settings for
/// both and counts the ticks. Half a tick apart or one right after the other makes no difference.
///
/// Contexts. The tick is the highest; the serial interrupt may be preempted by it; the main loop by both.
/// What crosses: settings and enables main -> tick (Handover, atomics), reports and the trace tick -> main
/// (Snapshot, Trace), a capture's plan and its samples (Capture), bytes serial -> main (InterruptQueue).
/// Nothing else is shared.
///
/// Time: `now_us` is a microsecond clock that wraps at 2^32; poll() at least once a second, in practice
/// every tick. Errors: none of these calls can fail; what goes wrong becomes a fault of an axis, a refusal,
/// or a counter, all of which a host can read. Memory: about 27 KiB on the target, no heap.
class Application {
 public:
  /// `capture_memory`: for captures, up to capture_words; without it none can be taken. It outlives the
  /// application.
  explicit Application(const BoardIdentity& board, std::span<std::uint32_t> capture_memory = {});
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;

  /// The result is valid until the axis' next tick.
  const AxisOutput& ISR_tick(std::size_t axis, const AxisInput& input);
  /// Both axes, for a board that samples them at the same time.
  TickOutput ISR_tick(const TickInput& input) {
    return {{{ISR_tick(0, input.axis[0]), ISR_tick(1, input.axis[1])}}};
  }
  void ISR_serial_byte(std::uint8_t byte, bool line_error, std::uint32_t time_us);

  void poll(std::uint32_t now_us);
  /// Before poll(), as often as they change.
  void set_readings(const BoardReadings& readings) { readings_ = readings; }

  /// A reply that may be sent now, once; the bytes stay valid until serial_reply_sent().
  std::span<const std::uint8_t> serial_reply_due(std::uint32_t now_us) { return port_.reply_due(now_us); }
  /// The reply's last stop bit has left.
  void serial_reply_sent(std::uint32_t now_us) { port_.reply_sent(now_us); }
  /// What the line must be set to; changes only while no reply is under way.
  SerialSettings serial_settings() const { return {port_.config().baud_rate}; }

  /// Parameters a board or a scene starts with, before the first tick. Refused like a host's write, and
  /// then nothing changes.
  DeviceRegisters::WriteResult preset(std::size_t entry, std::size_t axis, std::uint32_t raw);

  /// Gives the application the memory it keeps parameters in, and takes the newest set in it over; before the
  /// first tick, once. Parameters that the set lacks keep their present values. Without it nothing can be
  /// saved. `flash` refers to a memory that outlives the application.
  const LoadReport& attach_store(AnyFlashSectors flash);

  const ParameterValues& values() const { return registers_.values(); }
  /// Rises with every change of a parameter.
  std::uint32_t parameter_changes() const { return registers_.changes(); }
  bool any_armed() const;
  /// A save is under way; its next step may stop the processor for half a second.
  bool store_busy() const { return keeper_.busy(); }
  DriveState state(std::size_t axis) const { return machines_[axis].state(); }
  Refusal refusal(std::size_t axis) const { return machines_[axis].refusal(); }
  Fault fault(std::size_t axis) const { return machines_[axis].fault(); }
  /// Of the last tick; for interrupt context, or where nothing interrupts.
  AxisReport ISR_report(std::size_t axis) const { return axes_[axis].ISR_report(); }

 private:
  /// The registers as the Modbus server sees them.
  class Bank {
   public:
    explicit Bank(Application& application) : app_(application) {}
    modbus::Exception read_holding(std::uint16_t address, std::span<std::uint16_t> out);
    modbus::Exception read_input(std::uint16_t address, std::span<std::uint16_t> out);
    modbus::Exception write_holding(std::uint16_t address, std::span<const std::uint16_t> in);
    bool has_holding(std::uint16_t address, std::uint16_t count) const;
    std::string_view identification(std::uint8_t object_id) const;

   private:
    Application& app_;
  };

  using Settings = std::array<AxisSetting, axis_count>;
  /// What an axis' settings depend on beside the parameters.
  struct Circumstances {
    float current_share = 1.0f;         ///< of current.limit that the temperatures leave
    float winding_temperature = 25.0f;  ///< degC, in steps
    bool commutated = true;             ///< the rotor's angle is known
    friend constexpr bool operator==(const Circumstances&, const Circumstances&) = default;
  };
  struct SerialByte {
    std::uint32_t time_us;
    std::uint8_t byte;
    bool line_error;
  };

  bool settled(std::size_t axis) const;
  Settings make_settings() const;
  void offer_settings_if_changed();
  void act();
  void supervise(std::size_t axis);
  Refusal obstacle_to_arming(std::size_t axis) const;
  void trip(std::size_t axis, Fault fault, float value, float bound);
  void refresh_readings();
  void refresh_store_readings();
  DeviceRegisters::WriteResult command_store(std::uint16_t command);
  DeviceRegisters::WriteResult command_capture(std::uint16_t command);
  void refresh_capture_readings();
  void take_reports();
  bool commutation_known(std::size_t axis) const;
  DriveMode mode(std::size_t axis) const { return registers_.values().choice<DriveMode, "drive.mode">(axis); }
  Circumstances circumstances_of(std::size_t axis) const;
  void configure_thermal();
  void poll_temperatures();
  float bound_of(Fault fault, std::size_t axis) const;
  void ISR_supervise_main_loop();
  void ISR_trace(const control::HapticLoop<float>::Output& traced);
  // Rare, and kept out of the tick's one function, whose registers it would take.
  [[gnu::noinline]] void ISR_capture(std::size_t axis, const AxisInput& input, const AxisOutput& output);

  BoardIdentity board_;
  DeviceRegisters registers_;
  Bank bank_;
  modbus::RtuPort<Bank> port_;
  std::array<AxisStateMachine, axis_count> machines_;
  std::array<bool, axis_count> command_pending_{};
  std::array<std::uint16_t, axis_count> pending_command_{};
  std::array<float, axis_count> fault_value_{}, fault_bound_{};
  std::array<TripRecord, axis_count> trip_record_{};
  /// When a fault was seen: power stage, winding.
  std::array<std::array<float, 2>, axis_count> fault_temperatures_{};
  std::array<ThermalSupervisor, axis_count> thermal_;
  std::array<Commutation, axis_count> commutation_;
  std::array<Circumstances, axis_count> offered_{};
  BoardReadings readings_;
  ParameterKeeper keeper_;
  // Before settings_, which is made from them.
  std::array<AxisReport, axis_count> report_;  ///< main loop's copies
  std::uint32_t offered_changes_ = 0, generation_ = 1, offered_restarts_ = 0;
  Settings settings_;
  std::uint32_t now_us_ = 0, uptime_second_us_ = 0, uptime_s_ = 0;
  bool started_ = false;

  Handover<Settings> handover_;
  std::array<Snapshot<AxisReport>, axis_count> snapshots_;
  InterruptQueue<SerialByte, 512> serial_queue_;
  Trace trace_;
  Capture capture_;
  std::array<std::atomic<bool>, axis_count> enable_{};
  std::atomic<std::uint32_t> polls_{0};  ///< by which the tick sees that the main loop runs
  /// Asked for by the main loop, taken back by the tick that publishes.
  std::array<std::atomic<bool>, axis_count> report_wanted_{};
  std::atomic<std::uint8_t> trace_axis_{0};
  std::atomic<std::uint32_t> trace_interval_{0};

  // Interrupt context only.
  std::array<Axis, axis_count> axes_;
  std::array<float, axis_count> tangential_{};
  std::uint32_t ISR_tick_ = 0;
  bool ISR_main_loop_stands_ = false;
  std::uint32_t ISR_polls_seen_ = 0, ISR_ticks_without_poll_ = 0;
  std::uint32_t ISR_trace_countdown_ = 0;
};

}  // namespace kmax::firmware
