#include "firmware/board_interface/crash_record.hpp"

#include <gtest/gtest.h>

#include <array>

namespace kmax::firmware::crash_record_test {
namespace {

// Hosts read these numbers: info.reset_cause and info.crash_cause.
TEST(CrashRecord, NumbersOfCausesStay) {
  using enum ResetCause;
  constexpr std::array resets{unknown,         power_on,  pin,       software, independent_watchdog,
                              window_watchdog, low_power, brown_out, native};
  for (std::size_t number = 0; number < resets.size(); ++number)
    EXPECT_EQ(static_cast<std::size_t>(resets[number]), number);
  constexpr std::array crashes{CrashCause::none, CrashCause::fault, CrashCause::unexpected_interrupt};
  for (std::size_t number = 0; number < crashes.size(); ++number)
    EXPECT_EQ(static_cast<std::size_t>(crashes[number]), number);
}

TEST(CrashRecord, BeginsWithoutACrash) {
  constexpr CrashRecord record;
  EXPECT_EQ(record.cause, CrashCause::none);
  EXPECT_EQ(record.count + record.exception_number + record.program_counter + record.link_register, 0U);
  EXPECT_EQ(record.status + record.hard_fault_status + record.address, 0U);
}

}  // namespace
}  // namespace kmax::firmware::crash_record_test
