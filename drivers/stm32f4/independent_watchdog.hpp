#pragma once

#include <cstdint>

#include "drivers/register_field.hpp"
#include "drivers/stm32f4/registers/dbgmcu.hpp"
#include "drivers/stm32f4/registers/iwdg.hpp"

// Independent watchdog: resets the chip unless it is fed in time. RM0090 chapter on IWDG. Once started it
// cannot be stopped; a reset stops it.
//
// Its clock is the LSI, 32 kHz give or take nearly a half (17 to 47 kHz). The period asked for is therefore
// the one that is GUARANTEED: fed at least that often, the watchdog never fires. How late it may fire on a
// slow chip is `fires_at_latest_us`, up to 2.8 times as long plus the rounding to whole counts:
//
//   period    not before   typically   at latest
//   100 ms    100 ms       147 ms      277 ms
//   1000 ms   1000 ms      1.47 s      2.77 s
//
// It must outlast an erase of the parameter flash (drivers/stm32f4/flash_sectors.hpp), during which nothing
// runs.
//
// Contexts: `start` once at start-up; `feed` is a single store and may be called from any.

namespace kmax::drivers::stm32f4 {

struct IndependentWatchdogTiming {
  bool usable;  // false: the period cannot be had, and the rest is 0
  std::uint32_t prescaler_code;
  std::uint32_t reload;
  std::uint32_t guaranteed_not_before_us;  // after start() or the latest feed()
  std::uint32_t fires_at_latest_us;
};

/// 1 ms to 22 s. The counter runs for between `reload` and `reload` + 1 prescaled cycles, because a feed may
/// come at any phase of the prescaler, plus one cycle of the LSI to take the feed over.
constexpr IndependentWatchdogTiming independent_watchdog_timing(std::uint32_t period_ms) {
  if (period_ms == 0 || period_ms > 22'000) return {};
  const std::uint32_t lsi_cycles = period_ms * (lsi_maximum_hz / 1000);
  for (std::uint32_t code = 0; code <= 6; ++code) {
    const std::uint32_t divider = iwdg_pr::divider(code);
    const std::uint32_t reload = (lsi_cycles + divider - 1) / divider;
    if (reload > iwdg_rlr::Reload::maximum) continue;
    const std::uint64_t shortest = std::uint64_t{reload} * divider * 1'000'000;
    const std::uint64_t longest = ((std::uint64_t{reload} + 1) * divider + 1) * 1'000'000;
    return {true, code, reload, static_cast<std::uint32_t>(shortest / lsi_maximum_hz),
            static_cast<std::uint32_t>(longest / lsi_minimum_hz + 1)};
  }
  return {};
}
static_assert(independent_watchdog_timing(22'000).usable);

template <typename Iwdg = IwdgRegisters, typename Dbgmcu = DbgmcuRegisters>
class IndependentWatchdog {
 public:
  /// The update of prescaler and reload takes some cycles of the LSI, six of the longest prescaled ones at
  /// most: 90 ms at 17 kHz. In reads of at least five core cycles at 168 MHz.
  static constexpr std::uint32_t default_update_polls = 3'100'000;

  IndependentWatchdog(Iwdg& iwdg, Dbgmcu& dbgmcu, std::uint32_t update_polls = default_update_polls)
      : iwdg_(iwdg), dbgmcu_(dbgmcu), update_polls_(update_polls) {}

  /// Starts it, frozen while a debugger halts the core. False: the watchdog is not running (period), or it
  /// runs but did not take the period over, so that it fires 0.35 s to 1 s after the latest feed,
  /// or with the period of an earlier start.
  ///
  /// RM0090 allows PR and RLR to be written while it stands still, but the flags fall only when the LSI runs,
  /// which starting it sees to: hence start first.
  [[nodiscard]] bool start(const IndependentWatchdogTiming& timing) {
    if (!timing.usable) return false;
    dbgmcu_apb1_fz::IndependentWatchdog::set(dbgmcu_.apb1_fz);
    iwdg_.kr = iwdg_kr::start;
    if (!updated()) return false;
    iwdg_.kr = iwdg_kr::unlock;
    iwdg_.pr = iwdg_pr::Prescaler::bits(timing.prescaler_code);
    iwdg_.rlr = iwdg_rlr::Reload::bits(timing.reload);
    const bool taken_over = updated();
    feed();
    return taken_over;
  }
  [[nodiscard]] bool start(std::uint32_t period_ms) { return start(independent_watchdog_timing(period_ms)); }

  void feed() { iwdg_.kr = iwdg_kr::reload; }

 private:
  bool updated() const {
    return wait_until(iwdg_.sr, iwdg_sr::PrescalerUpdating::mask | iwdg_sr::ReloadUpdating::mask, 0,
                      update_polls_);
  }

  Iwdg& iwdg_;
  Dbgmcu& dbgmcu_;
  std::uint32_t update_polls_;
};

}  // namespace kmax::drivers::stm32f4
