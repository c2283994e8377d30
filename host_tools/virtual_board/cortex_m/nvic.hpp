#pragma once

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/cortex_m/exception_table.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// Nested vectored interrupt controller, PM0214: the register face of the exception table for the chip's
// interrupts, and the place where peripherals raise their lines.
//
// Enabling or pending an interrupt that the chip has not is refused. Priorities are bytes and may be accessed
// as bytes, half words and words; all other registers only as words.

namespace kmax::virtual_board {

class Nvic final : public Peripheral, public InterruptLines {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::NvicRegisters);

  explicit Nvic(ExceptionTable& exceptions) : exceptions_(exceptions) {}

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  /// The exception table is reset by the processor.
  void reset(BoardTime /*now*/) override {}

  void set_line(unsigned interrupt, bool level) override;

 private:
  ExceptionTable& exceptions_;
};

/// STIR, which lies apart: pends the interrupt with the number that is written.
class SoftwareTrigger final : public Peripheral {
 public:
  explicit SoftwareTrigger(ExceptionTable& exceptions) : exceptions_(exceptions) {}

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime /*now*/) override {}

 private:
  ExceptionTable& exceptions_;
};

}  // namespace kmax::virtual_board
