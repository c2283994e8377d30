#include "host_tools/virtual_board/stm32f4/usart.hpp"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/usart.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

// RM0090, chapter Universal synchronous asynchronous receiver transmitter (USART).

namespace kmax::virtual_board::usart_test {

namespace stm32 = drivers::stm32f4;
namespace sr = stm32::usart_sr;
namespace cr1 = stm32::usart_cr1;
using stm32::Interrupt;
using stm32::UsartRegisters;

constexpr std::uint32_t enabled =
    cr1::Enable::mask | cr1::TransmitterEnable::mask | cr1::ReceiverEnable::mask;
constexpr std::uint32_t even_parity = cr1::NineBits::mask | cr1::ParityEnable::mask;

struct Port : testing::ModelBench {
  explicit Port(std::uint32_t control = enabled, std::uint32_t stop_bits = 0) : ModelBench({&model}, 0) {
    clocks.apb1 = units_per_period(42'000'000);
    model.on_transmitted([this](std::uint8_t byte, BoardTime end) { sent.emplace_back(byte, end); });
    write(offsetof(UsartRegisters, brr), 0x16D);
    write(offsetof(UsartRegisters, cr2), stop_bits << 12);
    bit = 0x16D * clocks.apb1;
    write(offsetof(UsartRegisters, cr1), control);
    run(20 * bit);  // the idle frame after TE
  }
  std::uint32_t status() { return read(offsetof(UsartRegisters, sr)); }
  std::uint32_t data() { return read(offsetof(UsartRegisters, dr)); }
  void send(std::uint32_t byte) { write(offsetof(UsartRegisters, dr), byte); }

  UsartModel model{clocks, interrupts, Interrupt::usart2};
  BoardTime bit = 0;
  std::vector<std::pair<std::uint8_t, BoardTime>> sent;
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
    port.run(row.bits * port.bit - 1);
    EXPECT_TRUE(port.sent.empty());
    port.run(1);
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
  port.run(10 * port.bit);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask);
  port.run(10 * port.bit);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask | sr::TransmissionComplete::mask);
  ASSERT_EQ(port.sent.size(), 2U);
  EXPECT_EQ(port.sent[1].second, start + 20 * port.bit) << "no gap";
}

TEST(UsartModelTransmitter, CompleteIsClearedBySrThenDrOrByWritingZero) {
  Port port;
  port.send(1);
  EXPECT_NE(port.status() & sr::TransmissionComplete::mask, 0U) << "SR was not read before";
  port.write(offsetof(UsartRegisters, sr), ~sr::TransmissionComplete::mask);
  EXPECT_EQ(port.status() & sr::TransmissionComplete::mask, 0U);
  port.write(offsetof(UsartRegisters, sr), 0);
  EXPECT_NE(port.status() & sr::TransmitEmpty::mask, 0U) << "not one of those that writing clears";
}

TEST(UsartModelTransmitter, IdleFrameComesFirst) {
  Port port{cr1::Enable::mask};
  port.write(offsetof(UsartRegisters, cr1), enabled);
  const BoardTime start = port.now;
  port.send(7);
  port.run(20 * port.bit);
  ASSERT_EQ(port.sent.size(), 1U);
  EXPECT_EQ(port.sent[0].second, start + 20 * port.bit);
}

TEST(UsartModelTransmitter, SwitchedOffItDropsWhatItHas) {
  Port port;
  port.send(1);
  port.send(2);
  port.run(port.bit);
  port.write(offsetof(UsartRegisters, cr1), 0);
  EXPECT_EQ(port.status(), sr::TransmitEmpty::mask | sr::TransmissionComplete::mask);
  port.write(offsetof(UsartRegisters, cr1), enabled);
  port.run(50 * port.bit);
  EXPECT_TRUE(port.sent.empty());
}

// Section Receiver: character reception.
TEST(UsartModelReceiver, ByteInTheMiddleOfItsStopBit) {
  Port port;
  port.model.receive(0x5A, true, true, port.now);
  port.run(19 * port.bit / 2 - 1);
  EXPECT_EQ(port.status() & sr::ReceiveNotEmpty::mask, 0U);
  port.run(1);
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
    port.run_until(start + byte * 10 * port.bit + 19 * port.bit / 2);
    EXPECT_EQ(port.data(), byte);
  }
  EXPECT_EQ(port.status() & sr::Overrun::mask, 0U);
}

// Section Parity control: the parity bit is read with the data.
TEST(UsartModelReceiver, ParityBitAndParityError) {
  for (const bool odd : {false, true}) {
    Port port{enabled | even_parity | (odd ? cr1::OddParity::mask : 0)};
    port.model.receive(0x07, true, true, port.now);
    port.run(11 * port.bit);
    EXPECT_EQ(port.status() & sr::ParityError::mask, 0U);
    EXPECT_EQ(port.data(), odd ? 0x007U : 0x107U);
    port.model.receive(0x07, false, true, port.now);
    port.run(11 * port.bit);
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
  port.run(25 * port.bit);
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
    port.run(10 * port.bit);
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
  port.run(25 * port.bit);
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
  port.run(35 * port.bit - 1);
  EXPECT_EQ(port.status() & sr::Idle::mask, 0U) << "half a frame between the bytes is no pause";
  port.run(1);
  EXPECT_NE(port.status() & sr::Idle::mask, 0U);
  EXPECT_TRUE(port.interrupts.level(Interrupt::usart2));
  port.data();
  EXPECT_FALSE(port.interrupts.level(Interrupt::usart2));
  port.run(100 * port.bit);
  EXPECT_EQ(port.status() & sr::Idle::mask, 0U);
}

TEST(UsartModelReceiver, ByteToASleepingReceiverIsLost) {
  Port port{cr1::Enable::mask | cr1::TransmitterEnable::mask};
  port.model.receive(1, true, true, port.now);
  port.run(5 * port.bit);
  port.write(offsetof(UsartRegisters, cr1), enabled);
  port.run(20 * port.bit);
  EXPECT_EQ(port.status() & sr::ReceiveNotEmpty::mask, 0U);
  EXPECT_EQ(port.model.bytes_to_come(), 0U);
}

// Section USART interrupts.
TEST(UsartModelInterrupt, LevelFollowsFlagAndEnable) {
  Port port{enabled | cr1::ReceiveInterrupt::mask};
  EXPECT_FALSE(port.interrupts.level(Interrupt::usart2));
  port.model.receive(1, true, true, port.now);
  port.run(10 * port.bit);
  EXPECT_TRUE(port.interrupts.level(Interrupt::usart2));
  port.data();
  EXPECT_FALSE(port.interrupts.level(Interrupt::usart2));
  port.write(offsetof(UsartRegisters, cr1), enabled | cr1::TransmitEmptyInterrupt::mask);
  EXPECT_TRUE(port.interrupts.level(Interrupt::usart2));
  port.write(offsetof(UsartRegisters, cr1), enabled | cr1::TransmissionCompleteInterrupt::mask);
  EXPECT_TRUE(port.interrupts.level(Interrupt::usart2));
  port.status();
  port.send(1);
  EXPECT_FALSE(port.interrupts.level(Interrupt::usart2));
  port.run(10 * port.bit);
  EXPECT_TRUE(port.interrupts.level(Interrupt::usart2));
  port.model.reset(port.now);
  EXPECT_FALSE(port.interrupts.level(Interrupt::usart2));
}

TEST(UsartModel, WhatIsNotModelledIsRefused) {
  Port port;
  for (const std::uint32_t bit : {0U, 1U, 11U, 15U})
    EXPECT_THROW(port.write(offsetof(UsartRegisters, cr1), enabled | 1U << bit), RefusedAccess) << bit;
  for (const std::uint32_t bit : {0U, 3U, 6U, 7U, 8U, 9U})
    EXPECT_THROW(port.write(offsetof(UsartRegisters, cr3), 1U << bit), RefusedAccess) << bit;
  EXPECT_THROW(port.write(offsetof(UsartRegisters, cr2), 1U << 12), RefusedAccess) << "half a stop bit";
  EXPECT_THROW(port.write(offsetof(UsartRegisters, brr), 0x100), RefusedAccess) << "enabled";
  EXPECT_THROW(port.write(offsetof(UsartRegisters, cr1), enabled | cr1::NineBits::mask), RefusedAccess);
  EXPECT_THROW(port.write(offsetof(UsartRegisters, gtpr), 0), RefusedAccess);
  port.write(offsetof(UsartRegisters, cr1), 0);
  EXPECT_THROW(port.send(1), RefusedAccess) << "disabled";
  EXPECT_THROW(port.write(offsetof(UsartRegisters, brr), 15), RefusedAccess);
  EXPECT_THROW(port.write(offsetof(UsartRegisters, brr), 0x1'0000), RefusedAccess);
}

// drivers/stm32f4/usart.hpp on the model.
constexpr std::uint32_t apb1_hz = 42'000'000;
constexpr BoardTime bit_at_115200 = BoardTime{0x16D} * 8;

struct UsartOnModel {
  testing::RegisterOnModel sr, dr, brr, cr1, cr2, cr3;
};

/// With a processor that takes its interrupt 2 us after it was raised.
struct DrivenPort : testing::ModelBench {
  explicit DrivenPort(const stm32::UsartConfig& config = {}) : ModelBench({&model}, 0) {
    clocks.apb1 = units_per_period(apb1_hz);
    access_time = 20;
    model.on_transmitted([this](std::uint8_t byte, BoardTime end) {
      sent.push_back(byte);
      last_stop_bit = end;
    });
    model.on_transmitting([this](bool on, BoardTime at) {
      if (on) start_bits.push_back(at);
    });
    EXPECT_TRUE(usart.configure(config, apb1_hz));
  }
  void serve(BoardTime duration) {
    const BoardTime end = now + duration;
    while (now < end) {
      run(2 * units_per_microsecond);
      if (interrupts.level(Interrupt::uart4)) serve_once();
    }
  }
  void serve_once() {
    events_served.push_back(usart.ISR_serve());
    if (events_served.back().transmission_complete) sent_at_completion = sent.size();
  }

  UsartModel model{clocks, interrupts, Interrupt::uart4};
  UsartOnModel registers = block_on_model<UsartOnModel>(*this, model);
  stm32::Usart<UsartOnModel> usart{registers};
  std::vector<std::uint8_t> sent;
  std::size_t sent_at_completion = 0;
  std::vector<BoardTime> start_bits;
  BoardTime last_stop_bit = 0;
  std::vector<stm32::UsartEvent> events_served;
};

std::array<std::uint8_t, 256> all_bytes() {
  std::array<std::uint8_t, 256> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 167 + 13);
  return bytes;
}

TEST(UsartOnModel, RoundTripOf256BytesInBothDirectionsAtOnce) {
  DrivenPort port;
  const auto bytes = all_bytes();
  for (const std::uint8_t byte : bytes)
    port.model.receive(static_cast<std::uint8_t>(~byte), true, true, port.now + 12 * bit_at_115200);
  EXPECT_FALSE(port.usart.transmit({}));
  ASSERT_TRUE(port.usart.transmit(bytes));
  EXPECT_FALSE(port.usart.transmit(bytes)) << "one transmission at a time";
  port.serve(260 * 11 * bit_at_115200);

  EXPECT_TRUE(std::equal(port.sent.begin(), port.sent.end(), bytes.begin(), bytes.end()));
  std::vector<std::uint8_t> received;
  unsigned completions = 0;
  for (const stm32::UsartEvent& event : port.events_served) {
    EXPECT_FALSE(event.line_error);
    if (event.received) received.push_back(event.byte);
    completions += event.transmission_complete ? 1 : 0;
  }
  ASSERT_EQ(received.size(), bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) EXPECT_EQ(received[i], static_cast<std::uint8_t>(~bytes[i]));
  EXPECT_EQ(completions, 1U);
  EXPECT_EQ(port.sent_at_completion, bytes.size()) << "only when the last stop bit has left";
  EXPECT_FALSE(port.usart.transmitting());
  EXPECT_FALSE(port.interrupts.level(Interrupt::uart4));
  // 256 frames of 11 bits without a gap.
  EXPECT_EQ(port.last_stop_bit - port.start_bits.front(), 256 * 11 * bit_at_115200);
}

TEST(UsartOnModel, ErrorsOnTheLineReachTheirByte) {
  DrivenPort port;
  port.model.receive(1, true, true, port.now);
  port.model.receive(2, false, true, port.now);
  port.model.receive(3, true, false, port.now);
  port.model.receive(4, true, true, port.now);
  port.serve(60 * bit_at_115200);
  port.model.add_noise();
  port.model.receive(5, true, true, port.now);
  port.model.receive(6, true, true, port.now);
  port.serve(40 * bit_at_115200);
  ASSERT_EQ(port.events_served.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(port.events_served[i].byte, i + 1);
    EXPECT_EQ(port.events_served[i].line_error, i == 1 || i == 2 || i == 4) << i;
  }
}

TEST(UsartOnModel, LateServiceIsAnOverrunAndTheNextByteIsClean) {
  DrivenPort port;
  for (std::uint8_t byte = 1; byte <= 3; ++byte) port.model.receive(byte, true, true, port.now);
  port.run(40 * bit_at_115200);
  port.serve(10 * bit_at_115200);
  ASSERT_EQ(port.events_served.size(), 1U);
  EXPECT_EQ(port.events_served[0].byte, 1);
  EXPECT_TRUE(port.events_served[0].line_error);
  port.model.receive(9, true, true, port.now);
  port.serve(20 * bit_at_115200);
  ASSERT_EQ(port.events_served.size(), 2U);
  EXPECT_EQ(port.events_served[1].byte, 9);
  EXPECT_FALSE(port.events_served[1].line_error);
}

TEST(UsartOnModel, AnOverrunIsReportedWithoutAByteAndDroppedByConfigure) {
  DrivenPort port;
  port.model.receive(1, true, true, port.now);
  port.run(12 * bit_at_115200);
  static_cast<void>(static_cast<std::uint32_t>(port.registers.sr));  // before the second byte has come
  port.model.receive(2, true, true, port.now);
  port.run(12 * bit_at_115200);
  static_cast<void>(static_cast<std::uint32_t>(port.registers.dr));
  const stm32::UsartEvent event = port.usart.ISR_serve();
  EXPECT_TRUE(!event.received && event.line_error);
  port.model.receive(3, true, false, port.now);
  port.run(12 * bit_at_115200);
  EXPECT_TRUE(port.interrupts.level(Interrupt::uart4));
  ASSERT_TRUE(port.usart.configure({}, apb1_hz));
  EXPECT_FALSE(port.interrupts.level(Interrupt::uart4));
}

// Bytes in at any time, interrupts served late, or with nothing to serve: every byte leaves once and in
// order, every received byte is seen or its loss is.
RC_GTEST_PROP(UsartOnModel, AnyInterleaving, ()) {
  DrivenPort port;
  const auto message = *rc::gen::nonEmpty(rc::gen::arbitrary<std::vector<std::uint8_t>>());
  const auto script = *rc::gen::container<std::vector<int>>(100, rc::gen::inRange(0, 4));
  RC_ASSERT(port.usart.transmit(message));
  std::uint8_t received = 0;
  for (const int action : script) {
    if (action == 0) port.model.receive(received++, true, true, port.now);
    if (action == 1) port.run(8 * bit_at_115200);
    if (action == 2 && port.interrupts.level(Interrupt::uart4)) port.serve_once();
    if (action == 3) port.serve_once();  // pended by software
  }
  port.serve((message.size() + received + 3) * 11 * bit_at_115200);
  unsigned completions = 0;
  bool lost = false;
  std::vector<std::uint8_t> seen;
  for (const stm32::UsartEvent& event : port.events_served) {
    if (event.received) seen.push_back(event.byte);
    completions += event.transmission_complete ? 1 : 0;
    lost = lost || event.line_error;
  }
  RC_ASSERT(completions == 1U);
  RC_ASSERT(port.sent == message);
  RC_ASSERT(port.sent_at_completion == message.size());
  RC_ASSERT(lost || seen.size() == received);
  for (std::size_t i = 0; !lost && i < seen.size(); ++i) RC_ASSERT(seen[i] == i);
}

TEST(UsartOnModel, ReconfiguredInTheMiddleOfATelegram) {
  DrivenPort port;
  const auto bytes = all_bytes();
  ASSERT_TRUE(port.usart.transmit(bytes));
  port.serve(30 * 11 * bit_at_115200);
  const std::size_t before = port.sent.size();
  ASSERT_TRUE(port.usart.configure({.baud_rate = 1'000'000, .parity = stm32::UsartParity::none}, apb1_hz));
  EXPECT_FALSE(port.usart.transmitting());
  port.serve(1000 * units_per_microsecond);
  EXPECT_EQ(port.sent.size(), before);
  EXPECT_EQ(port.model.frame_time(), 11 * units_per_microsecond);
  ASSERT_TRUE(port.usart.transmit(std::span(bytes).first(10)));
  port.serve(200 * units_per_microsecond);
  EXPECT_EQ(port.sent.size(), before + 10);
}

}  // namespace kmax::virtual_board::usart_test
