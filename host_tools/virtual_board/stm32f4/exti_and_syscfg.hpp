#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "drivers/stm32f4/registers/exti.hpp"
#include "drivers/stm32f4/registers/gpio.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// SYSCFG: RM0090, chapter System configuration controller. EXTICR1 to 4 with ports A to D, the ones that
/// have pins here; MEMRMP but for the external memory, which the part's package has no pins for. PMC and
/// CMPCR are refused.
class SyscfgModel final : public RegisterBlock<SyscfgModel> {
 public:
  SyscfgModel() : RegisterBlock("SYSCFG", registers()) {}
  void reset(BoardTime now) override;

  /// Index of the port (0 = A) whose pin feeds a line (0 to 15).
  unsigned port_of(unsigned line) const;
  /// Called when MEMRMP is written and at a reset: whether SRAM1 is at address 0.
  void on_memory_at_zero(std::function<void(bool sram)> callback) { memory_at_zero_ = std::move(callback); }
  /// Called after EXTICR has changed. The EXTI model takes it.
  void on_routing_change(std::function<void(BoardTime)> callback) { routing_change_ = std::move(callback); }

 private:
  static const RegisterTable<SyscfgModel>& registers();
  void write_memrmp(const Access& access, std::uint32_t value);
  void write_exticr(const Access& access, unsigned index, std::uint32_t value);

  std::uint32_t memrmp_ = 0;
  std::array<std::uint32_t, 4> exticr_{};
  std::function<void(bool)> memory_at_zero_;
  std::function<void(BoardTime)> routing_change_;
};

/// EXTI: RM0090, chapter Interrupts and events, section External interrupt/event controller.
///
/// Pin lines 0 to 15 follow the level of the pin that EXTICR routes to them; an edge that RTSR or FTSR
/// selects sets PR whether the line is masked or not (figure of the block diagram: the mask comes after the
/// pending register). A change of EXTICR can be such an edge. The vectors EXTI2, EXTI4, EXTI9_5 and EXTI15_10
/// are levels: PR and IMR. Edges are seen however short they are (silicon: the pulse has to exceed 10 ns).
///
/// Refused: unmasking a line that has no vector in this firmware (0, 1, 3, 16 and above), events (EMR), SWIER
/// of a masked line (the manual defines it for unmasked ones only), bits above line 15.
class ExtiModel final : public RegisterBlock<ExtiModel> {
 public:
  ExtiModel(SyscfgModel& syscfg, InterruptLines& interrupts);

  void reset(BoardTime now) override;

  /// Level of a port's pin as the input buffer sees it. Wire GpioPortModel::on_input_change of each port
  /// here. All pins are low until told otherwise.
  void set_pin(drivers::stm32f4::GpioPort port, unsigned pin, bool level, BoardTime now);

 private:
  static const RegisterTable<ExtiModel>& registers();
  void write_swier(const Access& access, std::uint32_t value);
  void write_pr(std::uint32_t value);
  void after_write() override { update_interrupts(); }
  void follow();
  void follow_line(unsigned line);
  void update_interrupts();

  SyscfgModel& syscfg_;
  InterruptLines& interrupts_;
  std::array<std::uint32_t, 4> pins_{};  // by port
  std::uint32_t lines_ = 0;              // levels
  std::uint32_t imr_ = 0, rtsr_ = 0, ftsr_ = 0, swier_ = 0, pr_ = 0;
  std::uint32_t raised_ = 0;  // lines of which the vector's level is known to be up: PR and IMR as told last
};

}  // namespace kmax::virtual_board
