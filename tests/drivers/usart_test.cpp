#include "drivers/stm32f4/usart.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <deque>
#include <vector>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::usart_test {
namespace {

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

/// USART as RM0090 describes it: data and shift register on the way out, one data register with overrun on
/// the way in, flags cleared by reading SR and then DR, TC cleared by reading SR and then writing DR.
struct FakeUsart {
  FakeRegister sr, dr, brr, cr1, cr2, cr3;
  std::vector<std::uint8_t> line;  // what has left, stop bit included

  FakeUsart() {
    sr.value = txe | tc;
    sr.on_read = [this](std::uint32_t stored) {
      sr_was_read_ = stored;
      return stored;
    };
    dr.on_read = [this](std::uint32_t) {
      sr.value &= ~rxne;
      if ((sr_was_read_ & errors) != 0) sr.value &= ~errors;
      return received_;
    };
    dr.on_write = [this](std::uint32_t word) {
      if ((sr.value & txe) == 0) overwritten = true;
      if ((sr_was_read_ & tc) != 0) sr.value &= ~tc;
      waiting_.push_back(static_cast<std::uint8_t>(word));
      sr.value &= ~txe;
      load_shift_register();
    };
  }

  /// One frame time passes on the outgoing line.
  void frame_sent() {
    if (!shifting_) return;
    line.push_back(shift_register_);
    shifting_ = false;
    load_shift_register();
    if (!shifting_) sr.value |= tc;
  }

  void frame_received(std::uint16_t data, std::uint32_t error_flags = 0) {
    if ((sr.value & rxne) != 0) {
      sr.value |= ore;
      return;
    }
    received_ = data;
    sr.value |= rxne | error_flags;
  }

  bool asks_for_interrupt() const {
    return ((cr1.value & 1U << 5) != 0 && (sr.value & (rxne | ore)) != 0) ||
           ((cr1.value & 1U << 6) != 0 && (sr.value & tc) != 0) ||
           ((cr1.value & 1U << 7) != 0 && (sr.value & txe) != 0);
  }

  static constexpr std::uint32_t pe = 1, fe = 2, ne = 4, ore = 8, rxne = 0x20, tc = 0x40, txe = 0x80;
  static constexpr std::uint32_t errors = pe | fe | ne | ore;
  bool overwritten = false;

 private:
  void load_shift_register() {
    if (shifting_ || waiting_.empty()) return;
    shift_register_ = waiting_.front();
    waiting_.pop_front();
    shifting_ = true;
    sr.value |= txe;
  }
  std::uint32_t sr_was_read_ = 0;
  std::uint32_t received_ = 0;
  std::deque<std::uint8_t> waiting_;
  std::uint8_t shift_register_ = 0;
  bool shifting_ = false;
};

struct Line {
  FakeUsart registers;
  Usart<FakeUsart> usart{registers};
  Line() { EXPECT_TRUE(usart.configure({}, apb1)); }

  UsartEvent the_event() {
    const auto events = serve();
    EXPECT_EQ(events.size(), 1U);
    return events.empty() ? UsartEvent{} : events[0];
  }

  /// Serves until the hardware is content; a driver that never satisfies it would hang the board.
  std::vector<UsartEvent> serve() {
    std::vector<UsartEvent> events;
    while (registers.asks_for_interrupt()) {
      events.push_back(usart.ISR_serve());
      if (events.size() > 20) {
        ADD_FAILURE() << "interrupt storm";
        break;
      }
    }
    return events;
  }
};

TEST(Usart, ReceivesAByteWithoutItsParityBit) {
  Line line;
  line.registers.frame_received(0x1A5);
  const UsartEvent event = line.the_event();
  EXPECT_TRUE(event.received);
  EXPECT_EQ(event.byte, 0xA5);
  EXPECT_FALSE(event.line_error || event.transmission_complete);
}

TEST(Usart, EachErrorBelongsToItsByteOnly) {
  for (const std::uint32_t flag : {FakeUsart::pe, FakeUsart::fe, FakeUsart::ne}) {
    Line line;
    line.registers.frame_received(0x42, flag);
    const UsartEvent event = line.the_event();
    EXPECT_TRUE(event.line_error) << flag;
    EXPECT_EQ(event.byte, 0x42);
    line.registers.frame_received(0x43);
    EXPECT_FALSE(line.the_event().line_error) << flag;
  }
}

TEST(Usart, OverrunIsReportedAndCleared) {
  Line line;
  line.registers.frame_received(1);
  line.registers.frame_received(2);
  const UsartEvent event = line.the_event();
  EXPECT_TRUE(event.received && event.line_error);
  EXPECT_EQ(event.byte, 1);
  line.registers.sr.value |= FakeUsart::ore;
  const UsartEvent without_a_byte = line.the_event();
  EXPECT_TRUE(!without_a_byte.received && without_a_byte.line_error);
}

TEST(Usart, CompleteOnlyWhenTheLastStopBitHasLeft) {
  Line line;
  const std::array<std::uint8_t, 3> bytes{1, 2, 3};
  ASSERT_TRUE(line.usart.transmit(bytes));
  for (unsigned frame = 0; frame < 3; ++frame) {
    for (const UsartEvent& event : line.serve()) EXPECT_FALSE(event.transmission_complete) << frame;
    EXPECT_TRUE(line.usart.transmitting());
    line.registers.frame_sent();
  }
  EXPECT_TRUE(line.the_event().transmission_complete);
  EXPECT_FALSE(line.usart.transmitting());
  EXPECT_EQ(line.registers.line, (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_FALSE(line.registers.asks_for_interrupt()) << "TC stays set for ever; its interrupt must not";
}

TEST(Usart, OneTransmissionAtATime) {
  Line line;
  const std::array<std::uint8_t, 2> first{1, 2};
  const std::array<std::uint8_t, 2> second{3, 4};
  EXPECT_FALSE(line.usart.transmit({}));
  EXPECT_FALSE(line.registers.asks_for_interrupt());
  ASSERT_TRUE(line.usart.transmit(first));
  EXPECT_FALSE(line.usart.transmit(second));
  for (int frame = 0; frame < 3; ++frame) {
    line.serve();
    line.registers.frame_sent();
  }
  line.serve();
  EXPECT_EQ(line.registers.line, (std::vector<std::uint8_t>{1, 2}));
  EXPECT_TRUE(line.usart.transmit(second));
}

TEST(Usart, ReconfiguringDropsTheTransmission) {
  Line line;
  const std::array<std::uint8_t, 4> bytes{1, 2, 3, 4};
  ASSERT_TRUE(line.usart.transmit(bytes));
  line.usart.ISR_serve();
  ASSERT_TRUE(line.usart.configure({.baud_rate = 9'600}, apb1));
  EXPECT_FALSE(line.usart.transmitting());
  EXPECT_EQ(line.registers.cr1.writes.at(line.registers.cr1.writes.size() - 2), 0U)
      << "BRR may only change while the USART is disabled";
  line.registers.frame_sent();
  EXPECT_TRUE(line.serve().empty());
}

TEST(Usart, OldByteAndErrorsAreDroppedByConfigure) {
  Line line;
  line.registers.frame_received(0x55, FakeUsart::fe);
  ASSERT_TRUE(line.usart.configure({}, apb1));
  EXPECT_FALSE(line.registers.asks_for_interrupt());
}

// Any order of frames in, frames out, interrupts with and without cause: every byte leaves once and in order,
// every received byte is seen or its loss is.
RC_GTEST_PROP(Usart, AnyInterleaving, ()) {
  Line line;
  const auto message = *rc::gen::nonEmpty(rc::gen::arbitrary<std::vector<std::uint8_t>>());
  const auto script = *rc::gen::container<std::vector<int>>(200, rc::gen::inRange(0, 4));
  RC_ASSERT(line.usart.transmit(message));
  unsigned completions = 0;
  std::uint8_t next_in = 0;
  std::vector<std::uint8_t> seen;
  bool loss_reported = false;
  unsigned sent_in = 0;
  const auto handle = [&](const UsartEvent& event) {
    if (event.received) seen.push_back(event.byte);
    loss_reported = loss_reported || event.line_error;
    if (event.transmission_complete) {
      ++completions;
      RC_ASSERT(line.registers.line == message);
    }
  };
  const auto step = [&](int action) {
    if (action == 0) {
      line.registers.frame_received(next_in++);
      ++sent_in;
    }
    if (action == 1) line.registers.frame_sent();
    if (action == 2 && line.registers.asks_for_interrupt()) handle(line.usart.ISR_serve());
    if (action == 3) handle(line.usart.ISR_serve());  // pended by software
  };
  for (const int action : script) step(action);
  for (std::size_t i = 0; i < 4 * message.size() + 4; ++i) {
    step(1);
    step(2);
    step(2);
  }
  RC_ASSERT(completions == 1U);
  RC_ASSERT(line.registers.line == message);
  RC_ASSERT(!line.registers.overwritten);
  RC_ASSERT(seen.size() == sent_in || loss_reported);
  if (!loss_reported) {
    for (std::size_t i = 0; i < seen.size(); ++i) RC_ASSERT(seen[i] == static_cast<std::uint8_t>(i));
  }
}

}  // namespace
}  // namespace kmax::drivers::stm32f4::usart_test
