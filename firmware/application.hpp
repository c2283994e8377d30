#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/can_frame.hpp"
#include "firmware/application_objects.hpp"
#include "firmware/can_port.hpp"
#include "firmware/canopen/node.hpp"
#include "firmware/capture_commands.hpp"
#include "firmware/crash_record.hpp"
#include "firmware/drive/axes_tick.hpp"
#include "firmware/drive/emergency_reports.hpp"
#include "firmware/drive/supervisor.hpp"
#include "firmware/interrupt_queue.hpp"
#include "firmware/modbus/rtu_port.hpp"
#include "firmware/parameters/parameter_access.hpp"
#include "firmware/parameters/store_commands.hpp"
#include "firmware/stability_guard.hpp"

namespace kmax::firmware {

/// What a board tells the application about itself.
struct BoardIdentity {
  std::string_view board_name = "unnamed";
  std::uint32_t serial_number = 0;
  std::uint32_t core_clock_hz = 0;
  std::uint8_t clock_source = 0;  ///< as info.clock_source says
  ResetCause reset_cause = ResetCause::unknown;
  CrashRecord crash{};  ///< what is left of the run before
  /// Of the supply, that the current controllers may use: what the board's bridge can give.
  float modulation_limit = MotorControlConfig{}.modulation_limit;
};

inline constexpr std::uint32_t firmware_version = 0x000100;  ///< 0.1.0
inline constexpr std::string_view firmware_version_text = "0.1.0";
inline constexpr std::uint32_t vendor_id = 0;  ///< none assigned by CiA
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
  std::array<float, axis_count> power_stage_temperature = [] {
    std::array<float, axis_count> at_room_temperature{};
    at_room_temperature.fill(25.0f);
    return at_room_temperature;
  }();                          ///< degC
  float supply_voltage = 0.0f;  ///< V; 0: not measured
  std::uint32_t missed_ticks = 0;
  bool has_power_stage = false;     ///< false: forces are ideal, and nothing is commutated
  bool ticks_have_stopped = false;  ///< no tick for a while: nobody else could say so
};

/// The whole firmware, free of any chip. A board owns one, calls ISR_tick() for each axis at 20 kHz from the
/// interrupt that follows the axis' current sample, ISR_serial_byte() from its serial receive interrupt, and
/// everything else from its main loop.
///
/// The axes' ticks never interrupt each other, and axis 0's comes first: it takes over new settings for
/// all and counts the ticks. Half a tick apart or one right after the other makes no difference.
///
/// Contexts. The tick is the highest; the serial interrupt may be preempted by it; the main loop by both.
/// What crosses: settings, enables and forces from the main loop to the tick (DoubleBuffer, atomics), reports
/// and the trace back (Seqlock, Trace), a capture's plan and its samples (Capture), serial bytes and CAN
/// frames to the main loop (InterruptQueue). Nothing else is shared.
///
/// Two hosts, one device. Serial and CAN reach the same parameters and the same state machines; see
/// ParameterAccess for whose settings are taken and Supervisor for who commands an axis.
///
/// Time: `now_us` is a microsecond clock that wraps at 2^32; poll() at least once a second, in practice
/// every tick. Errors: none of these calls can fail; what goes wrong becomes a fault of an axis, a refusal,
/// or a counter, all of which a host can read. Memory: about 36 KiB on the target, no heap.
class Application {
 public:
  /// The main loop's rhythm.
  static constexpr std::uint32_t round_ticks = AxesTick<axis_count>::round_ticks;
  static constexpr bool needs_all_positions = AxesTick<axis_count>::needs_all_positions;
  static constexpr std::uint32_t round_interval_us = round_ticks * 1'000'000 / tick_rate_hz;

  /// `capture_memory`: for captures, up to capture_words; without it none can be taken. It outlives the
  /// application.
  [[gnu::cold]] explicit Application(const BoardIdentity& board,
                                     std::span<std::uint32_t> capture_memory = {});
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;

  /// The result is valid until the axis' next tick.
  const AxisOutput& ISR_tick(std::size_t axis, const AxisInput& input);
  /// All axes, for a board that samples them at the same time.
  TickOutput ISR_tick(const TickInput& input) {
    TickOutput output;
    for (std::size_t axis = 0; axis < axis_count; ++axis)
      output.axis[axis] = ISR_tick(axis, input.axis[axis]);
    return output;
  }
  /// Between two ticks: the last one began a round, in which all axes report. Behind the last axis' tick the
  /// main loop should be woken: what it reads then is of this tick.
  bool ISR_round_begins() const { return tick_.ISR_round_begins(); }
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

  /// A data frame with an 11-bit identifier; the CAN receive interrupt, which the tick may preempt.
  void ISR_can_frame(const drivers::CanFrame& frame) { can_queue_.ISR_push(frame); }
  /// Before poll(), as often as they change.
  void set_can(const CanReadings& readings) { can_ = readings; }
  /// The next frame to send; called while there is room for it, after poll(). A frame that is taken counts as
  /// sent.
  bool next_can_frame(drivers::CanFrame& frame);
  /// What the controller must be set to; a bit rate changes only when the communication is reset.
  CanSettings can_settings() const { return node_.settings(); }
  /// A host has asked for a restart (NMT reset node), and no axis is driven any more.
  bool restart_wanted() const { return restart_wanted_; }

  /// Parameters a board or a scene starts with, before the first tick. Refused like a host's write, and
  /// then nothing changes.
  ParameterAccess::Result preset(std::size_t entry, std::size_t axis, std::uint32_t raw);

  /// Gives the application the memory it keeps parameters in, and takes the newest set in it over; before the
  /// first tick, once. Parameters that the set lacks keep their present values. Without it nothing can be
  /// saved. `flash` refers to a memory that outlives the application.
  const LoadReport& attach_store(AnyFlashSectors flash);

  /// What a host wrote by this link: parameters, or one command to the store or the capture.
  ParameterAccess::Result write(std::span<const SlotValue> wanted, Link by);
  /// Brings all readings among values() up to date: to the reports that the present poll began with, so that
  /// all are of one moment.
  void refresh_readings();
  /// Only those of the axis, or of the device, that this slot belongs to.
  void refresh_reading(std::size_t slot);
  const ParameterValues& values() const { return parameters_.values(); }
  /// Rises with every change of a parameter.
  std::uint32_t parameter_changes() const { return parameters_.changes(); }
  /// Of the present poll().
  std::uint32_t now_us() const { return now_us_; }
  ArmedAxes armed_axes() const;
  bool any_armed() const { return armed_axes().any(); }
  /// A save is under way; its next step may stop the processor for half a second.
  bool store_busy() const { return store_.keeper().busy(); }
  DriveState state(std::size_t axis) const { return supervisors_[axis].machine().state(); }
  Refusal refusal(std::size_t axis) const { return supervisors_[axis].machine().refusal(); }
  Fault fault(std::size_t axis) const { return supervisors_[axis].machine().fault(); }
  /// Of the last tick; for interrupt context, or where nothing interrupts.
  AxisReport ISR_report(std::size_t axis) const { return tick_.ISR_report(axis); }
  /// Likewise, N, outwards: what a simulated person answers to.
  float ISR_background_force(std::size_t axis) const { return tick_.ISR_background_force(axis); }

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

  using Settings = AxesTick<axis_count>::Settings;
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
  // Rare: small code rather than fast code.
  [[gnu::cold]] Settings make_settings() const;
  [[gnu::cold]] void offer_settings_if_changed();
  void judge_if_changed();
  [[gnu::cold]] void make_scales();
  void act();
  Supervisor::Situation situation(std::size_t axis);
  void refresh_axis_readings(std::size_t axis);
  void refresh_device_readings();
  std::uint32_t flags_of(std::size_t axis) const;
  bool saturated(std::size_t axis) const;
  void refresh_crash_readings();
  void take_reports();
  bool round_has_begun();
  bool commutation_known(std::size_t axis) const;
  DriveMode mode(std::size_t axis) const {
    return parameters_.values().choice<DriveMode, "drive.mode">(axis);
  }
  Circumstances circumstances_of(std::size_t axis) const;
  void configure_thermal();
  [[gnu::cold]] void poll_temperatures();
  void start_communication(bool power_on);
  void poll_can();
  void act_on(const canopen::NodeEvents& events);
  void report_emergencies();
  void refresh_can_readings();
  void publish_torques();
  bool commands_anothers_axis(const SlotValue& one, Link by) const;
  void note_commander(std::span<const SlotValue> written, Link by);
  void disarm(std::size_t axis);
  bool save_identity();
  void finish_saves();
  std::optional<std::uint32_t> last_heard_us(std::size_t axis) const;

  BoardIdentity board_;
  ParameterAccess parameters_;
  Bank bank_;
  modbus::RtuPort<Bank> port_;
  std::array<Supervisor, axis_count> supervisors_;
  std::array<ThermalSupervisor, axis_count> thermal_;
  std::array<Commutation, axis_count> commutation_;
  std::array<Circumstances, axis_count> offered_{};
  BoardReadings readings_;
  CanReadings can_;
  EmergencyReports emergencies_;
  bool was_bus_off_ = false;
  bool identity_saving_ = false;
  std::uint32_t configured_communication_ = 0;
  /// Of the settings in force; to work it out takes a division in double.
  struct Scale {
    double count_length = 0.0;  ///< m
    float resolution = 0.0f;    ///< m
  };
  std::array<Scale, axis_count> scale_{};
  bool restart_wanted_ = false, restarting_ = false;
  StoreCommands store_{parameters_};
  // Before settings_, which is made from them.
  std::array<AxisReport, axis_count> report_;  ///< main loop's copies
  std::array<GuardFinding, axis_count> guard_{};
  std::uint32_t judged_changes_ = 0;
  std::uint32_t offered_changes_ = 0, generation_ = 1, offered_restarts_ = 0;
  Settings settings_;
  std::uint32_t now_us_ = 0, uptime_second_us_ = 0, uptime_s_ = 0;
  std::uint32_t round_ = 0, round_us_ = 0, round_clock_us_ = 0;
  bool started_ = false;

  InterruptQueue<SerialByte, 512> serial_queue_;
  InterruptQueue<drivers::CanFrame, 64> can_queue_;
  ApplicationObjects objects_;
  canopen::Node<ApplicationObjects> node_;
  AxesTick<axis_count> tick_;
};

}  // namespace kmax::firmware
