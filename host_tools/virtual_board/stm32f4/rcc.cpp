#include "host_tools/virtual_board/stm32f4/rcc.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

#include "host_tools/virtual_board/stm32f4/clock_rules.hpp"

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace cr = stm32::rcc_cr;
namespace pllcfgr = stm32::rcc_pllcfgr;
namespace cfgr = stm32::rcc_cfgr;
namespace cir = stm32::rcc_cir;
namespace csr = stm32::rcc_csr;
namespace ahb1 = stm32::rcc_ahb1enr;
namespace apb1 = stm32::rcc_apb1enr;
namespace apb2 = stm32::rcc_apb2enr;
using stm32::RccRegisters;

constexpr const char* block = "RCC";

constexpr std::uint32_t cr_read_only =
    cr::InternalReady::mask | cr::InternalCalibration::mask | cr::CrystalReady::mask | cr::PllReady::mask;
constexpr std::uint32_t cr_stored = cr::InternalOn::mask | cr::InternalTrim::mask | cr::CrystalOn::mask |
                                    cr::ClockSecurity::mask | cr::PllOn::mask;
constexpr std::uint32_t trim_reset_value = 16;
constexpr std::uint32_t pllcfgr_bits = pllcfgr::InputDivider::mask | pllcfgr::Multiplier::mask |
                                       pllcfgr::OutputDivider::mask | pllcfgr::FromCrystal::mask |
                                       pllcfgr::UsbDivider::mask | pllcfgr::Reserved29::mask;
constexpr std::uint32_t prescaler_bits =
    cfgr::AhbPrescaler::mask | cfgr::Apb1Prescaler::mask | cfgr::Apb2Prescaler::mask;
constexpr std::uint32_t flag_bits = csr::BrownOut::mask | csr::Pin::mask | csr::PowerOn::mask |
                                    csr::Software::mask | csr::IndependentWatchdog::mask |
                                    csr::WindowWatchdog::mask | csr::LowPower::mask;

constexpr std::uint32_t ports = ahb1::GpioA::mask | ahb1::GpioB::mask | ahb1::GpioC::mask | ahb1::GpioD::mask;
constexpr std::uint32_t apb1_bits = apb1::Timer2::mask | apb1::Timer3::mask | apb1::Timer4::mask |
                                    apb1::Timer5::mask | apb1::Spi3::mask | apb1::Usart2::mask |
                                    apb1::Uart4::mask | apb1::Can1::mask | apb1::Power::mask;
constexpr std::uint32_t apb2_bits = apb2::Timer1::mask | apb2::Timer8::mask | apb2::Adc1::mask |
                                    apb2::Adc2::mask | apb2::Adc3::mask | apb2::SystemConfiguration::mask;

std::uint32_t peripherals_at(std::uint32_t offset) {
  switch (offset) {
    case offsetof(RccRegisters, ahb1enr):
      return ports | ahb1::Ccm::mask;
    case offsetof(RccRegisters, ahb1rstr):
      return ports;
    case offsetof(RccRegisters, apb1enr):
    case offsetof(RccRegisters, apb1rstr):
      return apb1_bits;
    case offsetof(RccRegisters, apb2enr):
      return apb2_bits;
    case offsetof(RccRegisters, apb2rstr):
      return (apb2_bits & ~(apb2::Adc2::mask | apb2::Adc3::mask)) | stm32::rcc_apb2rstr::Adc::mask;
    default:
      return 0;
  }
}

}  // namespace

RccModel::RccModel(BoardClocks& clocks, const FlashInterface& flash, const PwrModel& power)
    : clocks_(clocks), flash_(flash), power_(power) {
  restore_reset_values();
  note_reset(stm32::ResetCause::power_on);
}

void RccModel::restore_reset_values() {
  cr_ = cr::InternalOn::mask | cr::InternalTrim::bits(trim_reset_value);
  pllcfgr_ = pllcfgr::reset_value;
  cfgr_ = cir_ = 0;
  ahb1rstr_ = apb1rstr_ = apb2rstr_ = 0;
  ahb1enr_ = ahb1::Ccm::mask;
  apb1enr_ = apb2enr_ = 0;
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
      csr_ = csr::PowerOn::mask | csr::BrownOut::mask | csr::Pin::mask;
      return;
    case ResetCause::brown_out:
      csr_ |= csr::BrownOut::mask;
      break;
    case ResetCause::software:
      csr_ |= csr::Software::mask;
      break;
    case ResetCause::independent_watchdog:
      csr_ |= csr::IndependentWatchdog::mask;
      break;
    case ResetCause::window_watchdog:
      csr_ |= csr::WindowWatchdog::mask;
      break;
    case ResetCause::low_power:
      csr_ |= csr::LowPower::mask;
      break;
    case ResetCause::pin:
      break;
  }
  csr_ |= csr::Pin::mask;
}

std::uint32_t* RccModel::storage(std::uint32_t offset) {
  switch (offset) {
    case offsetof(RccRegisters, ahb1rstr):
      return &ahb1rstr_;
    case offsetof(RccRegisters, apb1rstr):
      return &apb1rstr_;
    case offsetof(RccRegisters, apb2rstr):
      return &apb2rstr_;
    case offsetof(RccRegisters, ahb1enr):
      return &ahb1enr_;
    case offsetof(RccRegisters, apb1enr):
      return &apb1enr_;
    case offsetof(RccRegisters, apb2enr):
      return &apb2enr_;
    default:
      return nullptr;
  }
}

bool RccModel::clock_enabled(std::uint32_t offset, std::uint32_t mask) const {
  const std::uint32_t* enables = const_cast<RccModel*>(this)->storage(offset);
  return enables != nullptr && (*enables & mask) == mask;
}

std::uint32_t RccModel::ready_flags(BoardTime now) const {
  return (now >= internal_ready_ ? cr::InternalReady::mask : 0) |
         (now >= crystal_ready_ ? cr::CrystalReady::mask : 0) | (now >= pll_ready_ ? cr::PllReady::mask : 0);
}

std::uint32_t RccModel::read(const Access& access) {
  require_word(access, block);
  advance(access.now);
  switch (access.offset) {
    case offsetof(RccRegisters, cr):
      return cr_ | ready_flags(access.now);
    case offsetof(RccRegisters, pllcfgr):
      return pllcfgr_;
    case offsetof(RccRegisters, cfgr):
      return cfgr_;
    case offsetof(RccRegisters, cir):
      return cir_;
    case offsetof(RccRegisters, csr):
      return csr_ | csr::LowSpeedReady::bits(low_speed_runs_ ? 1 : 0);
    default:
      if (const std::uint32_t* word = storage(access.offset)) return *word;
      refuse(access, block, "not modelled");
  }
}

void RccModel::write(const Access& access, std::uint32_t value) {
  require_word(access, block);
  advance(access.now);
  switch (access.offset) {
    case offsetof(RccRegisters, cr):
      return write_control(access, value);
    case offsetof(RccRegisters, pllcfgr):
      return write_pll(access, value);
    case offsetof(RccRegisters, cfgr):
      return write_configuration(access, value);
    case offsetof(RccRegisters, cir):
      return write_interrupts(access, value);
    case offsetof(RccRegisters, csr):
      return write_status(access, value);
    case offsetof(RccRegisters, ahb1enr):
    case offsetof(RccRegisters, apb1enr):
    case offsetof(RccRegisters, apb2enr):
      return write_enables(access, value);
    case offsetof(RccRegisters, ahb1rstr):
    case offsetof(RccRegisters, apb1rstr):
    case offsetof(RccRegisters, apb2rstr):
      return write_resets(access, value);
    default:
      refuse(access, block, "not modelled");
  }
}

void RccModel::write_control(const Access& access, std::uint32_t value) {
  value &= ~cr_read_only;
  if ((value & ~cr_stored) != 0)
    refuse(access, block, "CR: HSEBYP, PLLI2SON or a reserved bit: not modelled");
  if (cr::InternalTrim::of(value) != trim_reset_value) refuse(access, block, "CR: HSITRIM is not modelled");
  const std::uint32_t falling = cr_ & ~value;
  const std::uint32_t rising = value & ~cr_;
  const std::uint32_t wanted = cfgr::Switch::of(cfgr_);
  const auto needed = [&](std::uint32_t source) { return source_in_use() == source || wanted == source; };
  const bool pll_needs_crystal = pllcfgr::FromCrystal::of(pllcfgr_) != 0;
  const bool pll_on = cr::PllOn::of(value) != 0;
  if (cr::PllOn::of(falling) != 0 && needed(cfgr::pll))
    refuse(access, block, "CR: PLL stopped under the core");
  if (cr::CrystalOn::of(falling) != 0 && (needed(cfgr::crystal) || (pll_on && pll_needs_crystal)))
    refuse(access, block, "CR: crystal stopped under the core or the PLL");
  if (cr::InternalOn::of(falling) != 0 && (needed(cfgr::internal) || (pll_on && !pll_needs_crystal)))
    refuse(access, block, "CR: internal oscillator stopped under the core or the PLL");

  if (cr::InternalOn::of(rising) != 0) internal_ready_ = access.now + internal_start_time;
  if (cr::InternalOn::of(falling) != 0) internal_ready_ = never;
  if (cr::CrystalOn::of(rising) != 0)
    crystal_ready_ = crystal_works_ ? access.now + crystal_start_time : never;
  if (cr::CrystalOn::of(falling) != 0) crystal_ready_ = never;
  if (cr::PllOn::of(rising) != 0) {
    const bool ready = access.now >= (pll_needs_crystal ? crystal_ready_ : internal_ready_);
    if (!ready) refuse(access, block, "CR: PLL switched on before its source is ready");
    check_pll(pllcfgr_);
    pll_ready_ = pll_locks_ ? access.now + pll_lock_time : never;
  }
  if (cr::PllOn::of(falling) != 0) pll_ready_ = never;
  cr_ = value;
}

void RccModel::write_pll(const Access& access, std::uint32_t value) {
  if (cr::PllOn::of(cr_) != 0) refuse(access, block, "PLLCFGR written while the PLL is on");
  if ((value & ~pllcfgr_bits) != 0) refuse(access, block, "PLLCFGR: reserved bit written 1");
  pllcfgr_ = value;
}

BoardTime RccModel::ready_at(std::uint32_t source) const {
  if (source == cfgr::internal) return internal_ready_;
  return source == cfgr::crystal ? crystal_ready_ : pll_ready_;
}

BoardClocks RccModel::clocks_for(std::uint32_t configuration, std::uint32_t source) const {
  const std::uint64_t sysclk = source == cfgr::internal  ? internal_oscillator_hz
                               : source == cfgr::crystal ? crystal_hz
                                                         : pll_output_hz(pllcfgr_);
  return board_clocks(sysclk, configuration, {flash_.wait_states(), power_.voltage_scale_1()});
}

void RccModel::write_configuration(const Access& access, std::uint32_t value) {
  if ((value & ~(prescaler_bits | cfgr::Switch::mask | cfgr::SwitchStatus::mask)) != 0)
    refuse(access, block, "CFGR: clock outputs, RTC and I2S: not modelled");
  const std::uint32_t wanted = cfgr::Switch::of(value);
  if (wanted > cfgr::pll) refuse(access, block, "CFGR: SW = 3 is not allowed");
  // Prescalers act at once, on the clock in use; the switch comes later but must be allowed too.
  const BoardClocks now = clocks_for(value, source_in_use());
  static_cast<void>(clocks_for(value, wanted));
  if (wanted != cfgr::Switch::of(cfgr_)) switch_requested_ = access.now;
  cfgr_ = (value & (prescaler_bits | cfgr::Switch::mask)) | cfgr::SwitchStatus::bits(source_in_use());
  clocks_ = now;
}

void RccModel::write_interrupts(const Access& access, std::uint32_t value) {
  if ((value & ~(cir::ClockSecurityFlag::mask | cir::ClockSecurityClear::mask)) != 0)
    refuse(access, block, "CIR: ready interrupts are not modelled");
  if (cir::ClockSecurityClear::of(value) == 0 || cir_ == 0) return;
  cir_ = 0;
  if (clock_security_interrupt_) clock_security_interrupt_(false, access.now);
}

void RccModel::write_status(const Access& access, std::uint32_t value) {
  if ((value & ~(flag_bits | csr::RemoveFlags::mask | csr::LowSpeedReady::mask)) != 0)
    refuse(access, block,
           "CSR: LSION or a reserved bit: not modelled (the watchdog starts the LSI by itself)");
  csr_ = (csr_ & flag_bits) | (value & csr::RemoveFlags::mask);
  if (csr::RemoveFlags::of(value) != 0) csr_ &= ~flag_bits;
}

void RccModel::write_enables(const Access& access, std::uint32_t value) {
  if ((value & ~peripherals_at(access.offset)) != 0)
    refuse(access, block,
           "enable bit of a peripheral that the board does not model; written " + std::to_string(value));
  *storage(access.offset) = value;
}

void RccModel::write_resets(const Access& access, std::uint32_t value) {
  if ((value & ~peripherals_at(access.offset)) != 0)
    refuse(access, block,
           "reset bit of a peripheral that the board does not model; written " + std::to_string(value));
  if (!peripheral_reset_) refuse(access, block, "peripheral resets are not connected");
  std::uint32_t& stored = *storage(access.offset);
  const std::uint32_t rising = value & ~stored;
  stored = value;
  if (rising != 0) peripheral_reset_(access.offset, rising, access.now);
}

BoardTime RccModel::next_event() const {
  const std::uint32_t wanted = cfgr::Switch::of(cfgr_);
  if (wanted == source_in_use() || core_clock_lost_) return never;
  const BoardTime ready = ready_at(wanted);
  return ready == never ? never : std::max(switch_requested_ + switch_time, ready);
}

void RccModel::advance(BoardTime now) {
  if (next_event() > now) return;
  const std::uint32_t wanted = cfgr::Switch::of(cfgr_);
  run_from(wanted, clocks_for(cfgr_, wanted));
}

void RccModel::run_from(std::uint32_t source, const BoardClocks& clocks) {
  cfgr_ = (cfgr_ & ~(cfgr::SwitchStatus::mask | cfgr::Switch::mask)) | cfgr::SwitchStatus::bits(source) |
          cfgr::Switch::bits(source);
  clocks_ = clocks;
}

bool RccModel::core_depends_on_crystal() const {
  return source_in_use() == cfgr::crystal ||
         (source_in_use() == cfgr::pll && pllcfgr::FromCrystal::of(pllcfgr_) != 0);
}

void RccModel::fail_crystal(BoardTime now) {
  advance(now);
  const bool was_running = now >= crystal_ready_;
  crystal_works_ = false;
  crystal_ready_ = never;
  if (pllcfgr::FromCrystal::of(pllcfgr_) != 0) pll_ready_ = never;
  if (!was_running) return;
  if (cr::ClockSecurity::of(cr_) == 0) {
    core_clock_lost_ = core_depends_on_crystal();
    return;
  }
  if (core_depends_on_crystal()) {
    if (source_in_use() == cfgr::pll) cr_ &= ~cr::PllOn::mask;
    cr_ |= cr::InternalOn::mask;
    internal_ready_ = std::min(internal_ready_, now);
    run_from(cfgr::internal, clocks_for(cfgr_, cfgr::internal));
  }
  cr_ &= ~cr::CrystalOn::mask;
  cir_ = cir::ClockSecurityFlag::mask;
  if (clock_failure_) clock_failure_(now);
  if (clock_security_interrupt_) clock_security_interrupt_(true, now);
}

}  // namespace kmax::virtual_board
