#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"

#include <cstddef>

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
namespace syscfg_memrmp = drivers::stm32f4::syscfg_memrmp;

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

}  // namespace

const RegisterTable<SyscfgModel>& SyscfgModel::registers() {
  using Model = SyscfgModel;
  using Row = Register<Model>;
  constexpr auto routing = []<unsigned index>() {
    return Row{offsetof(SyscfgRegisters, exticr) + 4 * index, "EXTICR", Row::shows<&Model::exticr_, index>,
               0xFFFF, Row::takes<&Model::write_exticr, index>};
  };
  static const RegisterTable<Model> table{
      {offsetof(SyscfgRegisters, memrmp), "MEMRMP", Row::shows<&Model::memrmp_>,
       syscfg_memrmp::MemoryAt0::mask, Row::takes<&Model::write_memrmp>},
      routing.operator()<0>(),
      routing.operator()<1>(),
      routing.operator()<2>(),
      routing.operator()<3>()};
  return table;
}

void SyscfgModel::write_memrmp(const Access& access, std::uint32_t value) {
  using namespace syscfg_memrmp;
  const std::uint32_t memory = MemoryAt0::of(value);
  refuse_if(memory != main_flash && memory != system_flash && memory != sram1, access,
            "MEM_MODE = {}: the external memory at address 0 is not modelled", memory);
  memrmp_ = value;
  if (memory_at_zero_) memory_at_zero_(memory == sram1);
}

void SyscfgModel::write_exticr(const Access& access, unsigned index, std::uint32_t value) {
  for (unsigned line = 4 * index; line < 4 * index + 4; ++line) {
    const std::uint32_t port = value >> syscfg_exticr::position(line) & syscfg_exticr::port_mask;
    refuse_if(port >= port_count, access, "EXTI line {} is given port number {}; 0 (A) to 3 (D) are allowed",
              line, port);
  }
  exticr_[index] = value;
  if (routing_change_) routing_change_(access.now);
}

void SyscfgModel::reset(BoardTime now) {
  memrmp_ = 0;
  if (memory_at_zero_) memory_at_zero_(false);
  exticr_ = {};
  if (routing_change_) routing_change_(now);
}

unsigned SyscfgModel::port_of(unsigned line) const {
  return exticr_.at(syscfg_exticr::index(line)) >> syscfg_exticr::position(line) & syscfg_exticr::port_mask;
}

ExtiModel::ExtiModel(SyscfgModel& syscfg, InterruptLines& interrupts)
    : RegisterBlock("EXTI", registers()), syscfg_(syscfg), interrupts_(interrupts) {
  syscfg_.on_routing_change([this](BoardTime) { follow(); });
}

const RegisterTable<ExtiModel>& ExtiModel::registers() {
  using Model = ExtiModel;
  using Row = Register<Model>;
  using Layout = ExtiRegisters;
  static const RegisterTable<Model> table{
      Row::word<&Model::imr_>(offsetof(Layout, imr), "IMR", lines_with_vector),
      Row::reserved(offsetof(Layout, emr), "EMR"),
      Row::word<&Model::rtsr_>(offsetof(Layout, rtsr), "RTSR", pin_lines),
      Row::word<&Model::ftsr_>(offsetof(Layout, ftsr), "FTSR", pin_lines),
      {offsetof(Layout, swier), "SWIER", Row::shows<&Model::swier_>, pin_lines,
       Row::takes<&Model::write_swier>},
      {offsetof(Layout, pr), "PR", Row::shows<&Model::pr_>, pin_lines, Row::takes<&Model::write_pr>}};
  return table;
}

/// Writing 1 to a bit that is 0 sets the pending bit; the bit falls when PR is cleared.
void ExtiModel::write_swier(const Access& access, std::uint32_t value) {
  const std::uint32_t set = value & ~swier_;
  refuse_if((set & ~imr_) != 0, access, "SWIER of a masked line: its effect is not defined");
  swier_ |= set;
  pr_ |= set;
}

void ExtiModel::write_pr(std::uint32_t value) {
  pr_ &= ~value;
  swier_ &= ~value;
}

void ExtiModel::reset(BoardTime /*now*/) {
  imr_ = rtsr_ = ftsr_ = swier_ = pr_ = 0;
  follow();
}

void ExtiModel::set_pin(drivers::stm32f4::GpioPort port, unsigned pin, bool level, BoardTime /*now*/) {
  std::uint32_t& pins = pins_.at(static_cast<unsigned>(port));
  pins = level ? pins | 1U << pin : pins & ~(1U << pin);
  follow_line(pin);
  update_interrupts();
}

void ExtiModel::follow() {
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
