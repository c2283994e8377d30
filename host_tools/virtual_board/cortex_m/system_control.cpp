#include "host_tools/virtual_board/cortex_m/system_control.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace kmax::virtual_board {
namespace {

using namespace drivers::cortex_m;
namespace number = exception_number;

constexpr const char* name = "SCB";
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
  for (unsigned exception = number::first_interrupt; exception < exception_count; ++exception) {
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

std::uint32_t SystemControl::read(const Access& access) {
  if (access.offset >= shpr_begin && access.offset < shpr_end) return priorities(access.offset, access.bytes);
  require_word(access, name);
  switch (access.offset) {
    case offsetof(ScbRegisters, cpuid):
      return cpuid;
    case offsetof(ScbRegisters, icsr):
      return interrupt_control_state();
    case offsetof(ScbRegisters, vtor):
      return vtor_;
    case offsetof(ScbRegisters, aircr):
      return scb_aircr::Key::bits(scb_aircr::key_read) |
             scb_aircr::PriorityGroup::bits(exceptions_.priority_group());
    case offsetof(ScbRegisters, scr):
      return 0;
    case offsetof(ScbRegisters, ccr):
      return ccr_reset;
    case offsetof(ScbRegisters, shcsr):
      return handler_control_state();
    case offsetof(ScbRegisters, cfsr):
      return cfsr_;
    case offsetof(ScbRegisters, hfsr):
      return hfsr_;
    case offsetof(ScbRegisters, mmfar):
      return mmfar_;
    case offsetof(ScbRegisters, bfar):
      return bfar_;
    case offsetof(ScbRegisters, cpacr):
      return cpacr_;
    default:
      refuse(access, name, "register not modelled");
  }
}

void SystemControl::write(const Access& access, std::uint32_t value) {
  if (access.offset >= shpr_begin && access.offset < shpr_end) return write_priorities(access, value);
  require_word(access, name);
  switch (access.offset) {
    case offsetof(ScbRegisters, icsr):
      return write_interrupt_control(access, value);
    case offsetof(ScbRegisters, vtor):
      if ((value & ~scb_vtor::TableOffset::mask) != 0) {
        refuse(access, name,
               fmt::format("VTOR = 0x{:08X}: the vector table must be aligned to 512 bytes", value));
      }
      vtor_ = value;
      return;
    case offsetof(ScbRegisters, aircr):
      return write_application_interrupt(access, value);
    case offsetof(ScbRegisters, scr):
      if (value != 0) refuse(access, name, fmt::format("SCR = 0x{:X}: only plain sleep is modelled", value));
      return;
    case offsetof(ScbRegisters, ccr):
      if (value != ccr_reset) {
        refuse(access, name, fmt::format("CCR = 0x{:X}: only its reset value 0x200 is modelled", value));
      }
      return;
    case offsetof(ScbRegisters, shcsr):
      return write_handler_control(access, value);
    case offsetof(ScbRegisters, cfsr):
      cfsr_ &= ~value;
      return;
    case offsetof(ScbRegisters, hfsr):
      hfsr_ &= ~value;
      return;
    case offsetof(ScbRegisters, mmfar):
      mmfar_ = value;
      return;
    case offsetof(ScbRegisters, bfar):
      bfar_ = value;
      return;
    case offsetof(ScbRegisters, cpacr): {
      const std::uint32_t fpu = scb_cpacr::FpuAccess::of(value);
      if ((value & ~scb_cpacr::FpuAccess::mask) != 0 || (fpu != 0 && fpu != full_access)) {
        refuse(access, name,
               fmt::format("CPACR = 0x{:08X}: only no and full access to CP10 and CP11", value));
      }
      cpacr_ = value;
      return;
    }
    default:
      refuse(access, name, "register read-only or not modelled");
  }
}

void SystemControl::write_interrupt_control(const Access& /*access*/, std::uint32_t value) {
  if (scb_icsr::NonMaskablePending::of(value) != 0) exceptions_.pend(number::non_maskable);
  if (scb_icsr::SupervisorPending::of(value) != 0) exceptions_.pend(number::pend_supervisor);
  if (scb_icsr::SupervisorPendingClear::of(value) != 0) exceptions_.clear_pending(number::pend_supervisor);
  if (scb_icsr::SystemTickPending::of(value) != 0) exceptions_.pend(number::system_tick);
  if (scb_icsr::SystemTickPendingClear::of(value) != 0) exceptions_.clear_pending(number::system_tick);
}

void SystemControl::write_application_interrupt(const Access& access, std::uint32_t value) {
  if (scb_aircr::Key::of(value) != scb_aircr::key) {
    refuse(access, name, fmt::format("AIRCR = 0x{:08X}: the key 0x05FA is missing", value));
  }
  const std::uint32_t known =
      scb_aircr::Key::mask | scb_aircr::PriorityGroup::mask | scb_aircr::SystemResetRequest::mask;
  if ((value & ~known) != 0) refuse(access, name, fmt::format("AIRCR = 0x{:08X}: bit not modelled", value));
  exceptions_.set_priority_group(scb_aircr::PriorityGroup::of(value));
  if (scb_aircr::SystemResetRequest::of(value) == 0) return;
  reset_requested_ = true;
  if (on_reset_request_) on_reset_request_(access.now);
}

void SystemControl::write_handler_control(const Access& access, std::uint32_t value) {
  const std::uint32_t enables = scb_shcsr::MemoryFaultEnable::mask | scb_shcsr::BusFaultEnable::mask |
                                scb_shcsr::UsageFaultEnable::mask;
  if ((value & ~enables) != (handler_control_state() & ~enables)) {
    refuse(access, name, fmt::format("SHCSR = 0x{:X}: active and pending bits cannot be written", value));
  }
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
      refuse(access, name, fmt::format("exception {} has no priority", exception));
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
