#include "host_tools/virtual_board/stm32f4/clock_rules.hpp"

#include <algorithm>
#include <string>

#include "drivers/stm32f4/registers/rcc.hpp"
#include "host_tools/virtual_board/peripheral.hpp"
#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"
#include "host_tools/virtual_board/stm32f4/rcc.hpp"

namespace kmax::virtual_board {

namespace {

namespace rcc_cfgr = drivers::stm32f4::rcc_cfgr;
namespace rcc_pllcfgr = drivers::stm32f4::rcc_pllcfgr;

constexpr std::uint64_t mhz = 1'000'000;

std::uint64_t ahb_divider(std::uint32_t code) {
  constexpr std::uint64_t dividers[8] = {2, 4, 8, 16, 64, 128, 256, 512};
  return code < 8 ? 1 : dividers[code - 8];
}
std::uint64_t apb_divider(std::uint32_t code) {
  return code < 4 ? 1 : std::uint64_t{2} << (code - 4);
}

std::string in_mhz(std::uint64_t hz) {
  return std::to_string(hz / mhz) + "." + std::to_string(hz % mhz / 10'000 + 100).substr(1) + " MHz";
}

[[noreturn]] void refuse_clock(const std::string& what) {
  throw RefusedAccess("RCC: " + what);
}

void check_limit(const char* what, std::uint64_t hz, std::uint64_t maximum) {
  if (hz > maximum) refuse_clock(std::string(what) + " at " + in_mhz(hz) + ", at most " + in_mhz(maximum));
}

std::uint64_t pll_source_hz(std::uint32_t pllcfgr) {
  return rcc_pllcfgr::FromCrystal::of(pllcfgr) != 0 ? crystal_hz : internal_oscillator_hz;
}

}  // namespace

void check_pll(std::uint32_t pllcfgr) {
  const std::uint32_t divider = rcc_pllcfgr::InputDivider::of(pllcfgr);
  if (divider < 2) refuse_clock("PLLCFGR: M = " + std::to_string(divider) + ", must be 2 to 63");
  const std::uint64_t input = pll_source_hz(pllcfgr) / divider;
  if (input < 950'000 || input > 2'100'000)
    refuse_clock("PLLCFGR: PLL input " + in_mhz(input) + ", must be 0.95 to 2.10 MHz");
  const std::uint64_t vco = pll_source_hz(pllcfgr) * rcc_pllcfgr::Multiplier::of(pllcfgr) / divider;
  if (vco < 192 * mhz || vco > 432 * mhz)
    refuse_clock("PLLCFGR: VCO at " + in_mhz(vco) + ", must be 192 to 432 MHz");
  const std::uint32_t usb_divider = rcc_pllcfgr::UsbDivider::of(pllcfgr);
  if (usb_divider < 2 || vco > 48 * mhz * usb_divider)
    refuse_clock("PLLCFGR: Q = " + std::to_string(usb_divider) + " is below 2 or gives more than 48 MHz");
}

std::uint64_t pll_output_hz(std::uint32_t pllcfgr) {
  const std::uint64_t product = pll_source_hz(pllcfgr) * rcc_pllcfgr::Multiplier::of(pllcfgr);
  const std::uint64_t divider = std::uint64_t{2} * (rcc_pllcfgr::OutputDivider::of(pllcfgr) + 1) *
                                std::max(rcc_pllcfgr::InputDivider::of(pllcfgr), 1U);
  if (product % divider != 0) refuse_clock("PLL output is no whole number of hertz: not modelled");
  return product / divider;
}

BoardClocks board_clocks(std::uint64_t system_clock_hz, std::uint32_t cfgr,
                         const ClockConditions& conditions) {
  const std::uint64_t divider = ahb_divider(rcc_cfgr::AhbPrescaler::of(cfgr));
  const std::uint64_t divider1 = apb_divider(rcc_cfgr::Apb1Prescaler::of(cfgr));
  const std::uint64_t divider2 = apb_divider(rcc_cfgr::Apb2Prescaler::of(cfgr));
  const std::uint64_t hclk = system_clock_hz / divider;
  check_limit("HCLK", hclk, 168 * mhz);
  check_limit("PCLK1", hclk / divider1, 42 * mhz);
  check_limit("PCLK2", hclk / divider2, 84 * mhz);
  const BoardTime source_period = units_per_period(system_clock_hz);
  if (source_period == 0)
    refuse_clock("system clock of " + in_mhz(system_clock_hz) + " does not divide 336 MHz: not modelled");
  const BoardTime core = source_period * divider;
  const std::uint32_t needed = FlashInterface::wait_states_needed(core);
  if (conditions.flash_wait_states < needed) {
    refuse_clock("HCLK at " + in_mhz(hclk) + " with " + std::to_string(conditions.flash_wait_states) +
                 " flash wait states, needs " + std::to_string(needed));
  }
  if (hclk > PwrModel::scale_2_maximum_hz && !conditions.voltage_scale_1)
    refuse_clock("HCLK at " + in_mhz(hclk) + " without voltage scale 1 (PWR_CR.VOS)");
  // The timers' clock is that of their bus, doubled when the bus is divided.
  const auto timer = [&](std::uint64_t bus_divider) {
    return core * (bus_divider == 1 ? 1 : bus_divider / 2);
  };
  return {core, core * divider1, core * divider2, timer(divider1), timer(divider2)};
}

}  // namespace kmax::virtual_board
