#include "host_tools/virtual_board/cortex_m/system_control.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace kmax::virtual_board {
namespace {

using namespace drivers::cortex_m;
namespace number = exception_number;

constexpr std::uint32_t shpr_begin = offsetof(ScbRegisters, shpr);
constexpr std::uint32_t shpr_end = shpr_begin + sizeof(ScbRegisters::shpr);
constexpr unsigned first_settable = 4;
/// What CCR comes out of reset with on this part, and the only settings that are modelled.
constexpr std::uint32_t ccr_reset = scb_ccr::AlignStack::mask;
constexpr std::uint32_t full_access = scb_cpacr::FpuAccess::maximum;

bool has_priority(unsigned exception) {
  return (exception >= number::memory_fault && exception <= number::usage_fault) ||
         exception == number::supervisor_call || exception == number::debug_monitor ||
         exception == number::pend_supervisor || exception == number::system_tick;
}

std::uint32_t flag(bool value, std::uint32_t mask) {
  return value ? mask : 0;
}

}  // namespace

bool SystemControl::fpu_enabled() const {
  return scb_cpacr::FpuAccess::of(cpacr_) == full_access;
}

void SystemControl::reset(BoardTime /*now*/) {
  reset_requested_ = false;
  active_exception_ = number::thread;
  vtor_ = 0;
  cfsr_ = 0;
  hfsr_ = 0;
  cpacr_ = 0;
}

std::uint32_t SystemControl::interrupt_control_state() const {
  bool interrupt_pending = false;
  for (unsigned exception = number::first_interrupt;
       exception < number::first_interrupt + exceptions_.interrupts(); ++exception) {
    interrupt_pending = interrupt_pending || exceptions_.pending(exception);
  }
  return scb_icsr::ActiveVector::bits(active_exception_) |
         flag(exceptions_.active_count() <= 1, scb_icsr::ReturnToBase::mask) |
         scb_icsr::PendingVector::bits(exceptions_.candidate()) |
         flag(interrupt_pending, scb_icsr::InterruptPending::mask) |
         flag(exceptions_.pending(number::system_tick), scb_icsr::SystemTickPending::mask) |
         flag(exceptions_.pending(number::pend_supervisor), scb_icsr::SupervisorPending::mask) |
         flag(exceptions_.pending(number::non_maskable), scb_icsr::NonMaskablePending::mask);
}

std::uint32_t SystemControl::application_interrupt_state() const {
  return scb_aircr::Key::bits(scb_aircr::key_read) |
         scb_aircr::PriorityGroup::bits(exceptions_.priority_group());
}

std::uint32_t SystemControl::handler_control_state() const {
  return flag(exceptions_.active(number::memory_fault), scb_shcsr::MemoryFaultActive::mask) |
         flag(exceptions_.active(number::bus_fault), scb_shcsr::BusFaultActive::mask) |
         flag(exceptions_.active(number::usage_fault), scb_shcsr::UsageFaultActive::mask) |
         flag(exceptions_.active(number::supervisor_call), scb_shcsr::SupervisorCallActive::mask) |
         flag(exceptions_.active(number::pend_supervisor), scb_shcsr::PendSupervisorActive::mask) |
         flag(exceptions_.active(number::system_tick), scb_shcsr::SystemTickActive::mask) |
         flag(exceptions_.enabled(number::memory_fault), scb_shcsr::MemoryFaultEnable::mask) |
         flag(exceptions_.enabled(number::bus_fault), scb_shcsr::BusFaultEnable::mask) |
         flag(exceptions_.enabled(number::usage_fault), scb_shcsr::UsageFaultEnable::mask);
}

std::uint32_t SystemControl::priorities(std::uint32_t offset, unsigned bytes) const {
  std::uint32_t value = 0;
  for (unsigned byte = 0; byte < bytes; ++byte) {
    const unsigned exception = first_settable + offset - shpr_begin + byte;
    if (has_priority(exception)) value |= std::uint32_t{exceptions_.priority(exception)} << (8 * byte);
  }
  return value;
}

const RegisterTable<SystemControl>& SystemControl::registers() {
  using Model = SystemControl;
  using Row = Register<Model>;
  using Layout = ScbRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, cpuid), "CPUID", [](Model&, const Access&) { return cpuid; }},
      {offsetof(Layout, icsr), "ICSR", Row::shows<&Model::interrupt_control_state>, any_bits,
       Row::takes<&Model::write_interrupt_control>},
      Row::word<&Model::vtor_>(offsetof(Layout, vtor), "VTOR", scb_vtor::TableOffset::mask),
      {offsetof(Layout, aircr), "AIRCR", Row::shows<&Model::application_interrupt_state>,
       scb_aircr::Key::mask | scb_aircr::PriorityGroup::mask | scb_aircr::SystemResetRequest::mask,
       Row::takes<&Model::write_application_interrupt>},
      Row::reserved(offsetof(Layout, scr), "SCR"),
      {offsetof(Layout, ccr), "CCR", [](Model&, const Access&) { return ccr_reset; }, ccr_reset,
       Row::takes<&Model::write_control>},
      {offsetof(Layout, shcsr), "SHCSR", Row::shows<&Model::handler_control_state>, any_bits,
       Row::takes<&Model::write_handler_control>},
      {offsetof(Layout, cfsr), "CFSR", Row::shows<&Model::cfsr_>, any_bits,
       Row::clears_by_ones<&Model::cfsr_>},
      {offsetof(Layout, hfsr), "HFSR", Row::shows<&Model::hfsr_>, any_bits,
       Row::clears_by_ones<&Model::hfsr_>},
      Row::word<&Model::mmfar_>(offsetof(Layout, mmfar), "MMFAR", any_bits),
      Row::word<&Model::bfar_>(offsetof(Layout, bfar), "BFAR", any_bits),
      {offsetof(Layout, cpacr), "CPACR", Row::shows<&Model::cpacr_>, scb_cpacr::FpuAccess::mask,
       Row::takes<&Model::write_coprocessor_access>}};
  return table;
}

std::uint32_t SystemControl::read(const Access& access) {
  const bool priority = access.offset >= shpr_begin && access.offset < shpr_end;
  return priority ? priorities(access.offset, access.bytes) : RegisterBlock::read(access);
}

void SystemControl::write(const Access& access, std::uint32_t value) {
  const bool priority = access.offset >= shpr_begin && access.offset < shpr_end;
  return priority ? write_priorities(access, value) : RegisterBlock::write(access, value);
}

void SystemControl::write_control(const Access& access, std::uint32_t value) {
  refuse_if(value != ccr_reset, access, "CCR = 0x{:X}: only its reset value 0x200 is modelled", value);
}

void SystemControl::write_coprocessor_access(const Access& access, std::uint32_t value) {
  const std::uint32_t fpu = scb_cpacr::FpuAccess::of(value);
  refuse_if(fpu != 0 && fpu != full_access, access,
            "CPACR = 0x{:08X}: only no and full access to CP10 and CP11", value);
  cpacr_ = value;
}

void SystemControl::write_interrupt_control(std::uint32_t value) {
  if (scb_icsr::NonMaskablePending::of(value) != 0) exceptions_.pend(number::non_maskable);
  if (scb_icsr::SupervisorPending::of(value) != 0) exceptions_.pend(number::pend_supervisor);
  if (scb_icsr::SupervisorPendingClear::of(value) != 0) exceptions_.clear_pending(number::pend_supervisor);
  if (scb_icsr::SystemTickPending::of(value) != 0) exceptions_.pend(number::system_tick);
  if (scb_icsr::SystemTickPendingClear::of(value) != 0) exceptions_.clear_pending(number::system_tick);
}

void SystemControl::write_application_interrupt(const Access& access, std::uint32_t value) {
  refuse_if(scb_aircr::Key::of(value) != scb_aircr::key, access,
            "AIRCR = 0x{:08X}: the key 0x05FA is missing", value);
  exceptions_.set_priority_group(scb_aircr::PriorityGroup::of(value));
  if (scb_aircr::SystemResetRequest::of(value) == 0) return;
  reset_requested_ = true;
  if (on_reset_request_) on_reset_request_(access.now);
}

void SystemControl::write_handler_control(const Access& access, std::uint32_t value) {
  const std::uint32_t enables = scb_shcsr::MemoryFaultEnable::mask | scb_shcsr::BusFaultEnable::mask |
                                scb_shcsr::UsageFaultEnable::mask;
  refuse_if((value & ~enables) != (handler_control_state() & ~enables), access,
            "SHCSR = 0x{:X}: active and pending bits cannot be written", value);
  exceptions_.set_enabled(number::memory_fault, scb_shcsr::MemoryFaultEnable::of(value) != 0);
  exceptions_.set_enabled(number::bus_fault, scb_shcsr::BusFaultEnable::of(value) != 0);
  exceptions_.set_enabled(number::usage_fault, scb_shcsr::UsageFaultEnable::of(value) != 0);
}

void SystemControl::write_priorities(const Access& access, std::uint32_t value) {
  for (unsigned byte = 0; byte < access.bytes; ++byte) {
    const unsigned exception = first_settable + access.offset - shpr_begin + byte;
    const auto priority = static_cast<std::uint8_t>(value >> (8 * byte));
    if (has_priority(exception)) {
      exceptions_.set_priority(exception, priority);
    } else if (priority != 0) {
      refuse(access, fmt::format("exception {} has no priority", exception));
    }
  }
}

bool SystemControl::raise_fault(unsigned exception, std::uint32_t status_bits, int execution_level) {
  cfsr_ |= status_bits;
  if (exception != number::hard_fault && exceptions_.enabled(exception) &&
      exceptions_.level(exception) < execution_level) {
    exceptions_.pend(exception);
    return true;
  }
  if (exception != number::hard_fault) hfsr_ |= scb_hfsr::Forced::mask;
  if (execution_level <= exceptions_.level(number::hard_fault)) return false;
  exceptions_.pend(number::hard_fault);
  return true;
}

}  // namespace kmax::virtual_board
