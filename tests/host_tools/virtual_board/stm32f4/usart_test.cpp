#include "host_tools/virtual_board/stm32f4/usart.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

// RM0090, chapter Universal synchronous asynchronous receiver transmitter (USART).

namespace kmax::virtual_board::usart_test {
namespace {

namespace stm32 = drivers::stm32f4;
namespace sr = stm32::usart_sr;
namespace cr1 = stm32::usart_cr1;
using stm32::Interrupt;
using stm32::UsartRegisters;

constexpr std::uint32_t enabled =
    cr1::Enable::mask | cr1::TransmitterEnable::mask | cr1::ReceiverEnable::mask;
constexpr std::uint32_t even_parity = cr1::NineBits::mask | cr1::ParityEnable::mask;

struct Port {
  BoardClocks clocks;
  testing::RecordedInterrupts lines;
  UsartModel model{clocks, lines, Interrupt::usart2};
  BoardTime now = 0;
  BoardTime bit = 0;
  std::vector<std::pair<std::uint8_t, BoardTime>> sent;

  explicit Port(std::uint32_t control = enabled, std::uint32_t stop_bits = 0) {
    clocks.apb1 = units_per_period(42'000'000);
    model.on_transmitted([this](std::uint8_t byte, BoardTime end) { sent.emplace_back(byte, end); });
    put(offsetof(UsartRegisters, brr), 0x16D);
    put(offsetof(UsartRegisters, cr2), stop_bits << 12);
    bit = 0x16D * clocks.apb1;
    put(offsetof(UsartRegisters, cr1), control);
    pass(20 * bit);  // the idle frame after TE
  }
  std::uint32_t get(std::size_t offset) { return model.read({static_cast<std::uint32_t>(offset), 4, now}); }
  void put(std::size_t offset, std::uint32_t word) {
    model.write({static_cast<std::uint32_t>(offset), 4, now}, word);
  }
  std::uint32_t status() { return get(offsetof(UsartRegisters, sr)); }
  std::uint32_t data() { return get(offsetof(UsartRegisters, dr)); }
  void send(std::uint32_t byte) { put(offsetof(UsartRegisters, dr), byte); }
  void pass(BoardTime duration) {
    now += duration;
    model.advance(now);
  }
};

// Section Fractional baud rate generation: 42 MHz / 0x16D = 115068 Bd.
TEST(UsartModelTransmitter, FrameLengthsToTheClock) {
  struct Row {
    std::uint32_t control, stop_bits;
    unsigned bits;
  };
  for (const Row& row : {Row{enabled, 0, 10}, Row{enabled | even_parity, 0, 11}, Row{enabled, 2, 11},
                         Row{enabled | even_parity, 2, 12}}) {
    Port port{row.control, row.stop_bits};
    const BoardTime start = port.now;
    port.send(0xA5);
    port.pass(row.bits * port.bit - 1);
    EXPECT_TRUE(port.sent.empty());
    port.pass(1);
    ASSERT_EQ(port.sent.size(), 1U);
    EXPECT_EQ(port.sent[0], std::make_pair(std::uint8_t{0xA5}, start + row.bits * port.bit));
  }
}

// Section Transmitter: single byte communication; TXE, TC.
TEST(UsartModelTransmitter, TwoBytesDeepAndBackToBack) {
  Port port;
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask | sr::TransmissionComplete::mask);
  const BoardTime start = port.now;
  port.send(1);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask) << "moved on at once; TC cleared by SR, DR";
  port.send(2);
  EXPECT_EQ(port.status(), 0U);
  EXPECT_THROW(port.send(3), RefusedAccess) << "would overwrite";
  port.pass(10 * port.bit);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask);
  port.pass(10 * port.bit);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask | sr::TransmissionComplete::mask);
  ASSERT_EQ(port.sent.size(), 2U);
  EXPECT_EQ(port.sent[1].second, start + 20 * port.bit) << "no gap";
}

TEST(UsartModelTransmitter, CompleteIsClearedBySrThenDrOrByWritingZero) {
  Port port;
  port.send(1);
  EXPECT_NE(port.status() & sr::TransmissionComplete::mask, 0U) << "SR was not read before";
  port.put(offsetof(UsartRegisters, sr), ~sr::TransmissionComplete::mask);
  EXPECT_EQ(port.status() & sr::TransmissionComplete::mask, 0U);
  port.put(offsetof(UsartRegisters, sr), 0);
  EXPECT_NE(port.status() & sr::TransmitEmpty::mask, 0U) << "not one of those that writing clears";
}

TEST(UsartModelTransmitter, IdleFrameComesFirst) {
  Port port{cr1::Enable::mask};
  port.put(offsetof(UsartRegisters, cr1), enabled);
  const BoardTime start = port.now;
  port.send(7);
  port.pass(20 * port.bit);
  ASSERT_EQ(port.sent.size(), 1U);
  EXPECT_EQ(port.sent[0].second, start + 20 * port.bit);
}

TEST(UsartModelTransmitter, SwitchedOffItDropsWhatItHas) {
  Port port;
  port.send(1);
  port.send(2);
  port.pass(port.bit);
  port.put(offsetof(UsartRegisters, cr1), 0);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask | sr::TransmissionComplete::mask);
  port.put(offsetof(UsartRegisters, cr1), enabled);
  port.pass(50 * port.bit);
  EXPECT_TRUE(port.sent.empty());
}

// Section Receiver: character reception.
TEST(UsartModelReceiver, ByteInTheMiddleOfItsStopBit) {
  Port port;
  port.model.receive(0x5A, true, true, port.now);
  port.pass(19 * port.bit / 2 - 1);
  EXPECT_EQ(port.status() & sr::ReceiveNotEmpty::mask, 0U);
  port.pass(1);
  EXPECT_NE(port.status() & sr::ReceiveNotEmpty::mask, 0U);
  EXPECT_EQ(port.data(), 0x5AU);
  EXPECT_EQ(port.status() & sr::ReceiveNotEmpty::mask, 0U) << "cleared by reading DR";
}

TEST(UsartModelReceiver, BytesQueueOnTheLine) {
  Port port;
  const BoardTime start = port.now;
  for (std::uint8_t byte = 0; byte < 3; ++byte) port.model.receive(byte, true, true, start);
  EXPECT_EQ(port.model.bytes_to_come(), 3U);
  for (std::uint32_t byte = 0; byte < 3; ++byte) {
    port.now = start + byte * 10 * port.bit + 19 * port.bit / 2;
    port.model.advance(port.now);
    EXPECT_EQ(port.data(), byte);
  }
  EXPECT_EQ(port.status() & sr::Overrun::mask, 0U);
}

// Section Parity control: the parity bit is read with the data.
TEST(UsartModelReceiver, ParityBitAndParityError) {
  for (const bool odd : {false, true}) {
    Port port{enabled | even_parity | (odd ? cr1::OddParity::mask : 0)};
    port.model.receive(0x07, true, true, port.now);
    port.pass(11 * port.bit);
    EXPECT_EQ(port.status() & sr::ParityError::mask, 0U);
    EXPECT_EQ(port.data(), odd ? 0x007U : 0x107U);
    port.model.receive(0x07, false, true, port.now);
    port.pass(11 * port.bit);
    EXPECT_NE(port.status() & sr::ParityError::mask, 0U);
    EXPECT_EQ(port.data(), odd ? 0x107U : 0x007U);
    EXPECT_EQ(port.status() & sr::ParityError::mask, 0U);
  }
}

// Section Receiver: overrun error.
TEST(UsartModelReceiver, OverrunKeepsTheFirstByte) {
  Port port;
  port.model.receive(1, true, true, port.now);
  port.model.receive(2, true, false, port.now);
  port.pass(25 * port.bit);
  EXPECT_EQ(port.status() & (sr::ReceiveNotEmpty::mask | sr::Overrun::mask | sr::FramingError::mask),
            sr::ReceiveNotEmpty::mask | sr::Overrun::mask);
  EXPECT_EQ(port.data(), 1U);
  EXPECT_EQ(port.status() & (sr::ReceiveNotEmpty::mask | sr::Overrun::mask), 0U);
}

TEST(UsartModelReceiver, ErrorsAreClearedBySrThenDrOnly) {
  for (const bool read_status_first : {true, false}) {
    Port port;
    port.status();
    port.data();
    port.model.add_noise();
    port.model.receive(1, true, false, port.now);
    port.pass(10 * port.bit);
    if (read_status_first) {
      EXPECT_EQ(port.status() & 0xFU, sr::FramingError::mask | sr::Noise::mask);
    }
    port.data();
    EXPECT_EQ((port.status() & 0xFU) == 0, read_status_first);
  }
}

// An error that arrives between the two reads was not seen and stays.
TEST(UsartModelReceiver, ErrorThatTheStatusReadDidNotShowStays) {
  Port port;
  port.status();
  port.model.receive(1, true, true, port.now);
  port.model.receive(2, true, true, port.now);
  port.pass(25 * port.bit);
  port.data();
  EXPECT_NE(port.status() & sr::Overrun::mask, 0U);
}

// Section Receiver: idle character.
TEST(UsartModelReceiver, IdleOncePerPause) {
  Port port{enabled | cr1::IdleInterrupt::mask};
  EXPECT_EQ(port.status() & sr::Idle::mask, 0U) << "not before the first byte";
  const BoardTime start = port.now;
  port.model.receive(1, true, true, start);
  port.model.receive(2, true, true, start + 15 * port.bit);
  port.pass(35 * port.bit - 1);
  EXPECT_EQ(port.status() & sr::Idle::mask, 0U) << "half a frame between the bytes is no pause";
  port.pass(1);
  EXPECT_NE(port.status() & sr::Idle::mask, 0U);
  EXPECT_TRUE(port.lines.level(Interrupt::usart2));
  port.data();
  EXPECT_FALSE(port.lines.level(Interrupt::usart2));
  port.pass(100 * port.bit);
  EXPECT_EQ(port.status() & sr::Idle::mask, 0U);
}

TEST(UsartModelReceiver, ByteToASleepingReceiverIsLost) {
  Port port{cr1::Enable::mask | cr1::TransmitterEnable::mask};
  port.model.receive(1, true, true, port.now);
  port.pass(5 * port.bit);
  port.put(offsetof(UsartRegisters, cr1), enabled);
  port.pass(20 * port.bit);
  EXPECT_EQ(port.status() & sr::ReceiveNotEmpty::mask, 0U);
  EXPECT_EQ(port.model.bytes_to_come(), 0U);
}

// Section USART interrupts.
TEST(UsartModelInterrupt, LevelFollowsFlagAndEnable) {
  Port port{enabled | cr1::ReceiveInterrupt::mask};
  EXPECT_FALSE(port.lines.level(Interrupt::usart2));
  port.model.receive(1, true, true, port.now);
  port.pass(10 * port.bit);
  EXPECT_TRUE(port.lines.level(Interrupt::usart2));
  port.data();
  EXPECT_FALSE(port.lines.level(Interrupt::usart2));
  port.put(offsetof(UsartRegisters, cr1), enabled | cr1::TransmitEmptyInterrupt::mask);
  EXPECT_TRUE(port.lines.level(Interrupt::usart2));
  port.put(offsetof(UsartRegisters, cr1), enabled | cr1::TransmissionCompleteInterrupt::mask);
  EXPECT_TRUE(port.lines.level(Interrupt::usart2));
  port.status();
  port.send(1);
  EXPECT_FALSE(port.lines.level(Interrupt::usart2));
  port.pass(10 * port.bit);
  EXPECT_TRUE(port.lines.level(Interrupt::usart2));
  port.model.reset(port.now);
  EXPECT_FALSE(port.lines.level(Interrupt::usart2));
}

TEST(UsartModel, WhatIsNotModelledIsRefused) {
  Port port;
  for (const std::uint32_t bit : {0U, 1U, 11U, 15U})
    EXPECT_THROW(port.put(offsetof(UsartRegisters, cr1), enabled | 1U << bit), RefusedAccess) << bit;
  for (const std::uint32_t bit : {0U, 3U, 6U, 7U, 8U, 9U})
    EXPECT_THROW(port.put(offsetof(UsartRegisters, cr3), 1U << bit), RefusedAccess) << bit;
  EXPECT_THROW(port.put(offsetof(UsartRegisters, cr2), 1U << 12), RefusedAccess) << "half a stop bit";
  EXPECT_THROW(port.put(offsetof(UsartRegisters, brr), 0x100), RefusedAccess) << "enabled";
  EXPECT_THROW(port.put(offsetof(UsartRegisters, cr1), enabled | cr1::NineBits::mask), RefusedAccess);
  EXPECT_THROW(port.put(offsetof(UsartRegisters, gtpr), 0), RefusedAccess);
  port.put(offsetof(UsartRegisters, cr1), 0);
  EXPECT_THROW(port.send(1), RefusedAccess) << "disabled";
  EXPECT_THROW(port.put(offsetof(UsartRegisters, brr), 15), RefusedAccess);
  EXPECT_THROW(port.put(offsetof(UsartRegisters, brr), 0x1'0000), RefusedAccess);
}

}  // namespace
}  // namespace kmax::virtual_board::usart_test
