#pragma once

#include <cstdint>

#include "drivers/register_field.hpp"
#include "drivers/stm32f4/registers/flash.hpp"
#include "drivers/stm32f4/registers/pwr.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"

// Brings the core to 168 MHz and says what it got. Every wait is bounded, so start-up always ends.
//
//   8 MHz crystal -> PLL -> 168 MHz     what the board is built for
//   16 MHz RC     -> PLL -> 168 MHz     crystal or PLL input dead: same speed, but the RC oscillator is only
//                                       within about 1 %: good enough for a USART, not for CAN
//   16 MHz RC                           PLL dead: the link still answers, the haptic rate cannot be kept
//
// Sequence as in RM0090 (RCC, PWR, FLASH chapters): voltage scale 1, oscillator, flash wait states read back,
// bus prescalers, PLL, switch, switch status. It starts by going back to the RC oscillator, because a boot
// loader may have left the PLL running and a running PLL cannot be reprogrammed.
//
// Both PLL set-ups use a 2 MHz VCO input and a 336 MHz VCO (limits 0.95-2.1 MHz and 192-432 MHz).

namespace kmax::drivers::stm32f4 {

/// The numbers are published to the host; 4 belongs to the native build.
enum class ClockSource : std::uint8_t {
  crystal_pll = 0,
  internal_pll = 1,
  internal = 2,
  /// Of the image for an emulator without a clock tree: the nominal frequencies are assumed. No board says
  /// so.
  unreadable = 3,
  /// RCC is there but does not obey: the core could not even be returned to the RC oscillator. Frequencies
  /// are a guess.
  unresponsive = 5,
};

struct ClockFrequencies {
  ClockSource source;
  std::uint32_t core_hz;
  std::uint32_t apb1_hz;  // USART2, UART4, CAN1, SPI3
  std::uint32_t apb2_hz;  // ADC
};

/// Limits of the waits, in register reads. One read in a loop takes at least five core cycles, 0.3 us at 16
/// MHz. The crystal gets at least 30 ms (a few are usual), the PLL 6 ms, all else some 0.3 ms.
struct ClockWaits {
  std::uint32_t crystal = 100'000;
  std::uint32_t pll = 20'000;
  std::uint32_t other = 1'000;
};

template <typename Rcc = RccRegisters, typename Pwr = PwrRegisters, typename Flash = FlashRegisters>
class ClockTree {
 public:
  ClockTree(Rcc& rcc, Pwr& pwr, Flash& flash, ClockWaits waits = {})
      : rcc_(rcc), pwr_(pwr), flash_(flash), waits_(waits) {}

  ClockFrequencies start() {
    if (!return_to_internal()) return base_speed(ClockSource::unresponsive);

    enable_peripheral_clock(rcc_.apb1enr, rcc_apb1enr::Power::mask);
    pwr_cr::VoltageScale1::set(pwr_.cr);

    if (crystal_runs() && switch_to_pll(crystal_pll_set_up)) {
      // A crystal that stops then raises the NMI, and the core goes on from the internal oscillator; without,
      // it stops.
      rcc_cr::ClockSecurity::set(rcc_.cr);
      return full_speed(ClockSource::crystal_pll);
    }
    rcc_cr::CrystalOn::clear(rcc_.cr);
    if (switch_to_pll(internal_pll_set_up)) return full_speed(ClockSource::internal_pll);
    return base_speed(ClockSource::internal);
  }

 private:
  static constexpr std::uint32_t pll_set_up(bool from_crystal, std::uint32_t input_divider) {
    return rcc_pllcfgr::InputDivider::bits(input_divider) | rcc_pllcfgr::Multiplier::bits(168) |
           rcc_pllcfgr::OutputDivider::bits(0) | rcc_pllcfgr::FromCrystal::bits(from_crystal ? 1 : 0) |
           rcc_pllcfgr::UsbDivider::bits(7);
  }
  static constexpr std::uint32_t crystal_pll_set_up = pll_set_up(true, 4);    // 8 MHz / 4 * 168 / 2
  static constexpr std::uint32_t internal_pll_set_up = pll_set_up(false, 8);  // 16 MHz / 8 * 168 / 2
  static_assert(crystal_pll_set_up == 0x0740'2A04);

  static constexpr std::uint32_t switch_internal = 0;
  static constexpr std::uint32_t switch_pll = 2;
  static constexpr std::uint32_t divide_by_2 = 4;
  static constexpr std::uint32_t divide_by_4 = 5;
  static constexpr std::uint32_t wait_states_at_168_mhz = 5;  // at 2.7-3.6 V

  static constexpr ClockFrequencies full_speed(ClockSource source) {
    return {source, 168'000'000, 42'000'000, 84'000'000};
  }
  static constexpr ClockFrequencies base_speed(ClockSource source) {
    return {source, 16'000'000, 16'000'000, 16'000'000};
  }

  /// Core on the RC oscillator, buses undivided, PLL off. The order keeps every bus below its limit on the
  /// way.
  bool return_to_internal() {
    rcc_cr::InternalOn::set(rcc_.cr);
    if (!wait_until(rcc_.cr, rcc_cr::InternalReady::mask, rcc_cr::InternalReady::mask, waits_.other))
      return false;
    rcc_cfgr::Switch::write(rcc_.cfgr, switch_internal);
    if (!wait_until(rcc_.cfgr, rcc_cfgr::SwitchStatus::mask, rcc_cfgr::SwitchStatus::bits(switch_internal),
                    waits_.other)) {
      return false;
    }
    rcc_cfgr::AhbPrescaler::write(rcc_.cfgr, 0);
    rcc_cfgr::Apb1Prescaler::write(rcc_.cfgr, 0);
    rcc_cfgr::Apb2Prescaler::write(rcc_.cfgr, 0);
    return stop_pll();
  }

  bool stop_pll() {
    rcc_cr::PllOn::clear(rcc_.cr);
    return wait_until(rcc_.cr, rcc_cr::PllReady::mask, 0, waits_.pll);
  }

  bool crystal_runs() {
    rcc_cr::CrystalOn::set(rcc_.cr);
    return wait_until(rcc_.cr, rcc_cr::CrystalReady::mask, rcc_cr::CrystalReady::mask, waits_.crystal);
  }

  bool slow_down_flash() {
    flash_.acr = flash_acr::Latency::bits(wait_states_at_168_mhz) | flash_acr::Prefetch::mask |
                 flash_acr::InstructionCache::mask | flash_acr::DataCache::mask;
    return wait_until(flash_.acr, flash_acr::Latency::mask, flash_acr::Latency::bits(wait_states_at_168_mhz),
                      waits_.other);
  }

  /// Expects the PLL to be off. On failure the core is back on the RC oscillator with undivided buses and the
  /// PLL off, as before the call. The wait states stay: too many are only slow.
  bool switch_to_pll(std::uint32_t set_up) {
    rcc_.pllcfgr = set_up;
    if (!slow_down_flash()) return false;
    rcc_cr::PllOn::set(rcc_.cr);
    if (!wait_until(rcc_.cr, rcc_cr::PllReady::mask, rcc_cr::PllReady::mask, waits_.pll)) {
      static_cast<void>(stop_pll());
      return false;
    }
    rcc_cfgr::Apb1Prescaler::write(rcc_.cfgr, divide_by_4);
    rcc_cfgr::Apb2Prescaler::write(rcc_.cfgr, divide_by_2);
    rcc_cfgr::Switch::write(rcc_.cfgr, switch_pll);
    if (wait_until(rcc_.cfgr, rcc_cfgr::SwitchStatus::mask, rcc_cfgr::SwitchStatus::bits(switch_pll),
                   waits_.other)) {
      return true;
    }
    static_cast<void>(return_to_internal());
    return false;
  }

  Rcc& rcc_;
  Pwr& pwr_;
  Flash& flash_;
  ClockWaits waits_;
};

}  // namespace kmax::drivers::stm32f4
