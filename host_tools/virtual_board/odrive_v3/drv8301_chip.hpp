#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "drivers/drv8301_registers.hpp"
#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// A DRV8301 as its pins show it: DRV8301 data sheet, sections SPI communication, Register maps, EN_GATE,
/// Fault and protection handling.
///
/// EN_GATE high wakes it: its SPI answers after `start_up`. EN_GATE low for 20 us or more resets it wholly; a
/// pulse of less than 10 us (quick reset) takes latched faults back and leaves the registers; in between the
/// data sheet promises nothing and neither does this: it counts as a full reset for the registers and as none
/// for the faults. SPI is dead while EN_GATE is low.
///
/// A frame needs its own chip select. The reply to a frame is shifted out in the next; after power-up it is
/// 0. Reading status 1 clears what is in it except FAULT; a fault whose cause lasts comes back at once.
///
/// nFAULT is low, and FAULT set, while a latched fault is there and while the chip starts. Whether an
/// over-current latches depends on OCP_MODE.
class Drv8301Chip {
 public:
  using Fault = drivers::Drv8301Fault;
  static constexpr BoardTime full_reset = 20 * units_per_microsecond;
  static constexpr BoardTime quick_reset = 10 * units_per_microsecond;

  /// `start_up`: from EN_GATE high to an SPI that answers; 10 ms at most by the data sheet.
  explicit Drv8301Chip(BoardTime start_up = 5'000 * units_per_microsecond) : start_up_(start_up) {}

  /// nSCS: false selects. Frames while it is high are not the chip's.
  void select(bool level, BoardTime now);
  /// What the chip puts on the line during the frame; none: it does not drive it.
  std::optional<std::uint16_t> exchange(std::uint16_t mosi, BoardTime now);
  /// `starts`: false while a voltage at its SH pins keeps it from waking; it stays so until EN_GATE rises
  /// again. That it pulls nFAULT and is silent meanwhile is a guess.
  void enable_gate(bool level, BoardTime now, bool starts = true);
  /// The motor supply went away and came back: registers as after power-up, nFAULT low for the start-up time.
  void power_cycle(BoardTime now);

  /// nFAULT, low = fault; called at once with the present level.
  void on_fault_output(std::function<void(bool level, BoardTime now)> callback);
  bool fault_output() const { return fault_output_; }
  BoardTime next_event() const { return awake_at_ != never && !answered_ ? awake_at_ : never; }
  void advance(BoardTime now);

  /// A condition begins or ends. Over-temperature warning does not pull nFAULT; over-currents do what
  /// OCP_MODE says.
  void set_condition(Fault fault, bool present, BoardTime now);
  /// A FET carried too much for a moment.
  void over_current(Fault fault, BoardTime now);
  /// The next `count` writes to control registers have no effect.
  void lose_writes(unsigned count) { writes_to_lose_ = count; }
  /// The chip is gone from the board: it drives nothing.
  void set_fitted(bool fitted) { fitted_ = fitted; }

  bool answers(BoardTime now) const { return fitted_ && enabled_ && awake_at_ <= now; }
  /// EN_GATE high, awake and without a latched fault: PWM inputs reach the gates.
  bool drives_gates(BoardTime now) const { return answers(now) && latched_ == 0; }
  std::uint16_t control(unsigned index) const { return control_.at(index); }  ///< 0: control 1, 1: control 2
  drivers::CurrentSenseGain gain() const;
  /// DC_CAL of either channel: the amplifiers give their offset.
  bool calibrating() const;

 private:
  std::uint16_t read_register(unsigned address);
  void write_register(unsigned address, std::uint16_t data, BoardTime now);
  void update_output(BoardTime now);
  std::uint16_t over_voltage_bit() const;

  BoardTime start_up_;
  bool fitted_ = true;
  bool enabled_ = false;
  bool selected_ = false;
  bool frame_taken_ = false;  ///< of the present select
  bool answered_ = false;     ///< the start-up has been reported to the output
  BoardTime low_since_ = 0;
  BoardTime awake_at_ = never;
  std::uint16_t reply_ = 0;
  std::uint16_t flags_ = 0;       ///< status 1 and GVDD_OV, as Drv8301Fault
  std::uint16_t conditions_ = 0;  ///< causes that are there now
  std::uint16_t latched_ = 0;     ///< what holds the gates off
  std::array<std::uint16_t, 2> control_{};
  unsigned writes_to_lose_ = 0;
  bool fault_output_ = true;
  std::function<void(bool, BoardTime)> fault_callback_;
};

}  // namespace kmax::virtual_board
