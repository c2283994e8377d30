#pragma once

#include <cstddef>
#include <cstdint>

// Neighbouring words in one instruction. On a Cortex-M4 a pair (LDRD, STRD) or four words (LDM) cost one
// executed instruction; GCC 12 seldom makes them of single accesses by itself. Elsewhere these are the single
// accesses.
namespace kmax::control {

struct TwoWords {
  std::uint32_t first;
  std::uint32_t second;
};

/// at[index] and at[index + 1]; index <= 254.
template <std::size_t index>
[[gnu::always_inline]] inline TwoWords load_two(const std::uint32_t* at) {
  static_assert(index <= 254);
#if defined(__thumb2__)
  std::uint32_t first;
  std::uint32_t second;
  asm("ldrd %0, %1, [%2, %3]"
      : "=r"(first), "=r"(second)
      : "r"(at), "i"(4 * index), "m"(at[index]), "m"(at[index + 1]));
  return {first, second};
#else
  return {at[index], at[index + 1]};
#endif
}

/// at[index] = words.first, at[index + 1] = words.second; index <= 254.
template <std::size_t index>
[[gnu::always_inline]] inline void store_two(std::uint32_t* at, TwoWords words) {
  static_assert(index <= 254);
#if defined(__thumb2__)
  asm("strd %3, %4, [%2, %5]"
      : "=m"(at[index]), "=m"(at[index + 1])
      : "r"(at), "r"(words.first), "r"(words.second), "i"(4 * index));
#else
  at[index] = words.first;
  at[index + 1] = words.second;
#endif
}

struct FourWords {
  std::uint32_t first;
  std::uint32_t second;
  std::uint32_t third;
  std::uint32_t fourth;
};

/// The next four words; moves `at` behind them. LDM wants ascending registers: r8 to r11.
[[gnu::always_inline]] inline FourWords load_next_four(const std::uint32_t*& at) {
#if defined(__thumb2__)
  register std::uint32_t first asm("r8");
  register std::uint32_t second asm("r9");
  register std::uint32_t third asm("r10");
  register std::uint32_t fourth asm("r11");
  asm("ldmia %0!, {%1, %2, %3, %4}"
      : "+r"(at), "=r"(first), "=r"(second), "=r"(third), "=r"(fourth)
      : "m"(at[0]), "m"(at[1]), "m"(at[2]), "m"(at[3]));
  return {first, second, third, fourth};
#else
  at += 4;
  return {at[-4], at[-3], at[-2], at[-1]};
#endif
}

}  // namespace kmax::control
