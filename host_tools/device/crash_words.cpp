#include "host_tools/device/crash_words.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "drivers/cortex_m/registers.hpp"

namespace kmax::device {

namespace {
namespace cfsr = drivers::cortex_m::scb_cfsr;
namespace hfsr = drivers::cortex_m::scb_hfsr;

struct BitWords {
  std::uint32_t mask;
  std::string_view words;
};

constexpr std::array status_bits = std::to_array<BitWords>({
    {cfsr::FetchViolation::mask, "instruction fetch from where no code may be"},
    {cfsr::DataViolation::mask, "data access that the memory protection forbids"},
    {cfsr::MemoryFaultUnstacking::mask, "memory protection fault on leaving an exception"},
    {cfsr::MemoryFaultStacking::mask, "memory protection fault on entering an exception (stack overflow?)"},
    {cfsr::MemoryFaultLazyFloat::mask, "memory protection fault on saving floating-point registers"},
    {cfsr::FetchBusFault::mask, "bus error on an instruction fetch"},
    {cfsr::PreciseBusFault::mask, "precise data bus error"},
    {cfsr::ImpreciseBusFault::mask, "imprecise data bus error (some instructions before)"},
    {cfsr::BusFaultUnstacking::mask, "bus error on leaving an exception"},
    {cfsr::BusFaultStacking::mask, "bus error on entering an exception (stack overflow?)"},
    {cfsr::BusFaultLazyFloat::mask, "bus error on saving floating-point registers"},
    {cfsr::UndefinedInstruction::mask, "undefined instruction"},
    {cfsr::InvalidState::mask, "invalid processor state (a jump to an even address?)"},
    {cfsr::InvalidReturn::mask, "exception return that does not fit (stack overwritten?)"},
    {cfsr::NoCoprocessor::mask, "floating-point instruction while the unit was off"},
    {cfsr::UnalignedAccess::mask, "unaligned access"},
    {cfsr::DivisionByZero::mask, "division by zero"},
});

void append(std::string& text, std::string_view more) {
  if (!text.empty()) text += "; ";
  text += more;
}
}  // namespace

std::string fault_status_words(std::uint32_t status, std::uint32_t hard_fault_status, std::uint32_t address) {
  std::string text;
  for (const BitWords& bit : status_bits) {
    if ((status & bit.mask) != 0) append(text, bit.words);
  }
  if ((hard_fault_status & hfsr::VectorTableRead::mask) != 0)
    append(text, "bus error on reading the vector table");
  constexpr std::uint32_t address_known =
      cfsr::MemoryFaultAddressValid::mask | cfsr::BusFaultAddressValid::mask;
  if ((status & address_known) != 0) text += fmt::format(" at address 0x{:08X}", address);
  return text;
}

std::string crash_words(const firmware::CrashRecord& crash) {
  if (crash.count == 0 || crash.cause == firmware::CrashCause::none) return {};
  std::string text;
  if (crash.cause == firmware::CrashCause::unexpected_interrupt) {
    text = crash.exception_number >= 16
               ? fmt::format("interrupt {} came, which nobody handles", crash.exception_number - 16)
               : fmt::format("exception {} came, which nobody handles", crash.exception_number);
  } else {
    const std::string status = fault_status_words(crash.status, crash.hard_fault_status, crash.address);
    text = status.empty() ? fmt::format("fault, exception {}", crash.exception_number) : status;
  }
  if (crash.program_counter != 0 || crash.link_register != 0) {
    text += fmt::format("; program counter 0x{:08X}, link register 0x{:08X}", crash.program_counter,
                        crash.link_register);
  } else if (crash.cause == firmware::CrashCause::fault) {
    text += "; the stack could not be read (overflow?)";
  }
  return text + fmt::format("; {} since power-on", crash.count == 1 ? std::string("the only crash")
                                                                    : fmt::format("{} crashes", crash.count));
}

}  // namespace kmax::device
