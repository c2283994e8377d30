#include "firmware/modbus/rtu_timing.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>

#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::rtu_timing_test {
namespace {

static_assert(CharacterFormat{}.bits() == 11);
static_assert(CharacterFormat{Parity::none, 2}.bits() == 11);
static_assert(CharacterFormat{Parity::none, 1}.bits() == 10);
static_assert(CharacterFormat{Parity::odd, 2}.bits() == 12);
static_assert(rtu_timing(9600) == RtuTiming{1146, 1719, 4011});
static_assert(rtu_timing(9600, {Parity::none, 1}) == RtuTiming{1042, 1563, 3646});
static_assert(rtu_timing(19200) == RtuTiming{573, 860, 2006});
static_assert(rtu_timing(19201) == RtuTiming{573, 750, 1750}, "fixed above 19200 baud");

// Wraps, and never goes backwards.
static_assert(elapsed_us(5, 0xFFFF'FFFE) == 7);
static_assert(elapsed_us(0x7FFF'FFFF, 0) == 0x7FFF'FFFF);
static_assert(elapsed_us(10, 11) == 0);
static_assert(elapsed_us(0xFFFF'FFFF, 3) == 0);

RC_GTEST_PROP(RtuTiming, RoundedUpByLessThanOneMicrosecond, ()) {
  const auto baud_rate = *rc::gen::inRange<std::uint32_t>(baud_rate_min, baud_rate_max + 1);
  const CharacterFormat format{*rc::gen::element(Parity::none, Parity::even, Parity::odd),
                               *rc::gen::element<std::uint8_t>(1, 2)};
  const double character = format.bits() * 1e6 / baud_rate;
  const RtuTiming timing = rtu_timing(baud_rate, format);
  const auto rounds_up = [](std::uint32_t rounded, double exact) {
    return rounded >= exact - 1e-6 && rounded < exact + 1.0;
  };
  RC_ASSERT(rounds_up(timing.character_us, character));
  if (baud_rate <= 19200) {
    RC_ASSERT(rounds_up(timing.t1_5_us, 1.5 * character));
    RC_ASSERT(rounds_up(timing.t3_5_us, 3.5 * character));
  } else {
    RC_ASSERT(timing.t1_5_us == 750U);
    RC_ASSERT(timing.t3_5_us == 1750U);
  }
}

}  // namespace
}  // namespace kmax::firmware::modbus::rtu_timing_test
