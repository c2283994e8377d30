#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/rcc.hpp"

// Why the program starts: the reset flags of the RCC. RM0090, RCC clock control and status register
// (RCC_CSR).
//
// Flags stay until they are cleared or power is lost, and every reset sets the pin's flag too, because the
// chip pulls NRST low itself. So the one that says most is taken, the causes that need a running program
// first: they came after the power-on whose flag may still be there.

namespace kmax::drivers::stm32f4 {

enum class ResetCause : std::uint8_t {
  none,  // no flag: not a reset (a jump that was not noticed), or an emulator without RCC
  power_on,
  pin,
  software,
  independent_watchdog,
  window_watchdog,
  low_power,
  brown_out,
};

constexpr ResetCause reset_cause(std::uint32_t csr) {
  if (rcc_csr::LowPower::of(csr) != 0) return ResetCause::low_power;
  if (rcc_csr::WindowWatchdog::of(csr) != 0) return ResetCause::window_watchdog;
  if (rcc_csr::IndependentWatchdog::of(csr) != 0) return ResetCause::independent_watchdog;
  if (rcc_csr::Software::of(csr) != 0) return ResetCause::software;
  if (rcc_csr::PowerOn::of(csr) != 0) return ResetCause::power_on;
  if (rcc_csr::BrownOut::of(csr) != 0) return ResetCause::brown_out;
  if (rcc_csr::Pin::of(csr) != 0) return ResetCause::pin;
  return ResetCause::none;
}

/// Reads the cause and clears the flags, so that the next reset is not taken for this one. Once, at start-up.
ResetCause take_reset_cause(auto& rcc) {
  const ResetCause cause = reset_cause(static_cast<std::uint32_t>(rcc.csr));
  rcc_csr::RemoveFlags::set(rcc.csr);
  rcc_csr::RemoveFlags::clear(rcc.csr);
  return cause;
}

/// The program begins behind another's jump and not behind a reset: a clock is on that a reset turns off
/// (RM0090, reset values of RCC_CR, RCC_CFGR and RCC_AHB2ENR). False for a program that has turned its own
/// off.
bool begins_behind_a_jump(auto& rcc) {
  constexpr std::uint32_t clocks = rcc_cr::CrystalOn::mask | rcc_cr::PllOn::mask;
  return (static_cast<std::uint32_t>(rcc.cr) & clocks) != 0 || static_cast<std::uint32_t>(rcc.cfgr) != 0 ||
         static_cast<std::uint32_t>(rcc.ahb2enr) != 0;
}

}  // namespace kmax::drivers::stm32f4
