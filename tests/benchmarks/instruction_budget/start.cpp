// Vectors, start-up and the counted call of the measuring image.
#include <cstdint>

#include "tests/benchmarks/instruction_budget/machine.hpp"

int main();

extern "C" {
extern std::uint32_t data_start;
extern std::uint32_t data_end;
extern const std::uint32_t data_image;
extern std::uint32_t bss_start;
extern std::uint32_t bss_end;
extern std::uint32_t stack_top;

[[noreturn]] void start() {
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88U) = 0xFU << 20;  // CPACR: the FPU is on
  asm volatile("dsb\n isb");
  const std::uint32_t* from = &data_image;
  for (std::uint32_t* word = &data_start; word < &data_end; ++word) *word = *from++;
  for (std::uint32_t* word = &bss_start; word < &bss_end; ++word) *word = 0;
  kmax::instruction_budget::exit_with(static_cast<std::uint32_t>(main()));
}

[[noreturn]] void fault() {
  kmax::instruction_budget::print("instruction budget: the image faulted\n");
  kmax::instruction_budget::exit_with(2);
}

[[gnu::section(".vectors"), gnu::used]] const void* const vectors[16] = {
    &stack_top,
    reinterpret_cast<const void*>(&start),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault)};

// r0 the arguments, r1 the function. Nothing but the call lies between the two reads.
[[gnu::naked]] std::uint32_t counted_call_in_assembly() {
  asm volatile(
      ".global counted_call\n"
      ".type counted_call, %function\n"
      ".thumb_func\n"
      "counted_call:\n"
      "  push {r4, r5, r6, lr}\n"
      "  mov r6, r1\n"
      "  mov r4, #0x40000000\n"
      "  vldr s0, [r0, #16]\n"
      "  vldr s1, [r0, #20]\n"
      "  vldr s2, [r0, #24]\n"
      "  vldr s3, [r0, #28]\n"
      "  vldr s4, [r0, #32]\n"
      "  vldr s5, [r0, #36]\n"
      "  ldm r0, {r0, r1, r2, r3}\n"
      "  ldr r5, [r4, #0x24]\n"
      "  blx r6\n"
      "  ldr r0, [r4, #0x24]\n"
      "  subs r0, r0, r5\n"
      "  pop {r4, r5, r6, pc}\n");
}
}
