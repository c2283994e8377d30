#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "drivers/stm32f4/registers/pwr.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/reset_cause.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"
#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"

namespace kmax::virtual_board {

/// Power control: RM0090, chapter Power controller (PWR), section Voltage regulator. Only the voltage scale;
/// low-power modes, the voltage detector and the backup domain are refused.
///
/// Sources disagree on VOS after reset. It is 0 (scale 2) here, the case in which a program that forgets it
/// fails.
class PwrModel final : public RegisterBlock<PwrModel> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::PwrRegisters);
  /// Highest HCLK at scale 2 (STM32F405 data sheet, general operating conditions).
  static constexpr std::uint64_t scale_2_maximum_hz = 144'000'000;

  explicit PwrModel(const BoardClocks& clocks) : RegisterBlock("PWR", registers()), clocks_(clocks) {}
  void reset(BoardTime /*now*/) override { cr_ = 0; }

  bool voltage_scale_1() const { return drivers::stm32f4::pwr_cr::VoltageScale1::of(cr_) != 0; }

 private:
  static const RegisterTable<PwrModel>& registers();
  void write_cr(const Access& access, std::uint32_t value);

  const BoardClocks& clocks_;
  std::uint32_t cr_ = 0;
};

/// Reset and clock control: RM0090, chapter Reset and clock control for STM32F405xx (RCC), sections Clocks,
/// Clock security system, RCC registers. Crystal of 8 MHz. Writes BoardClocks whenever the core changes its
/// clock.
///
/// Start-up times: internal oscillator 4 us, crystal 2 ms, PLL 200 us (STM32F405 data sheet: 4 us at most, 2
/// ms typical, 75 to 300 us), a switch of the system clock 10 cycles of the internal oscillator.
///
/// Refused, when written (and, should the conditions change before a switch takes place, by advance()): a PLL
/// outside its limits (input 0.95 to 2.1 MHz, VCO 192 to 432 MHz, 48 MHz output not above 48 MHz) or without
/// a ready source; changes of a PLL that is on; stopping what the core runs on (silicon ignores that); HCLK
/// above 168, PCLK1 above 42, PCLK2 above 84 MHz; HCLK above what the flash wait states and the voltage scale
/// allow; frequencies of which 336 MHz is no multiple, which BoardTime cannot express; clock outputs, I2S
/// PLL, backup domain, LSION, ready interrupts, low-power enables; peripheral resets but those of TIM1, TIM8
/// and OTG_FS; enable bits of peripherals that the board does not have.
class RccModel final : public RegisterBlock<RccModel> {
 public:
  static constexpr std::uint32_t size = 0x90;
  static constexpr BoardTime internal_start_time = 4 * units_per_microsecond;
  static constexpr BoardTime crystal_start_time = 2000 * units_per_microsecond;
  static constexpr BoardTime pll_lock_time = 200 * units_per_microsecond;
  static constexpr BoardTime switch_time = 10 * BoardClocks::internal;

  RccModel(BoardClocks& clocks, const FlashInterface& flash, const PwrModel& power);

  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  /// The reset flags stay: note_reset() sets them.
  void reset(BoardTime now) override;

  /// Whether all bits of `mask` are set in the enable register at `offset`, e.g. offsetof(RccRegisters,
  /// apb1enr). Throws std::out_of_range for any other register.
  bool clock_enabled(std::size_t offset, std::uint32_t mask) const {
    return (enable_word(offset) & mask) == mask;
  }
  /// What the reset flags will say; call it with reset(). Also as after construction: power_on.
  void note_reset(drivers::stm32f4::ResetCause cause);
  /// The watchdog has started the low-speed oscillator.
  void note_low_speed_oscillator_running() { low_speed_runs_ = true; }

  /// Called with the level of the clock security flag, which is the NMI's.
  void on_clock_security_interrupt(std::function<void(bool level, BoardTime)> callback) {
    clock_security_interrupt_ = std::move(callback);
  }
  /// Called when the clock security system finds the crystal dead: also a break for TIM1 and TIM8.
  void on_clock_failure(std::function<void(BoardTime)> callback) { clock_failure_ = std::move(callback); }
  /// Called when the bit of OTG_FS in AHB2RSTR rises.
  void on_usb_reset(std::function<void(BoardTime)> callback) { usb_reset_ = std::move(callback); }
  /// Called when bits of APB2RSTR rise: those of TIM1 and TIM8 alone are modelled.
  void on_peripheral_reset(std::function<void(std::uint32_t bits, BoardTime)> callback) {
    peripheral_reset_ = std::move(callback);
  }
  /// A crystal that does not oscillate, from the next start on.
  void set_crystal_works(bool works) { crystal_works_ = works; }
  /// A PLL that does not lock, from the next start on.
  void set_pll_locks(bool locks) { pll_locks_ = locks; }
  /// The crystal stops now. With the clock security system on, the core goes on from the internal oscillator;
  /// without, and if it ran from the crystal, it stops (core_clock_lost).
  void fail_crystal(BoardTime now);
  bool core_clock_lost() const { return core_clock_lost_; }
  /// The PLL gives exactly 48 MHz, from the crystal: what USB needs (RM0090, section Clocks). The internal
  /// oscillator is off by more than the 0.25 % that a host accepts.
  bool usb_clock(BoardTime now) const;

 private:
  const std::uint32_t& enable_word(std::size_t offset) const;
  static const RegisterTable<RccModel>& registers();
  std::uint32_t read_control(const Access& access) const { return cr_ | ready_flags(access.now); }
  std::uint32_t ready_flags(BoardTime now) const;
  void write_control(const Access& access, std::uint32_t value);
  void write_pll(const Access& access, std::uint32_t value);
  void write_configuration(const Access& access, std::uint32_t value);
  void write_usb_reset(const Access& access, std::uint32_t value);
  void write_peripheral_reset(const Access& access, std::uint32_t value);
  void write_interrupts(const Access& access, std::uint32_t value);
  void write_status(std::uint32_t value);
  std::uint32_t read_status() const;
  BoardTime ready_at(std::uint32_t source) const;
  /// The clocks that a CFGR would give with the core on `source`; throws RefusedAccess when they are not
  /// allowed.
  BoardClocks clocks_for(std::uint32_t configuration, std::uint32_t source) const;
  std::uint32_t source_in_use() const { return drivers::stm32f4::rcc_cfgr::SwitchStatus::of(cfgr_); }
  bool core_depends_on_crystal() const;
  void run_from(std::uint32_t source, const BoardClocks& clocks);
  void restore_reset_values();

  BoardClocks& clocks_;
  const FlashInterface& flash_;
  const PwrModel& power_;
  std::uint32_t cr_ = 0, pllcfgr_ = 0, cfgr_ = 0, cir_ = 0;  // CR without the ready flags
  std::uint32_t ahb1enr_ = 0, ahb2enr_ = 0, apb1enr_ = 0, apb2enr_ = 0, apb2rstr_ = 0, ahb2rstr_ = 0;
  std::uint32_t csr_ = 0;
  BoardTime internal_ready_ = 0;
  BoardTime crystal_ready_ = never;
  BoardTime pll_ready_ = never;
  BoardTime switch_requested_ = 0;
  bool crystal_works_ = true;
  bool pll_locks_ = true;
  bool core_clock_lost_ = false;
  bool low_speed_runs_ = false;
  std::function<void(bool, BoardTime)> clock_security_interrupt_;
  std::function<void(BoardTime)> clock_failure_;
  std::function<void(std::uint32_t, BoardTime)> peripheral_reset_;
  std::function<void(BoardTime)> usb_reset_;
};

}  // namespace kmax::virtual_board
