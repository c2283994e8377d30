#include "drivers/stm32f4/usart.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::usart_test {

constexpr std::uint32_t apb1 = 42'000'000;

TEST(UsartDivisor, TableAt42MHz) {
  struct Row {
    std::uint32_t baud;
    std::uint32_t value;
    float percent;
  };
  for (const Row& row : {Row{115'200, 0x16D, -0.11F}, Row{230'400, 0xB6, 0.16F}, Row{460'800, 0x5B, 0.16F},
                         Row{921'600, 0x2E, -0.93F}, Row{1'000'000, 0x2A, 0.0F}, Row{2'000'000, 0x15, 0.0F},
                         Row{9'600, 4375, 0.0F}, Row{19'200, 2188, -0.02F}}) {
    const UsartDivisor divisor = usart_divisor(apb1, row.baud);
    EXPECT_EQ(divisor.value, row.value) << row.baud;
    EXPECT_NEAR(divisor.error * 100, row.percent, 0.0051F) << row.baud;
    EXPECT_TRUE(divisor.usable) << row.baud;
  }
}

TEST(UsartDivisor, RefusesWhatTheHardwareCannotDo) {
  EXPECT_FALSE(usart_divisor(apb1, 0).usable);
  EXPECT_FALSE(usart_divisor(apb1, 300).usable) << "140000 needs more than 16 bits";
  EXPECT_TRUE(usart_divisor(apb1, 641).usable);
  EXPECT_FALSE(usart_divisor(apb1, 640).usable) << "65625";
  EXPECT_TRUE(usart_divisor(apb1, 2'625'000).usable) << "16 is the smallest divisor";
  EXPECT_FALSE(usart_divisor(apb1, 2'800'000).usable) << "15";
  EXPECT_FALSE(usart_divisor(apb1, 50'000'000).usable);
  EXPECT_FALSE(usart_divisor(apb1, 0xFFFF'FFFFU).usable);
  EXPECT_FALSE(usart_divisor(16'000'000, 921'600).usable) << "17.36 -> 17 is 2.1 % off";
}

RC_GTEST_PROP(UsartDivisor, NearestDivisorAndTrueError, ()) {
  const auto clock = *rc::gen::inRange<std::uint32_t>(1'000'000, 84'000'001);
  const auto baud = *rc::gen::inRange<std::uint32_t>(1, 6'000'000);
  const UsartDivisor divisor = usart_divisor(clock, baud);
  if (!divisor.usable) return;
  const double ideal = static_cast<double>(clock) / baud;
  RC_ASSERT(std::abs(divisor.value - ideal) <= 0.5);
  const double actual = static_cast<double>(clock) / divisor.value;
  RC_ASSERT(std::abs(static_cast<double>(divisor.error) - (actual - baud) / baud) < 1e-5);
  RC_ASSERT(std::abs((actual - baud) / baud) < 0.0201);
}

TEST(Usart, EvenParityIsNineBitsAndOneStopBitNoneIsEightAndTwo) {
  struct Row {
    UsartConfig config;
    std::uint32_t brr, cr1, cr2;
  };
  // UE 13, M 12, PCE 10, RXNEIE 5, TE 3, RE 2; PS clear. STOP 13:12.
  for (const Row& row : {Row{{}, 0x16D, 0x342C, 0},
                         {{.baud_rate = 1'000'000, .parity = UsartParity::none}, 0x2A, 0x202C, 2U << 12}}) {
    UsartRegisters registers{};
    registers.cr3 = 0xFFFF;
    Usart usart{registers};
    ASSERT_TRUE(usart.configure(row.config, apb1));
    EXPECT_EQ(registers.brr, row.brr);
    EXPECT_EQ(registers.cr1, row.cr1);
    EXPECT_EQ(registers.cr2, row.cr2);
    EXPECT_EQ(registers.cr3, 0U);
  }
}

TEST(Usart, ImpossibleBaudRateTouchesNothing) {
  UsartRegisters registers{};
  registers.cr1 = 0x1234;
  registers.brr = 0x55;
  Usart usart{registers};
  EXPECT_FALSE(usart.configure({.baud_rate = 300}, apb1));
  EXPECT_EQ(registers.cr1, 0x1234U);
  EXPECT_EQ(registers.brr, 0x55U);
}

struct FakeUsart {
  FakeRegister sr, dr, brr, cr1, cr2, cr3;
};

TEST(Usart, IsOffWhileItsLineIsSetUp) {
  FakeUsart registers;
  WriteOrder order;
  order.watch(registers.sr, "sr"), order.watch(registers.dr, "dr"), order.watch(registers.brr, "brr");
  order.watch(registers.cr1, "cr1"), order.watch(registers.cr2, "cr2"), order.watch(registers.cr3, "cr3");
  Usart usart{registers};
  ASSERT_TRUE(usart.configure({}, apb1));
  EXPECT_EQ(order.all,
            (WriteOrder::Writes{{"cr1", 0}, {"brr", 0x16D}, {"cr2", 0}, {"cr3", 0}, {"cr1", 0x342C}}));
  EXPECT_EQ(registers.sr.reads, 1U) << "clears old errors";
  EXPECT_EQ(registers.dr.reads, 1U);
}

// RM0090, status register: PE 0, FE 1, NF 2, ORE 3, RXNE 5, TC 6, TXE 7.
TEST(Usart, EveryStatusGivesTheByteAndItsErrors) {
  for (std::uint32_t status = 0; status < 0x100; ++status) {
    FakeUsart registers;
    Usart usart{registers};
    registers.sr.value = status;
    registers.dr.value = 0x1A5;  // with the parity bit
    const UsartEvent event = usart.ISR_serve();
    const bool received = (status & 0x20) != 0, read = (status & 0x28) != 0;
    EXPECT_EQ(event.received, received) << status;
    EXPECT_EQ(event.byte, received ? 0xA5 : 0) << status;
    EXPECT_EQ(event.line_error, read && (status & 0x0F) != 0) << status;
    EXPECT_EQ(registers.dr.reads, read ? 1U : 0U) << status;
    EXPECT_FALSE(event.transmission_complete) << "nothing is being sent";
    EXPECT_TRUE(registers.dr.writes.empty() && registers.cr1.writes.empty()) << status;
  }
}

TEST(Usart, SendsByteByByteAndIsDoneWithTheLastStopBit) {
  constexpr std::uint32_t tcie = 1U << 6, txeie = 1U << 7, tc = 1U << 6, txe = 1U << 7;
  FakeUsart registers;
  Usart usart{registers};
  ASSERT_TRUE(usart.configure({}, apb1));
  const std::uint32_t idle = registers.cr1.value;
  const std::array<std::uint8_t, 3> bytes{0x81, 0x00, 0xFF};
  for (int round = 0; round < 2; ++round) {
    registers.dr.writes.clear();
    EXPECT_FALSE(usart.transmit({}));
    EXPECT_FALSE(usart.transmitting());
    ASSERT_TRUE(usart.transmit(bytes));
    EXPECT_FALSE(usart.transmit(bytes)) << "one after the other";
    for (std::size_t sent = 0; sent < 3; ++sent) {
      EXPECT_EQ(registers.cr1.value, idle | txeie);
      registers.sr.value = tc;
      EXPECT_FALSE(usart.ISR_serve().transmission_complete);
      EXPECT_EQ(registers.dr.writes.size(), sent) << "the register is full still";
      registers.sr.value = tc | txe;
      EXPECT_FALSE(usart.ISR_serve().transmission_complete) << "TC of the byte before";
      EXPECT_EQ(registers.dr.writes.size(), sent + 1);
    }
    EXPECT_EQ(registers.dr.writes, std::vector<std::uint32_t>(bytes.begin(), bytes.end()));
    EXPECT_EQ(registers.cr1.value, idle | tcie);
    registers.sr.value = txe;
    EXPECT_FALSE(usart.ISR_serve().transmission_complete) << "the last byte is on its way";
    EXPECT_TRUE(usart.transmitting());
    registers.sr.value = tc | txe;
    EXPECT_TRUE(usart.ISR_serve().transmission_complete);
    EXPECT_EQ(registers.cr1.value, idle);
    EXPECT_FALSE(usart.transmitting());
  }
}

TEST(Usart, ConfiguringDropsWhatIsBeingSentAndWhatHasComeIn) {
  FakeUsart registers;
  Usart usart{registers};
  const std::array<std::uint8_t, 2> bytes{1, 2};
  ASSERT_TRUE(usart.transmit(bytes));
  ASSERT_TRUE(usart.configure({}, apb1));
  EXPECT_FALSE(usart.transmitting());
  EXPECT_EQ(registers.sr.reads, 1U);
  EXPECT_EQ(registers.dr.reads, 1U);
  registers.sr.value = 0xC0;
  EXPECT_FALSE(usart.ISR_serve().transmission_complete);
  EXPECT_TRUE(registers.dr.writes.empty());
}

}  // namespace kmax::drivers::stm32f4::usart_test
