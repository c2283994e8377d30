#include "firmware/canopen/sdo_server.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/canopen/sdo_bench.hpp"

// Requests and answers byte by byte, after the frame tables of CiA 301 v4.2, 7.2.4.3. Whole transfers of all
// sizes are in sdo_server_transfers_test.cpp.

namespace kmax::firmware::canopen::sdo_server_test {
namespace {

constexpr ObjectAddress device_type = InMemoryObjects::device_type;
constexpr ObjectAddress domain = InMemoryObjects::domain;
constexpr ObjectAddress u8{0x2000, 1};
constexpr ObjectAddress u16{0x2000, 2};
constexpr ObjectAddress u32{0x2000, 4};
constexpr ObjectAddress u64{0x2000, 8};
constexpr ObjectAddress write_only{0x2011, 0};
constexpr ObjectAddress refuses_value{0x2012, 0};
constexpr ObjectAddress text{0x2013, 0};

class SdoServerTest : public testing::Test {
 protected:
  void TearDown() override {
    EXPECT_EQ(bench.complaints, std::vector<std::string>{});
    EXPECT_EQ(bench.objects.broken_promises, 0);
  }

  void expect_alive() { EXPECT_EQ(bench.ask(request(0x40, device_type)), device_type_answer); }

  static constexpr Eight device_type_answer{0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00};
  SdoBench<> bench;
};

TEST_F(SdoServerTest, ExpeditedReadOfEveryLengthSaysHowManyBytesCount) {
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x20, 1}), (Eight{0x4F, 0x00, 0x20, 1, 0xA0, 0, 0, 0}));
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x20, 2}), (Eight{0x4B, 0x00, 0x20, 2, 0xA0, 0xB0, 0, 0}));
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x20, 3}), (Eight{0x47, 0x00, 0x20, 3, 0xA0, 0xB0, 0xC0, 0}));
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x20, 4}), (Eight{0x43, 0x00, 0x20, 4, 0xA0, 0xB0, 0xC0, 0xD0}));
  EXPECT_FALSE(bench.server.busy());
}

TEST_F(SdoServerTest, ANumberOfEightBytesIsReadOnceAndSentInTwoSegments) {
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x20, 8}), (Eight{0x41, 0x00, 0x20, 8, 8, 0, 0, 0}));
  bench.objects.at(u64).value.assign(8, 0x55);  // changed halfway: not seen
  EXPECT_EQ(bench.ask({0x60}), (Eight{0x00, 0xA0, 0xB0, 0xC0, 0xD0, 0xE0, 0xF0, 0x00}));
  EXPECT_EQ(bench.ask({0x70}), (Eight{0x1D, 0x10}));
  EXPECT_EQ(bench.objects.reads.size(), 1U);
  EXPECT_FALSE(bench.server.busy());
  EXPECT_EQ(bench.ask({0x60}), abort_frame({}, Abort::command)) << "nothing is left to read";
}

TEST_F(SdoServerTest, ExpeditedWriteTakesTheBytesThatAreMeant) {
  EXPECT_EQ(bench.ask({0x2B, 0x00, 0x20, 2, 0x34, 0x12, 0x99, 0x99}), (Eight{0x60, 0x00, 0x20, 2}));
  EXPECT_EQ(bench.ask({0x2F, 0x00, 0x20, 1, 0x77}), (Eight{0x60, 0x00, 0x20, 1}));
  EXPECT_EQ(bench.objects.writes, (std::vector<InMemoryObjects::Written>{{u16, {0x34, 0x12}}, {u8, {0x77}}}));
}

TEST_F(SdoServerTest, ExpeditedWriteWithoutALengthTakesAsManyBytesAsTheObjectHas) {
  for (std::uint8_t size = 1; size <= 4; ++size) {
    EXPECT_EQ(bench.ask({0x22, 0x00, 0x20, size, 1, 2, 3, 4}), (Eight{0x60, 0x00, 0x20, size}));
    Bytes expected{1, 2, 3, 4};
    expected.resize(size);
    EXPECT_EQ(bench.objects.at({0x2000, size}).value, expected);
  }
  EXPECT_EQ(bench.ask({0x22, 0x00, 0x20, 5, 1, 2, 3, 4}), abort_frame({0x2000, 5}, Abort::too_short));
  EXPECT_EQ(bench.ask({0x22, 0x13, 0x20, 0, 'a', 'b', 'c', 'd'}), (Eight{0x60, 0x13, 0x20, 0}));
  EXPECT_EQ(bench.objects.at(text).value, (Bytes{'a', 'b', 'c', 'd'}));
}

// The flags come to one byte only: n in bits 2 and 3 means nothing unless e and s are set.
TEST_F(SdoServerTest, ReservedBitsAndUnusedFieldsAreNotLookedAt) {
  EXPECT_EQ(bench.ask({0x5F, 0x00, 0x10, 0x00, 9, 9, 9, 9}), device_type_answer);
  EXPECT_EQ(bench.ask({0x2E, 0x00, 0x20, 4, 1, 2, 3, 4}), (Eight{0x60, 0x00, 0x20, 4}));
  EXPECT_EQ(bench.ask({0x3B, 0x00, 0x20, 2, 1, 2}), (Eight{0x60, 0x00, 0x20, 2}));
}

TEST_F(SdoServerTest, RefusalsInTheStandardsOrder) {
  EXPECT_EQ(bench.ask({0x40, 0x34, 0x12, 7}), abort_frame({0x1234, 7}, Abort::no_object));
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x10, 1}), abort_frame({0x1000, 1}, Abort::no_subindex));
  EXPECT_EQ(bench.ask(request(0x40, write_only)), abort_frame(write_only, Abort::write_only));
  EXPECT_EQ(bench.ask(request(0xA0, write_only, {127, 0})), abort_frame(write_only, Abort::write_only));
  for (const std::uint8_t command : Bytes{0x20, 0x21, 0x22, 0x23, 0x2F, 0xC0, 0xC2, 0xC6}) {
    EXPECT_EQ(bench.ask(request(command, {0x1234, 7})), abort_frame({0x1234, 7}, Abort::no_object));
    EXPECT_EQ(bench.ask(request(command, {0x1000, 1})), abort_frame({0x1000, 1}, Abort::no_subindex));
    // Access before length: all of them would be too long, or too short.
    EXPECT_EQ(bench.ask(request(command, device_type)), abort_frame(device_type, Abort::read_only));
  }
  // Length before range.
  EXPECT_EQ(bench.ask(request(0x2F, refuses_value)), abort_frame(refuses_value, Abort::too_short));
  EXPECT_EQ(bench.ask(request(0x23, refuses_value)), abort_frame(refuses_value, Abort::value_too_high));
  EXPECT_EQ(bench.ask(request(0x23, u16)), abort_frame(u16, Abort::too_long));
  EXPECT_TRUE(bench.objects.writes.empty());
  EXPECT_FALSE(bench.server.busy());
  expect_alive();
}

TEST_F(SdoServerTest, AnIndicatedSizeThatDoesNotFitTheObjectIsRefusedAtOnce) {
  for (const std::uint8_t command : Bytes{0x21, 0xC2, 0xC6}) {
    EXPECT_EQ(bench.ask(request(command, u64, {9})), abort_frame(u64, Abort::too_long));
    EXPECT_EQ(bench.ask(request(command, u64, {7})), abort_frame(u64, Abort::too_short));
    EXPECT_EQ(bench.ask(request(command, u64, {0, 0, 0, 0x80})), abort_frame(u64, Abort::too_long));
    EXPECT_EQ(bench.ask(request(command, u64, {8, 0, 0, 1})), abort_frame(u64, Abort::too_long));
    EXPECT_EQ(bench.ask(request(command, text, {11})), abort_frame(text, Abort::too_long));
    EXPECT_EQ(bench.ask(request(command, text, {1})), abort_frame(text, Abort::too_short));
    EXPECT_EQ(bench.ask(request(command, domain, {0x01, 0x08})), abort_frame(domain, Abort::memory));
    EXPECT_EQ(bench.ask(request(command, domain, {0x61, 0xEA})), abort_frame(domain, Abort::too_long));
  }
  EXPECT_TRUE(bench.objects.writes.empty());
}

TEST_F(SdoServerTest, WrongToggleEndsADownload) {
  for (const std::uint8_t first : Bytes{0x10, 0x00}) {
    EXPECT_EQ(bench.ask(request(0x21, domain, {14})), request(0x60, domain));
    if (first == 0x00) {
      EXPECT_EQ(bench.ask({0x00, 1, 2, 3, 4, 5, 6, 7}), (Eight{0x20}));
    }
    EXPECT_EQ(bench.ask({first, 1, 2, 3, 4, 5, 6, 7}), abort_frame(domain, Abort::toggle));
    EXPECT_EQ(bench.ask({0x11}), abort_frame({}, Abort::command)) << "the transfer is over";
  }
  EXPECT_TRUE(bench.objects.writes.empty());
}

TEST_F(SdoServerTest, WrongToggleEndsAnUpload) {
  bench.objects.at(domain).value = pattern(30);
  EXPECT_EQ(bench.ask(request(0x40, domain)), request(0x41, domain, {30}));
  EXPECT_EQ(bench.ask({0x70}), abort_frame(domain, Abort::toggle));
  EXPECT_EQ(bench.ask(request(0x40, domain)), request(0x41, domain, {30}));
  EXPECT_EQ(bench.ask({0x60})[0], 0x00);
  EXPECT_EQ(bench.ask({0x60}), abort_frame(domain, Abort::toggle));
}

TEST_F(SdoServerTest, ToggleBeginsAtZeroWithEachInitiate) {
  bench.objects.at(domain).value = pattern(30);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(bench.ask(request(0x40, domain)), request(0x41, domain, {30}));
    EXPECT_EQ(bench.ask({0x60})[0], 0x00);
    EXPECT_EQ(bench.ask(request(0x20, domain)), request(0x60, domain));
    EXPECT_EQ(bench.ask({0x00}), (Eight{0x20}));
  }
}

TEST_F(SdoServerTest, NIsHonouredInEverySegment) {
  EXPECT_EQ(bench.ask(request(0x20, text)), request(0x60, text));
  EXPECT_EQ(bench.ask({0x0A, 'a', 'b', '#', '#', '#', '#', '#'}), (Eight{0x20}));
  EXPECT_EQ(bench.ask({0x1D, 'c', '#', '#', '#', '#', '#', '#'}), (Eight{0x30}));
  EXPECT_EQ(bench.objects.at(text).value, (Bytes{'a', 'b', 'c'}));
}

TEST_F(SdoServerTest, ABlockUploadMarksItsLastSegmentAndPadsItWithZeros) {
  const Bytes value = pattern(9);
  bench.objects.at(domain).value = value;
  EXPECT_EQ(bench.ask(request(0xA4, domain, {127})), request(0xC6, domain, {9}));
  bench.send({0xA3});
  EXPECT_EQ(bench.reply().value_or(bench.no_answer)[0], 1);
  EXPECT_EQ(bench.reply(), (Eight{0x82, value[7], value[8]}));
  EXPECT_FALSE(bench.reply().has_value());
  const std::uint16_t crc = SdoTestClient<SdoBench<>>::bitwise_crc(value);
  EXPECT_EQ(bench.ask({0xA2, 2, 0}), (Eight{0xC1 | 5 << 2, static_cast<std::uint8_t>(crc & 0xFF),
                                            static_cast<std::uint8_t>(crc >> 8)}));
  EXPECT_EQ(bench.ask({0xA2, 2, 127}), abort_frame(domain, Abort::command)) << "after the end";
  bench.ask(request(0xA4, domain, {127}));
  bench.send({0xA3});
  bench.reply();
  EXPECT_EQ(bench.ask({0xA3}), abort_frame(domain, Abort::command)) << "the go-ahead twice";
}

TEST_F(SdoServerTest, CommandsThatFitNoTransferAreRefused) {
  // Segments, block commands without an initiate, and the command that CiA 301 does not know.
  for (const std::uint8_t command : Bytes{0x00, 0x01, 0x10, 0x60, 0x70, 0xA1, 0xA2, 0xA3, 0xC1, 0xE0, 0xFF}) {
    EXPECT_EQ(bench.ask({command, 0x00, 0x10, 0x00}), abort_frame({}, Abort::command)) << int{command};
  }
  EXPECT_EQ(bench.server.counters().aborts_sent, 11U);
  expect_alive();
}

TEST_F(SdoServerTest, CommandsOfAnotherTransferEndTheOneUnderWayAndNameItsObject) {
  bench.objects.at(domain).value = pattern(30);
  const Eight segmented_download = request(0x21, domain, {14});
  const Eight segmented_upload = request(0x40, domain);
  const Eight block_download = request(0xC6, domain, {14});
  const Eight block_upload = request(0xA4, domain, {10});
  const auto refuses = [&](const Eight& initiate, std::initializer_list<std::uint8_t> commands) {
    for (const std::uint8_t command : commands) {
      bench.ask(initiate);
      EXPECT_EQ(bench.ask({command}), abort_frame(domain, Abort::command)) << initiate[0] << ' ' << command;
      EXPECT_FALSE(bench.server.busy());
    }
  };
  refuses(segmented_download, {0x60, 0xA1, 0xA2, 0xA3, 0xC1, 0xE0});
  refuses(segmented_upload, {0x00, 0xA1, 0xA2, 0xA3, 0xC1, 0xE0});
  refuses(block_download, {0x00, 0x60, 0xA1, 0xA2, 0xA3, 0xC1, 0xE0});
  refuses(block_upload, {0x00, 0x60, 0xA1, 0xA2, 0xC1, 0xE0});
  EXPECT_TRUE(bench.objects.writes.empty());
}

TEST_F(SdoServerTest, AnAbortEndsEveryTransferAndIsNeverAnswered) {
  bench.objects.at(domain).value = pattern(30);
  for (const Eight& initiate : {request(0x21, domain, {14}), request(0x40, domain),
                                request(0xC6, domain, {14}), request(0xA4, domain, {10})}) {
    for (const bool answer_fetched : {true, false}) {
      bench.send(initiate);
      if (answer_fetched) {
        ASSERT_TRUE(bench.reply().has_value());
      }
      EXPECT_TRUE(bench.server.busy());
      EXPECT_EQ(bench.ask(abort_frame(domain, Abort::general)), bench.no_answer);
      EXPECT_FALSE(bench.server.busy());
    }
  }
  EXPECT_EQ(bench.ask(abort_frame(domain, Abort::general)), bench.no_answer) << "nothing to abort";
  EXPECT_EQ(bench.server.counters().aborts_sent, 0U);
  expect_alive();
}

TEST_F(SdoServerTest, FramesOfAnotherKindAreIgnoredAndCounted) {
  const Eight read = request(0x40, device_type);
  for (std::uint8_t length = 0; length < 8; ++length) {
    bench.server.receive({.identifier = 0x605, .length = length, .data = read}, bench.now_us);
  }
  bench.server.receive({.identifier = 0x605, .extended = true, .length = 8, .data = read}, bench.now_us);
  bench.server.receive({.identifier = 0x605, .remote = true, .length = 8, .data = read}, bench.now_us);
  bench.server.receive({.identifier = 0x606, .length = 8, .data = read}, bench.now_us);
  EXPECT_FALSE(bench.reply().has_value());
  expect_alive();
}

TEST_F(SdoServerTest, FramesOfAnotherKindNeitherDisturbATransferNorKeepItAlive) {
  EXPECT_EQ(bench.ask(request(0x21, domain, {7})), request(0x60, domain));
  for (int i = 0; i < 9; ++i) {
    bench.wait(100'000);
    bench.server.receive({.identifier = 0x605, .length = 7}, bench.now_us);
  }
  EXPECT_FALSE(bench.reply().has_value());
  bench.wait(100'000);
  EXPECT_EQ(bench.reply(), abort_frame(domain, Abort::timeout));
}

TEST_F(SdoServerTest, ATimeOutEndsEveryTransferOnceAndFreesTheChannel) {
  bench.objects.at(domain).value = pattern(30);
  for (const Eight& initiate : {request(0x21, domain, {14}), request(0x40, domain),
                                request(0xC6, domain, {14}), request(0xA4, domain, {10})}) {
    bench.ask(initiate);
    bench.wait(999'000);
    EXPECT_FALSE(bench.reply().has_value()) << "too early";
    bench.wait(1'000);
    EXPECT_EQ(bench.reply(), abort_frame(domain, Abort::timeout));
    bench.wait(3'000'000);
    EXPECT_FALSE(bench.reply().has_value()) << "told once";
    EXPECT_FALSE(bench.server.busy());
  }
  EXPECT_EQ(bench.server.counters().timeouts, 4U);
  EXPECT_TRUE(bench.objects.writes.empty());
  expect_alive();
}

TEST_F(SdoServerTest, IdleForHoursThereIsNoTimeOut) {
  for (int i = 0; i < 200'000; ++i) {
    bench.now_us += 99'999;
    bench.server.poll(bench.now_us);
  }
  EXPECT_FALSE(bench.server.busy());
  EXPECT_EQ(bench.server.counters().timeouts, 0U);
  expect_alive();
}

TEST_F(SdoServerTest, AnAnswerThatCannotLeaveGivesWayToTheTimeOut) {
  bench.send(request(0x21, domain, {14}));
  bench.wait(1'100'000);
  EXPECT_EQ(bench.reply(), abort_frame(domain, Abort::timeout));
  EXPECT_FALSE(bench.reply().has_value());
}

TEST_F(SdoServerTest, StoppedItIsSilentAndForgetsTheTransfer) {
  bench.ask(request(0x21, domain, {7}));
  bench.send({0x01, 1, 2, 3, 4, 5, 6, 7});
  bench.server.stop();
  EXPECT_FALSE(bench.reply().has_value()) << "an answer left over";
  EXPECT_EQ(bench.ask(request(0x40, device_type)), bench.no_answer);
  bench.ask(request(0x21, domain, {7}));
  bench.wait(2'000'000);
  EXPECT_FALSE(bench.server.busy());
  bench.server.start(SdoChannel::predefined(bench.node_id));
  EXPECT_EQ(bench.ask({0x01}), abort_frame({}, Abort::command));
  expect_alive();
}

TEST_F(SdoServerTest, AnObjectMayStopTheServerWhileItIsWritten) {
  bench.objects.on_write = [&] { bench.server.stop(); };
  EXPECT_EQ(bench.ask(request(0x23, u32)), bench.no_answer);
  EXPECT_FALSE(bench.server.busy());
}

TEST_F(SdoServerTest, AnotherNodeIdTakesEffectWithTheStart) {
  bench.server.start(SdoChannel::predefined(127));
  bench.server.receive({.identifier = 0x67F, .length = 8, .data = request(0x40, device_type)}, 0);
  drivers::CanFrame frame;
  ASSERT_TRUE(bench.server.next_frame(frame, 0));
  EXPECT_EQ(frame, (drivers::CanFrame{.identifier = 0x5FF, .length = 8, .data = device_type_answer}));
}

TEST(SdoChannel, IsNoneByDefault) {
  const SdoChannel defaults{};
  EXPECT_EQ(defaults.request, 0);
  EXPECT_EQ(defaults.response, 0);
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_server_test
