#pragma once

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/cortex_m/exception_table.hpp"
#include "host_tools/virtual_board/register_block.hpp"

// SysTick, PM0214 system timer: a 24-bit counter that runs down to 0 and starts again from LOAD.
//
// The model keeps no counter, only the time at which it reaches 0 next; VAL is worked out when it is read.
// After enabling or writing VAL the counter stands at 0, takes LOAD with the next clock and so reaches 0
// again LOAD + 1 clocks later. Reaching 0 sets COUNTFLAG and, with TICKINT, pends exception 15. With LOAD = 0
// it never counts.
//
// The counter stands while a debugger halts the core (ARMv7-M architecture reference manual, B3.3).
//
// CALIB reads 18750 with SKEW: a millisecond, and that only at 150 MHz / 8. The reference clock is HCLK / 8.
// A change of the core clock while the counter runs takes effect with the next reload.

namespace kmax::virtual_board {

class SystemTick final : public RegisterBlock<SystemTick> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::SystemTickRegisters);
  static constexpr std::uint32_t calibration =
      drivers::cortex_m::system_tick_calib::Skewed::mask |
      drivers::cortex_m::system_tick_calib::TenMilliseconds::bits(18750);

  SystemTick(const BoardClocks& clocks, ExceptionTable& exceptions)
      : RegisterBlock("SysTick", registers()), clocks_(clocks), exceptions_(exceptions) {}

  void advance(BoardTime now) override;
  BoardTime next_event() const override { return zero_at_; }
  void reset(BoardTime now) override;

  /// The core is halted, or goes on.
  void halt(BoardTime now);
  void resume(BoardTime now);

 private:
  static const RegisterTable<SystemTick>& registers();
  std::uint32_t read_ctrl();
  void write_ctrl(const Access& access, std::uint32_t value);
  void write_load(const Access& access, std::uint32_t value);
  std::uint32_t read_val(const Access& access) const { return value_at(access.now); }
  void write_val(const Access& access, std::uint32_t value);
  bool enabled() const { return drivers::cortex_m::system_tick_ctrl::Enable::of(ctrl_) != 0; }
  BoardTime tick_period() const;
  std::uint32_t value_at(BoardTime now) const;
  void start_from(std::uint32_t value, BoardTime now);

  const BoardClocks& clocks_;
  ExceptionTable& exceptions_;
  std::uint32_t ctrl_ = 0;
  std::uint32_t load_ = 0;
  std::uint32_t stopped_value_ = 0;  ///< VAL while the counter is disabled or idle
  bool count_flag_ = false;
  BoardTime zero_at_ = never;   ///< never: disabled, or at 0 with nothing to load
  BoardTime left_ = never;      ///< to reach 0, while the core is halted
  BoardTime clock_period_ = 1;  ///< of the count that is running
  std::uint32_t reload_ = 0;    ///< LOAD that the count began with
};

}  // namespace kmax::virtual_board
