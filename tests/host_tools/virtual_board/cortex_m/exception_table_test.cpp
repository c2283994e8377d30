// PM0214, exception model: states, priorities, grouping, masks; NVIC: level-sensitive and pulse interrupts.

#include "host_tools/virtual_board/cortex_m/exception_table.hpp"

#include <gtest/gtest.h>

namespace kmax::virtual_board::exception_table_test {

constexpr unsigned a = 20;
constexpr unsigned b = 40;
constexpr unsigned interrupts = 82;
constexpr unsigned c = 97;  // interrupt 81, the last one

ExceptionTable with_enabled() {
  ExceptionTable table{interrupts};
  table.reset();
  for (const unsigned exception : {a, b, c}) table.set_enabled(exception, true);
  return table;
}

TEST(ExceptionTable, HasNothingToDoAfterReset) {
  ExceptionTable table{interrupts};
  table.reset();
  EXPECT_EQ(table.candidate(), 0U);
  EXPECT_FALSE(table.preempting());
  for (unsigned exception = exception_number::first_interrupt;
       exception < exception_number::first_interrupt + interrupts; ++exception) {
    table.pend(exception);
    EXPECT_EQ(table.candidate(), 0U) << "not enabled";
  }
}

TEST(ExceptionTable, PicksByPriorityThenByNumber) {
  ExceptionTable table = with_enabled();
  table.set_priority(a, 0x50);
  table.set_priority(b, 0x30);
  table.set_priority(c, 0x30);
  table.pend(a);
  EXPECT_EQ(table.candidate(), a);
  table.pend(c);
  EXPECT_EQ(table.candidate(), c);
  table.pend(b);
  EXPECT_EQ(table.candidate(), b);
  table.pend(exception_number::hard_fault);
  EXPECT_EQ(table.candidate(), exception_number::hard_fault);
  table.pend(exception_number::non_maskable);
  EXPECT_EQ(table.candidate(), exception_number::non_maskable);
}

TEST(ExceptionTable, KeepsOnlyTheUpperFourBitsOfAPriority) {
  ExceptionTable table = with_enabled();
  table.set_priority(a, 0x7F);
  EXPECT_EQ(table.priority(a), 0x70);
}

TEST(ExceptionTable, PreemptsOnlyByAMoreUrgentGroup) {
  for (unsigned group = 0; group < 8; ++group) {
    ExceptionTable table = with_enabled();
    table.set_priority_group(group);
    table.set_priority(a, 0xA0);
    table.pend(a);
    ASSERT_TRUE(table.deliverable({})) << group;
    table.activate(a);
    for (unsigned other = 0; other < 16; ++other) {
      table.set_priority(b, static_cast<std::uint8_t>(other << 4));
      table.pend(b);
      const unsigned shift = group + 1;
      const bool expected = (other << 4) >> shift << shift < 0xA0U >> shift << shift;
      EXPECT_EQ(table.deliverable({}), expected) << "group " << group << ", priority " << other;
      table.clear_pending(b);
    }
  }
}

TEST(ExceptionTable, OrdersSubPrioritiesWithinAGroup) {
  ExceptionTable table = with_enabled();
  table.set_priority_group(6);  // one bit pre-empts
  table.set_priority(a, 0x70);
  table.set_priority(b, 0x10);
  table.pend(a);
  table.pend(b);
  EXPECT_EQ(table.candidate(), b);
  table.activate(b);
  EXPECT_EQ(table.candidate(), a);
  EXPECT_FALSE(table.preempting());
  table.deactivate(b);
  EXPECT_TRUE(table.preempting());
}

TEST(ExceptionTable, HeedsTheSpecialRegisters) {
  ExceptionTable table = with_enabled();
  table.set_priority(a, 0x50);
  table.pend(a);
  EXPECT_TRUE(table.deliverable({.basepri = 0}));
  EXPECT_TRUE(table.deliverable({.basepri = 0x60}));
  EXPECT_FALSE(table.deliverable({.basepri = 0x50}));
  EXPECT_FALSE(table.deliverable({.basepri = 0x10}));
  EXPECT_TRUE(table.deliverable({.basepri = 0x0F})) << "bits that do not exist mask nothing";
  EXPECT_FALSE(table.deliverable({.primask = true}));
  EXPECT_TRUE(table.wakes({.primask = true}));
  EXPECT_FALSE(table.wakes({.primask = true, .basepri = 0x50}));
  table.pend(exception_number::hard_fault);
  EXPECT_TRUE(table.deliverable({.primask = true, .basepri = 0x10}));
  EXPECT_FALSE(table.deliverable({.faultmask = true}));
  table.pend(exception_number::non_maskable);
  EXPECT_TRUE(table.deliverable({.faultmask = true}));
}

TEST(ExceptionTable, ReturnsToTheOuterLevel) {
  ExceptionTable table = with_enabled();
  table.set_priority(a, 0x80);
  table.set_priority(b, 0x40);
  table.set_priority(c, 0x60);
  table.pend(a);
  table.activate(a);
  table.pend(b);
  table.activate(b);
  EXPECT_EQ(table.active_count(), 2U);
  table.pend(c);
  EXPECT_FALSE(table.preempting());
  table.deactivate(b);
  EXPECT_TRUE(table.preempting());
  EXPECT_EQ(table.execution_level({}), 0x80);
  EXPECT_EQ(table.execution_level({.basepri = 0x20}), 0x20);
}

TEST(ExceptionTable, RaisesAnActiveHandlersLevelWithItsPriority) {
  ExceptionTable table = with_enabled();
  table.set_priority(a, 0x80);
  table.set_priority(b, 0x40);
  table.pend(a);
  table.activate(a);
  table.pend(b);
  table.set_priority(a, 0x30);
  EXPECT_FALSE(table.preempting());
  table.set_priority(a, 0x50);
  EXPECT_TRUE(table.preempting());
}

TEST(ExceptionTable, LatchesAPulse_PulseInterrupts) {
  ExceptionTable table = with_enabled();
  table.set_line(a, true);
  table.set_line(a, false);
  EXPECT_EQ(table.candidate(), a);
  table.activate(a);
  EXPECT_FALSE(table.pending(a));
  table.set_line(a, true);  // again while its handler runs
  table.set_line(a, false);
  EXPECT_TRUE(table.pending(a));
  table.deactivate(a);
  EXPECT_TRUE(table.preempting());
}

TEST(ExceptionTable, PendsAgainWhileTheLineIsHigh_LevelSensitiveInterrupts) {
  ExceptionTable table = with_enabled();
  table.set_line(a, true);
  table.clear_pending(a);
  EXPECT_TRUE(table.pending(a)) << "the line is still high";
  table.activate(a);
  EXPECT_FALSE(table.pending(a));
  table.clear_pending(a);
  EXPECT_FALSE(table.pending(a));
  table.deactivate(a);
  EXPECT_TRUE(table.pending(a));
  table.activate(a);
  table.set_line(a, false);
  table.deactivate(a);
  EXPECT_FALSE(table.pending(a));
}

TEST(ExceptionTable, KeepsLinesOverAReset) {
  ExceptionTable table = with_enabled();
  table.set_line(a, true);
  table.reset();
  EXPECT_FALSE(table.enabled(a));
  EXPECT_TRUE(table.pending(a));
  table.set_enabled(a, true);
  EXPECT_EQ(table.candidate(), a);
}

}  // namespace kmax::virtual_board::exception_table_test
