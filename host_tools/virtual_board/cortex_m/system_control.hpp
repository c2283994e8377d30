#pragma once

#include <cstdint>
#include <functional>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/cortex_m/exception_table.hpp"
#include "host_tools/virtual_board/register_block.hpp"

// System control block, PM0214: the register face of the exception table for the system exceptions, the
// vector table's place, the FPU's switch, the fault status and the reset request.
//
// Refused, because nothing of ours may need them: sleep-on-exit, deep sleep and SEVONPEND in SCR; trapping of
// unaligned accesses and of divisions by zero, bus faults ignored, and 4-byte stack alignment in CCR; writing
// the active bits of SHCSR; VECTRESET and VECTCLRACTIVE of AIRCR; AIRCR without its key (hardware ignores
// that silently).

namespace kmax::virtual_board {

class SystemControl final : public RegisterBlock<SystemControl> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::ScbRegisters);
  /// Cortex-M4 r0p1 (PM0214, CPUID).
  static constexpr std::uint32_t cpuid = 0x410F'C241;

  explicit SystemControl(ExceptionTable& exceptions)
      : RegisterBlock("SCB", registers()), exceptions_(exceptions) {}

  /// Besides words, bytes and half words of the priorities.
  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

  /// Called in the middle of the writing block; the processor stops before the next one with
  /// RunEnd::reset_requested.
  void on_reset_request(std::function<void(BoardTime)> callback) { on_reset_request_ = std::move(callback); }
  bool reset_requested() const { return reset_requested_; }

  std::uint32_t vector_table() const { return vtor_; }
  /// CPACR gives full access to coprocessors 10 and 11.
  bool fpu_enabled() const;

  /// The exception that the processor runs in, for VECTACTIVE: kept by the processor.
  void set_active_exception(unsigned exception) { active_exception_ = exception; }

  /// Records a fault and pends its exception: the given configurable one if SHCSR enables it and it is more
  /// urgent than `execution_level`, otherwise HardFault (PM0214, fault escalation). False: HardFault or NMI
  /// was running already, the core locks up.
  [[nodiscard]] bool raise_fault(unsigned exception, std::uint32_t status_bits, int execution_level);
  void set_bus_fault_address(std::uint32_t address) { bfar_ = address; }
  void set_memory_fault_address(std::uint32_t address) { mmfar_ = address; }

 private:
  static const RegisterTable<SystemControl>& registers();
  std::uint32_t interrupt_control_state() const;
  std::uint32_t application_interrupt_state() const;
  std::uint32_t handler_control_state() const;
  std::uint32_t priorities(std::uint32_t offset, unsigned bytes) const;
  void write_interrupt_control(std::uint32_t value);
  void write_control(const Access& access, std::uint32_t value);
  void write_coprocessor_access(const Access& access, std::uint32_t value);
  void write_application_interrupt(const Access& access, std::uint32_t value);
  void write_handler_control(const Access& access, std::uint32_t value);
  void write_priorities(const Access& access, std::uint32_t value);

  ExceptionTable& exceptions_;
  std::function<void(BoardTime)> on_reset_request_;
  bool reset_requested_ = false;
  unsigned active_exception_ = 0;
  std::uint32_t vtor_ = 0;
  std::uint32_t cfsr_ = 0;
  std::uint32_t hfsr_ = 0;
  std::uint32_t mmfar_ = 0;
  std::uint32_t bfar_ = 0;
  std::uint32_t cpacr_ = 0;
};

}  // namespace kmax::virtual_board
