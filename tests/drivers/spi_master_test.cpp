#include "drivers/stm32f4/spi_master.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::spi_master_test {

struct FakeSpi {
  FakeRegister cr1, cr2, sr, dr;
};

constexpr std::uint32_t txe = 1U << 1, rxne = 1U << 0, bsy = 1U << 7, ovr = 1U << 6;

struct Bus {
  Bus() {
    spi.sr.value = txe;
    EXPECT_TRUE(master.configure({}));
  }
  FakeSpi spi;
  SpiMaster<FakeSpi> master{spi};
};

TEST(SpiMaster, SettingsOfTheBoard) {
  Bus bus;
  // CPHA 1, MSTR 1, BR 3 (/16), SSI, SSM, DFF; SPE last.
  EXPECT_EQ(bus.spi.cr1.writes, (std::vector<std::uint32_t>{0, 0x0B1D, 0x0B5D}));
  EXPECT_EQ(bus.spi.cr2.value, 0U);
  EXPECT_FALSE(bus.master.configure({.prescaler_code = 8}));
  EXPECT_EQ(bus.spi.cr1.value, 0x0B5DU);
}

TEST(SpiMaster, FrameEndsWithBusyAndNotWithReceived) {
  Bus bus;
  ASSERT_TRUE(bus.master.start(0xA5F0));
  EXPECT_EQ(bus.spi.dr.value, 0xA5F0U);
  bus.spi.sr.value = txe | bsy;
  EXPECT_FALSE(bus.master.ready());
  EXPECT_FALSE(bus.master.start(1)) << "a frame is under way";
  bus.spi.sr.value = txe | rxne | bsy;
  EXPECT_FALSE(bus.master.ready()) << "the last bit is still on the wire";
  EXPECT_EQ(bus.master.finish(), std::nullopt);
  bus.spi.sr.value = txe | rxne;
  bus.spi.dr.value = 0x1234;
  EXPECT_TRUE(bus.master.ready());
  EXPECT_FALSE(bus.master.start(1)) << "the word of the frame before is not fetched";
  EXPECT_EQ(bus.master.finish(), 0x1234);
}

TEST(SpiMaster, NothingReceivedYetIsNotReady) {
  Bus bus;
  ASSERT_TRUE(bus.master.start(1));
  bus.spi.sr.value = txe;  // between the store and the first clock BSY may still be down
  EXPECT_FALSE(bus.master.ready());
}

TEST(SpiMaster, OverrunIsNotData) {
  Bus bus;
  bus.spi.sr.value = txe | rxne | ovr;
  const unsigned status_reads = bus.spi.sr.reads, data_reads = bus.spi.dr.reads;
  EXPECT_EQ(bus.master.finish(), std::nullopt);
  EXPECT_EQ(bus.spi.dr.reads, data_reads + 1);
  EXPECT_EQ(bus.spi.sr.reads, status_reads + 2) << "OVR falls by reading DR and then SR";
}

TEST(SpiMaster, ExchangeWaitsInBoundsAndRestarts) {
  Bus bus;
  bus.spi.dr.on_write = [&](std::uint32_t) { bus.spi.sr.value = txe | bsy; };
  const unsigned reads = bus.spi.sr.reads;
  EXPECT_EQ(bus.master.exchange(7), std::nullopt);
  EXPECT_LE(bus.spi.sr.reads - reads, SpiMasterConfig{}.polls + 3);
  EXPECT_EQ(bus.spi.cr1.value, 0x0B5DU) << "ready for the next";

  bus.spi.sr.value = txe;
  bus.spi.dr.on_write = [&](std::uint32_t word) {
    bus.spi.sr.value = txe | rxne;
    bus.spi.dr.value = word ^ 0xFFFF;
  };
  EXPECT_EQ(bus.master.exchange(0x00FF), 0xFF00);
}

TEST(SpiMaster, DeadPeripheralIsATimeOutAndNotAHang) {
  FakeSpi spi;  // reads 0 everywhere, as without a clock
  SpiMaster master{spi};
  ASSERT_TRUE(master.configure({}));
  EXPECT_EQ(master.exchange(1), std::nullopt);
}

TEST(SpiMaster, OneHolderAtATime) {
  Bus bus;
  ASSERT_TRUE(bus.master.claim());
  EXPECT_FALSE(bus.master.claim());
  bus.master.release();
  EXPECT_TRUE(bus.master.claim());
}

}  // namespace kmax::drivers::stm32f4::spi_master_test
