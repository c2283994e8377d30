#include "firmware/modbus/transfer_port.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/firmware/modbus/in_memory_bank.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::transfer_port_test {
namespace {

constexpr std::size_t full = TransferReceiver::packet_bytes;

struct Client {
  /// One transfer; `ends_empty`: as a host does that ends a full last packet with an empty one.
  void send(const Bytes& bytes, bool ends_empty = false) {
    std::size_t at = 0;
    while (at < bytes.size()) {
      const std::size_t size = std::min(full, bytes.size() - at);
      port.receive(std::span(bytes).subspan(at, size), ++now);
      at += size;
    }
    if (bytes.empty() || (ends_empty && bytes.size() % full == 0)) port.receive({}, ++now);
  }
  Bytes reply() {
    const auto span = port.take_reply();
    Bytes bytes(span.begin(), span.end());
    port.reply_sent();
    return bytes;
  }
  Bytes exchange(const Bytes& pdu, bool ends_empty = false) {
    send(adu(1, pdu), ends_empty);
    return reply();
  }
  std::uint32_t now = 0xFFFF'FFF0;
  InMemoryBank bank;
  TransferPort<InMemoryBank> port{bank, 1};
};

const Bytes read_pdu = read_request(3, 2, 1);
const Bytes read_reply = adu(1, {3, 2, 0x5A, 0x02});

/// A write of so many registers has 9 + 2 n bytes.
Bytes write_of(std::size_t count) {
  return multiple_request(0x100, std::vector<std::uint16_t>(count, 0x1234));
}

TEST(TransferPort, AnswersARequestOfOnePacketAtOnce) {
  Client client;
  EXPECT_EQ(client.exchange(read_pdu), read_reply);
  EXPECT_EQ(client.port.last_valid_request_time(), client.now);
  EXPECT_EQ(client.port.receiver_counters().frames_received, 1U);
}

TEST(TransferPort, ARequestMayHaveSeveralPackets) {
  for (std::size_t count = 1; count <= 123; ++count) {
    Client client;
    EXPECT_EQ(client.exchange(write_of(count)), adu(1, {16, 1, 0, 0, static_cast<std::uint8_t>(count)}))
        << count;
    EXPECT_EQ(client.bank.writes, 1) << count;
  }
}

/// 1 tag, 2 CRC and unit around it: lengths that fill their last packet, with and without an empty one
/// behind.
TEST(TransferPort, AFullLastPacketEndsARequestThatIsAsLongAsItSays) {
  for (const bool ends_empty : {false, true}) {
    for (const std::size_t size : {full, 2 * full, 3 * full, 4 * full}) {
      Client client;
      Bytes pdu = {65, 7, 7};  // a tag makes the length even
      pdu = pdu + write_of((size - 3 - 3 - 6) / 2);
      ASSERT_EQ(adu(1, pdu).size(), size);
      const Bytes answer = client.exchange(pdu, ends_empty);
      ASSERT_FALSE(answer.empty()) << size;
      EXPECT_EQ(answer[1], 65);
      EXPECT_EQ(client.exchange(read_pdu), read_reply);
      EXPECT_EQ(client.port.receiver_counters().undersize, 0U);
      EXPECT_EQ(client.port.receiver_counters().crc_errors, 0U);
    }
  }
}

TEST(TransferPort, AFullLastPacketEndsWhateverHasTheRightCrc) {
  Client client;
  Bytes echo{8, 0, 0};
  echo.resize(full - 3, 0x55);
  EXPECT_EQ(client.exchange(echo), adu(1, echo));
}

TEST(TransferPort, ATornTransferIsNoRequestAndHoldsNothingUp) {
  Client client;
  const Bytes whole = adu(1, read_pdu);
  client.send(Bytes(whole.begin(), whole.begin() + 5));
  EXPECT_TRUE(client.reply().empty());
  client.send(Bytes(whole.begin() + 5, whole.end()));
  EXPECT_TRUE(client.reply().empty());
  EXPECT_EQ(client.port.receiver_counters().crc_errors, 1U);
  EXPECT_EQ(client.port.receiver_counters().undersize, 1U);
  EXPECT_EQ(client.exchange(read_pdu), read_reply);
}

TEST(TransferPort, WhatWasTornOffBehindAFullPacketGoesWithTheLineThatBeginsAnew) {
  Client client;
  const Bytes whole = adu(1, write_of(100));
  client.send(Bytes(whole.begin(), whole.begin() + full));
  client.port.restart();
  EXPECT_EQ(client.port.receiver_counters().abandoned, 1U);
  EXPECT_EQ(client.exchange(read_pdu), read_reply);
}

TEST(TransferPort, MoreThanAFrameIsThrownAwayUpToTheEndOfItsTransfer) {
  Client client;
  client.send(Bytes(5 * full + 7));
  EXPECT_EQ(client.port.receiver_counters().oversize, 1U);
  EXPECT_EQ(client.port.receiver_counters().crc_errors, 0U);
  EXPECT_EQ(client.exchange(read_pdu), read_reply);
}

TEST(TransferPort, AnEmptyTransferIsNothing) {
  Client client;
  client.send({});
  EXPECT_EQ(client.port.receiver_counters().undersize, 0U);
  EXPECT_EQ(client.exchange(read_pdu), read_reply);
}

TEST(TransferPort, OtherUnitsAndBroadcastsHaveNoReply) {
  Client client;
  client.send(adu(2, read_pdu));
  EXPECT_TRUE(client.reply().empty());
  EXPECT_FALSE(client.port.last_valid_request_time());
  client.send(adu(0, {6, 0, 2, 0x12, 0x34}));
  EXPECT_TRUE(client.reply().empty());
  EXPECT_EQ(client.bank.holding[2], 0x1234);
}

TEST(TransferPort, WhileAReplyIsSentNothingIsCarriedOut) {
  Client client;
  client.send(adu(1, read_pdu));
  const auto reply = client.port.take_reply();
  const Bytes before(reply.begin(), reply.end());
  client.send(adu(1, {6, 0, 2, 0x12, 0x34}));
  EXPECT_EQ(client.bank.writes, 0);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), reply.begin()));
  EXPECT_EQ(client.port.last_valid_request_time(), client.now) << "its host is alive";
  client.port.reply_sent();
  EXPECT_EQ(client.exchange(read_pdu), read_reply);
}

TEST(TransferPort, OfTwoRequestsInARowTheSecondIsAnswered) {
  Client client;
  client.send(adu(1, {6, 0, 3, 0x12, 0x34}));
  client.send(adu(1, read_pdu));
  EXPECT_EQ(client.reply(), read_reply);
  EXPECT_TRUE(client.reply().empty());
  EXPECT_EQ(client.bank.holding[3], 0x1234) << "what it wrote stays written";
}

TEST(TransferPort, ATaggedWriteThatComesAgainIsAnsweredAndNotCarriedOutAgain) {
  Client client;
  const Bytes tagged{65, 1, 2, 6, 0, 2, 0x12, 0x34};
  const Bytes first = client.exchange(tagged);
  EXPECT_EQ(client.exchange(tagged), first);
  EXPECT_EQ(client.bank.writes, 1);
}

}  // namespace
}  // namespace kmax::firmware::modbus::transfer_port_test
