// Whole transfers of every size between a client that keeps to the standard and the server; over a bus that
// loses, repeats and reorders frames, and with clients that pause.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "firmware/canopen/sdo_server.hpp"
#include "tests/firmware/canopen/sdo_bench.hpp"

namespace kmax::firmware::canopen::sdo_server_transfers_test {
namespace {

constexpr ObjectAddress domain = InMemoryObjects::domain;
constexpr ObjectAddress device_type = InMemoryObjects::device_type;
using Bench = CleanSdoBench<>;
using Client = SdoTestClient<Bench>;
using LargeBench = CleanSdoBench<65536>;

/// Around the limits of expedited transfer (4), segments (7), the window of an upload (112), blocks of 31 and
/// 127 segments (217, 889) and the buffer (2048).
constexpr std::array<std::size_t, 28> sizes{0,   1,    4,    5,    6,    7,    8,    9,    13,  14,
                                            100, 111,  112,  113,  216,  217,  218,  434,  888, 889,
                                            890, 1777, 1778, 2000, 2047, 2048, 2049, 49152};

Abort download(Client& client, bool block, const Bytes& data, const Client::Download& how) {
  return block ? client.block_download(domain, data, how) : client.download(domain, data, how);
}

class SdoSizes : public testing::TestWithParam<std::size_t> {
 protected:
  Bytes data = pattern(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Transfers, SdoSizes, testing::ValuesIn(sizes), testing::PrintToStringParamName());

TEST_P(SdoSizes, Upload) {
  Bench bench;
  bench.objects.at(domain).value = data;
  Client client(bench);
  for (int i = 0; i < 2; ++i) {
    const Client::Outcome outcome = client.upload(domain);
    EXPECT_EQ(outcome.abort, Abort::none);
    EXPECT_EQ(outcome.data, bench.objects.at(domain).value);
    std::reverse(bench.objects.at(domain).value.begin(), bench.objects.at(domain).value.end());
  }
}

TEST_P(SdoSizes, BlockUploadInEveryBlockSize) {
  for (const std::uint8_t block_size : Bytes{1, 2, 7, 16, 17, 31, 126, 127}) {
    for (const bool crc : {true, false}) {
      Bench bench;
      bench.objects.at(domain).value = data;
      Client client(bench);
      const Client::Outcome outcome =
          client.block_upload(domain, {.crc = crc, .block_size = [&] { return block_size; }});
      EXPECT_EQ(outcome.abort, Abort::none);
      EXPECT_EQ(outcome.data, data);
    }
  }
}

TEST_P(SdoSizes, BlockUploadInChangingBlockSizes) {
  Bench bench;
  bench.objects.at(domain).value = data;
  Client client(bench);
  std::uint32_t state = 1;
  const auto changing = [&] {
    return static_cast<std::uint8_t>(1 + (state = state * 75 + 74) % 65537 % 127);
  };
  const Client::Outcome outcome = client.block_upload(domain, {.block_size = changing});
  EXPECT_EQ(outcome.abort, Abort::none);
  EXPECT_EQ(outcome.data, data);
}

TEST_P(SdoSizes, BlockUploadSwitchesUpToTheThreshold) {
  for (const std::uint8_t threshold : Bytes{0, 1, 4, 7, 99, 100, 255}) {
    Bench bench;
    bench.objects.at(domain).value = data;
    Client client(bench);
    const Client::Outcome outcome = client.block_upload(domain, {.switch_threshold = threshold});
    EXPECT_EQ(outcome.data, data);
    EXPECT_EQ(client.blocks == 0, threshold != 0 && data.size() <= threshold) << int{threshold};
  }
}

TEST_P(SdoSizes, DownloadWithAndWithoutASize) {
  for (const bool size_indicated : {true, false}) {
    for (const bool block : {false, true}) {
      for (const bool crc : {false, true}) {
        Bench bench;
        bench.objects.at(domain).value = {1, 2, 3};
        Client client(bench);
        const Client::Download how{.size_indicated = size_indicated, .crc = crc};
        const bool fits = data.size() <= 2048;
        EXPECT_EQ(download(client, block, data, how), fits ? Abort::none : Abort::memory);
        EXPECT_EQ(bench.objects.at(domain).value, fits ? data : (Bytes{1, 2, 3}));
        EXPECT_EQ(bench.objects.writes.size(), fits ? 1U : 0U);
        EXPECT_EQ(client.time_outs, 0);
      }
    }
  }
}

TEST_P(SdoSizes, DownloadInSegmentsEvenWhereExpeditedWouldDo) {
  Bench bench;
  Client client(bench);
  EXPECT_EQ(client.download_segmented(domain, data), data.size() <= 2048 ? Abort::none : Abort::memory);
}

TEST_P(SdoSizes, BlockDownloadInEveryBlockSizeOfTheServer) {
  for (const std::uint8_t block_size : Bytes{1, 2, 7, 31, 126, 127}) {
    LargeBench bench({.download_block_size = block_size});
    SdoTestClient<LargeBench> client(bench);
    EXPECT_EQ(client.block_download(domain, data), Abort::none);
    EXPECT_EQ(bench.objects.at(domain).value, data);
    const std::size_t segments = std::max<std::size_t>(1, (data.size() + 6) / 7);
    EXPECT_EQ(static_cast<std::size_t>(client.blocks), (segments + block_size - 1) / block_size);
  }
}

TEST_P(SdoSizes, IndicatedSizesThatDoNotMatchWriteNothing) {
  if (data.empty() || data.size() >= 2048) return;
  const auto size = static_cast<std::uint32_t>(data.size());
  for (const int difference : {-7, -1, 1, 6, 7, 8}) {
    const std::uint32_t indicated = size + static_cast<std::uint32_t>(difference);
    if (indicated > 2048) continue;
    for (const bool block : {false, true}) {
      Bench bench;
      Client client(bench);
      EXPECT_EQ(download(client, block, data, {.size = indicated}),
                difference < 0 ? Abort::too_long : Abort::too_short)
          << difference << block;
      EXPECT_TRUE(bench.objects.writes.empty());
    }
  }
}

TEST_P(SdoSizes, AWrongNInTheLastSegmentWritesNothing) {
  if (data.empty() || data.size() > 2000) return;
  const std::size_t true_unused = (7 - data.size() % 7) % 7;
  for (std::uint8_t unused = 0; unused <= 7; ++unused) {
    if (unused == true_unused) continue;
    const Abort expected = unused < true_unused ? Abort::too_long : Abort::too_short;
    for (const bool block : {false, true}) {
      Bench bench;
      Client client(bench);
      EXPECT_EQ(download(client, block, data, {.unused = unused}), expected);
      EXPECT_TRUE(bench.objects.writes.empty());
    }
    // Without a size the CRC finds it; zeros of the padding taken for data would be the worst case.
    Bench bench;
    Client client(bench);
    EXPECT_EQ(client.block_download(domain, data, {.size_indicated = false, .unused = unused}), Abort::crc);
    EXPECT_TRUE(bench.objects.writes.empty());
  }
}

TEST_P(SdoSizes, AWrongCrcWritesNothingUnlessItIsSwitchedOff) {
  if (data.size() > 2048) return;
  for (const std::uint16_t error : std::vector<std::uint16_t>{0x0001, 0x8000, 0x0100, 0xFFFF}) {
    Bench bench;
    Client client(bench);
    EXPECT_EQ(client.block_download(domain, data, {.crc_error = error}), Abort::crc);
    EXPECT_TRUE(bench.objects.writes.empty());
    EXPECT_EQ(client.block_download(domain, data, {.crc = false, .crc_error = error}), Abort::none);
    EXPECT_EQ(bench.objects.writes, (std::vector<InMemoryObjects::Written>{{domain, data}}));
  }
}

TEST(SdoTransfers, BlockSizesThatDoNotExistAreRefused) {
  Bench bench;
  bench.objects.at(domain).value = pattern(2000);
  Client client(bench);
  for (const std::uint8_t wrong : Bytes{0, 128, 255}) {
    EXPECT_EQ(client.block_upload(domain, {.block_size = [&] { return wrong; }}).abort, Abort::block_size);
    bool first = true;
    const auto later = [&] { return std::exchange(first, false) ? std::uint8_t{127} : wrong; };
    EXPECT_EQ(client.block_upload(domain, {.block_size = later}).abort, Abort::block_size);
    // After the last block none is to come: its size means nothing.
    bench.objects.at(domain).value = pattern(20);
    first = true;
    EXPECT_EQ(client.block_upload(domain, {.block_size = later}).data, pattern(20));
    bench.objects.at(domain).value = pattern(2000);
  }
}

TEST(SdoTransfers, MoreSegmentsAcknowledgedThanSentIsRefused) {
  Bench bench;
  bench.objects.at(domain).value = pattern(2000);
  for (const std::uint8_t too_many : Bytes{11, 127, 255}) {
    bench.ask(request(0xA4, domain, {10}));
    bench.send({0xA3});
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(bench.reply().has_value());
    EXPECT_EQ(bench.ask({0xA2, too_many, 10}), abort_frame(domain, Abort::sequence));
  }
}

TEST(SdoTransfers, TheSegmentsOfABlockLeaveWithoutWaiting) {
  SdoBench<> bench;
  bench.objects.at(domain).value = pattern(49152);
  bench.ask(request(0xA4, domain, {127}));
  bench.send({0xA3});
  for (int i = 1; i <= 127; ++i) EXPECT_EQ(bench.reply().value_or(Bench::no_answer)[0], i);
  EXPECT_FALSE(bench.reply().has_value());
  EXPECT_EQ(bench.objects.reads.size(), 8U) << "127 segments, 16 to a read";
}

TEST(SdoTransfers, AnObjectThatChangesHalfwayEndsTheUpload) {
  Bench bench;
  bench.objects.at(domain) = {.value = pattern(2000), .bounds = {0, 60000}, .readable_up_to = 1000};
  Client client(bench);
  EXPECT_EQ(client.upload(domain).abort, Abort::device_state);
  EXPECT_EQ(client.block_upload(domain).abort, Abort::device_state);
  bench.objects.at(domain).readable_up_to = 0;
  EXPECT_EQ(client.upload(domain).abort, Abort::device_state);
  bench.objects.at(domain).value = pattern(4);
  EXPECT_EQ(client.upload(domain).abort, Abort::device_state);
}

TEST(SdoTransfers, ARefusedValueAndATooLongOneWithoutASizeWriteNothing) {
  Bench bench;
  Client client(bench);
  for (const bool size_indicated : {true, false}) {
    const Client::Download how{.size_indicated = size_indicated};
    EXPECT_EQ(client.block_download({0x2012, 0}, Bytes(4), how), Abort::value_too_high);
    EXPECT_EQ(client.download_segmented({0x2012, 0}, Bytes(4), how), Abort::value_too_high);
    for (const std::size_t size : std::vector<std::size_t>{3, 5, 7, 8, 300}) {
      const Abort expected = size < 4 ? Abort::too_short : Abort::too_long;
      EXPECT_EQ(client.block_download({0x2012, 0}, Bytes(size), how), expected) << size;
      EXPECT_EQ(client.download_segmented({0x2012, 0}, Bytes(size), how), expected) << size;
    }
  }
  EXPECT_EQ(client.time_outs, 0);
}

TEST(SdoTransfers, ANewInitiateReplacesEveryTransferAtEveryPoint) {
  const Eight read = request(0x40, device_type);
  const Eight answer{0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00};
  for (const Eight& initiate :
       {request(0x20, domain), request(0x40, domain), request(0xC4, domain), request(0xA4, domain, {20})}) {
    for (std::uint8_t steps = 0; steps < 31; ++steps) {
      Bench bench;
      bench.objects.at(domain).value = pattern(2000);
      bench.ask(initiate);
      if (initiate[0] == 0xA4) bench.send({0xA3});
      for (std::uint8_t i = 0; i < steps; ++i) {
        const auto toggle = static_cast<std::uint8_t>(i % 2 << 4);
        if (initiate[0] == 0x20) bench.ask({toggle, 1, 2, 3, 4, 5, 6, 7});
        if (initiate[0] == 0x40) bench.ask({static_cast<std::uint8_t>(0x60 | toggle)});
        if (initiate[0] == 0xC4) bench.send({static_cast<std::uint8_t>(i + 1)});
        if (initiate[0] == 0xA4) bench.reply();
      }
      EXPECT_EQ(bench.ask(read), answer) << int{initiate[0]} << ' ' << int{steps};
      EXPECT_EQ(bench.objects.at(domain).value, pattern(2000));
    }
  }
}

using Block = std::vector<Eight>;
using At = Block::difference_type;

void lose(Block& block, std::size_t at) {
  block.erase(block.begin() + static_cast<At>(at));
}
void repeat(Block& block, std::size_t at) {
  block.insert(block.begin() + static_cast<At>(at), block[at]);
}
void swap_with_next(Block& block, std::size_t at) {
  if (at + 1 < block.size()) std::swap(block[at], block[at + 1]);
}
void lose_from(Block& block, std::size_t at) {
  block.resize(at);
}

using Damage = void (*)(Block&, std::size_t);
constexpr std::array<Damage, 4> damages{lose, repeat, swap_with_next, lose_from};

/// Does `damage` once, to the segment with this number counted over the whole transfer.
Client::Fault once(Damage damage, std::size_t at) {
  return [=, passed = std::size_t{0}, done = false](Block& block) mutable {
    const std::size_t length = block.size();
    if (!done && at < passed + length) {
      damage(block, at - passed);
      done = true;
    }
    passed += length;
  };
}

// 75 segments: blocks of 31, 31 and 13.
const Bytes data = pattern(75 * 7 - 3);

TEST(SdoFaults, ADownloadSurvivesOneFaultAtEverySegment) {
  for (const Damage damage : damages) {
    for (std::size_t at = 0; at < 75; ++at) {
      Bench bench;
      Client client(bench);
      const Abort abort = client.block_download(domain, data, {.fault = once(damage, at)});
      // When nothing of a block arrives the server has no reason to believe that it was sent.
      const bool whole_block_lost = damage == lose_from && at % 31 == 0;
      EXPECT_EQ(abort, whole_block_lost ? Abort::timeout : Abort::none) << at;
      EXPECT_EQ(bench.objects.writes.size(), whole_block_lost ? 0U : 1U);
      if (!whole_block_lost) {
        EXPECT_EQ(bench.objects.at(domain).value, data) << at;
      }
    }
  }
}

// A frame lost in the middle costs one more block, no time-out.
TEST(SdoFaults, ALostSegmentIsResumedBehindTheLastGoodOne) {
  Bench bench;
  EXPECT_EQ(bench.ask(request(0xC6, domain, {35})), request(0xA4, domain, {31}));
  bench.send({1, 1, 1, 1, 1, 1, 1, 1});
  bench.send({2, 2, 2, 2, 2, 2, 2, 2});
  bench.send({4, 4, 4, 4, 4, 4, 4, 4});
  EXPECT_FALSE(bench.reply().has_value());
  EXPECT_EQ(bench.ask({0x85, 5, 5, 5, 5, 5, 5, 5}), (Eight{0xA2, 2, 31}));
  bench.send({1, 3, 3, 3, 3, 3, 3, 3});
  bench.send({2, 4, 4, 4, 4, 4, 4, 4});
  EXPECT_EQ(bench.ask({0x83, 5, 5, 5, 5, 5, 5, 5}), (Eight{0xA2, 3, 31}));
  Bytes expected;
  for (std::uint8_t i = 1; i <= 5; ++i) expected.insert(expected.end(), 7, i);
  const std::uint16_t crc = Client::bitwise_crc(expected);
  EXPECT_EQ(bench.ask({0xC1, static_cast<std::uint8_t>(crc & 0xFF), static_cast<std::uint8_t>(crc >> 8)}),
            (Eight{0xA1}));
  EXPECT_EQ(bench.objects.at(domain).value, expected);
  EXPECT_EQ(bench.server.counters().segments_lost, 2U);
}

TEST(SdoFaults, TheLastSegmentOnceMoreIsNoAbort) {
  Bench bench;
  bench.ask(request(0xC2, domain, {7}));
  const Eight segment{0x81, 1, 2, 3, 4, 5, 6, 7};
  EXPECT_EQ(bench.ask(segment), (Eight{0xA2, 1, 31}));
  EXPECT_EQ(bench.ask(segment), bench.no_answer);
  EXPECT_EQ(bench.ask({0xC1}), (Eight{0xA1}));
  EXPECT_EQ(bench.server.counters().segments_repeated, 1U);
}

// The acknowledgement that the server makes of its own accord is no sign of life of the client.
TEST(SdoFaults, AClientThatVanishesWithinABlockIsGivenUpAfterTheSameTime) {
  Bench bench;
  bench.ask(request(0xC4, domain));
  bench.send({1});
  bench.wait(249'500);
  EXPECT_FALSE(bench.reply().has_value());
  bench.wait(500);
  EXPECT_EQ(bench.reply(), (Eight{0xA2, 1, 31}));
  bench.wait(749'000);
  EXPECT_FALSE(bench.reply().has_value()) << "acknowledged once";
  bench.wait(1'000);
  EXPECT_EQ(bench.reply(), abort_frame(domain, Abort::timeout));
}

TEST(SdoFaults, WithoutCrcALostEndOfABlockIsNotGuessed) {
  Bench bench;
  Client client(bench);
  EXPECT_EQ(client.block_download(domain, data, {.crc = false, .fault = once(lose, 30)}), Abort::timeout);
  EXPECT_TRUE(bench.objects.writes.empty());
}

// The server acknowledges in the pause; the client, which did not look, goes on and then takes each of the
// two acknowledgements for that of the block it sent last. CRC and size must find out.
TEST(SdoFaults, AClientThatPausesWithinABlockNeverWritesAnythingElse) {
  for (std::uint8_t before = 1; before < 31; ++before) {
    Bench bench;
    bench.ask(request(0xC4, domain));  // no size: only the CRC is left
    std::vector<Eight> answers;
    std::size_t read = 0;
    const auto collect = [&] {
      while (const auto answer = bench.reply()) answers.push_back(*answer);
    };
    const auto answer = [&] {
      if (read == answers.size()) bench.wait(600'000);
      collect();
      return read < answers.size() ? answers[read++] : abort_frame({}, Abort::timeout);
    };
    Abort result = Abort::none;
    for (std::size_t next = 0, blocks = 0; next < 75 && result == Abort::none; ++blocks) {
      for (std::uint8_t number = 1; number <= 31 && next + number <= 75; ++number) {
        Eight segment{static_cast<std::uint8_t>(number | (next + number == 75 ? 0x80 : 0))};
        const std::size_t offset = 7 * (next + number - 1);
        for (std::size_t i = 0; i < 7 && offset + i < data.size(); ++i) segment[i + 1] = data[offset + i];
        bench.send(segment);
        if (blocks == 1 && number == before) bench.wait(300'000);
        collect();
      }
      const Eight acknowledged = answer();
      if (acknowledged[0] == 0x80) result = Abort::general;
      next += acknowledged[0] == 0xA2 ? acknowledged[1] : 0;
    }
    const std::uint16_t crc = Client::bitwise_crc(data);
    bench.send({0xCD, static_cast<std::uint8_t>(crc & 0xFF), static_cast<std::uint8_t>(crc >> 8)});
    bench.wait(1'100'000);
    for (const auto& written : bench.objects.writes) EXPECT_EQ(written.value, data) << int{before};
    while (bench.reply()) {
    }
  }
}

TEST(SdoFaults, AnUploadSurvivesOneFaultAtEverySegment) {
  for (const Damage damage : damages) {
    for (const std::uint8_t block_size : Bytes{1, 20, 127}) {
      for (std::size_t at = 0; at < 75; ++at) {
        Bench bench;
        bench.objects.at(domain).value = data;
        Client client(bench);
        const Client::Outcome outcome = client.block_upload(
            domain, {.block_size = [&] { return block_size; }, .fault = once(damage, at)});
        EXPECT_EQ(outcome.abort, Abort::none) << at;
        EXPECT_EQ(outcome.data, data) << at;
      }
    }
  }
}

TEST(SdoFaults, ResumingFarBackReadsTheObjectAgain) {
  Bench bench;
  bench.objects.at(domain).value = pattern(2000);
  Client client(bench);
  const Client::Outcome outcome = client.block_upload(domain, {.fault = once(lose, 1)});
  EXPECT_EQ(outcome.data, pattern(2000));
  const auto& reads = bench.objects.reads;
  EXPECT_EQ(reads[7].first, 7U * 112U);
  EXPECT_EQ(reads[8].first, 7U) << "behind the first segment";
}

TEST(SdoFaults, AnAcknowledgementBeforeTheBlockIsCompleteBeginsTheNextOne) {
  SdoBench<> bench;
  bench.objects.at(domain).value = pattern(200);
  bench.ask(request(0xA0, domain, {20}));
  bench.send({0xA3});
  for (int i = 0; i < 5; ++i) bench.reply();
  const Eight next = bench.ask({0xA2, 3, 2});
  EXPECT_EQ(next[0], 1);
  EXPECT_TRUE(std::equal(next.begin() + 1, next.end(), pattern(200).begin() + 21));
  bench.complaints.clear();  // `ask` expects one answer; a block is several
  EXPECT_FALSE(bench.reply().has_value()) << "a block of two";
}

/// Neighbours are not damaged twice: a segment that is repeated and then delayed beyond the end of its block
/// is more than CAN does, and more than the protocol can see without a CRC.
Client::Fault random_faults(std::mt19937& random, bool reordered) {
  const unsigned chance = *rc::gen::element(10U, 50U, 300U, 2000U);  // one segment in so many
  return [&random, chance, reordered](Block& block) {
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (random() % chance != 0) continue;
      damages[random() % (reordered ? 3 : 2)](block, i);
      i += 2;
    }
  };
}

RC_GTEST_PROP(SdoFaults, WhatIsWrittenIsWhatWasSentWhateverGetsLost, ()) {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  // CAN does not reorder; where something else does, only the CRC can find a segment of the block before.
  const bool crc = *rc::gen::arbitrary<bool>();
  Bench bench({.download_block_size = *rc::gen::element<std::uint8_t>(2, 5, 31, 127)});
  Client client(bench);
  const Bytes value = pattern(*rc::gen::inRange<std::size_t>(0, 2049));
  const Abort abort = client.block_download(
      domain, value,
      {.size_indicated = *rc::gen::arbitrary<bool>(), .crc = crc, .fault = random_faults(random, crc)});
  RC_ASSERT(bench.complaints.empty());
  RC_ASSERT(bench.objects.writes.size() == (abort == Abort::none ? 1U : 0U));
  for (const auto& written : bench.objects.writes) RC_ASSERT(written.value == value);
  RC_ASSERT(bench.objects.broken_promises == 0);
  RC_ASSERT(!bench.server.busy());
}

RC_GTEST_PROP(SdoFaults, WhatIsReadIsWhatIsThereWhateverGetsLost, ()) {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  Bench bench;
  Client client(bench);
  const Bytes value = pattern(*rc::gen::inRange<std::size_t>(0, 3000));
  bench.objects.at(domain).value = value;
  const Client::Outcome outcome = client.block_upload(
      domain, {.crc = *rc::gen::arbitrary<bool>(),
               .block_size = [&] { return static_cast<std::uint8_t>(1 + random() % 127); },
               .fault = random_faults(random, true)});
  RC_ASSERT(bench.complaints.empty());
  RC_ASSERT(outcome.abort == Abort::none);
  RC_ASSERT(outcome.data == value);
  RC_ASSERT(!bench.server.busy());
}

// Any sequence of frames: nothing crashes (run under the sanitizers), the objects are asked only for what is
// within their contract, an abort is never answered, and the server goes on to serve.

rc::Gen<std::uint8_t> any_byte() {
  return rc::gen::arbitrary<std::uint8_t>();
}

/// A request that gets somewhere: a known command, an object that is mostly there, sizes around the limits.
Eight plausible_frame(bool with_domain) {
  const auto command = *rc::gen::element<std::uint8_t>(
      0x00, 0x10, 0x01, 0x11, 0x0D, 0x20, 0x21, 0x22, 0x23, 0x2B, 0x2F, 0x40, 0x60, 0x70, 0x80, 0xA0, 0xA1,
      0xA2, 0xA3, 0xA4, 0xC0, 0xC1, 0xC2, 0xC4, 0xC6, 0xD5, 0x02, 0x03, 0x1F, 0x81, 0x82, 0x9F);
  if ((command & 0xFC) == 0xA0) return {command, *any_byte(), *any_byte(), *any_byte(), *any_byte()};
  const std::vector<ObjectAddress> others{device_type, {0x2000, 1}, {0x2000, 4}, {0x2000, 8},
                                          {0x2011, 0}, {0x2013, 0}, {0x1234, 5}, {0x2000, 99}};
  const bool at_domain = with_domain && *rc::gen::arbitrary<bool>();
  const ObjectAddress address = at_domain ? domain : *rc::gen::elementOf(others);
  const auto low = *rc::gen::element<std::uint8_t>(0, 1, 4, 7, 8, 31, 127, 128, 255);
  return request(command, address, {low, *rc::gen::element<std::uint8_t>(0, 0, 0, 1, 8, 255), 0, 0});
}

Eight garbage_frame(bool with_domain) {
  if (*rc::gen::inRange(0, 3) != 0) return plausible_frame(with_domain);
  Eight bytes{};
  for (std::uint8_t& byte : bytes) byte = *any_byte();
  if (!with_domain && bytes[1] == 0x10 && bytes[2] == 0x20) bytes[2] = 0x30;
  return bytes;
}

void let_time_pass(SdoBench<>& bench) {
  bench.wait(*rc::gen::element<std::uint32_t>(0, 0, 0, 0, 0, 0, 0, 300'000, 1'000'000));
}

RC_GTEST_PROP(SdoGarbage, TheServerSurvivesAndServes, ()) {
  SdoBench<> bench;
  bench.objects.at(domain).value = pattern(*rc::gen::element<std::size_t>(0, 5, 9, 300, 2000));
  const int count = *rc::gen::inRange(1, 150);
  for (int i = 0; i < count; ++i) {
    const Eight frame = garbage_frame(true);
    if (*rc::gen::inRange(0, 10) == 0) {
      drivers::CanFrame other{.identifier = 0x605, .data = frame};
      other.extended = *rc::gen::arbitrary<bool>();
      other.remote = *rc::gen::arbitrary<bool>();
      other.length = *rc::gen::inRange<std::uint8_t>(0, 8);
      bench.server.receive(other, bench.now_us);
    } else {
      bench.send(frame);
      if (frame[0] == 0x80) RC_ASSERT(!bench.reply().has_value());
    }
    for (int pulls = *rc::gen::element(0, 1, 1, 5, 200); pulls > 0; --pulls) {
      const std::optional<Eight> answer = bench.reply();
      if (!answer) break;
      if ((*answer)[0] == 0x80) RC_ASSERT(!bench.server.busy());
    }
    let_time_pass(bench);
  }
  RC_ASSERT(bench.objects.broken_promises == 0);
  RC_ASSERT(bench.complaints.empty());
  const Eight expected{0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00};
  const Eight answer = bench.ask(request(0x40, device_type));
  RC_ASSERT(answer == expected);
  RC_ASSERT(!bench.server.busy());
}

// Garbage in the middle of a block download, which then goes on as if nothing had been: the object is as it
// was or as it was to become. What garbage may do to other objects is its own business.
RC_GTEST_PROP(SdoGarbage, ABlockDownloadIsWrittenWholeOrNotAtAll, ()) {
  SdoBench<> bench;
  const Bytes before = pattern(11);
  bench.objects.at(domain).value = before;
  const Bytes value = pattern(*rc::gen::inRange<std::size_t>(1, 600));
  const auto inject = [&](Block& block) {
    if (*rc::gen::inRange(0, 3) != 0) return;
    const auto at = *rc::gen::inRange<std::size_t>(0, block.size() + 1);
    block.insert(block.begin() + static_cast<long>(at), garbage_frame(false));
  };
  SdoTestClient<SdoBench<>> client(bench);
  const Abort abort = client.block_download(domain, value, {.fault = inject});
  const Bytes& after = bench.objects.at(domain).value;
  RC_ASSERT(after == (abort == Abort::none ? value : before) || after == value);
  RC_ASSERT(after == before || after == value);
  RC_ASSERT(bench.objects.broken_promises == 0);
}

// Likewise a segmented one. A segment with the toggle bit that is due is no garbage and is left out.
RC_GTEST_PROP(SdoGarbage, ASegmentedDownloadIsWrittenWholeOrNotAtAll, ()) {
  SdoBench<> bench;
  const Bytes before = pattern(11);
  bench.objects.at(domain).value = before;
  const Bytes value = pattern(*rc::gen::inRange<std::size_t>(1, 200));
  const std::size_t segments = (value.size() + 6) / 7;
  const auto disturbed = *rc::gen::inRange<std::size_t>(0, 2 * segments);  // half of the runs: never
  bench.ask(request(0x20, domain));
  for (std::size_t i = 0; i < segments; ++i) {
    if (i == disturbed) {
      Eight frame = garbage_frame(false);
      if (frame[0] < 0x20) frame[0] = static_cast<std::uint8_t>((frame[0] & 0xEF) | (i % 2 == 0 ? 0x10 : 0));
      bench.ask(frame);
    }
    const std::size_t length = std::min<std::size_t>(7, value.size() - 7 * i);
    Eight segment{static_cast<std::uint8_t>(i % 2 << 4 | (7 - length) << 1 | (i + 1 == segments ? 1 : 0))};
    for (std::size_t k = 0; k < length; ++k) segment[k + 1] = value[7 * i + k];
    bench.send(segment);
    bench.reply();
  }
  const bool disturbed_within = disturbed < segments;
  RC_CLASSIFY(disturbed_within);
  RC_ASSERT(bench.objects.at(domain).value == (disturbed_within ? before : value));
  RC_ASSERT(bench.objects.broken_promises == 0);
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_server_transfers_test
