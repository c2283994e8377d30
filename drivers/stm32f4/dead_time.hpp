#pragma once

#include <cstdint>
#include <optional>

// The dead time between the two FETs of a leg as TIM1 and TIM8 encode it: RM0090, TIMx_BDTR, field DTG. Four
// ranges, each coarser than the one before:
//
//   code        ticks                     range at 168 MHz
//   0xxxxxxx    code                      0 to 127 ticks      0.76 us
//   10xxxxxx    (64 + x) * 2              128 to 254          1.5 us
//   110xxxxx    (32 + x) * 8              256 to 504          3.0 us
//   111xxxxx    (32 + x) * 16             512 to 1008         6.0 us
//
// One tick is one period of the timer's clock (CR1.CKD = 0).
//
// Cost: for configuration time or the compiler; `dead_time_code_for` exists at compile time only.

namespace kmax::drivers::stm32f4 {

inline constexpr std::uint32_t longest_dead_time_ticks = 1008;

/// What a code makes the timer wait.
constexpr std::uint32_t dead_time_ticks(std::uint8_t code) {
  if (code < 0x80U) return code;
  if (code < 0xC0U) return (64U + (code & 0x3FU)) * 2U;
  if (code < 0xE0U) return (32U + (code & 0x1FU)) * 8U;
  return (32U + (code & 0x1FU)) * 16U;
}

/// The code of the shortest dead time that is not shorter than `ticks`. None for 0, since a bridge without
/// dead time shorts its supply, and none above longest_dead_time_ticks.
constexpr std::optional<std::uint8_t> dead_time_code(std::uint32_t ticks) {
  if (ticks == 0 || ticks > longest_dead_time_ticks) return std::nullopt;
  if (ticks <= 127) return static_cast<std::uint8_t>(ticks);
  if (ticks <= 254) return static_cast<std::uint8_t>(0x80U + (ticks + 1U) / 2U - 64U);
  if (ticks <= 504) return static_cast<std::uint8_t>(0xC0U + (ticks + 7U) / 8U - 32U);
  return static_cast<std::uint8_t>(0xE0U + (ticks + 15U) / 16U - 32U);
}

/// Ticks of `clock_hz` that are not shorter than `nanoseconds`.
constexpr std::uint32_t ticks_not_shorter_than(std::uint32_t clock_hz, std::uint32_t nanoseconds) {
  constexpr std::uint64_t nanoseconds_per_second = 1'000'000'000;
  const std::uint64_t product = std::uint64_t{clock_hz} * nanoseconds;
  const std::uint64_t ticks = (product + nanoseconds_per_second - 1) / nanoseconds_per_second;
  return ticks > 0xFFFF'FFFFU ? 0xFFFF'FFFFU : static_cast<std::uint32_t>(ticks);
}

/// Never defined: its name is the compiler's error message.
void the_dead_time_is_zero_or_too_long_for_this_clock();

/// Does not compile when the timer cannot do it.
consteval std::uint8_t dead_time_code_for(std::uint32_t clock_hz, std::uint32_t nanoseconds) {
  const auto code = dead_time_code(ticks_not_shorter_than(clock_hz, nanoseconds));
  if (!code) the_dead_time_is_zero_or_too_long_for_this_clock();
  return *code;
}

}  // namespace kmax::drivers::stm32f4
