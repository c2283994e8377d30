#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/cortex_m/core_engine.hpp"
#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"

// What exception entry and return do to registers and stack: PM0214, exception entry and return; ARMv7-M
// architecture reference manual, B1.5.6 to B1.5.8.
//
// A frame of 8 words, or of 26 when the interrupted code used the FPU (CONTROL.FPCA). The FP registers are
// written at once, also with lazy preservation: a program sees the same.

namespace kmax::virtual_board {

/// EXC_RETURN, the value in LR that ends a handler.
struct ExceptionReturn {
  std::uint32_t value;

  static constexpr std::uint32_t handler = 0xFFFF'FFF1;
  static constexpr std::uint32_t thread_main_stack = 0xFFFF'FFF9;
  static constexpr std::uint32_t thread_process_stack = 0xFFFF'FFFD;
  static constexpr std::uint32_t basic_frame = 0x10;

  constexpr std::uint32_t target() const { return value | basic_frame; }
  constexpr bool floating_point() const { return (value & basic_frame) == 0; }
  constexpr bool valid() const {
    return target() == handler || target() == thread_main_stack || target() == thread_process_stack;
  }
};

/// The frame that was made.
struct ExceptionFrame {
  ExceptionReturn exception_return;
  std::uint32_t floating_point_address;  ///< of S0 in the frame; 0 in a frame without
};

class ExceptionStack {
 public:
  ExceptionStack(CoreEngine& engine, Bus& bus) : engine_(engine), bus_(bus) {}

  /// Saves the interrupted code, which would go on at `return_address`, and puts the core into the handler's
  /// mode. None when the frame would not lie in memory, or where `protection` forbids it (null: it is off):
  /// problem() says why, the stack pointer is where the frame should have been, fault() says what the chip
  /// makes of it.
  std::optional<ExceptionFrame> push(unsigned exception, std::uint32_t return_address,
                                     const MemoryProtection* protection);

  /// The bit of CFSR for a frame that could not be saved; 0: not a fault of the chip but of this model.
  struct StackingFault {
    std::uint32_t status = 0;
    ExceptionReturn exception_return{};
  };
  const StackingFault& fault() const { return fault_; }

  /// Switches from one handler to the next without touching the frame (tail-chaining).
  void chain(unsigned exception, ExceptionReturn exception_return);

  /// Restores what push() saved; gives the address to go on at. None when the frame or the return is broken.
  std::optional<std::uint32_t> pop(ExceptionReturn exception_return);

  const std::string& problem() const { return problem_; }

 private:
  void enter_handler(unsigned exception, ExceptionReturn exception_return);

  CoreEngine& engine_;
  Bus& bus_;
  std::string problem_;
  StackingFault fault_;
};

}  // namespace kmax::virtual_board
