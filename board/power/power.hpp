#pragma once

#include "board/power/drives.hpp"
#include "drivers/drv8301_registers.hpp"

namespace kmax::board {

/// What a board's hardware must have beside what its drives need (DriveHardware): the lines and chips of the
/// power stage. All calls come from the main loop.
template <typename Hardware>
concept MotorHardware = DriveHardware<Hardware> &&
    requires(Hardware& hardware, const Hardware& constant, std::size_t axis, bool level,
             drivers::CurrentSenseGain gain) {
  // As in PowerStageHardware.
  {hardware.set_gate_enable(level)};
  { constant.fault_line_low() } -> std::same_as<bool>;
  { constant.emergency_stop_open() } -> std::same_as<bool>;
  /// Writes and reads back one gate driver.
  { hardware.configure_gate_driver(axis, gain) } -> std::same_as<GateDriverAnswer>;
  /// In the bits of drive.gate_driver_faults.
  { hardware.read_gate_driver_faults(axis) } -> std::same_as<std::uint16_t>;
};

/// All that drives motors: the drives and the sequence of their power stage.
template <typename Hardware>
class Power {
 public:
  template <typename... Arguments>
  explicit Power(float supply_ratio, Arguments&&... hardware)
      : drives_(supply_ratio, std::forward<Arguments>(hardware)...) {
    static_assert(MotorHardware<Hardware>);
  }
  Power(const Power&) = delete;
  Power& operator=(const Power&) = delete;

  Drives<Hardware>& drives() { return drives_; }
  const Drives<Hardware>& drives() const { return drives_; }
  Hardware& hardware() { return drives_.hardware(); }
  const Hardware& hardware() const { return drives_.hardware(); }

  [[gnu::always_inline]] inline void ISR_tick(std::size_t axis, firmware::Application::Tick& axes) {
    drives_.ISR_tick(axis, axes, stage_);
  }
  /// The two parts of ISR_tick(), for a board in which all axes are sampled together.
  firmware::AxisInput ISR_measure(std::size_t axis) {
    if (!drives_.in_service(axis)) {
      drives_.ISR_begin_pass(axis);
      return {};
    }
    return drives_.ISR_measure(axis, stage_);
  }
  void ISR_drive(std::size_t axis, const firmware::AxisOutput& output, float supply_voltage) {
    if (!drives_.in_service(axis)) return drives_.ISR_end_pass(axis);
    drives_.ISR_drive(axis, output, supply_voltage, stage_);
  }

  /// The falling edge of the gate drivers' fault line, after it has been acknowledged. All bridges are off
  /// before anything is asked. Then the line is: an edge after which it is at rest for a microsecond was
  /// interference, and the bridges go on, as often as InterferenceBudget has it: beyond, and where the line
  /// does not come to rest within 3 us, it is a fault for good. An edge meanwhile calls again.
  void ISR_fault_line() { ISR_line(PowerStage<Lines>::Line::fault); }
  /// The same of the emergency stop's contact, which opens, and bounces.
  void ISR_emergency_stop() { ISR_line(PowerStage<Lines>::Line::emergency_stop); }

  bool ready() const { return stage_.ready(); }
  firmware::Fault condition() const { return stage_.condition(); }

  /// Main loop, with the ticks not yet running or no axis armed.
  void take_parameters(const firmware::Application& application) {
    taken_changes_ = application.parameter_changes();
    taken_ = true;
    std::array<bool, firmware::axis_count> absent = lines_.missing;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      absent[axis] = absent[axis] || application.values().template whole<"drive.declared_absent">(axis) != 0;
    drives_.apply(application.values(), absent);
  }
  /// Main loop: what the application has been given since the last poll() does not wait for the next one.
  bool has_to_take_over(const firmware::Application& application) const {
    return application.parameter_changes() != taken_changes_ || application.store_busy();
  }
  /// Main loop: for the application.
  firmware::BoardReadings readings() const {
    firmware::BoardReadings readings = drives_.readings();
    readings.gate_driver_missing = lines_.missing;
    readings.gate_driver_faults = lines_.faults;
    readings.interference_forgiven = interference_.forgiven();
    return readings;
  }

  /// Main loop, after the application's poll(), at least every few milliseconds: takes parameters over while
  /// nothing is armed, leads through the power-up sequence, and keeps the brake off while a save is under
  /// way, whose next step may stop the processor.
  void poll(const firmware::Application& application, std::uint32_t now_us) {
    const bool armed = application.any_armed();
    drives_.inhibit_brake(application.store_busy());
    // Nobody has taken frames while the stage was not ready.
    if (stage_.ready() && !was_ready_) drives_.serial_encoder().restart();
    was_ready_ = stage_.ready();
    if (!armed) {
      const auto in_service = drives_.in_service();
      if (!taken_ || application.parameter_changes() != taken_changes_ || lines_.found_missing)
        take_parameters(application);
      lines_.found_missing = false;
      if (drives_.in_service() != in_service) stage_.restart(now_us);
      if (stage_.ready() && lines_.configured_gain != drives_.gain()) stage_.restart(now_us);
    }
    stage_.poll(now_us, armed);
    interference_.poll(now_us);
  }

 private:
  /// What the stage's sequence sees of them (PowerStageHardware).
  struct Lines {
    void set_gate_enable(bool level) { drives.hardware().set_gate_enable(level); }
    bool fault_line_low() const { return drives.hardware().fault_line_low(); }
    bool emergency_stop_open() const { return drives.hardware().emergency_stop_open(); }
    bool in_service(std::size_t axis) const { return drives.in_service(axis) && !missing[axis]; }
    bool is_missing(std::size_t axis) const { return missing[axis]; }
    void set_missing(std::size_t axis) { missing[axis] = found_missing = true; }
    GateDriverAnswer configure_gate_driver(std::size_t axis) {
      configured_gain = drives.gain();
      return drives.hardware().configure_gate_driver(axis, configured_gain);
    }
    bool note_gate_driver_faults(std::size_t axis) {
      faults[axis] = drives.hardware().read_gate_driver_faults(axis);
      return (faults[axis] & static_cast<unsigned>(drivers::Drv8301Fault::fault)) != 0;
    }
    void restart_offset_calibration() { drives.restart_offset_calibration(); }
    OffsetProgress offset_progress() { return drives.offset_progress(); }
    bool track_offsets() { return drives.track_offsets(); }

    Drives<Hardware>& drives;
    drivers::CurrentSenseGain configured_gain = drivers::CurrentSenseGain::x80;
    std::array<bool, firmware::axis_count> missing{};
    std::array<std::uint16_t, firmware::axis_count> faults{};
    bool found_missing = false;  ///< and not yet taken over
  };
  static_assert(PowerStageHardware<Lines>);

  [[gnu::noinline]] void ISR_line(typename PowerStage<Lines>::Line line) {
    const auto armed = drives_.ISR_disarm();
    if (interference_.ISR_spent() || stage_.ISR_is_meant(line)) {
      stage_.ISR_take(line);
    } else {
      interference_.ISR_forgive();
      drives_.ISR_arm_again(armed);
    }
  }

  Drives<Hardware> drives_;
  Lines lines_{drives_};
  PowerStage<Lines> stage_{lines_};
  bool was_ready_ = false, taken_ = false;
  std::uint32_t taken_changes_ = 0;
  InterferenceBudget interference_;
};

}  // namespace kmax::board
