// What entry and return do to stacks, LR and flags. PM0214, exception entry and return.

#include "board/stm32f405/vectors.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "tests/board/core_self_test/lines.hpp"
#include "tests/board/core_self_test/report.hpp"
#include "tests/board/core_self_test/tests.hpp"

namespace kmax::core_self_test {

using namespace drivers::cortex_m;
using namespace drivers::stm32f4;

// Written by the naked handler of EXTI2 below.
extern "C" {
volatile std::uint32_t kmax_seen_lr;
volatile std::uint32_t kmax_seen_control;
volatile std::uint32_t kmax_seen_msp;
volatile std::uint32_t kmax_seen_psp;
volatile std::uint32_t kmax_seen_xpsr;
}

namespace {

Trace trace;
constexpr Line probe{static_cast<std::uint32_t>(Interrupt::exti2)};

void clear_fp_active() {
  asm volatile(
      "mrs r0, control\n\t"
      "bic r0, #4\n\t"
      "msr control, r0\n\t"
      "isb" ::
          : "r0", "memory");
}

void use_fpu() {
  asm volatile("vmov.f32 s0, #1.0" ::: "s0");
}

void trace_probe() {
  trace.add(kmax_seen_lr);
  trace.add(kmax_seen_control);
}

/// EXC_RETURN and CONTROL for thread and handler, with and without an FP context.
std::uint32_t exception_return() {
  trace.clear();
  prepare_lines();
  probe.set_priority(0);
  probe.enable();
  for (int round = 0; round < 100; ++round) {
    clear_fp_active();
    pend_and_wait(probe);
    trace_probe();
    use_fpu();
    pend_and_wait(probe);
    trace_probe();
    line_action[3] = [] {
      pend_and_wait(probe);
      trace_probe();
    };
    pend_and_wait(lines[3]);
    line_action[3] = [] {
      use_fpu();
      pend_and_wait(probe);
      trace_probe();
    };
    pend_and_wait(lines[3]);
    clear_fp_active();
    pend_and_wait(lines[3]);
    std::uint32_t control = 0;
    asm volatile("mrs %0, control" : "=r"(control));
    trace.add(control);
  }
  return trace.word();
}

alignas(8) std::uint32_t process_stack_memory[256];

/// Thread mode on the process stack; also with a stack pointer that is no multiple of 8.
std::uint32_t process_stack() {
  trace.clear();
  prepare_lines();
  probe.enable();
  line_action[2] = [] { pend_and_wait(probe); };
  for (std::uint32_t round = 0; round < 100; ++round) {
    std::uint32_t* const top = process_stack_memory + 250 + round % 2;
    const std::uint32_t number = round % 3 == 0 ? lines[2].bit() : 0;
    const std::uint32_t other = round % 3 == 0 ? 0 : probe.bit();
    volatile std::uint32_t* const first = &nvic().ispr[lines[2].number / 32];
    volatile std::uint32_t* const second = &nvic().ispr[probe.number / 32];
    std::uint32_t left = 0;
    asm volatile(
        "msr psp, %[top]\n\t"
        "mrs r4, control\n\t"
        "orr r5, r4, #2\n\t"
        "msr control, r5\n\t"
        "isb\n\t"
        "str %[number], [%[first]]\n\t"
        "str %[other], [%[second]]\n\t"
        "dsb\n\t"
        "isb\n\t"
        "mov %[left], sp\n\t"
        "mrs r5, control\n\t"
        "bic r5, #2\n\t"
        "msr control, r5\n\t"
        "isb\n\t"
        : [left] "=&r"(left)
        : [top] "r"(top), [number] "r"(number), [other] "r"(other), [first] "r"(first), [second] "r"(second)
        : "r4", "r5", "memory");
    trace.add(left == reinterpret_cast<std::uintptr_t>(top) ? 1 : 0);
    trace_probe();
    trace.add(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(top) - kmax_seen_psp));
    trace.add(
        process_stack_memory[(kmax_seen_psp - reinterpret_cast<std::uintptr_t>(process_stack_memory)) / 4 +
                             7] &
        0x200U);
  }
  return trace.word();
}

/// An interrupt in the middle of an IT block: the block straddles a page, where emulators look for
/// interrupts. Flags and the rest of the block must come back.
[[gnu::naked, gnu::noinline, gnu::aligned(4096)]] std::uint32_t interrupted_if_then(
    volatile std::uint32_t* /*set_pending*/, std::uint32_t /*bit*/) {
  asm volatile(
      "push {r4, r5, lr}\n\t"
      "movs r4, #0\n\t"
      "movs r5, #0\n\t"
      "b.w 1f\n\t"
      ".space 4074\n\t"
      "1:\n\t"
      "cmp r4, #0\n\t"  // 4084
      "nop\n\t"
      "nop\n\t"
      "nop\n\t"
      "itete eq\n\t"          // 4092
      "streq r1, [r0]\n\t"    // 4094: pends
      "addne r4, r4, #1\n\t"  // 4096: the next page
      "addeq r5, r5, #16\n\t"
      "addne r4, r4, #256\n\t"
      "dsb\n\t"
      "isb\n\t"
      "mrs r0, apsr\n\t"
      "lsrs r0, r0, #28\n\t"
      "add r0, r0, r5\n\t"
      "add r0, r0, r4\n\t"
      "pop {r4, r5, pc}\n\t");
}

std::uint32_t if_then() {
  trace.clear();
  prepare_lines();
  probe.enable();
  for (int round = 0; round < 100; ++round) {
    kmax_seen_lr = 0;
    trace.add(interrupted_if_then(&nvic().ispr[0], probe.bit()));
    trace.add(kmax_seen_lr);
  }
  return trace.word();
}

/// Core registers and flags over an interrupt whose handler changes them all.
std::uint32_t core_registers() {
  trace.clear();
  prepare_lines();
  probe.enable();
  for (std::uint32_t round = 0; round < 1000; ++round) {
    std::uint32_t sum = round * 2654435761U;
    asm volatile(
        "mov r8, %[sum]\n\t"
        "add r9, r8, #1\n\t"
        "add r10, r8, #2\n\t"
        "add r2, r8, #4\n\t"
        "add r3, r8, #5\n\t"
        "add r12, r8, #6\n\t"
        "add r14, r8, #7\n\t"
        "msr apsr_nzcvq, r8\n\t"
        "str %[bit], [%[set]]\n\t"
        "dsb\n\t"
        "isb\n\t"
        "mrs r4, apsr\n\t"
        "eor r9, r9, r10, ror #3\n\t"
        "eor r9, r9, r2, ror #5\n\t"
        "eor r9, r9, r3, ror #7\n\t"
        "eor r9, r9, r12, ror #11\n\t"
        "eor r9, r9, r14, ror #13\n\t"
        "eor %[sum], r9, r4\n\t"
        : [sum] "+&r"(sum)
        : [bit] "r"(probe.bit()), [set] "r"(&nvic().ispr[0])
        : "r2", "r3", "r4", "r8", "r9", "r10", "r12", "r14", "cc", "memory");
    trace.add(sum);
  }
  return trace.word();
}

}  // namespace

void test_frames() {
  run("exception_return", exception_return);
  run("process_stack", process_stack);
  run("if_then", if_then);
  run("core_registers", core_registers);
}

}  // namespace kmax::core_self_test

extern "C" [[gnu::naked]] void ISR_exti2() {
  asm volatile(
      "ldr r0, =kmax_seen_lr\n\t"
      "str lr, [r0]\n\t"
      "ldr r0, =kmax_seen_control\n\t"
      "mrs r1, control\n\t"
      "str r1, [r0]\n\t"
      "ldr r0, =kmax_seen_msp\n\t"
      "mrs r1, msp\n\t"
      "str r1, [r0]\n\t"
      "ldr r0, =kmax_seen_psp\n\t"
      "mrs r1, psp\n\t"
      "str r1, [r0]\n\t"
      "ldr r0, =kmax_seen_xpsr\n\t"
      "mrs r1, xpsr\n\t"
      "str r1, [r0]\n\t"
      "mov r2, #0\n\t"
      "mov r3, #0\n\t"
      "mov r12, #0\n\t"
      "subs r2, #1\n\t"
      "bx lr\n\t"
      ".ltorg\n\t");
}
