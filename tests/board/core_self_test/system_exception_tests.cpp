// SVC, PendSV, the vector table's place. PM0214, exception types.

#include "board/stm32f405/vectors.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "tests/board/core_self_test/lines.hpp"
#include "tests/board/core_self_test/report.hpp"
#include "tests/board/core_self_test/tests.hpp"

namespace kmax::core_self_test {

using namespace drivers::cortex_m;
using namespace drivers::stm32f4;

namespace {

Trace trace;

void set_system_priority(std::uint32_t exception, std::uint32_t priority) {
  auto* bytes = reinterpret_cast<volatile std::uint8_t*>(&scb().shpr[0]);
  bytes[exception - 4] = static_cast<std::uint8_t>(priority << 4);
}

void pend_supervisor() {
  scb().icsr = scb_icsr::SupervisorPending::mask;
}

std::uint32_t supervise(std::uint32_t a, std::uint32_t b) {
  register std::uint32_t r0 asm("r0") = a;
  register std::uint32_t r1 asm("r1") = b;
  asm volatile("svc 0x5A" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

/// Arguments and result travel in the stacked registers, the number in the instruction.
std::uint32_t supervisor_call() {
  trace.clear();
  set_system_priority(11, 6);
  for (std::uint32_t round = 0; round < 1000; ++round) trace.add(supervise(round, 3 * round + 1));
  // From a handler that the SVC outranks.
  prepare_lines();
  line_action[4] = [] { trace.add(supervise(7, 8)); };
  pend_and_wait(lines[4]);
  return trace.word();
}

/// PendSV asked for in a handler runs after it, below everything else.
std::uint32_t pended_supervisor() {
  trace.clear();
  prepare_lines();
  set_system_priority(14, 15);
  for (std::uint32_t index = 0; index < lines.size(); ++index) {
    line_action[index] = [] {
      trace.add(scb_icsr::ActiveVector::read(scb().icsr));
      pend_supervisor();
      synchronize();
      trace.add(scb_icsr::SupervisorPending::read(scb().icsr));
    };
  }
  for (std::uint32_t round = 0; round < 500; ++round) {
    pend_and_wait(lines[round % lines.size()]);
    trace.add(0xCC);
  }
  asm volatile("cpsid i" ::: "memory");
  pend_supervisor();
  synchronize();
  scb().icsr = scb_icsr::SupervisorPendingClear::mask;
  synchronize();
  asm volatile("cpsie i\n\tisb" ::: "memory");
  trace.add(0xDD);
  return trace.word();
}

alignas(512) board::VectorTable moved_table;

std::uint32_t moved_vectors() {
  trace.clear();
  prepare_lines();
  line_action[1] = [] { trace.add(1); };
  pend_and_wait(lines[1]);
  moved_table = board::vector_table;
  moved_table.exception[16 + lines[1].number - 1] = [] {
    trace.add(2);
    trace.add(scb_icsr::ActiveVector::read(scb().icsr));
  };
  const std::uint32_t before = scb().vtor;
  scb().vtor = reinterpret_cast<std::uintptr_t>(&moved_table);
  synchronize();
  pend_and_wait(lines[1]);
  scb().vtor = before;
  synchronize();
  pend_and_wait(lines[1]);
  return trace.word();
}

}  // namespace

void note_supervisor_call(std::uint32_t* frame) {
  const auto* next = reinterpret_cast<const std::uint16_t*>(static_cast<std::uintptr_t>(frame[6]));
  frame[0] = frame[0] * 31 + frame[1] + (next[-1] & 0xFFU);
  trace.add(scb_icsr::ActiveVector::read(scb().icsr));
}

void test_system_exceptions() {
  run("supervisor_call", supervisor_call);
  run("pended_supervisor", pended_supervisor);
  run("moved_vectors", moved_vectors);
}

}  // namespace kmax::core_self_test

extern "C" {

[[gnu::used]] void kmax_note_supervisor_call(std::uint32_t* frame) {
  kmax::core_self_test::note_supervisor_call(frame);
}

[[gnu::naked]] void ISR_supervisor_call() {
  asm volatile(
      "tst lr, #4\n\t"
      "ite eq\n\t"
      "mrseq r0, msp\n\t"
      "mrsne r0, psp\n\t"
      "b kmax_note_supervisor_call\n\t");
}

void ISR_pend_supervisor() {
  kmax::core_self_test::trace.add(0xEE);
}
}
