#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/timer.hpp"

// How the self-test tells its results: one line `name result count` for each test over USART2, both numbers
// in hexadecimal, and at last the line `end`, after which a semihosting call ends the run.
//
// `count` is the number of instructions of the test, read from TIM2: the emulators that run this image let
// TIM2 count instructions. On a chip it counts clocks and only the results can be compared.

namespace kmax::core_self_test {

/// Switches TIM2 and USART2 on.
void begin_report();

inline std::uint32_t instruction_count() {
  return drivers::stm32f4::tim2().cnt;
}

/// `count` is left out of the line when the test depends on time ("-").
void report(const char* name, std::uint32_t result, std::uint32_t count);
void report_uncounted(const char* name, std::uint32_t result);

[[noreturn]] void end_report();

/// Order and values of what happened, folded into one word: FNV-1a.
class Trace {
 public:
  void clear() { word_ = 2166136261U; }
  void add(std::uint32_t value) { word_ = (word_ ^ value) * 16777619U; }
  std::uint32_t word() const { return word_; }

 private:
  volatile std::uint32_t word_ = 2166136261U;
};

/// Runs `test`, which returns its result, and reports it.
template <typename Test>
[[gnu::noinline]] void run(const char* name, Test test) {
  const std::uint32_t before = instruction_count();
  const std::uint32_t result = test();
  report(name, result, instruction_count() - before);
}

}  // namespace kmax::core_self_test
