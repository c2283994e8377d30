// Who runs when: nesting, order, masks and grouping of priorities. PM0214, exception model.

#include "drivers/cortex_m/registers.hpp"
#include "tests/board/core_self_test/lines.hpp"
#include "tests/board/core_self_test/report.hpp"
#include "tests/board/core_self_test/tests.hpp"

namespace kmax::core_self_test {

using namespace drivers::cortex_m;
using namespace drivers::stm32f4;

namespace {

Trace trace;

void set_primask(bool masked) {
  if (masked) {
    asm volatile("cpsid i" ::: "memory");
  } else {
    asm volatile("cpsie i" ::: "memory");
  }
}

void set_basepri(std::uint32_t priority) {
  asm volatile("msr basepri, %0" ::"r"(priority << 4) : "memory");
  instruction_synchronization_barrier();
}

std::uint32_t active_exception() {
  return scb_icsr::ActiveVector::read(scb().icsr);
}

/// Notes begin and end of a handler, so that nesting and sequence leave different traces.
template <std::uint32_t index>
void note() {
  trace.add(0x100 + active_exception());
  trace.add(lines[index].active());
}

/// Handler of line `index` that pends the next more urgent line in its middle.
template <std::uint32_t index>
void nest() {
  trace.add(0x1000 + index);
  trace.add(active_exception());
  if constexpr (index > 0) {
    pend_and_wait(lines[index - 1]);
    lines[lines.size() - 1].pend();  // less urgent or the same: has to wait
    synchronize();
  }
  for (const Line& line : lines) trace.add(line.active() ? 1 : 0);
  trace.add(0x2000 + index);
}

std::uint32_t nested() {
  prepare_lines();
  line_action[0] = nest<0>;
  line_action[1] = nest<1>;
  line_action[2] = nest<2>;
  line_action[3] = nest<3>;
  static volatile bool second_round;
  second_round = false;
  line_action[4] = [] {
    if (second_round) {
      trace.add(0x7777);
      return;
    }
    second_round = true;
    nest<4>();
  };
  trace.clear();
  for (int round = 0; round < 200; ++round) {
    second_round = false;
    pend_and_wait(lines[4]);
  }
  return trace.word();
}

/// All pending at once behind PRIMASK: they follow one another by priority, then by number.
std::uint32_t sequence() {
  trace.clear();
  for (std::uint32_t round = 0; round < 100; ++round) {
    prepare_lines();
    line_action[0] = note<0>;
    line_action[1] = note<1>;
    line_action[2] = note<2>;
    line_action[3] = note<3>;
    line_action[4] = note<4>;
    for (std::uint32_t index = 0; index < lines.size(); ++index) {
      lines[index].set_priority((round * (index + 3) / 4) % 5 + 2);
    }
    set_primask(true);
    for (std::uint32_t index = 0; index < lines.size(); ++index) lines[(index + round) % lines.size()].pend();
    synchronize();
    trace.add(scb_icsr::PendingVector::read(scb().icsr));
    trace.add(0xAAAA);
    set_primask(false);
    instruction_synchronization_barrier();
    trace.add(0xBBBB);
  }
  return trace.word();
}

/// For each split of the priority: does a line pre-empt one that differs in some bits only?
std::uint32_t grouping() {
  trace.clear();
  for (std::uint32_t group = 0; group < 8; ++group) {
    scb().aircr = scb_aircr::Key::bits(scb_aircr::key) | scb_aircr::PriorityGroup::bits(group);
    synchronize();
    trace.add(scb_aircr::PriorityGroup::read(scb().aircr));
    for (std::uint32_t other = 0; other < 16; ++other) {
      prepare_lines();
      lines[1].set_priority(10);
      lines[2].set_priority(other);
      line_action[1] = [] {
        trace.add(1);
        pend_and_wait(lines[2]);
        trace.add(2);
      };
      line_action[2] = [] { trace.add(3); };
      pend_and_wait(lines[1]);
    }
  }
  scb().aircr = scb_aircr::Key::bits(scb_aircr::key);
  return trace.word();
}

std::uint32_t base_priority() {
  trace.clear();
  prepare_lines();
  line_action[0] = note<0>;
  line_action[1] = note<1>;
  line_action[2] = note<2>;
  line_action[3] = note<3>;
  line_action[4] = note<4>;
  for (std::uint32_t base = 0; base < 16; ++base) {
    set_basepri(base);
    for (const Line& line : lines) line.pend();
    synchronize();
    std::uint32_t pending = 0;
    for (const Line& line : lines) pending = 2 * pending + (line.pending() ? 1 : 0);
    trace.add(0x4000 + pending);
    set_basepri(0);
    trace.add(0x5000);
  }
  // BASEPRI_MAX only ever raises the mask.
  set_basepri(6);
  std::uint32_t read = 0;
  asm volatile("msr basepri_max, %1\n\tmrs %0, basepri" : "=r"(read) : "r"(9U << 4));
  trace.add(read);
  asm volatile("msr basepri_max, %1\n\tmrs %0, basepri" : "=r"(read) : "r"(3U << 4));
  trace.add(read);
  set_basepri(0);
  return trace.word();
}

/// A masked interrupt waits, may be taken back, and ends a WFI without being served.
std::uint32_t masked() {
  trace.clear();
  prepare_lines();
  line_action[2] = note<2>;
  set_primask(true);
  pend_and_wait(lines[2]);
  trace.add(lines[2].pending());
  wait_for_interrupt();
  trace.add(0x1234);
  lines[2].clear_pending();
  synchronize();
  set_primask(false);
  instruction_synchronization_barrier();
  trace.add(0x2345);
  asm volatile("cpsid f" ::: "memory");
  pend_and_wait(lines[2]);
  trace.add(lines[2].pending());
  asm volatile("cpsie f\n\tisb" ::: "memory");
  trace.add(lines[2].pending());
  // Disabled in the NVIC: pending, but not taken.
  lines[2].disable();
  pend_and_wait(lines[2]);
  trace.add(lines[2].pending());
  lines[2].enable();
  synchronize();
  software_trigger().stir = lines[2].number;
  synchronize();
  trace.add(lines[2].pending());
  return trace.word();
}

/// A handler may change its own priority, and pend itself: it then runs again.
std::uint32_t changed_while_active() {
  trace.clear();
  prepare_lines();
  static volatile int left;
  left = 3;
  line_action[3] = [] {
    note<3>();
    lines[3].set_priority(1);
    synchronize();
    pend_and_wait(lines[2]);  // 7: no longer more urgent
    trace.add(1);
    lines[3].set_priority(12);
    synchronize();  // now it is
    trace.add(2);
    left = left - 1;
    if (left > 0) lines[3].pend();
  };
  line_action[2] = note<2>;
  pend_and_wait(lines[3]);
  return trace.word();
}

}  // namespace

void test_priorities() {
  run("nested", nested);
  run("sequence", sequence);
  run("grouping", grouping);
  run("base_priority", base_priority);
  run("masked", masked);
  run("changed_while_active", changed_while_active);
}

}  // namespace kmax::core_self_test
