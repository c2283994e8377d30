// drivers/stm32f4/usart.hpp on the model of the port.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/usart.hpp"
#include "host_tools/virtual_board/stm32f4/usart.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"
#include "tests/host_tools/virtual_board/stm32f4/timed_register.hpp"

namespace kmax::virtual_board::usart_on_model_test {
namespace {

namespace stm32 = drivers::stm32f4;
using stm32::Interrupt;
using stm32::UsartEvent;
using testing::TimedBus;
using testing::TimedRegister;

constexpr std::uint32_t apb1_hz = 42'000'000;
constexpr BoardTime bit_at_115200 = BoardTime{0x16D} * 8;

struct UsartOnModel {
  TimedRegister sr, dr, brr, cr1, cr2, cr3;
};

/// The port with a processor that takes its interrupt 2 us after it was raised.
struct Port {
  BoardClocks clocks;
  testing::RecordedInterrupts lines;
  UsartModel model{clocks, lines, Interrupt::uart4};
  TimedBus bus{{&model}};
  UsartOnModel registers{
      {bus, model, offsetof(stm32::UsartRegisters, sr)},  {bus, model, offsetof(stm32::UsartRegisters, dr)},
      {bus, model, offsetof(stm32::UsartRegisters, brr)}, {bus, model, offsetof(stm32::UsartRegisters, cr1)},
      {bus, model, offsetof(stm32::UsartRegisters, cr2)}, {bus, model, offsetof(stm32::UsartRegisters, cr3)}};
  stm32::Usart<UsartOnModel> usart{registers};
  std::vector<std::uint8_t> sent;
  std::vector<BoardTime> start_bits;
  BoardTime last_stop_bit = 0;
  std::vector<UsartEvent> events;

  explicit Port(const stm32::UsartConfig& config = {}) {
    clocks.apb1 = units_per_period(apb1_hz);
    model.on_transmitted([this](std::uint8_t byte, BoardTime end) {
      sent.push_back(byte);
      last_stop_bit = end;
    });
    model.on_transmitting([this](bool on, BoardTime at) {
      if (on) start_bits.push_back(at);
    });
    EXPECT_TRUE(usart.configure(config, apb1_hz));
  }
  void run(BoardTime duration) {
    const BoardTime end = bus.now + duration;
    while (bus.now < end) {
      bus.pass(2 * units_per_microsecond);
      if (lines.level(Interrupt::uart4)) events.push_back(usart.ISR_serve());
    }
  }
};

std::array<std::uint8_t, 256> all_bytes() {
  std::array<std::uint8_t, 256> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 167 + 13);
  return bytes;
}

TEST(UsartOnModel, RoundTripOf256BytesInBothDirectionsAtOnce) {
  Port port;
  const auto bytes = all_bytes();
  for (const std::uint8_t byte : bytes)
    port.model.receive(static_cast<std::uint8_t>(~byte), true, true, port.bus.now + 12 * bit_at_115200);
  ASSERT_TRUE(port.usart.transmit(bytes));
  port.run(260 * 11 * bit_at_115200);

  EXPECT_TRUE(std::equal(port.sent.begin(), port.sent.end(), bytes.begin(), bytes.end()));
  std::vector<std::uint8_t> received;
  unsigned completions = 0;
  for (const UsartEvent& event : port.events) {
    EXPECT_FALSE(event.line_error);
    if (event.received) received.push_back(event.byte);
    completions += event.transmission_complete ? 1 : 0;
  }
  ASSERT_EQ(received.size(), bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) EXPECT_EQ(received[i], static_cast<std::uint8_t>(~bytes[i]));
  EXPECT_EQ(completions, 1U);
  EXPECT_FALSE(port.lines.level(Interrupt::uart4));
  // 256 frames of 11 bits without a gap.
  EXPECT_EQ(port.last_stop_bit - port.start_bits.front(), 256 * 11 * bit_at_115200);
}

TEST(UsartOnModel, ErrorsOnTheLineReachTheirByte) {
  Port port;
  port.model.receive(1, true, true, port.bus.now);
  port.model.receive(2, false, true, port.bus.now);
  port.model.receive(3, true, false, port.bus.now);
  port.model.receive(4, true, true, port.bus.now);
  port.run(60 * bit_at_115200);
  ASSERT_EQ(port.events.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(port.events[i].byte, i + 1);
    EXPECT_EQ(port.events[i].line_error, i == 1 || i == 2);
  }
}

TEST(UsartOnModel, LateServiceIsAnOverrunAndTheNextByteIsClean) {
  Port port;
  for (std::uint8_t byte = 1; byte <= 3; ++byte) port.model.receive(byte, true, true, port.bus.now);
  port.bus.pass(40 * bit_at_115200);
  port.run(10 * bit_at_115200);
  ASSERT_EQ(port.events.size(), 1U);
  EXPECT_EQ(port.events[0].byte, 1);
  EXPECT_TRUE(port.events[0].line_error);
  port.model.receive(9, true, true, port.bus.now);
  port.run(20 * bit_at_115200);
  ASSERT_EQ(port.events.size(), 2U);
  EXPECT_EQ(port.events[1].byte, 9);
  EXPECT_FALSE(port.events[1].line_error);
}

TEST(UsartOnModel, ReconfiguredInTheMiddleOfATelegram) {
  Port port;
  const auto bytes = all_bytes();
  ASSERT_TRUE(port.usart.transmit(bytes));
  port.run(30 * 11 * bit_at_115200);
  const std::size_t before = port.sent.size();
  ASSERT_TRUE(port.usart.configure({.baud_rate = 1'000'000, .parity = stm32::UsartParity::none}, apb1_hz));
  EXPECT_FALSE(port.usart.transmitting());
  port.run(1000 * units_per_microsecond);
  EXPECT_EQ(port.sent.size(), before);
  EXPECT_EQ(port.model.frame_time(), 11 * units_per_microsecond);
  ASSERT_TRUE(port.usart.transmit(std::span(bytes).first(10)));
  port.run(200 * units_per_microsecond);
  EXPECT_EQ(port.sent.size(), before + 10);
}

}  // namespace
}  // namespace kmax::virtual_board::usart_on_model_test
