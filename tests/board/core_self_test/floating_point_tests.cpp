// The FP registers over pre-emption, and single precision to the last bit. PM0214, floating-point unit.

#include "board/stm32f405/vectors.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "tests/board/core_self_test/float_loop.hpp"
#include "tests/board/core_self_test/lines.hpp"
#include "tests/board/core_self_test/report.hpp"
#include "tests/board/core_self_test/tests.hpp"

namespace kmax::core_self_test {

using namespace drivers::cortex_m;
using namespace drivers::stm32f4;

namespace {

constexpr std::uint32_t registers = 32;

std::uint32_t pattern[registers];
std::uint32_t seen[registers + 1];

/// Every FP register and FPSCR destroyed; the compiler saves those that belong to the caller.
[[gnu::always_inline]] inline void destroy_fp_registers(std::uint32_t value) {
  asm volatile(
      "vmov s0, %0\n\tvmov s1, %0\n\tvmov s2, %0\n\tvmov s3, %0\n\tvmov s4, %0\n\tvmov s5, %0\n\t"
      "vmov s6, %0\n\tvmov s7, %0\n\tvmov s8, %0\n\tvmov s9, %0\n\tvmov s10, %0\n\tvmov s11, %0\n\t"
      "vmov s12, %0\n\tvmov s13, %0\n\tvmov s14, %0\n\tvmov s15, %0\n\tvmov s16, %0\n\tvmov s17, %0\n\t"
      "vmov s18, %0\n\tvmov s19, %0\n\tvmov s20, %0\n\tvmov s21, %0\n\tvmov s22, %0\n\tvmov s23, %0\n\t"
      "vmov s24, %0\n\tvmov s25, %0\n\tvmov s26, %0\n\tvmov s27, %0\n\tvmov s28, %0\n\tvmov s29, %0\n\t"
      "vmov s30, %0\n\tvmov s31, %0\n\tvmsr fpscr, %1\n\t" ::"r"(value),
      "r"((value & 3U) << 22 | (value & 0x9FU))
      : "s0", "s1", "s2", "s3", "s4", "s5", "s6", "s7", "s8", "s9", "s10", "s11", "s12", "s13", "s14", "s15",
        "s16", "s17", "s18", "s19", "s20", "s21", "s22", "s23", "s24", "s25", "s26", "s27", "s28", "s29",
        "s30", "s31", "memory");
}

volatile std::uint32_t handled;

template <std::uint32_t index>
void preempt() {
  destroy_fp_registers(0xDEAD0000U + index + handled);
  handled = handled + 1;
  if constexpr (index > 0) {
    pend_and_wait(lines[index - 1]);
    destroy_fp_registers(0xBEEF0000U + index);
  }
}

/// Loads all registers from `pattern` and FPSCR, pends, stores them to `seen`.
[[gnu::naked, gnu::noinline]] void hold(const std::uint32_t* /*pattern*/, std::uint32_t* /*seen*/,
                                        volatile std::uint32_t* /*set_pending*/, std::uint32_t /*bit*/) {
  asm volatile(
      "vpush {s16-s31}\n\t"
      "ldr r12, =0x00C0009F\n\t"  // round towards zero, all flags
      "vmsr fpscr, r12\n\t"
      "vldmia r0, {s0-s31}\n\t"
      "str r3, [r2]\n\t"
      "dsb\n\t"
      "isb\n\t"
      "vstmia r1!, {s0-s31}\n\t"
      "vmrs r12, fpscr\n\t"
      "str r12, [r1]\n\t"
      "mov r12, #0\n\t"
      "vmsr fpscr, r12\n\t"
      "vpop {s16-s31}\n\t"
      "bx lr\n\t"
      ".ltorg\n\t");
}

/// Number of wrong registers in 10,000 rounds of three nested interrupts.
std::uint32_t preserved_registers() {
  prepare_lines();
  line_action[0] = preempt<0>;
  line_action[1] = preempt<1>;
  line_action[2] = preempt<2>;
  handled = 0;
  std::uint32_t wrong = 0;
  std::uint32_t random = 12345;
  for (int round = 0; round < 10'000; ++round) {
    for (std::uint32_t& word : pattern) {
      random = random * 1664525U + 1013904223U;
      word = random;
    }
    hold(pattern, seen, &nvic().ispr[lines[2].number / 32], lines[2].bit());
    for (std::uint32_t index = 0; index < registers; ++index) wrong += seen[index] != pattern[index] ? 1 : 0;
    wrong += seen[registers] != 0x00C0'009FU ? 1 : 0;
  }
  return wrong << 24 | handled;
}

/// Loop with the FPU in use that nothing may disturb, short enough to be repeated.
[[gnu::noinline]] std::uint32_t short_loop() {
  float x = 0.7F;
  float y = 0.1F;
  for (int step = 0; step < 1000; ++step) {
    const float z = x * 1.0001F - y / 3.7F;
    y = __builtin_sqrtf(z * z + 0.5F);
    x = z + y * 0.25F - 0.3F * z;
  }
  return std::bit_cast<std::uint32_t>(x) ^ std::bit_cast<std::uint32_t>(y);
}

volatile std::uint32_t ticks;

/// SysTick strikes anywhere in the loop; number of wrong results. How many ticks there are depends on time.
std::uint32_t struck_anywhere() {
  prepare_lines();
  line_action[0] = preempt<0>;
  const std::uint32_t right = short_loop();
  ticks = 0;
  system_tick().load = 1009;
  system_tick().val = 0;
  system_tick().ctrl = system_tick_ctrl::Enable::mask | system_tick_ctrl::TickInterrupt::mask |
                       system_tick_ctrl::ProcessorClock::mask;
  std::uint32_t wrong = 0;
  for (int round = 0; round < 2000; ++round) wrong += short_loop() != right ? 1 : 0;
  while (ticks < 100) wrong += short_loop() != right ? 1 : 0;
  system_tick().ctrl = 0;
  return wrong;
}

}  // namespace

void test_floating_point() {
  run("preserved_registers", preserved_registers);
  run("float_loop", float_loop);
  report_uncounted("struck_anywhere", struck_anywhere());
}

void count_tick() {
  destroy_fp_registers(0xABCD0000U + ticks);
  pend_and_wait(lines[0]);
  ticks = ticks + 1;
}

}  // namespace kmax::core_self_test

extern "C" void ISR_system_tick() {
  kmax::core_self_test::count_tick();
}
