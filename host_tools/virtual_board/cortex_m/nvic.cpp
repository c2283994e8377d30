#include "host_tools/virtual_board/cortex_m/nvic.hpp"
#include "drivers/stm32f4/interrupts.hpp"

#include <bit>
#include <cstddef>
#include <optional>

namespace kmax::virtual_board {
namespace {

using Registers = drivers::cortex_m::NvicRegisters;
using drivers::stm32f4::interrupt_count;

constexpr const char* name = "NVIC";

/// Number of the first interrupt in the word at `offset` of the bit array that begins at `begin`; none
/// outside.
std::optional<unsigned> first_interrupt(std::uint32_t offset, std::size_t begin) {
  if (offset < begin || offset >= begin + sizeof(Registers::iser)) return std::nullopt;
  return static_cast<unsigned>(offset - begin) * 8;
}

bool is_priority(std::uint32_t offset) {
  return offset >= offsetof(Registers, ipr);
}

template <typename Query>
std::uint32_t gather(unsigned first, Query query) {
  std::uint32_t word = 0;
  for (unsigned bit = 0; bit < 32 && first + bit < interrupt_count; ++bit) {
    if (query(exception_number::first_interrupt + first + bit)) word |= 1U << bit;
  }
  return word;
}

template <typename Action>
void for_each_bit(std::uint32_t word, unsigned first, Action action) {
  for (; word != 0; word &= word - 1) {
    const unsigned interrupt = first + static_cast<unsigned>(std::countr_zero(word));
    if (interrupt < interrupt_count) action(exception_number::first_interrupt + interrupt);
  }
}

void require_existing(const Access& access, std::uint32_t word, unsigned first) {
  const unsigned highest = first + static_cast<unsigned>(std::bit_width(word));
  if (word != 0 && highest > interrupt_count) {
    refuse(access, name, "interrupt " + std::to_string(highest - 1) + " does not exist, 81 is the last one");
  }
}

}  // namespace

std::uint32_t Nvic::read(const Access& access) {
  if (is_priority(access.offset)) {
    const auto first = static_cast<unsigned>(access.offset - offsetof(Registers, ipr));
    std::uint32_t value = 0;
    for (unsigned byte = 0; byte < access.bytes && first + byte < interrupt_count; ++byte) {
      value |= std::uint32_t{exceptions_.priority(exception_number::first_interrupt + first + byte)}
               << (8 * byte);
    }
    return value;
  }
  require_word(access, name);
  const auto enabled = [this](unsigned exception) { return exceptions_.enabled(exception); };
  const auto pending = [this](unsigned exception) { return exceptions_.pending(exception); };
  const auto active = [this](unsigned exception) { return exceptions_.active(exception); };
  if (auto first = first_interrupt(access.offset, offsetof(Registers, iser))) return gather(*first, enabled);
  if (auto first = first_interrupt(access.offset, offsetof(Registers, icer))) return gather(*first, enabled);
  if (auto first = first_interrupt(access.offset, offsetof(Registers, ispr))) return gather(*first, pending);
  if (auto first = first_interrupt(access.offset, offsetof(Registers, icpr))) return gather(*first, pending);
  if (auto first = first_interrupt(access.offset, offsetof(Registers, iabr))) return gather(*first, active);
  refuse(access, name, "no register here");
}

void Nvic::write(const Access& access, std::uint32_t value) {
  if (is_priority(access.offset)) {
    const auto first = static_cast<unsigned>(access.offset - offsetof(Registers, ipr));
    for (unsigned byte = 0; byte < access.bytes && first + byte < interrupt_count; ++byte) {
      exceptions_.set_priority(exception_number::first_interrupt + first + byte,
                               static_cast<std::uint8_t>(value >> (8 * byte)));
    }
    return;
  }
  require_word(access, name);
  if (auto first = first_interrupt(access.offset, offsetof(Registers, iser))) {
    require_existing(access, value, *first);
    for_each_bit(value, *first, [this](unsigned exception) { exceptions_.set_enabled(exception, true); });
  } else if (first = first_interrupt(access.offset, offsetof(Registers, icer)); first) {
    for_each_bit(value, *first, [this](unsigned exception) { exceptions_.set_enabled(exception, false); });
  } else if (first = first_interrupt(access.offset, offsetof(Registers, ispr)); first) {
    require_existing(access, value, *first);
    for_each_bit(value, *first, [this](unsigned exception) { exceptions_.pend(exception); });
  } else if (first = first_interrupt(access.offset, offsetof(Registers, icpr)); first) {
    for_each_bit(value, *first, [this](unsigned exception) { exceptions_.clear_pending(exception); });
  } else if (first_interrupt(access.offset, offsetof(Registers, iabr))) {
    refuse(access, name, "IABR is read-only");
  } else {
    refuse(access, name, "no register here");
  }
}

void Nvic::set_level(drivers::stm32f4::Interrupt interrupt, bool level) {
  exceptions_.set_line(exception_number::first_interrupt + static_cast<unsigned>(interrupt), level);
}

std::uint32_t SoftwareTrigger::read(const Access& access) {
  refuse(access, "STIR", "is write-only");
}

void SoftwareTrigger::write(const Access& access, std::uint32_t value) {
  require_word(access, "STIR");
  const std::uint32_t interrupt = drivers::cortex_m::nvic_stir::InterruptNumber::of(value);
  if (interrupt >= interrupt_count) {
    refuse(access, "STIR", "interrupt " + std::to_string(interrupt) + " does not exist, 81 is the last one");
  }
  exceptions_.pend(exception_number::first_interrupt + interrupt);
}

}  // namespace kmax::virtual_board
