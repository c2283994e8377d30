// AS5047P data sheet, section SPI interface.
#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"

#include <gtest/gtest.h>

#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board::as5047p_chip_test {

struct Bench {
  unsigned frame(unsigned word) {
    chip.select(false);
    const auto reply = chip.exchange(static_cast<std::uint16_t>(word), now);
    chip.select(true);
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

  bench.chip.select(false);
  bench.chip.select(true);
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
  EXPECT_EQ(bench.chip.exchange(0xFFFF, 0), std::nullopt);
  bench.chip.set_fitted(false);
  bench.chip.select(false);
  EXPECT_EQ(bench.chip.exchange(0xFFFF, 0), std::nullopt);
}

TEST(As5047pChip, RefusesWrites) {
  Bench bench;
  bench.chip.select(false);
  EXPECT_THROW(bench.chip.exchange(0x8016, 0), RefusedAccess);
  EXPECT_THROW(bench.chip.exchange(0xC003, 0), RefusedAccess) << "PROG";
}

}  // namespace kmax::virtual_board::as5047p_chip_test
