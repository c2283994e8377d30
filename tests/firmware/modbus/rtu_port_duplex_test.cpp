// Full-duplex lines: nothing that comes in is an echo.
#include "tests/firmware/modbus/rtu_client.hpp"

namespace kmax::firmware::modbus::rtu_port_duplex_test {
namespace {

const Bytes read_pdu = {4, 0, 1, 0, 1};
const Bytes read_reply_pdu = {4, 2, 0x80, 0x01};

// The driver reports the end of a reply late; the client, which has the last character, goes on at once.
TEST(RtuPortDuplex, RequestThatBeginsBeforeTheReplyIsReportedSentIsAnswered) {
  RtuClient client({.unit = 1, .half_duplex = false});
  for (int i = 0; i < 5; ++i) {
    client.send(adu(1, read_pdu));
    client.settle();
    const auto reply = client.port.reply_due(client.line.now());
    ASSERT_EQ(Bytes(reply.begin(), reply.end()), adu(1, read_reply_pdu));
    const Bytes next = adu(1, read_pdu);
    client.send(Bytes(next.begin(), next.begin() + 3));
    client.port.reply_sent(client.line.now());
    client.send(Bytes(next.begin() + 3, next.end()));
    client.settle();
    const auto second = client.port.reply_due(client.line.now());
    EXPECT_EQ(Bytes(second.begin(), second.end()), adu(1, read_reply_pdu));
    client.port.reply_sent(client.line.now());
  }
  EXPECT_EQ(client.port.counters().echo_bytes, 0U);
  EXPECT_EQ(client.port.receiver_counters().crc_errors, 0U);
}

TEST(RtuPortDuplex, RequestCompleteWhileSendingIsCountedAndLeavesTheReplyAlone) {
  RtuClient client({.unit = 1, .half_duplex = false});
  client.send(adu(1, read_pdu));
  client.settle();
  const auto reply = client.port.reply_due(client.line.now());
  const Bytes before(reply.begin(), reply.end());
  client.send(adu(1, {6, 0, 0, 0, 7}));
  client.settle();
  client.port.poll(client.line.now());
  EXPECT_EQ(Bytes(reply.begin(), reply.end()), before);
  EXPECT_EQ(client.port.counters().requests_while_sending, 1U);
  EXPECT_EQ(client.bank.writes, 0);
  client.port.reply_sent(client.line.now());
  EXPECT_TRUE(client.is_alive());
}

}  // namespace
}  // namespace kmax::firmware::modbus::rtu_port_duplex_test
