#pragma once

#include <cstdint>

// What the measuring image needs of the emulated machine (QEMU's netduinoplus2 under -icount shift=0): a
// counter of executed instructions, a place to print to and an exit.
namespace kmax::instruction_budget {

// Timer 2 of that machine counts nanoseconds of virtual time, and an instruction takes one.
inline volatile std::uint32_t& timer_register(std::uint32_t offset) {
  return *reinterpret_cast<volatile std::uint32_t*>(0x40000000U + offset);
}
inline void start_counter() {
  timer_register(0x2C) = 0xFFFFFFFFU;  // ARR
  timer_register(0x00) = 1;            // CR1: CEN
}

struct Registers {
  const void* integers[4] = {};  // r0 .. r3
  float floats[6] = {};          // s0 .. s5
};

// Calls `function` with these arguments and returns what the counter moved by between two reads of it. All
// that is not the function itself adds the same to every result.
extern "C" std::uint32_t counted_call(const Registers& arguments, void (*function)());

// Semihosting: the emulator carries these out.
inline std::uint32_t semihosting(std::uint32_t operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}
inline void print(const char* text) {
  semihosting(0x04, text);  // SYS_WRITE0
}
[[noreturn]] inline void exit_with(std::uint32_t code) {
  const std::uint32_t block[2] = {0x20026U, code};  // ADP_Stopped_ApplicationExit
  for (;;) semihosting(0x20, block);                // SYS_EXIT_EXTENDED
}

}  // namespace kmax::instruction_budget
