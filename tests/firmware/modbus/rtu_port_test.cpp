#include "firmware/modbus/rtu_port.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/firmware/modbus/in_memory_bank.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::rtu_port_test {
namespace {

const Bytes read_pdu{3, 0, 2, 0, 1};
const Bytes read_reply_pdu{3, 2, 0x5A, 0x02};
const Bytes written_reply_pdu{3, 2, 0x12, 0x34};
const Bytes write_pdu{6, 0, 2, 0x12, 0x34};

// A Modbus client and the line to one port, in virtual time. It sends requests and collects whole replies.
struct RtuClient {
  explicit RtuClient(RtuPortConfig config = {}, std::uint32_t start_us = 0)
      : line(config.baud_rate, start_us, config.format.bits()), port(bank, config) {}

  void send(const Bytes& bytes) { line.send(port, bytes); }

  // The silence that ends a frame, seen by the port.
  void settle() {
    line.silence(line.t3_5_us() + line.character_us() + 4);
    port.poll(line.now());
  }

  Bytes reply_due() {
    const auto reply = port.reply_due(line.now());
    return Bytes(reply.begin(), reply.end());
  }

  // Fetches a reply and plays it out.
  Bytes take_reply() {
    const std::span<const std::uint8_t> reply = port.reply_due(line.now());
    Bytes bytes(reply.begin(), reply.end());
    if (bytes.empty()) return bytes;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      line.character();
      EXPECT_TRUE(reply_due().empty());
    }
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), reply.begin()));
    port.reply_sent();
    return bytes;
  }

  Bytes exchange(const Bytes& request) {
    send(request);
    settle();
    return take_reply();
  }

  // After the silence that follows a reply.
  Bytes exchange_next(const Bytes& request) {
    settle();
    return exchange(request);
  }

  bool is_alive() {
    settle();
    (void)take_reply();
    settle();
    return exchange(adu(port.config().unit, {4, 0, 1, 0, 1})) == adu(port.config().unit, {4, 2, 0x80, 0x01});
  }

  InMemoryBank bank;
  RtuLine line;
  RtuPort<InMemoryBank> port;
};

Bytes beginning_of(const Bytes& request) {
  return Bytes(request.begin(), request.begin() + 3);
}
Bytes rest_of(const Bytes& request) {
  return Bytes(request.begin() + 3, request.end());
}

class RtuPortAtBaud : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(BaudRates, RtuPortAtBaud, testing::ValuesIn(tested_baud_rates));

TEST_P(RtuPortAtBaud, AnswersItsUnit) {
  RtuClient client({.unit = 17, .baud_rate = GetParam()});
  EXPECT_EQ(client.exchange(adu(17, read_pdu)), adu(17, read_reply_pdu));
  EXPECT_EQ(client.port.counters().replies, 1U);
  EXPECT_EQ(client.port.receiver_counters().frames_received, 1U);
}

// Asked every 7 us the reply comes t3.5 after the request's end at the earliest, and within one more
// character.
TEST_P(RtuPortAtBaud, ReplyIsDueNotBeforeT3_5AndOnlyOnce) {
  for (const std::uint32_t start : {0U, 0xFFFF'FFFFU, 0xFFFF'F700U, 0x7FFF'F700U}) {
    RtuClient client({.unit = 1, .baud_rate = GetParam()}, start);
    client.send(adu(1, read_pdu));
    double silence = 0.0;
    Bytes reply;
    while (reply.empty() && silence < 1e5) {
      client.line.silence(7.0);
      silence += 7.0;
      reply = client.reply_due();
    }
    EXPECT_EQ(reply, adu(1, read_reply_pdu));
    EXPECT_GE(silence, client.line.t3_5_us());
    EXPECT_LE(silence, client.line.t3_5_us() + client.line.character_us() + 10.0);
    EXPECT_TRUE(client.reply_due().empty());
  }
}

TEST_P(RtuPortAtBaud, RequestThatBeginsRightAfterTheReplyIsServed) {
  RtuClient client({.unit = 1, .baud_rate = GetParam()});
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(client.exchange(adu(1, read_pdu)), adu(1, read_reply_pdu));
    client.line.silence(1.0);
  }
}

TEST_P(RtuPortAtBaud, GapInsideARequestIsSilentAndHarmless) {
  RtuClient client({.unit = 1, .baud_rate = GetParam()});
  const Bytes request = adu(1, write_pdu);
  client.send(beginning_of(request));
  client.line.silence(client.line.t1_5_us() + 4);
  client.send(rest_of(request));
  client.settle();
  EXPECT_TRUE(client.reply_due().empty());
  EXPECT_EQ(client.bank.writes, 0);
  EXPECT_EQ(client.port.receiver_counters().gap_errors, 1U);
  EXPECT_TRUE(client.is_alive());
}

// Without a look at the port in between, so that the first character of the second request ends the first
// one.
TEST_P(RtuPortAtBaud, OfTwoBackToBackRequestsTheSecondIsAnswered) {
  for (const bool polled : {false, true}) {
    RtuClient client({.unit = 1, .baud_rate = GetParam()});
    client.send(adu(1, write_pdu));
    if (polled) client.settle();
    if (!polled) client.line.silence(client.line.t3_5_us() + 4);
    EXPECT_EQ(client.exchange(adu(1, read_pdu)), adu(1, written_reply_pdu));
    EXPECT_EQ(client.bank.writes, 1);
    client.settle();
    EXPECT_TRUE(client.take_reply().empty());
    EXPECT_TRUE(client.is_alive());
  }
}

TEST(RtuPort, NoReplyStartsWhileCharactersComeIn) {
  RtuClient client;
  client.send(adu(1, read_pdu));
  client.settle();
  client.send({0x02});
  EXPECT_TRUE(client.reply_due().empty());
  client.settle();
  EXPECT_TRUE(client.reply_due().empty());
  EXPECT_TRUE(client.is_alive());
}

// The first character of the second request ends the first one, and is itself still coming in.
TEST(RtuPort, NoReplyStartsOnTheCharacterThatEndedTheRequest) {
  RtuClient client;
  client.send(adu(1, read_pdu));
  client.line.silence(client.line.t3_5_us() + 4);
  client.send({0x01});
  EXPECT_TRUE(client.reply_due().empty());
  EXPECT_TRUE(client.is_alive());
}

// 248..255 are reserved: even a port that was asked to be one of them does not answer.
TEST(RtuPort, OnlyItsOwnUnitAnswers) {
  for (unsigned own = 0; own < 256; ++own) {
    for (const unsigned unit : {0U, 1U, 2U, 17U, 246U, 247U, 248U, 254U, 255U, own}) {
      RtuClient client({.unit = static_cast<std::uint8_t>(own)});
      const bool valid = own >= 1 && own <= 247;
      EXPECT_EQ(client.port.config().unit, valid ? own : 1U);
      const unsigned effective = valid ? own : 1U;
      const Bytes reply = client.exchange(adu(static_cast<std::uint8_t>(unit), write_pdu));
      EXPECT_EQ(reply, unit == effective ? adu(static_cast<std::uint8_t>(unit), write_pdu) : Bytes{})
          << own << " " << unit;
      EXPECT_EQ(client.bank.writes, unit == effective || unit == 0 ? 1 : 0);
      EXPECT_EQ(client.port.counters().other_units, unit == effective || unit == 0 ? 0U : 1U);
    }
  }
}

TEST(RtuPort, BroadcastWritesAreExecutedWithoutReply) {
  const Bytes writes[] = {
      {6, 0, 2, 0x12, 0x34},
      {16, 0, 2, 0, 1, 2, 0x12, 0x34},
      {22, 0, 2, 0, 0, 0x12, 0x34},
      {23, 0, 0, 0, 1, 0, 2, 0, 1, 2, 0x12, 0x34},
  };
  for (const Bytes& pdu : writes) {
    RtuClient client;
    EXPECT_TRUE(client.exchange(adu(0, pdu)).empty());
    EXPECT_EQ(client.bank.holding[2], 0x1234) << int{pdu[0]};
    EXPECT_EQ(client.port.counters().replies, 0U);
    EXPECT_TRUE(client.is_alive());
  }
}

TEST(RtuPort, BroadcastNeverGetsAReplyWhateverTheFunction) {
  for (unsigned function = 0; function < 256; ++function) {
    for (const Bytes& rest : {Bytes{}, Bytes{0, 2, 0, 1}, Bytes{14, 1, 0}, Bytes{0xFF, 0xFF, 0xFF, 0xFF}}) {
      RtuClient client;
      const int reads = client.bank.reads;
      EXPECT_TRUE(client.exchange(adu(0, Bytes{static_cast<std::uint8_t>(function)} + rest)).empty())
          << function;
      if (!is_write(static_cast<std::uint8_t>(function))) {
        EXPECT_EQ(client.bank.reads, reads);
      }
      EXPECT_TRUE(client.is_alive());
    }
  }
}

Bytes tagged(std::uint8_t tag, const Bytes& pdu) {
  return adu(1, Bytes{65, 0, tag} + pdu);
}

// The client has not got the answer, or the line has doubled the request.
TEST(RtuPort, ATaggedWriteThatComesAgainIsAnsweredAgainAndNotCarriedOutAgain) {
  RtuClient client;
  const Bytes reply = client.exchange_next(tagged(7, write_pdu));
  EXPECT_EQ(reply, tagged(7, write_pdu));
  for (int again = 0; again < 3; ++again) {
    EXPECT_EQ(client.exchange_next(tagged(7, write_pdu)), reply);
    EXPECT_EQ(client.bank.writes, 1);
  }
  EXPECT_EQ(client.exchange_next(tagged(8, write_pdu)), tagged(8, write_pdu));
  EXPECT_EQ(client.bank.writes, 2) << "another tag is another write";
  client.exchange_next(tagged(9, {6, 0, 2, 0, 1}));
  client.exchange_next(tagged(9, {6, 0, 2, 0, 2}));
  EXPECT_EQ(client.bank.writes, 4) << "another write is another one even under the same tag";
  client.exchange_next(adu(1, read_pdu));
  client.exchange_next(tagged(9, {6, 0, 2, 0, 2}));
  EXPECT_EQ(client.bank.writes, 5) << "its answer is gone";
}

TEST(RtuPort, ATaggedWriteWhoseAnswerWasDroppedIsNotCarriedOutAgainEither) {
  RtuClient client;
  client.send(tagged(7, write_pdu));
  client.settle();
  EXPECT_EQ(client.exchange_next(tagged(7, write_pdu)), tagged(7, write_pdu));
  EXPECT_EQ(client.bank.writes, 1);
}

/// `begin` with the two bytes behind it that give the CRC of `other`; there always are such.
Bytes of_equal_crc(const Bytes& begin, const Bytes& other) {
  Bytes bytes;
  for (unsigned value = 0; value < 0x1'0000 && reference_crc(bytes) != reference_crc(other); ++value)
    bytes = begin + Bytes{static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
  EXPECT_EQ(reference_crc(bytes), reference_crc(other));
  return bytes;
}

TEST(RtuPort, AnotherTaggedWriteIsCarriedOutEvenIfItsCrcIsTheSame) {
  const Bytes one = Bytes{65, 0, 7} + write_pdu;
  const Bytes two_values{65, 0, 7, 16, 0, 2, 0, 2, 4, 0x12, 0x34, 0, 0};
  const std::pair<Bytes, Bytes> pairs[] = {
      {one, of_equal_crc({65, 0, 8, 6, 0, 2}, one)},
      {two_values, of_equal_crc({65, 0, 7, 16, 0, 2, 0, 2, 4, 0x12, 0x35}, two_values)}};
  for (const auto& [first, second] : pairs) {
    RtuClient client;
    client.exchange_next(adu(1, first));
    const Bytes reply = client.exchange_next(adu(1, second));
    EXPECT_EQ(Bytes(reply.begin(), reply.begin() + 4), (Bytes{1, 65, 0, second[2]}));
    EXPECT_EQ(client.bank.writes, 2);
  }
}

TEST(RtuPort, ReadingsAndWritesWithoutATagAreCarriedOutEachTime) {
  RtuClient client;
  client.exchange_next(tagged(7, read_pdu));
  client.bank.holding[2] = 0x4321;
  EXPECT_EQ(client.exchange_next(tagged(7, read_pdu)), tagged(7, {3, 2, 0x43, 0x21}));
  client.exchange_next(adu(1, write_pdu));
  client.exchange_next(adu(1, write_pdu));
  EXPECT_EQ(client.bank.writes, 2);
}

TEST(RtuPort, ABroadcastWriteIsNotTakenForARepetition) {
  RtuClient client;
  client.exchange_next(tagged(7, write_pdu));
  client.exchange_next(adu(0, {6, 0, 2, 0, 9}));
  client.exchange_next(tagged(7, write_pdu));
  EXPECT_EQ(client.bank.holding[2], 0x1234);
  EXPECT_TRUE(client.exchange_next(adu(0, Bytes{65, 0, 1, 6, 0, 2, 0, 5})).empty());
  EXPECT_EQ(client.bank.holding[2], 0x1234) << "broadcasts are not tagged";
}

TEST(RtuPort, ANewPortHasCountedNothing) {
  const RtuClient client;
  const RtuPortCounters& counted = client.port.counters();
  for (const std::uint32_t number :
       {counted.other_units, counted.requests, counted.broadcasts, counted.replies, counted.exceptions})
    EXPECT_EQ(number, 0U);
}

TEST(RtuPort, DiagnosticsCountWhatTheLineCarried) {
  RtuClient client;
  const auto count = [&client](std::uint8_t which) {
    const Bytes reply = client.exchange_next(adu(1, {8, 0, which, 0, 0}));
    return reply.size() == 8 ? reply[4] * 256 + reply[5] : -1;
  };
  client.exchange_next(adu(1, {8, 0, 10, 0, 0}));
  client.exchange_next(adu(1, read_pdu));
  client.exchange_next(adu(1, {99}));
  client.exchange_next(adu(2, read_pdu));
  client.exchange_next(adu(0, write_pdu));
  Bytes torn = adu(1, read_pdu);
  torn.pop_back();
  client.exchange_next(torn);
  client.exchange_next(tagged(1, {99}));
  // Each asking is a frame, too.
  EXPECT_EQ(count(11), 6);
  EXPECT_EQ(count(12), 1);
  EXPECT_EQ(count(13), 2);
  EXPECT_EQ(count(14), 8);
  EXPECT_EQ(count(15), 1);
  client.exchange_next(adu(1, {8, 0, 10, 0, 0}));
  for (const std::uint8_t which : {std::uint8_t{12}, std::uint8_t{13}, std::uint8_t{15}})
    EXPECT_EQ(count(which), 0) << int{which};
  for (int n = 0; n < 300; ++n) client.exchange_next(adu(1, {99}));
  EXPECT_EQ(count(13), 300) << "more than a byte";
}

TEST(RtuPort, DiagnosticsEchoAnyData) {
  RtuClient client;
  const Bytes echo = adu(1, Bytes{8, 0, 0} + Bytes(250, 0xA5));
  EXPECT_EQ(client.exchange_next(echo), echo);
  for (const Bytes& short_one :
       {Bytes{8}, Bytes{8, 0, 0}, Bytes{8, 0, 0, 1}, Bytes{8, 0, 10, 0, 1}, Bytes{8, 0, 11, 0, 0, 0, 0}})
    EXPECT_EQ(client.exchange_next(adu(1, short_one)), adu(1, {8 | 0x80, 3}));
  for (const unsigned unknown : {1, 4, 9, 16, 20})
    EXPECT_EQ(client.exchange_next(adu(1, {8, 0, static_cast<std::uint8_t>(unknown), 0, 0})),
              adu(1, {8 | 0x80, 1}))
        << unknown;
}

TEST(RtuPort, ExceptionsAreRepliesAndCounted) {
  RtuClient client;
  EXPECT_EQ(client.exchange(adu(1, {5, 0, 0, 0xFF, 0})), adu(1, {0x85, 1}));
  client.settle();
  EXPECT_EQ(client.exchange(adu(1, {3, 0, 0, 0, 0})), adu(1, {0x83, 3}));
  EXPECT_EQ(client.port.counters().exceptions, 2U);
  EXPECT_EQ(client.port.counters().replies, 2U);
}

TEST(RtuPort, LongestRequestAndLongestReply) {
  RtuClient client;
  Bytes request{23, 1, 0, 0, 125, 1, 0, 0, 121, 242};
  request.resize(10 + 242, 0x77);
  const Bytes reply = client.exchange(adu(1, request));
  EXPECT_EQ(reply.size(), 1U + 252U + 2U);
  EXPECT_EQ(with_crc(Bytes(reply.begin(), reply.end() - 2)), reply);
  client.settle();
  client.bank.objects[0x80] = std::string(244, 'x');
  EXPECT_EQ(client.exchange(adu(1, {43, 14, 4, 0x80})).size(), adu_size_max);
}

TEST(RtuPort, HostSupervisionCountsOnlyValidFramesForThisUnit) {
  RtuClient client;
  const auto time = [&] { return client.port.last_valid_request_time(); };
  EXPECT_FALSE(time().has_value());
  (void)client.exchange(adu(2, read_pdu));
  Bytes damaged = adu(1, read_pdu);
  damaged[3] ^= 1;
  client.settle();
  (void)client.exchange(damaged);
  client.settle();
  (void)client.exchange({1, 2, 3});
  EXPECT_FALSE(time().has_value());
  client.settle();
  for (const Bytes& frame : {adu(1, read_pdu), adu(1, {5, 0}), adu(0, write_pdu), adu(0, read_pdu)}) {
    client.send(frame);
    const std::uint32_t end = client.line.now();
    client.settle();
    (void)client.take_reply();
    EXPECT_EQ(time(), end);
    client.settle();
    (void)client.exchange(adu(3, read_pdu));
    EXPECT_EQ(time(), end);
    client.settle();
  }
}

TEST(RtuPort, InvalidConfigurationsAreRefused) {
  RtuClient client;
  const RtuPortConfig before = client.port.config();
  EXPECT_FALSE(client.port.configure({.unit = 0}));
  EXPECT_FALSE(client.port.configure({.unit = 248}));
  EXPECT_FALSE(client.port.configure({.unit = 255}));
  EXPECT_FALSE(client.port.configure({.baud_rate = 0}));
  EXPECT_FALSE(client.port.configure({.baud_rate = baud_rate_min - 1}));
  EXPECT_FALSE(client.port.configure({.baud_rate = baud_rate_max + 1}));
  EXPECT_FALSE(client.port.configure({.format = {Parity::even, 0}}));
  EXPECT_FALSE(client.port.configure({.format = {Parity::even, 3}}));
  EXPECT_EQ(client.port.config(), before);
  EXPECT_TRUE(client.port.configure({.unit = 247, .baud_rate = baud_rate_min}));
  EXPECT_TRUE(client.port.configure({.unit = 1, .baud_rate = baud_rate_max, .format = {Parity::none, 2}}));
  EXPECT_EQ(client.port.config(), (RtuPortConfig{1, baud_rate_max, {Parity::none, 2}}));
  EXPECT_EQ(client.port.timing(), rtu_timing(baud_rate_max));
}

TEST(RtuPort, ConfigurationTakesEffectAtOnceWhenNoReplyIsUnderWay) {
  RtuClient client;
  EXPECT_TRUE(client.port.configure({.unit = 9, .baud_rate = 9600}));
  EXPECT_EQ(client.port.config().unit, 9);
  EXPECT_EQ(client.port.timing(), rtu_timing(9600));
  client.line = RtuLine(9600, client.line.now());
  EXPECT_TRUE(client.exchange(adu(1, read_pdu)).empty());
  client.settle();
  EXPECT_EQ(client.exchange(adu(9, read_pdu)), adu(9, read_reply_pdu));
}

TEST(RtuPort, ChangeOfTheUnitAloneLeavesAFrameUnderWayIntact) {
  RtuClient client;
  const Bytes request = adu(9, read_pdu);
  client.send(beginning_of(request));
  EXPECT_TRUE(client.port.configure({.unit = 9}));
  client.send(rest_of(request));
  client.settle();
  EXPECT_EQ(client.take_reply(), adu(9, read_reply_pdu));
}

// The bank configures the port from inside the write, as modbus.unit and modbus.baud_rate do.
TEST(RtuPort, WriteThatReconfiguresIsAnsweredUnderTheOldConfiguration) {
  RtuClient client({.unit = 1, .baud_rate = 115200});
  const RtuPortConfig changed{.unit = 42, .baud_rate = 9600};
  client.bank.on_write = [&] { EXPECT_TRUE(client.port.configure(changed)); };
  client.send(adu(1, write_pdu));
  client.settle();
  EXPECT_EQ(client.port.config().unit, 1);
  EXPECT_EQ(client.take_reply(), adu(1, write_pdu));
  EXPECT_EQ(client.port.config(), changed);
  EXPECT_EQ(client.port.timing(), rtu_timing(9600));
  client.bank.on_write = nullptr;

  client.line = RtuLine(9600, client.line.now());
  client.settle();
  EXPECT_TRUE(client.exchange(adu(1, read_pdu)).empty());
  client.settle();
  EXPECT_EQ(client.exchange(adu(42, read_pdu)), adu(42, written_reply_pdu));
}

TEST(RtuPort, ReconfigurationWaitsForAReplyThatIsBeingSent) {
  RtuClient client;
  client.send(adu(1, read_pdu));
  client.settle();
  ASSERT_FALSE(client.reply_due().empty());
  EXPECT_TRUE(client.port.configure({.unit = 5}));
  EXPECT_TRUE(client.port.configure({.unit = 6}));
  client.port.poll(client.line.now());
  EXPECT_EQ(client.port.config().unit, 1);
  client.port.reply_sent();
  EXPECT_EQ(client.port.config().unit, 6);
}

TEST(RtuPort, ReconfigurationByBroadcastOrWithADroppedReplyIsNotLost) {
  RtuClient client;
  std::uint8_t unit = 42;
  client.bank.on_write = [&] { EXPECT_TRUE(client.port.configure({.unit = unit})); };
  EXPECT_TRUE(client.exchange(adu(0, write_pdu)).empty());
  EXPECT_EQ(client.port.config().unit, 42);
  client.settle();

  unit = 43;
  client.send(adu(42, write_pdu));
  client.settle();
  EXPECT_EQ(client.port.config().unit, 42);
  EXPECT_EQ(client.exchange(adu(43, read_pdu)), adu(43, written_reply_pdu));
  EXPECT_EQ(client.port.config().unit, 43);
}

TEST(RtuPort, ReplySentWithoutAReplyChangesNothing) {
  RtuClient client;
  client.port.reply_sent();
  client.send(adu(1, read_pdu));
  client.port.reply_sent();
  client.settle();
  EXPECT_EQ(client.take_reply(), adu(1, read_reply_pdu));
}

TEST(RtuPort, AliveAfterLongIdleTimeAndAReplyMayWaitForHours) {
  RtuClient client;
  const auto idle = [&](int hours) {
    for (int second = 0; second < 3600 * hours; ++second) {
      client.line.silence(1e6);
      client.port.poll(client.line.now());
    }
  };
  (void)client.exchange(adu(1, read_pdu));
  idle(3);
  client.send(adu(1, read_pdu));
  idle(1);
  EXPECT_EQ(client.take_reply(), adu(1, read_reply_pdu));
}

// The driver reports the end of a reply late; the client, which has the last character, goes on at once.
TEST(RtuPort, ARequestThatBeginsBeforeTheReplyIsReportedSentIsAnswered) {
  RtuClient client;
  const Bytes request = adu(1, read_pdu);
  client.send(request);
  for (int i = 0; i < 10; ++i) {
    client.settle();
    ASSERT_EQ(client.reply_due(), adu(1, read_reply_pdu));
    client.send(beginning_of(request));
    client.port.reply_sent();
    client.send(rest_of(request));
  }
  EXPECT_EQ(client.port.receiver_counters().crc_errors, 0U);
}

TEST(RtuPort, ARequestCompleteWhileSendingLeavesTheReplyAlone) {
  RtuClient client;
  client.send(adu(1, read_pdu));
  client.settle();
  const auto reply = client.port.reply_due(client.line.now());
  const Bytes before(reply.begin(), reply.end());
  client.send(adu(1, {6, 0, 0, 0, 7}));
  client.settle();
  EXPECT_EQ(Bytes(reply.begin(), reply.end()), before);
  EXPECT_EQ(client.bank.writes, 0);
  client.port.reply_sent();
  EXPECT_TRUE(client.is_alive());
}

Bytes some_request(std::uint8_t unit) {
  static const std::vector<Bytes> pdus{{3, 0, 2, 0, 1},
                                       {4, 0, 0, 0, 9},
                                       {6, 0, 2, 0x12, 0x34},
                                       {6, 0, 0x40, 1, 1},
                                       {16, 0, 2, 0, 2, 4, 1, 2, 3, 4},
                                       {16, 0, 0x41, 0, 2, 4, 1, 2, 3, 4},
                                       {22, 0, 3, 0xF0, 0xF0, 1, 1},
                                       {23, 0, 0, 0, 2, 0, 4, 0, 1, 2, 9, 9},
                                       {23, 2, 0, 0, 2, 0, 4, 0, 1, 2, 9, 9},
                                       {43, 14, 1, 0},
                                       {43, 14, 4, 9},
                                       {99, 1}};
  return adu(unit, *rc::gen::elementOf(pdus));
}

// What the client sends is damaged in every way a line can: never a reply or a write for a frame with a bad
// CRC, never a change with an exception, and the next good request is answered.
RC_GTEST_PROP(RtuPort, DamagedTrafficIsHarmless, ()) {
  const auto start = *rc::gen::element<std::uint32_t>(0, 0xFFFF'0000, 0x7FFF'0000);
  RtuClient client({.unit = 1, .baud_rate = tested_baud_rates[*rc::gen::inRange<std::size_t>(0, 8)]}, start);
  for (int i = 0; i < 10; ++i) {
    Bytes frame = *rc::gen::inRange(0, 4) == 0
                      ? *rc::gen::resize(300, rc::gen::arbitrary<Bytes>())
                      : some_request(*rc::gen::element<std::uint8_t>(0, 1, 1, 1, 2, 250));
    switch (*rc::gen::inRange(0, 5)) {
      case 0:
        if (!frame.empty())
          frame[*rc::gen::inRange<std::size_t>(0, frame.size())] ^= *rc::gen::inRange<std::uint8_t>(1, 255);
        break;
      case 1:
        frame.resize(*rc::gen::inRange<std::size_t>(0, frame.size() + 1));
        break;
      case 2:
        frame.insert(frame.end(), *rc::gen::inRange<std::size_t>(1, 300),
                     *rc::gen::arbitrary<std::uint8_t>());
        break;
      default:
        break;
    }
    const auto line_error_at = *rc::gen::inRange<std::size_t>(0, 60);
    const auto before = client.bank.holding;
    for (std::size_t k = 0; k < frame.size(); ++k)
      client.port.receive(frame[k], k == line_error_at, client.line.character());
    client.settle();
    const Bytes reply = client.take_reply();
    const bool good = frame.size() >= 4 && frame.size() <= 256 && line_error_at >= frame.size() &&
                      with_crc(Bytes(frame.begin(), frame.end() - 2)) == frame;
    RC_ASSERT(reply.empty() != (good && frame[0] == 1));
    if (!good || frame[0] > 1) RC_ASSERT(client.bank.holding == before);
    if (!reply.empty()) {
      RC_ASSERT(reply[0] == 1);
      RC_ASSERT(with_crc(Bytes(reply.begin(), reply.end() - 2)) == reply);
      if ((reply[1] & 0x80) != 0) RC_ASSERT(client.bank.holding == before);
    }
    client.settle();
  }
  RC_ASSERT(!client.bank.asked_beyond_contract);
  RC_ASSERT(client.is_alive());
}

// Random characters at random distances, errors included, with calls in any order.
RC_GTEST_PROP(RtuPort, NoiseNeverGetsAReplyAndNeverStopsThePort, ()) {
  RtuClient client({}, *rc::gen::element<std::uint32_t>(0, 0xFFFF'F000));
  const auto before = client.bank.holding;
  const auto count = *rc::gen::inRange(0, 600);
  for (int i = 0; i < count; ++i) {
    // No frame for unit 0 or 1 can begin in this alphabet.
    const auto byte = *rc::gen::inRange<std::uint8_t>(2, 255);
    client.line.silence(*rc::gen::element(0.0, 0.0, 0.0, 0.0, 400.0, 800.0, 1740.0, 1760.0, 5000.0));
    client.port.receive(byte, *rc::gen::inRange(0, 100) == 0, client.line.character());
    if (*rc::gen::inRange(0, 10) == 0) client.port.poll(client.line.now());
    if (*rc::gen::inRange(0, 10) == 0) RC_ASSERT(client.reply_due().empty());
    if (*rc::gen::inRange(0, 50) == 0) client.port.reply_sent();
  }
  RC_ASSERT(client.bank.holding == before);
  RC_ASSERT(client.is_alive());
}

}  // namespace
}  // namespace kmax::firmware::modbus::rtu_port_test
