#include "host_tools/virtual_board/cortex_m/nvic.hpp"

#include <array>
#include <bit>
#include <cstddef>

namespace kmax::virtual_board {
namespace {

using Registers = drivers::cortex_m::NvicRegisters;

constexpr const char* nvic_name = "NVIC";

bool is_priority(std::uint32_t offset) {
  return offset >= offsetof(Registers, ipr);
}

/// An array of bits, one for each interrupt: what it shows, and what a 1 written to it does.
struct BitArray {
  std::size_t begin;
  bool (ExceptionTable::*shows)(unsigned exception) const;
  void (*sets)(ExceptionTable&, unsigned exception);  ///< none: read-only
  bool existing_only;                                 ///< a 1 for an interrupt that does not exist is refused
};
constexpr std::array bit_arrays{
    BitArray{offsetof(Registers, iser), &ExceptionTable::enabled,
             [](ExceptionTable& table, unsigned exception) { table.set_enabled(exception, true); }, true},
    BitArray{offsetof(Registers, icer), &ExceptionTable::enabled,
             [](ExceptionTable& table, unsigned exception) { table.set_enabled(exception, false); }, false},
    BitArray{offsetof(Registers, ispr), &ExceptionTable::pending,
             [](ExceptionTable& table, unsigned exception) { table.pend(exception); }, true},
    BitArray{offsetof(Registers, icpr), &ExceptionTable::pending,
             [](ExceptionTable& table, unsigned exception) { table.clear_pending(exception); }, false},
    BitArray{offsetof(Registers, iabr), &ExceptionTable::active, nullptr, false}};

const BitArray& array_at(const Access& access) {
  require_word(access, nvic_name);
  for (const BitArray& array : bit_arrays) {
    if (access.offset >= array.begin && access.offset < array.begin + sizeof(Registers::iser)) return array;
  }
  refuse(access, nvic_name, "no register here");
}

[[noreturn]] void refuse_interrupt(const Access& access, const char* block, unsigned interrupt,
                                   unsigned interrupts) {
  refuse(access, block,
         "interrupt " + std::to_string(interrupt) + " does not exist, " + std::to_string(interrupts - 1) +
             " is the last one");
}

}  // namespace

std::uint32_t Nvic::read(const Access& access) {
  if (is_priority(access.offset)) {
    const auto first = static_cast<unsigned>(access.offset - offsetof(Registers, ipr));
    std::uint32_t value = 0;
    for (unsigned byte = 0; byte < access.bytes && first + byte < exceptions_.interrupts(); ++byte) {
      value |= std::uint32_t{exceptions_.priority(exception_number::first_interrupt + first + byte)}
               << (8 * byte);
    }
    return value;
  }
  const BitArray& array = array_at(access);
  const auto first = static_cast<unsigned>(access.offset - array.begin) * 8;
  std::uint32_t word = 0;
  for (unsigned bit = 0; bit < 32 && first + bit < exceptions_.interrupts(); ++bit) {
    if ((exceptions_.*array.shows)(exception_number::first_interrupt + first + bit)) word |= 1U << bit;
  }
  return word;
}

void Nvic::write(const Access& access, std::uint32_t value) {
  if (is_priority(access.offset)) {
    const auto first = static_cast<unsigned>(access.offset - offsetof(Registers, ipr));
    for (unsigned byte = 0; byte < access.bytes && first + byte < exceptions_.interrupts(); ++byte) {
      exceptions_.set_priority(exception_number::first_interrupt + first + byte,
                               static_cast<std::uint8_t>(value >> (8 * byte)));
    }
    return;
  }
  const BitArray& array = array_at(access);
  if (array.sets == nullptr) refuse(access, nvic_name, "IABR is read-only");
  const auto first = static_cast<unsigned>(access.offset - array.begin) * 8;
  const unsigned end = first + static_cast<unsigned>(std::bit_width(value));
  if (array.existing_only && value != 0 && end > exceptions_.interrupts())
    refuse_interrupt(access, nvic_name, end - 1, exceptions_.interrupts());
  for (; value != 0; value &= value - 1) {
    const unsigned interrupt = first + static_cast<unsigned>(std::countr_zero(value));
    if (interrupt < exceptions_.interrupts())
      array.sets(exceptions_, exception_number::first_interrupt + interrupt);
  }
}

void Nvic::set_line(unsigned interrupt, bool level) {
  exceptions_.set_line(exception_number::first_interrupt + interrupt, level);
}

std::uint32_t SoftwareTrigger::read(const Access& access) {
  refuse(access, "STIR", "is write-only");
}

void SoftwareTrigger::write(const Access& access, std::uint32_t value) {
  require_word(access, "STIR");
  const std::uint32_t interrupt = drivers::cortex_m::nvic_stir::InterruptNumber::of(value);
  if (interrupt >= exceptions_.interrupts())
    refuse_interrupt(access, "STIR", interrupt, exceptions_.interrupts());
  exceptions_.pend(exception_number::first_interrupt + interrupt);
}

}  // namespace kmax::virtual_board
