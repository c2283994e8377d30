#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"

#include <cstddef>
#include <string>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::exti_interrupt;
using drivers::stm32f4::exti_pin_lines;
using drivers::stm32f4::ExtiRegisters;
using drivers::stm32f4::Interrupt;
using drivers::stm32f4::SyscfgRegisters;
namespace syscfg_exticr = drivers::stm32f4::syscfg_exticr;

constexpr const char* syscfg_name = "SYSCFG";
constexpr const char* exti_name = "EXTI";
constexpr std::uint32_t port_count = 4;
constexpr std::uint32_t pin_lines = (1U << exti_pin_lines) - 1U;

/// Lines that share a vector, by the first of them.
struct Vector {
  Interrupt interrupt;
  std::uint32_t lines;
};
constexpr std::uint32_t lines_of(Interrupt interrupt) {
  std::uint32_t lines = 0;
  for (unsigned line = 0; line < exti_pin_lines; ++line) {
    if (exti_interrupt(line) == interrupt) lines |= 1U << line;
  }
  return lines;
}
constexpr std::array vectors{Vector{Interrupt::exti2, lines_of(Interrupt::exti2)},
                             Vector{Interrupt::exti4, lines_of(Interrupt::exti4)},
                             Vector{Interrupt::exti9_5, lines_of(Interrupt::exti9_5)},
                             Vector{Interrupt::exti15_10, lines_of(Interrupt::exti15_10)}};
constexpr std::uint32_t lines_with_vector =
    vectors[0].lines | vectors[1].lines | vectors[2].lines | vectors[3].lines;

/// Index of the EXTICR at this offset; refuses all other registers.
unsigned exticr_index(const Access& access) {
  require_word(access, syscfg_name);
  constexpr std::uint32_t first = offsetof(SyscfgRegisters, exticr);
  if (access.offset < first || access.offset >= first + 16) {
    refuse(access, syscfg_name, "only EXTICR1 to EXTICR4 are modelled");
  }
  return (access.offset - first) / 4;
}

}  // namespace

std::uint32_t SyscfgModel::read(const Access& access) {
  return exticr_[exticr_index(access)];
}

void SyscfgModel::write(const Access& access, std::uint32_t value) {
  const unsigned index = exticr_index(access);
  if (value > 0xFFFFU) refuse(access, syscfg_name, "reserved bits of EXTICR are written 1");
  for (unsigned line = 4 * index; line < 4 * index + 4; ++line) {
    const std::uint32_t port = value >> syscfg_exticr::position(line) & syscfg_exticr::port_mask;
    if (port >= port_count) {
      refuse(access, syscfg_name,
             "EXTI line " + std::to_string(line) + " is given port number " + std::to_string(port) +
                 "; 0 (A) to 3 (D) are allowed");
    }
  }
  exticr_[index] = value;
  if (routing_change_) routing_change_(access.now);
}

void SyscfgModel::reset(BoardTime now) {
  exticr_ = {};
  if (routing_change_) routing_change_(now);
}

unsigned SyscfgModel::port_of(unsigned line) const {
  return exticr_.at(syscfg_exticr::index(line)) >> syscfg_exticr::position(line) & syscfg_exticr::port_mask;
}

ExtiModel::ExtiModel(SyscfgModel& syscfg, InterruptLines& interrupts)
    : syscfg_(syscfg), interrupts_(interrupts) {
  syscfg_.on_routing_change([this](BoardTime now) { follow(now); });
}

std::uint32_t ExtiModel::read(const Access& access) {
  require_word(access, exti_name);
  switch (access.offset) {
    case offsetof(ExtiRegisters, imr):
      return imr_;
    case offsetof(ExtiRegisters, emr):
      return 0;
    case offsetof(ExtiRegisters, rtsr):
      return rtsr_;
    case offsetof(ExtiRegisters, ftsr):
      return ftsr_;
    case offsetof(ExtiRegisters, swier):
      return swier_;
    case offsetof(ExtiRegisters, pr):
      return pr_;
    default:
      refuse(access, exti_name, "no such register");
  }
}

void ExtiModel::write(const Access& access, std::uint32_t value) {
  require_word(access, exti_name);
  if ((value & ~pin_lines) != 0) refuse(access, exti_name, "lines above 15 are not modelled");
  switch (access.offset) {
    case offsetof(ExtiRegisters, imr):
      if ((value & ~lines_with_vector) != 0) {
        refuse(access, exti_name,
               "IMR unmasks a line that has no vector here; lines 2, 4 and 5 to 15 have one");
      }
      imr_ = value;
      break;
    case offsetof(ExtiRegisters, emr):
      if (value != 0) refuse(access, exti_name, "events (EMR) are not modelled");
      break;
    case offsetof(ExtiRegisters, rtsr):
      rtsr_ = value;
      break;
    case offsetof(ExtiRegisters, ftsr):
      ftsr_ = value;
      break;
    case offsetof(ExtiRegisters, swier): {
      // Writing 1 to a bit that is 0 sets the pending bit; the bit falls when PR is cleared.
      const std::uint32_t set = value & ~swier_;
      if ((set & ~imr_) != 0) refuse(access, exti_name, "SWIER of a masked line: its effect is not defined");
      swier_ |= set;
      pr_ |= set;
      break;
    }
    case offsetof(ExtiRegisters, pr):
      pr_ &= ~value;
      swier_ &= ~value;
      break;
    default:
      refuse(access, exti_name, "no such register");
  }
  update_interrupts();
}

void ExtiModel::reset(BoardTime now) {
  imr_ = rtsr_ = ftsr_ = swier_ = pr_ = 0;
  follow(now);
}

void ExtiModel::set_pin(drivers::stm32f4::GpioPort port, unsigned pin, bool level, BoardTime now) {
  static_cast<void>(now);
  std::uint32_t& pins = pins_.at(static_cast<unsigned>(port));
  pins = level ? pins | 1U << pin : pins & ~(1U << pin);
  follow_line(pin);
  update_interrupts();
}

void ExtiModel::follow(BoardTime now) {
  static_cast<void>(now);
  for (unsigned line = 0; line < exti_pin_lines; ++line) follow_line(line);
  update_interrupts();
}

void ExtiModel::follow_line(unsigned line) {
  const std::uint32_t bit = 1U << line;
  const bool level = (pins_[syscfg_.port_of(line)] & bit) != 0;
  if (level == ((lines_ & bit) != 0)) return;
  lines_ ^= bit;
  pr_ |= (level ? rtsr_ : ftsr_) & bit;
}

void ExtiModel::update_interrupts() {
  const std::uint32_t now_raised = pr_ & imr_;
  for (const Vector& vector : vectors) {
    const bool before = (raised_ & vector.lines) != 0;
    const bool after = (now_raised & vector.lines) != 0;
    if (before != after) interrupts_.set_level(vector.interrupt, after);
  }
  raised_ = now_raised;
}

}  // namespace kmax::virtual_board
