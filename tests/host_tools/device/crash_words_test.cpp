#include "host_tools/device/crash_words.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::crash_words_test {

using firmware::CrashCause;
using firmware::CrashRecord;

// Bit positions as PM0214 gives them for the configurable fault status register.
TEST(CrashWords, EveryStatusBitHasItsOwnWords) {
  std::set<std::string> seen;
  for (const unsigned bit : {0, 1, 3, 4, 5, 8, 9, 10, 11, 12, 13, 16, 17, 18, 19, 24, 25}) {
    const std::string words = fault_status_words(1U << bit, 0, 0);
    EXPECT_FALSE(words.empty()) << bit;
    EXPECT_TRUE(seen.insert(words).second) << words;
  }
  for (const unsigned reserved : {2, 6, 14, 20, 23, 26, 31})
    EXPECT_EQ(fault_status_words(1U << reserved, 0, 0), "");
  EXPECT_CONTAINS(fault_status_words(1U << 25, 0, 0), "division by zero");
  EXPECT_CONTAINS(fault_status_words(1U << 16, 0, 0), "undefined instruction");
  EXPECT_CONTAINS(fault_status_words(1U << 18, 0, 0), "exception return");
  EXPECT_CONTAINS(fault_status_words(1U << 19, 0, 0), "floating-point");
  EXPECT_CONTAINS(fault_status_words(0, 1U << 1, 0), "vector table");
}

TEST(CrashWords, TheAddressIsShownOnlyIfTheProcessorKnewIt) {
  EXPECT_EQ(fault_status_words(0x8200, 0x4000'0000, 0x4003'0000),
            "precise data bus error at address 0x40030000");
  EXPECT_EQ(fault_status_words(0x0400, 0x4000'0000, 0x4003'0000),
            "imprecise data bus error (some instructions before)");
  EXPECT_CONTAINS(fault_status_words(0x0082, 0, 0x10), "at address 0x00000010");
}

TEST(CrashWords, OneLine) {
  CrashRecord crash;
  EXPECT_EQ(crash_words(crash), "");
  crash = {1, CrashCause::fault, 3, 0x0800'1234, 0x0800'5679, 0x8200, 0x4000'0000, 0x4003'0000};
  EXPECT_EQ(
      crash_words(crash),
      "precise data bus error at address 0x40030000; program counter 0x08001234, link register 0x08005679; "
      "the only crash since power-on");
  crash.count = 7;
  EXPECT_CONTAINS(crash_words(crash), "7 crashes since power-on");
  crash.program_counter = crash.link_register = 0;
  EXPECT_CONTAINS(crash_words(crash), "the stack could not be read");
  crash.status = 0;
  EXPECT_CONTAINS(crash_words(crash), "fault, exception 3");
  crash = {2, CrashCause::unexpected_interrupt, 16 + 38, 0, 0, 0, 0, 0};
  EXPECT_EQ(crash_words(crash), "interrupt 38 came, which nobody handles; 2 crashes since power-on");
}

}  // namespace kmax::device::crash_words_test
