#include "drivers/cortex_m/fault_handler.hpp"

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"

extern "C" {
extern std::uint32_t kmax_stack_bottom[];
extern std::uint32_t kmax_stack_top[];
}

namespace kmax::drivers::cortex_m {

[[gnu::section(".noinit")]] FaultRecord fault_record;

[[noreturn, gnu::section(".boot.reset")]] void reset_core() {
  data_synchronization_barrier();
  scb().aircr = scb_aircr::Key::bits(scb_aircr::key) | scb_aircr::SystemResetRequest::mask;
  data_synchronization_barrier();
  for (;;) {
  }
}

namespace {

[[gnu::section(".boot.record")]] void begin_record(FaultCause cause) {
  const bool first = fault_record.magic != FaultRecord::valid_magic;
  fault_record.count = first ? 1 : fault_record.count + 1;
  fault_record.cause = cause;
  fault_record.exception_number = scb_icsr::ActiveVector::read(scb().icsr);
  fault_record.configurable_status = scb().cfsr;
  fault_record.hard_fault_status = scb().hfsr;
  fault_record.memory_fault_address = scb().mmfar;
  fault_record.bus_fault_address = scb().bfar;
  fault_record.frame_valid = false;
  fault_record.reported = false;
  fault_record.magic = FaultRecord::valid_magic;
}

}  // namespace

[[noreturn, gnu::section(".boot.unexpected")]] void stop_on_unexpected_interrupt() {
  enter_safe_state();
  begin_record(FaultCause::unexpected_interrupt);
  reset_core();
}

}  // namespace kmax::drivers::cortex_m

/// Called by the naked handler below with the stacked frame's address and EXC_RETURN.
extern "C" [[noreturn, gnu::used, gnu::section(".boot.fault")]] void kmax_record_fault(
    const std::uint32_t* frame, std::uint32_t exception_return) {
  using namespace kmax::drivers::cortex_m;
  enter_safe_state();
  begin_record(FaultCause::fault);
  fault_record.exception_return = exception_return;
  fault_record.stack_pointer = reinterpret_cast<std::uintptr_t>(frame);
  constexpr int frame_words = 8;
  if (frame >= kmax_stack_bottom && frame + frame_words <= kmax_stack_top) {
    fault_record.frame_valid = true;
    fault_record.r0 = frame[0];
    fault_record.r1 = frame[1];
    fault_record.r2 = frame[2];
    fault_record.r3 = frame[3];
    fault_record.r12 = frame[4];
    fault_record.link_register = frame[5];
    fault_record.program_counter = frame[6];
    fault_record.program_status = frame[7];
  } else {
    fault_record.r0 = fault_record.r1 = fault_record.r2 = fault_record.r3 = fault_record.r12 = 0;
    fault_record.link_register = fault_record.program_counter = fault_record.program_status = 0;
  }
  reset_core();
}

/// All faults. With less than 256 bytes of stack left the recording would itself run over the end and lock
/// the core up, so it continues at the top of the stack: whoever owned that memory does not return, and the
/// frame is at the other end.
extern "C" [[gnu::naked, gnu::section(".boot.fault_entry")]] void ISR_hard_fault() {
  asm volatile(
      "mrs r0, msp\n\t"
      "mov r1, lr\n\t"
      "ldr r2, =kmax_stack_bottom + 256\n\t"
      "cmp r0, r2\n\t"
      "bhs 1f\n\t"
      "ldr r2, =kmax_stack_top\n\t"
      "msr msp, r2\n\t"
      "1:\n\t"
      "b kmax_record_fault\n\t"
      ".ltorg\n\t");
}
