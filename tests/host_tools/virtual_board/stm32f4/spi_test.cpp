// RM0090, chapter Serial peripheral interface (SPI).
#include "host_tools/virtual_board/stm32f4/spi.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::spi_test {

constexpr std::uint32_t cr1 = 0x00, cr2 = 0x04, sr = 0x08, dr = 0x0C;
constexpr std::uint32_t settings = 0x0B1D;  // 16 bit, SSM, SSI, /16, MSTR, CPHA
constexpr BoardTime bit = 16 * 8;           // at 42 MHz / 16
constexpr BoardTime clock = 8;
constexpr std::uint32_t txe = 2, rxne = 1, bsy = 0x80, ovr = 0x40;

struct Bench : testing::ModelBench {
  Bench() : ModelBench({&spi}, 777) {
    clocks.apb1 = units_per_period(42'000'000);
    spi.on_frame([this](std::uint16_t mosi, BoardTime /*at*/) {
      out.push_back(mosi);
      return static_cast<std::uint16_t>(~mosi);
    });
    write(cr1, settings);
    write(cr1, settings | 0x40);
  }
  SpiModel spi{clocks};
  std::vector<std::uint16_t> out;
};

// Section SPI status register: reset value 0x0002.
TEST(SpiModel, IsEmptyAfterReset) {
  Bench bench;
  EXPECT_EQ(bench.read(sr), txe);
  bench.write(dr, 1);
  bench.run(bit);
  bench.spi.reset(bench.now);
  EXPECT_EQ(bench.read(sr), txe);
  EXPECT_EQ(bench.read(cr1), 0U);
  EXPECT_EQ(bench.spi.next_event(), never);
}

// Sections Data transmission and reception procedures; Status flags (TXE, RXNE, BSY).
TEST(SpiModel, FlagsOfOneFrameInTime) {
  Bench bench;
  bench.write(dr, 0x1234);
  EXPECT_EQ(bench.read(sr), bsy) << "the word is in the buffer";
  bench.run(clock);
  EXPECT_EQ(bench.read(sr), bsy | txe) << "in the shift register one clock later";
  bench.run(16 * bit - bit / 2 - 1);
  EXPECT_EQ(bench.read(sr), bsy | txe);
  EXPECT_TRUE(bench.out.empty());
  bench.run(1);
  EXPECT_EQ(bench.read(sr), bsy | txe | rxne) << "the last sampling edge";
  bench.run(bit / 2 - 1);
  EXPECT_EQ(bench.read(sr), bsy | txe | rxne);
  bench.run(1);
  EXPECT_EQ(bench.read(sr), txe | rxne);
  EXPECT_EQ(bench.read(dr), 0xEDCBU);
  EXPECT_EQ(bench.read(sr), txe);
  EXPECT_EQ(bench.out, std::vector<std::uint16_t>{0x1234});
}

TEST(SpiModel, RateFollowsPrescalerAndClock) {
  for (std::uint32_t code = 0; code < 8; ++code) {
    Bench bench;
    bench.write(cr1, 0);
    bench.write(cr1, (settings & ~0x38U) | code << 3 | 0x40);
    bench.write(dr, 1);
    const BoardTime frame = 8 + 16 * (2ULL << code) * 8;
    bench.run(frame - 1);
    EXPECT_NE(bench.read(sr) & bsy, 0U) << code;
    bench.run(1);
    EXPECT_EQ(bench.read(sr), txe | rxne) << code;
  }
}

TEST(SpiModel, NextWordInTheBufferFollowsWithoutAGap) {
  Bench bench;
  bench.write(dr, 1);
  bench.run(clock);
  bench.write(dr, 2);
  EXPECT_EQ(bench.read(sr), bsy);
  bench.run(16 * bit);
  EXPECT_EQ(bench.read(sr), bsy | txe | rxne);
  EXPECT_EQ(bench.read(dr), 0xFFFEU);
  bench.run(16 * bit);
  EXPECT_EQ(bench.read(sr), txe | rxne);
  EXPECT_EQ(bench.read(dr), 0xFFFDU);
}

// Section Overrun condition: the first word stays; cleared by reading DR and then SR.
TEST(SpiModel, OverrunKeepsTheFirstWord) {
  Bench bench;
  for (const std::uint32_t word : {1U, 2U}) {
    bench.write(dr, word);
    bench.run(17 * bit);
  }
  EXPECT_EQ(bench.read(sr), txe | rxne | ovr);
  EXPECT_EQ(bench.read(sr), txe | rxne | ovr) << "reading SR alone clears nothing";
  EXPECT_EQ(bench.read(dr), 0xFFFEU);
  EXPECT_EQ(bench.read(sr), txe | ovr) << "this is the read that clears";
  EXPECT_EQ(bench.read(sr), txe);
  EXPECT_EQ(bench.spi.overruns(), 1U);
}

TEST(SpiModel, RefusesWhatItDoesNotModel) {
  const auto refused = [](auto&& action) {
    Bench bench;
    EXPECT_THROW(action(bench), RefusedAccess);
  };
  for (const std::uint32_t flip :
       {0x0800U, 0x0080U, 0x0400U, 0x8000U, 0x2000U, 0x0001U, 0x0002U, 0x0004U, 0x0100U, 0x0200U}) {
    refused([flip](Bench& bench) {
      bench.write(cr1, 0);
      bench.write(cr1, (settings ^ flip) | 0x40);
    });
  }
  for (const std::uint32_t value : {1U, 2U, 4U, 0x20U, 0x40U, 0x80U}) {
    refused([value](Bench& bench) { bench.write(cr2, value); });
  }
  refused([](Bench& bench) { bench.write(sr, 0); });
  refused([](Bench& bench) { bench.write(0x1C, 0); });
  refused([](Bench& bench) { bench.read(0x10); });
  refused([](Bench& bench) { bench.read(dr, 2); });
  refused([](Bench& bench) { bench.write(dr, 0x10000); });
  refused([](Bench& bench) { bench.write(cr1, (settings | 0x40) ^ 8); });
}

TEST(SpiModel, RefusesWhatWouldLoseBits) {
  Bench bench;
  bench.write(dr, 1);
  EXPECT_THROW(bench.write(dr, 2), RefusedAccess) << "TXE = 0";
  EXPECT_THROW(bench.write(cr1, 0), RefusedAccess) << "section Disabling the SPI";
  bench.run(17 * bit);
  bench.write(cr1, 0);
  EXPECT_THROW(bench.write(dr, 1), RefusedAccess) << "SPE = 0";
}

}  // namespace kmax::virtual_board::spi_test
