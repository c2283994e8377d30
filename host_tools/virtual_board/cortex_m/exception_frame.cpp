#include "host_tools/virtual_board/cortex_m/exception_frame.hpp"

#include <unicorn/unicorn.h>

#include <array>
#include <cstring>

#include <fmt/format.h>

namespace kmax::virtual_board {
namespace {

namespace scb_cfsr = drivers::cortex_m::scb_cfsr;

constexpr std::uint32_t basic_words = 8;
constexpr std::uint32_t extended_words = 26;

constexpr std::uint32_t control_unprivileged = 1U << 0;
constexpr std::uint32_t control_process_stack = 1U << 1;
constexpr std::uint32_t control_fp_active = 1U << 2;

constexpr std::uint32_t xpsr_exception = 0x1FF;
constexpr std::uint32_t xpsr_realigned = 1U << 9;
constexpr std::uint32_t xpsr_thumb = 1U << 24;
constexpr std::uint32_t xpsr_flags = 0xF80F'0000;  // N Z C V Q, GE
constexpr std::uint32_t xpsr_if_then = 0x0600'FC00;
constexpr std::uint32_t nzcv = 0xF000'0000;

constexpr std::array saved_registers{UC_ARM_REG_R0,   UC_ARM_REG_R1,  UC_ARM_REG_R2,
                                     UC_ARM_REG_R3,   UC_ARM_REG_R12, UC_ARM_REG_LR,
                                     UC_ARM_REG_XPSR, UC_ARM_REG_SP,  UC_ARM_REG_CONTROL};
constexpr std::array restored_registers{UC_ARM_REG_R0, UC_ARM_REG_R1,  UC_ARM_REG_R2,
                                        UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR};
constexpr std::array floating_point_registers{UC_ARM_REG_D0, UC_ARM_REG_D1, UC_ARM_REG_D2,
                                              UC_ARM_REG_D3, UC_ARM_REG_D4, UC_ARM_REG_D5,
                                              UC_ARM_REG_D6, UC_ARM_REG_D7, UC_ARM_REG_FPSCR};

template <std::size_t size>
constexpr std::array<int, size> identifiers(const std::array<uc_arm_reg, size>& names) {
  std::array<int, size> numbers{};
  for (std::size_t index = 0; index < size; ++index) numbers[index] = names[index];
  return numbers;
}

constexpr auto saved = identifiers(saved_registers);
constexpr auto restored = identifiers(restored_registers);
constexpr auto floating_point = identifiers(floating_point_registers);

}  // namespace

std::optional<ExceptionFrame> ExceptionStack::push(unsigned exception, std::uint32_t return_address,
                                                   const MemoryProtection* protection) {
  std::array<std::uint64_t, saved.size()> values{};
  engine_.get(saved, values);
  const auto xpsr = static_cast<std::uint32_t>(values[6]);
  const auto sp = static_cast<std::uint32_t>(values[7]);
  const auto control = static_cast<std::uint32_t>(values[8]);
  if ((control & control_unprivileged) != 0) {
    problem_ = "CONTROL.nPRIV is set; unprivileged code is not modelled";
    return std::nullopt;
  }
  const bool extended = (control & control_fp_active) != 0;
  const std::uint32_t size = 4 * (extended ? extended_words : basic_words);
  const std::uint32_t frame = (sp - size) & ~7U;
  const bool nested = (xpsr & xpsr_exception) != 0;
  std::uint32_t kind = nested                                   ? ExceptionReturn::handler
                       : (control & control_process_stack) != 0 ? ExceptionReturn::thread_process_stack
                                                                : ExceptionReturn::thread_main_stack;
  if (extended) kind &= ~ExceptionReturn::basic_frame;
  const auto bytes = bus_.memory(frame, size);
  const bool outside =
      bytes.empty() || memory_map::flash.contains(frame) || memory_map::sram1_at_zero.contains(frame);
  constexpr auto store = MemoryProtection::Use::store;
  const bool forbidden = protection != nullptr &&
                         !(protection->allows(frame, store) && protection->allows(frame + size - 4, store));
  if (outside || forbidden) {
    problem_ =
        fmt::format("exception {}: its frame of {} bytes below the stack pointer 0x{:08X} lies {}", exception,
                    size, sp, outside ? "outside RAM" : "where the memory protection forbids stores");
    fault_ = {forbidden ? scb_cfsr::MemoryFaultStacking::mask : scb_cfsr::BusFaultStacking::mask, {kind}};
    engine_.set(UC_ARM_REG_SP, frame);
    return std::nullopt;
  }

  std::array<std::uint32_t, extended_words> words{};
  for (std::size_t index = 0; index < 6; ++index) words[index] = static_cast<std::uint32_t>(values[index]);
  words[6] = return_address;
  words[7] = (xpsr & ~xpsr_realigned) | xpsr_thumb | ((sp & 4U) != 0 ? xpsr_realigned : 0U);
  if (extended) {
    std::array<std::uint64_t, floating_point.size()> doubles{};
    engine_.get(floating_point, doubles);
    std::memcpy(&words[basic_words], doubles.data(), 4 * (extended_words - basic_words));
    words[extended_words - 1] = 0;
  }
  std::memcpy(bytes.data(), words.data(), size);

  engine_.set(UC_ARM_REG_SP, frame);
  enter_handler(exception, {kind});
  return ExceptionFrame{{kind}, extended ? frame + 4 * basic_words : 0};
}

void ExceptionStack::chain(unsigned exception, ExceptionReturn exception_return) {
  enter_handler(exception, exception_return);
}

void ExceptionStack::enter_handler(unsigned exception, ExceptionReturn exception_return) {
  // In thread mode this also switches from the process to the main stack; it must come before handler mode,
  // in which the stack selection cannot be written.
  engine_.set(UC_ARM_REG_CONTROL, 0);
  const std::uint32_t flags = engine_.get(UC_ARM_REG_XPSR) & xpsr_flags;
  engine_.set(UC_ARM_REG_XPSR_NZCVQG, flags | xpsr_thumb | exception);
  engine_.set(UC_ARM_REG_LR, exception_return.value);
  // The one write after which the emulator works out again which mode it translates for.
  engine_.set(UC_ARM_REG_APSR_NZCV, flags & nzcv);
}

std::optional<std::uint32_t> ExceptionStack::pop(ExceptionReturn exception_return) {
  const bool process_stack = exception_return.target() == ExceptionReturn::thread_process_stack;
  const bool to_handler = exception_return.target() == ExceptionReturn::handler;
  const bool extended = exception_return.floating_point();
  const std::uint32_t frame = engine_.get(process_stack ? UC_ARM_REG_PSP : UC_ARM_REG_SP);
  const std::uint32_t size = 4 * (extended ? extended_words : basic_words);
  const auto bytes = bus_.memory(frame, size);
  if (bytes.empty()) {
    problem_ = fmt::format("exception return 0x{:08X}: no memory at the stack pointer 0x{:08X}",
                           exception_return.value, frame);
    return std::nullopt;
  }
  std::array<std::uint32_t, extended_words> words{};
  std::memcpy(words.data(), bytes.data(), size);
  const std::uint32_t xpsr = words[7];
  if (((xpsr & xpsr_exception) != 0) != to_handler || (xpsr & xpsr_thumb) == 0) {
    problem_ = fmt::format(
        "exception return 0x{:08X}: the stacked xPSR 0x{:08X} does not fit; was the stack overwritten?",
        exception_return.value, xpsr);
    return std::nullopt;
  }

  if (extended) {
    std::array<std::uint64_t, floating_point.size()> doubles{};
    std::memcpy(doubles.data(), &words[basic_words], 4 * (extended_words - basic_words));
    doubles.back() &= 0xFFFF'FFFFU;
    engine_.set(floating_point, doubles);
  }
  const std::uint32_t sp = frame + size + ((xpsr & xpsr_realigned) != 0 ? 4U : 0U);
  engine_.set(process_stack ? UC_ARM_REG_PSP : UC_ARM_REG_SP, sp);
  const std::uint32_t state = xpsr & (xpsr_flags | xpsr_if_then | xpsr_thumb | xpsr_exception);
  engine_.set(UC_ARM_REG_XPSR_NZCVQG, state);
  engine_.set(UC_ARM_REG_CONTROL,
              (process_stack ? control_process_stack : 0U) | (extended ? control_fp_active : 0U));
  std::array<std::uint64_t, restored.size()> values{};
  for (std::size_t index = 0; index < values.size(); ++index) values[index] = words[index];
  engine_.set(restored, values);
  engine_.set(UC_ARM_REG_APSR_NZCV, xpsr & nzcv);
  return words[6] & ~1U;
}

}  // namespace kmax::virtual_board
