#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/periodic_timer.hpp"
#include "firmware/board_interface/board_identity.hpp"
#include "firmware/board_interface/board_readings.hpp"
#include "firmware/command/axes.hpp"
#include "firmware/command/fault_log.hpp"
#include "firmware/command/host_writes.hpp"
#include "firmware/command/parameter_access.hpp"
#include "firmware/command/store_commands.hpp"
#include "firmware/command/write_lock.hpp"
#include "firmware/drive/link_states.hpp"
#include "firmware/links/canopen_edge.hpp"
#include "firmware/links/modbus_edge.hpp"
#include "firmware/links/readings.hpp"
#include "firmware/links/usb_modbus_edge.hpp"

namespace kmax::firmware {

using AxisInput = Axis::Input;
using AxisOutput = Axis::Output;
struct TickInput {
  std::array<AxisInput, axis_count> axis;
};
struct TickOutput {
  std::array<AxisOutput, axis_count> axis;
};

/// The whole firmware, free of any chip: its parts, put together, and the order in which the main loop runs
/// them.
///
///   serial() ModbusEdge  --+                       +--> axes() Axes: supervisors, AxesTick
///                          +--> HostWrites --------+--> ParameterAccess
///   can()    CanopenEdge --+--> Readings           +--> StoreCommands, WriteLock
///   usb()  UsbModbusEdge --+
///
/// A board owns one, calls ISR_tick() for each axis at 20 kHz from the interrupt that follows the axis'
/// current sample, serial().ISR_byte(), can().ISR_frame() and usb().ISR_packet() from its receive interrupts,
/// and everything else from its main loop.
///
/// Contexts. The tick is the highest; the receive interrupts may be preempted by it; the main loop by both.
/// What crosses: settings, enables and forces from the main loop to the tick (DoubleBuffer, atomics), reports
/// and the trace back (Seqlock, Trace), a capture's plan and its samples (Capture), serial bytes, CAN frames
/// and USB packets to the main loop (InterruptQueue). Nothing else is shared.
///
/// Several hosts, one device. Serial, CAN and USB reach the same parameters and the same state machines; see
/// ParameterAccess for whose settings are taken and Supervisor for who commands an axis.
///
/// Time: `now_us` is a microsecond clock that wraps at 2^32; poll() at least once a second, in practice
/// every tick. Errors: none of these calls can fail; what goes wrong becomes a fault of an axis, a refusal,
/// or a counter, all of which a host can read. Memory: about 42 KiB on the target, no heap.
class Application {
 public:
  using Tick = AxesTick<axis_count>;
  static constexpr bool needs_all_positions = Tick::needs_all_positions;

  /// `capture_memory`: for captures, up to capture_words; without it none can be taken. `log_memory`: for the
  /// fault log, untouched since power-on but by the application before this one; without it none is kept.
  /// Both outlive the application.
  [[gnu::cold]] explicit Application(const BoardIdentity& board, std::span<std::uint32_t> capture_memory = {},
                                     std::span<std::uint32_t> log_memory = {});
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;

  /// The result is valid until the axis' next tick.
  const AxisOutput& ISR_tick(std::size_t axis, const Tick::SlotInput& input) {
    return axes_.tick().ISR_tick(axis, input);
  }
  /// What stands behind it, for a board whose interrupt reaches it by its own address: an offset into this
  /// large object costs the tick an instruction at every access. Simulations pass over ticks by it.
  Tick& ISR_axes() { return axes_.tick(); }
  /// In place of it, for an axis that the board does not have.
  [[gnu::cold]] void ISR_tick(std::size_t axis) { axes_.tick().ISR_tick(axis); }
  /// All axes, for a board that samples them at the same time.
  TickOutput ISR_tick(const TickInput& input) {
    TickOutput output;
    for (std::size_t axis = 0; axis < axis_count; ++axis)
      output.axis[axis] = ISR_tick(axis, Tick::ISR_slot_input(input.axis, axis));
    return output;
  }
  /// Between two ticks: the last one began a round, in which all axes report. Behind the last axis' tick the
  /// main loop should be woken: what it reads then is of this tick.
  bool ISR_round_begins() const { return axes_.tick().ISR_round_begins(); }

  void poll(std::uint32_t now_us);
  /// Before poll(), as often as they change.
  void set_readings(const BoardReadings& readings) { axes_.set_readings(readings); }
  ModbusEdge& serial() { return serial_; }
  const ModbusEdge& serial() const { return serial_; }
  CanopenEdge& can() { return can_; }
  const CanopenEdge& can() const { return can_; }
  /// Polled by the board behind poll(), and only when something has come: without a host USB costs nothing.
  UsbModbusEdge& usb() { return usb_; }

  /// Parameters a board or a scene starts with, before the first tick. Refused like a host's write, and
  /// then nothing changes.
  ParameterAccess::Result preset(std::size_t entry, std::size_t axis, std::uint32_t raw);

  /// Gives the application the memory it keeps parameters in, and takes the newest set in it over; before the
  /// first tick, once. Parameters that the set lacks keep their present values. Without it nothing can be
  /// saved. `flash` refers to a memory that outlives the application.
  const LoadReport& attach_store(AnyFlashSectors flash);

  /// Brings all readings among values() up to date.
  void refresh_readings() { readings_.refresh(); }
  const ParameterValues& values() const { return parameters_.values(); }
  /// Rises with every change of a parameter.
  std::uint32_t parameter_changes() const { return parameters_.changes(); }
  bool any_armed() const { return axes_.any_armed(); }
  /// A save is under way; its next step may stop the processor for half a second.
  bool store_busy() const { return store_.keeper().busy(); }
  DriveState state(std::size_t axis) const { return axes_.supervisor(axis).machine().state(); }
  Refusal refusal(std::size_t axis) const { return axes_.supervisor(axis).machine().refusal(); }
  Fault fault(std::size_t axis) const { return axes_.supervisor(axis).machine().fault(); }
  /// Of the last tick; for interrupt context, or where nothing interrupts.
  AxisReport ISR_report(std::size_t axis) const { return axes_.tick().ISR_report(axis); }
  const control::HapticLoop<float>::Output& ISR_haptic(std::size_t axis) const {
    return axes_.tick().ISR_haptic(axis);
  }
  /// Likewise, N, outwards: what a simulated person answers to.
  float ISR_background_force(std::size_t axis) const { return axes_.tick().ISR_background_force(axis); }

 private:
  LinkSources link_sources() { return {board_, parameters_, store_, writes_, readings_, axes_, links_}; }
  // Rare: small code rather than fast code.
  [[gnu::cold]] void go_on_saving(std::uint32_t now_us);

  BoardIdentity board_;
  ParameterAccess parameters_;
  StoreCommands store_{parameters_};
  WriteLock lock_;
  LinkStates links_;
  FaultLog log_;
  Axes axes_;
  HostWrites writes_{parameters_, store_, lock_, axes_};
  Readings readings_;
  ModbusEdge serial_;
  CanopenEdge can_;
  UsbModbusEdge usb_;
  drivers::PeriodicTimer millisecond_{1'000};
};

}  // namespace kmax::firmware
