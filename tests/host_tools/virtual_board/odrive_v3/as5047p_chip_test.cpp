// AS5047P data sheet, section SPI interface.
#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"

#include <gtest/gtest.h>

#include <tuple>

#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board::as5047p_chip_test {

struct Bench {
  unsigned frame(unsigned word) {
    now += 10 * units_per_microsecond;
    chip.select(false, now);
    now += 10 * units_per_microsecond;
    const auto reply = chip.exchange(static_cast<std::uint16_t>(word), now, now);
    chip.select(true, now);
    EXPECT_TRUE(reply.has_value());
    EXPECT_EQ(__builtin_popcount(*reply) % 2, 0);
    return *reply;
  }
  std::int64_t angle = 0x1234;
  BoardTime now = 0;
  As5047pChip chip{[this](BoardTime) { return angle; }};
};

TEST(As5047pChip, AngleOfTheCommandComesWithTheNextFrame) {
  Bench bench;
  bench.frame(0xFFFF);
  bench.angle = -1;
  EXPECT_EQ(bench.frame(0xFFFF), 0x9234U) << "0x1234 has five ones";
  bench.angle = 0;
  EXPECT_EQ(bench.frame(0xFFFF), 0x3FFFU);
  EXPECT_EQ(bench.frame(0xFFFF), 0x0000U);
}

TEST(As5047pChip, ErrorsStayUntilErrflIsRead) {
  Bench bench;
  bench.frame(0x7FFF);  // wrong parity
  EXPECT_EQ(bench.frame(0xFFFF) & 0x4000U, 0x4000U);
  EXPECT_EQ(bench.frame(0x4001) & 0x4000U, 0x4000U);
  EXPECT_EQ(bench.frame(0xC000) & 0x3FFFU, 0x0004U) << "PARERR";
  EXPECT_EQ(bench.frame(0xC000) & 0x4000U, 0U);

  bench.frame(0x4002);  // no such register, parity right
  bench.frame(0x4001);
  EXPECT_EQ(bench.frame(0xC000) & 0x3FFFU, 0x0002U) << "INVCOMM";

  bench.chip.select(false, 0);
  bench.chip.select(true, 0);
  bench.frame(0x4001);
  EXPECT_EQ(bench.frame(0xC000) & 0x3FFFU, 0x0001U) << "FRERR: a select without a frame";
}

TEST(As5047pChip, DiagnosticsAndMagnitude) {
  Bench bench;
  bench.frame(0xFFFC);
  EXPECT_EQ(bench.frame(0x7FFD) & 0x3FFFU, 0x180U) << "LF set, AGC in the middle";
  EXPECT_EQ(bench.frame(0xC000) & 0x3FFFU, 0x1000U);
}

TEST(As5047pChip, DrivesNothingWhenNotSelectedOrNotThere) {
  Bench bench;
  EXPECT_EQ(bench.chip.exchange(0xFFFF, 0, 0), std::nullopt);
  bench.chip.set_fitted(false);
  bench.chip.select(false, 0);
  EXPECT_EQ(bench.chip.exchange(0xFFFF, 0, 0), std::nullopt);
}

// 3.3 kohm and 102 pF take 0.40 us to the threshold, the chip 0.35 us from there to the first clock.
TEST(As5047pChip, AFrameWhoseSelectCameLateIsNotItsOwn) {
  for (const auto& [filter, before_ns, taken] :
       {std::tuple{true, 700, false}, {true, 780, true}, {false, 340, false}, {false, 360, true}}) {
    Bench bench;
    if (!filter) bench.chip.set_select_timing({.filter = 0.0});
    bench.frame(0xFFFF);
    bench.now += units_per_microsecond * 10;
    bench.chip.select(false, bench.now);
    const BoardTime began = bench.now + units_per_microsecond * before_ns / 1000;
    EXPECT_EQ(bench.chip.exchange(0xFFFF, began + units_per_microsecond, began).has_value(), taken)
        << before_ns;
    EXPECT_EQ(bench.chip.late_selects(), taken ? 0U : 1U);
  }
}

TEST(As5047pChip, ASelectAfterTooShortAPauseIsNone) {
  Bench bench;
  bench.frame(0xFFFF);
  bench.chip.select(false, bench.now + units_per_microsecond * 300 / 1000);
  bench.now += units_per_microsecond * 20;
  EXPECT_FALSE(bench.chip.exchange(0xFFFF, bench.now, bench.now).has_value());
}

TEST(As5047pChip, RefusesWrites) {
  Bench bench;
  bench.chip.select(false, 0);
  EXPECT_THROW(bench.chip.exchange(0x8016, units_per_microsecond, units_per_microsecond), RefusedAccess);
  EXPECT_THROW(bench.chip.exchange(0xC003, units_per_microsecond, units_per_microsecond), RefusedAccess)
      << "PROG";
}

}  // namespace kmax::virtual_board::as5047p_chip_test
