#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "drivers/stm32f4/registers/iwdg.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// Independent watchdog: RM0090, chapter Independent watchdog (IWDG). Counts cycles of its own oscillator,
/// down from the reload value, and resets the chip (RLR + 1) prescaled cycles after the latest reload.
///
/// New values of PR and RLR take effect five cycles of the oscillator after the write (RM0090: up to five),
/// and only while it runs, that is once the watchdog is started. Until then PVU and RVU are set; a running
/// counter keeps its count when the prescaler changes.
///
/// Refused: PR and RLR without the unlock key (silicon ignores that) or while they are being updated, keys
/// that mean nothing, reading KR.
class IwdgModel final : public RegisterBlock<IwdgModel> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::IwdgRegisters);

  IwdgModel() : RegisterBlock("IWDG", registers()) {}

  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  /// Stops it, as every reset of the chip does.
  void reset(BoardTime now) override;

  /// The individual chip's oscillator; 17 to 47 kHz. Throws std::invalid_argument outside, std::logic_error
  /// while the watchdog runs.
  void set_oscillator_hz(std::uint32_t hz);
  /// Called at the moment it fires; it stays silent until reset().
  void on_reset(std::function<void(BoardTime)> callback) { on_reset_ = std::move(callback); }
  /// Called when it is started, and with it the oscillator.
  void on_started(std::function<void(BoardTime)> callback) { on_started_ = std::move(callback); }

  /// A debugger halts the core, with the watchdog's bit in DBGMCU set: it stands. Then it goes on.
  void freeze(bool frozen, BoardTime now);

  bool running() const { return running_; }
  /// When it fires unless it is fed.
  BoardTime fires_at() const;

 private:
  /// Duration of so many cycles of the oscillator, rounded up.
  BoardTime cycles(std::uint64_t count) const;
  std::uint64_t elapsed_cycles(BoardTime now) const;
  void take_prescaler_over(BoardTime now);
  void count_from(BoardTime now, std::uint64_t remaining);
  static const RegisterTable<IwdgModel>& registers();
  std::uint32_t read_status() const;
  void write_key(const Access& access, std::uint32_t key);
  template <std::uint32_t IwdgModel::*setting, BoardTime IwdgModel::*effective>
  void write_setting(const Access& access, std::uint32_t value);

  std::uint32_t oscillator_hz_ = drivers::stm32f4::lsi_typical_hz;
  std::function<void(BoardTime)> on_reset_;
  std::function<void(BoardTime)> on_started_;

  bool running_ = false;
  bool fired_ = false;
  bool unlocked_ = false;
  std::uint32_t pr_ = 0, rlr_ = 0xFFF;                // as written
  std::uint32_t active_pr_ = 0, active_rlr_ = 0xFFF;  // in effect
  // When a written value takes effect; `never` when there is none, 0 when it waits for the oscillator.
  BoardTime pr_effective_ = never;
  BoardTime rlr_effective_ = never;
  BoardTime frozen_at_ = never;
  BoardTime counted_from_ = 0;   // start of `remaining_`
  std::uint64_t remaining_ = 0;  // prescaled cycles from there to the reset
  BoardTime until_reset_ = 0;    // as time: it is asked for more often than it changes
};

}  // namespace kmax::virtual_board
