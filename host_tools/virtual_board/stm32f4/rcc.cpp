#include "host_tools/virtual_board/stm32f4/rcc.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace rcc_cr = stm32::rcc_cr;
namespace rcc_pllcfgr = stm32::rcc_pllcfgr;
namespace rcc_cfgr = stm32::rcc_cfgr;
namespace rcc_cir = stm32::rcc_cir;
namespace rcc_csr = stm32::rcc_csr;
namespace rcc_ahb1enr = stm32::rcc_ahb1enr;
namespace rcc_ahb2enr = stm32::rcc_ahb2enr;
namespace rcc_apb1enr = stm32::rcc_apb1enr;
namespace rcc_apb2enr = stm32::rcc_apb2enr;
using stm32::RccRegisters;

constexpr std::uint32_t cr_read_only = rcc_cr::InternalReady::mask | rcc_cr::InternalCalibration::mask |
                                       rcc_cr::CrystalReady::mask | rcc_cr::PllReady::mask;
constexpr std::uint32_t cr_stored = rcc_cr::InternalOn::mask | rcc_cr::InternalTrim::mask |
                                    rcc_cr::CrystalOn::mask | rcc_cr::ClockSecurity::mask |
                                    rcc_cr::PllOn::mask;
constexpr std::uint32_t trim_reset_value = 16;
constexpr std::uint32_t pllcfgr_bits = rcc_pllcfgr::InputDivider::mask | rcc_pllcfgr::Multiplier::mask |
                                       rcc_pllcfgr::OutputDivider::mask | rcc_pllcfgr::FromCrystal::mask |
                                       rcc_pllcfgr::UsbDivider::mask | rcc_pllcfgr::Reserved29::mask;
constexpr std::uint32_t prescaler_bits =
    rcc_cfgr::AhbPrescaler::mask | rcc_cfgr::Apb1Prescaler::mask | rcc_cfgr::Apb2Prescaler::mask;
constexpr std::uint32_t flag_bits = rcc_csr::BrownOut::mask | rcc_csr::Pin::mask | rcc_csr::PowerOn::mask |
                                    rcc_csr::Software::mask | rcc_csr::IndependentWatchdog::mask |
                                    rcc_csr::WindowWatchdog::mask | rcc_csr::LowPower::mask;

constexpr std::uint32_t ports =
    rcc_ahb1enr::GpioA::mask | rcc_ahb1enr::GpioB::mask | rcc_ahb1enr::GpioC::mask | rcc_ahb1enr::GpioD::mask;
constexpr std::uint32_t apb1_bits =
    rcc_apb1enr::Timer2::mask | rcc_apb1enr::Timer3::mask | rcc_apb1enr::Timer4::mask |
    rcc_apb1enr::Timer5::mask | rcc_apb1enr::Spi3::mask | rcc_apb1enr::Usart2::mask |
    rcc_apb1enr::Uart4::mask | rcc_apb1enr::Can1::mask | rcc_apb1enr::Power::mask;
constexpr std::uint32_t apb2_bits = rcc_apb2enr::Timer1::mask | rcc_apb2enr::Timer8::mask |
                                    rcc_apb2enr::Adc1::mask | rcc_apb2enr::Adc2::mask |
                                    rcc_apb2enr::Adc3::mask | rcc_apb2enr::SystemConfiguration::mask;

// The arithmetic of the clock tree and its limits: RM0090, chapter Reset and clock control for STM32F405xx
// (RCC), section Clocks; STM32F405 data sheet, general operating conditions and main PLL characteristics. All
// throw RefusedAccess with the value and what is allowed.
constexpr std::uint64_t internal_oscillator_hz = 16'000'000;
constexpr std::uint64_t crystal_hz = 8'000'000;

/// What the highest HCLK depends on.
struct ClockConditions {
  std::uint32_t flash_wait_states;
  bool voltage_scale_1;
};

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

/// M, N and Q of a PLLCFGR: input, VCO and the 48 MHz output within their limits.
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

/// System clock that a PLLCFGR makes.
std::uint64_t pll_output_hz(std::uint32_t pllcfgr) {
  const std::uint64_t product = pll_source_hz(pllcfgr) * rcc_pllcfgr::Multiplier::of(pllcfgr);
  const std::uint64_t divider = std::uint64_t{2} * (rcc_pllcfgr::OutputDivider::of(pllcfgr) + 1) *
                                std::max(rcc_pllcfgr::InputDivider::of(pllcfgr), 1U);
  if (product % divider != 0) refuse_clock("PLL output is no whole number of hertz: not modelled");
  return product / divider;
}

/// The periods behind the prescalers of a CFGR, all of them within their limits.
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

}  // namespace

const RegisterTable<PwrModel>& PwrModel::registers() {
  using Row = Register<PwrModel>;
  static const RegisterTable<PwrModel> table{
      {offsetof(stm32::PwrRegisters, cr), "CR", Row::shows<&PwrModel::cr_>,
       stm32::pwr_cr::VoltageScale1::mask, Row::takes<&PwrModel::write_cr>},
      {offsetof(stm32::PwrRegisters, csr), "CSR",
       [](PwrModel&, const Access&) { return stm32::pwr_csr::VoltageScaleReady::mask; }}};
  return table;
}

void PwrModel::write_cr(const Access& access, std::uint32_t value) {
  if (value == 0 && units_per_second / clocks_.core > scale_2_maximum_hz)
    refuse(access, "CR: voltage scale 2 with HCLK above 144 MHz");
  cr_ = value;
}

RccModel::RccModel(BoardClocks& clocks, const FlashInterface& flash, const PwrModel& power)
    : RegisterBlock("RCC", registers()), clocks_(clocks), flash_(flash), power_(power) {
  restore_reset_values();
  note_reset(stm32::ResetCause::power_on);
}

void RccModel::restore_reset_values() {
  cr_ = rcc_cr::InternalOn::mask | rcc_cr::InternalTrim::bits(trim_reset_value);
  pllcfgr_ = rcc_pllcfgr::reset_value;
  cfgr_ = cir_ = 0;
  ahb1enr_ = rcc_ahb1enr::Ccm::mask;
  ahb2enr_ = apb1enr_ = apb2enr_ = apb2rstr_ = ahb2rstr_ = 0;
  internal_ready_ = 0;
  crystal_ready_ = pll_ready_ = never;
  core_clock_lost_ = false;
  clocks_ = BoardClocks{};
}

void RccModel::reset(BoardTime now) {
  const bool interrupt = cir_ != 0;
  restore_reset_values();
  low_speed_runs_ = false;
  if (interrupt && clock_security_interrupt_) clock_security_interrupt_(false, now);
}

void RccModel::note_reset(stm32::ResetCause cause) {
  using stm32::ResetCause;
  switch (cause) {
    case ResetCause::none:
      return;
    case ResetCause::power_on:
      csr_ = rcc_csr::PowerOn::mask | rcc_csr::BrownOut::mask | rcc_csr::Pin::mask;
      return;
    case ResetCause::brown_out:
      csr_ |= rcc_csr::BrownOut::mask;
      break;
    case ResetCause::software:
      csr_ |= rcc_csr::Software::mask;
      break;
    case ResetCause::independent_watchdog:
      csr_ |= rcc_csr::IndependentWatchdog::mask;
      break;
    case ResetCause::window_watchdog:
      csr_ |= rcc_csr::WindowWatchdog::mask;
      break;
    case ResetCause::low_power:
      csr_ |= rcc_csr::LowPower::mask;
      break;
    case ResetCause::pin:
      break;
  }
  csr_ |= rcc_csr::Pin::mask;
}

const std::uint32_t& RccModel::enable_word(std::size_t offset) const {
  switch (offset) {
    case offsetof(RccRegisters, ahb1enr):
      return ahb1enr_;
    case offsetof(RccRegisters, ahb2enr):
      return ahb2enr_;
    case offsetof(RccRegisters, apb1enr):
      return apb1enr_;
    case offsetof(RccRegisters, apb2enr):
      return apb2enr_;
    default:
      throw std::out_of_range(fmt::format("offset {} of RCC is no enable register that is modelled", offset));
  }
}

std::uint32_t RccModel::ready_flags(BoardTime now) const {
  return (now >= internal_ready_ ? rcc_cr::InternalReady::mask : 0) |
         (now >= crystal_ready_ ? rcc_cr::CrystalReady::mask : 0) |
         (now >= pll_ready_ ? rcc_cr::PllReady::mask : 0);
}

const RegisterTable<RccModel>& RccModel::registers() {
  using Model = RccModel;
  using Row = Register<Model>;
  using Layout = RccRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, cr), "CR", Row::shows<&Model::read_control>, cr_stored | cr_read_only,
       Row::takes<&Model::write_control>},
      {offsetof(Layout, pllcfgr), "PLLCFGR", Row::shows<&Model::pllcfgr_>, pllcfgr_bits,
       Row::takes<&Model::write_pll>},
      {offsetof(Layout, cfgr), "CFGR", Row::shows<&Model::cfgr_>,
       prescaler_bits | rcc_cfgr::Switch::mask | rcc_cfgr::SwitchStatus::mask,
       Row::takes<&Model::write_configuration>},
      {offsetof(Layout, cir), "CIR", Row::shows<&Model::cir_>,
       rcc_cir::ClockSecurityFlag::mask | rcc_cir::ClockSecurityClear::mask,
       Row::takes<&Model::write_interrupts>},
      Row::reserved(offsetof(Layout, ahb1rstr), "AHB1RSTR"),
      {offsetof(Layout, ahb2rstr), "AHB2RSTR", Row::shows<&Model::ahb2rstr_>, rcc_ahb2enr::OtgFs::mask,
       Row::takes<&Model::write_usb_reset>},
      Row::reserved(offsetof(Layout, apb1rstr), "APB1RSTR"),
      {offsetof(Layout, apb2rstr), "APB2RSTR", Row::shows<&Model::apb2rstr_>,
       rcc_apb2enr::Timer1::mask | rcc_apb2enr::Timer8::mask, Row::takes<&Model::write_peripheral_reset>},
      Row::word<&Model::ahb1enr_>(offsetof(Layout, ahb1enr), "AHB1ENR",
                                  ports | rcc_ahb1enr::Ccm::mask | rcc_ahb1enr::Dma2::mask),
      Row::word<&Model::ahb2enr_>(offsetof(Layout, ahb2enr), "AHB2ENR", rcc_ahb2enr::OtgFs::mask),
      Row::word<&Model::apb1enr_>(offsetof(Layout, apb1enr), "APB1ENR", apb1_bits),
      Row::word<&Model::apb2enr_>(offsetof(Layout, apb2enr), "APB2ENR", apb2_bits),
      {offsetof(Layout, csr), "CSR", Row::shows<&Model::read_status>,
       flag_bits | rcc_csr::RemoveFlags::mask | rcc_csr::LowSpeedReady::mask,
       Row::takes<&Model::write_status>}};
  return table;
}

std::uint32_t RccModel::read_status() const {
  return csr_ | rcc_csr::LowSpeedReady::bits(low_speed_runs_ ? 1 : 0);
}

void RccModel::write_control(const Access& access, std::uint32_t value) {
  value &= ~cr_read_only;
  if (rcc_cr::InternalTrim::of(value) != trim_reset_value) refuse(access, "CR: HSITRIM is not modelled");
  const std::uint32_t falling = cr_ & ~value;
  const std::uint32_t rising = value & ~cr_;
  const std::uint32_t wanted = rcc_cfgr::Switch::of(cfgr_);
  const auto needed = [&](std::uint32_t source) { return source_in_use() == source || wanted == source; };
  const bool pll_needs_crystal = rcc_pllcfgr::FromCrystal::of(pllcfgr_) != 0;
  const bool pll_on = rcc_cr::PllOn::of(value) != 0;
  if (rcc_cr::PllOn::of(falling) != 0 && needed(rcc_cfgr::pll))
    refuse(access, "CR: PLL stopped under the core");
  if (rcc_cr::CrystalOn::of(falling) != 0 && (needed(rcc_cfgr::crystal) || (pll_on && pll_needs_crystal)))
    refuse(access, "CR: crystal stopped under the core or the PLL");
  if (rcc_cr::InternalOn::of(falling) != 0 && (needed(rcc_cfgr::internal) || (pll_on && !pll_needs_crystal)))
    refuse(access, "CR: internal oscillator stopped under the core or the PLL");

  if (rcc_cr::InternalOn::of(rising) != 0) internal_ready_ = access.now + internal_start_time;
  if (rcc_cr::InternalOn::of(falling) != 0) internal_ready_ = never;
  if (rcc_cr::CrystalOn::of(rising) != 0)
    crystal_ready_ = crystal_works_ ? access.now + crystal_start_time : never;
  if (rcc_cr::CrystalOn::of(falling) != 0) crystal_ready_ = never;
  if (rcc_cr::PllOn::of(rising) != 0) {
    const bool ready = access.now >= (pll_needs_crystal ? crystal_ready_ : internal_ready_);
    if (!ready) refuse(access, "CR: PLL switched on before its source is ready");
    check_pll(pllcfgr_);
    pll_ready_ = pll_locks_ ? access.now + pll_lock_time : never;
  }
  if (rcc_cr::PllOn::of(falling) != 0) pll_ready_ = never;
  cr_ = value;
}

void RccModel::write_pll(const Access& access, std::uint32_t value) {
  if (rcc_cr::PllOn::of(cr_) != 0) refuse(access, "PLLCFGR written while the PLL is on");
  pllcfgr_ = value;
}

BoardTime RccModel::ready_at(std::uint32_t source) const {
  if (source == rcc_cfgr::internal) return internal_ready_;
  return source == rcc_cfgr::crystal ? crystal_ready_ : pll_ready_;
}

BoardClocks RccModel::clocks_for(std::uint32_t configuration, std::uint32_t source) const {
  const std::uint64_t sysclk = source == rcc_cfgr::internal  ? internal_oscillator_hz
                               : source == rcc_cfgr::crystal ? crystal_hz
                                                             : pll_output_hz(pllcfgr_);
  return board_clocks(sysclk, configuration, {flash_.wait_states(), power_.voltage_scale_1()});
}

void RccModel::write_configuration(const Access& access, std::uint32_t value) {
  const std::uint32_t wanted = rcc_cfgr::Switch::of(value);
  if (wanted > rcc_cfgr::pll) refuse(access, "CFGR: SW = 3 is not allowed");
  // Prescalers act at once, on the clock in use; the switch comes later but must be allowed too.
  const BoardClocks now = clocks_for(value, source_in_use());
  static_cast<void>(clocks_for(value, wanted));
  if (wanted != rcc_cfgr::Switch::of(cfgr_)) switch_requested_ = access.now;
  cfgr_ = (value & (prescaler_bits | rcc_cfgr::Switch::mask)) | rcc_cfgr::SwitchStatus::bits(source_in_use());
  clocks_ = now;
}

void RccModel::write_peripheral_reset(const Access& access, std::uint32_t value) {
  const std::uint32_t rising = value & ~apb2rstr_;
  apb2rstr_ = value;
  if (rising != 0 && peripheral_reset_) peripheral_reset_(rising, access.now);
}

void RccModel::write_usb_reset(const Access& access, std::uint32_t value) {
  const bool rises = (value & ~ahb2rstr_) != 0;
  ahb2rstr_ = value;
  if (rises && usb_reset_) usb_reset_(access.now);
}

bool RccModel::usb_clock(BoardTime now) const {
  const std::uint64_t product = crystal_hz * rcc_pllcfgr::Multiplier::of(pllcfgr_);
  const std::uint64_t divider =
      std::uint64_t{rcc_pllcfgr::InputDivider::of(pllcfgr_)} * rcc_pllcfgr::UsbDivider::of(pllcfgr_);
  return now >= pll_ready_ && rcc_pllcfgr::FromCrystal::of(pllcfgr_) != 0 && product == 48 * mhz * divider;
}

void RccModel::write_interrupts(const Access& access, std::uint32_t value) {
  if (rcc_cir::ClockSecurityClear::of(value) == 0 || cir_ == 0) return;
  cir_ = 0;
  if (clock_security_interrupt_) clock_security_interrupt_(false, access.now);
}

void RccModel::write_status(std::uint32_t value) {
  csr_ = (csr_ & flag_bits) | (value & rcc_csr::RemoveFlags::mask);
  if (rcc_csr::RemoveFlags::of(value) != 0) csr_ &= ~flag_bits;
}

BoardTime RccModel::next_event() const {
  const std::uint32_t wanted = rcc_cfgr::Switch::of(cfgr_);
  if (wanted == source_in_use() || core_clock_lost_) return never;
  const BoardTime ready = ready_at(wanted);
  return ready == never ? never : std::max(switch_requested_ + switch_time, ready);
}

void RccModel::advance(BoardTime now) {
  if (next_event() > now) return;
  const std::uint32_t wanted = rcc_cfgr::Switch::of(cfgr_);
  run_from(wanted, clocks_for(cfgr_, wanted));
}

void RccModel::run_from(std::uint32_t source, const BoardClocks& clocks) {
  cfgr_ = (cfgr_ & ~(rcc_cfgr::SwitchStatus::mask | rcc_cfgr::Switch::mask)) |
          rcc_cfgr::SwitchStatus::bits(source) | rcc_cfgr::Switch::bits(source);
  clocks_ = clocks;
}

bool RccModel::core_depends_on_crystal() const {
  return source_in_use() == rcc_cfgr::crystal ||
         (source_in_use() == rcc_cfgr::pll && rcc_pllcfgr::FromCrystal::of(pllcfgr_) != 0);
}

void RccModel::fail_crystal(BoardTime now) {
  advance(now);
  const bool was_running = now >= crystal_ready_;
  crystal_works_ = false;
  crystal_ready_ = never;
  if (rcc_pllcfgr::FromCrystal::of(pllcfgr_) != 0) pll_ready_ = never;
  if (!was_running) return;
  if (rcc_cr::ClockSecurity::of(cr_) == 0) {
    core_clock_lost_ = core_depends_on_crystal();
    return;
  }
  if (core_depends_on_crystal()) {
    if (source_in_use() == rcc_cfgr::pll) cr_ &= ~rcc_cr::PllOn::mask;
    cr_ |= rcc_cr::InternalOn::mask;
    internal_ready_ = std::min(internal_ready_, now);
    run_from(rcc_cfgr::internal, clocks_for(cfgr_, rcc_cfgr::internal));
  }
  cr_ &= ~rcc_cr::CrystalOn::mask;
  cir_ = rcc_cir::ClockSecurityFlag::mask;
  if (clock_failure_) clock_failure_(now);
  if (clock_security_interrupt_) clock_security_interrupt_(true, now);
}

}  // namespace kmax::virtual_board
