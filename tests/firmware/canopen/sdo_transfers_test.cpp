// Whole transfers of every size between a client that keeps to the standard (sdo_test_client.hpp) and the
// server, and what goes wrong on the way.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "firmware/canopen/sdo_server.hpp"
#include "tests/firmware/canopen/sdo_bench.hpp"
#include "tests/firmware/canopen/sdo_test_client.hpp"

namespace kmax::firmware::canopen::sdo_transfers_test {
namespace {

constexpr ObjectAddress domain = InMemoryObjects::domain;
constexpr ObjectAddress device_type = InMemoryObjects::device_type;
using Bench = SdoBench<>;
using Client = SdoTestClient<Bench>;
using LargeBench = SdoBench<65536>;

/// Around the limits of expedited transfer (4), segments (7), the window of an upload (112), blocks of 31 and
/// 127 segments (217, 889) and the buffer (2048).
constexpr std::array<std::size_t, 28> sizes{0,   1,    4,    5,    6,    7,    8,    9,    13,  14,
                                            100, 111,  112,  113,  216,  217,  218,  434,  888, 889,
                                            890, 1777, 1778, 2000, 2047, 2048, 2049, 49152};

template <typename AnyBench>
void expect_clean(const AnyBench& bench) {
  EXPECT_EQ(bench.complaints, std::vector<std::string>{});
  EXPECT_EQ(bench.objects.broken_promises, 0);
  EXPECT_FALSE(bench.server.busy());
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
    EXPECT_EQ(outcome.data, data);
  }
  EXPECT_EQ(bench.server.counters().uploads, 2U);
  expect_clean(bench);
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
      EXPECT_EQ(bench.server.counters().uploads, 1U);
      EXPECT_EQ(bench.server.counters().blocks_resumed, 0U);
      expect_clean(bench);
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
  expect_clean(bench);
}

TEST_P(SdoSizes, BlockUploadSwitchesUpToTheThreshold) {
  for (const std::uint8_t threshold : Bytes{0, 1, 4, 7, 99, 100, 255}) {
    Bench bench;
    bench.objects.at(domain).value = data;
    Client client(bench);
    const Client::Outcome outcome = client.block_upload(domain, {.switch_threshold = threshold});
    EXPECT_EQ(outcome.data, data);
    EXPECT_EQ(client.blocks == 0, threshold != 0 && data.size() <= threshold) << int{threshold};
    expect_clean(bench);
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
        const Abort abort =
            block ? client.block_download(domain, data, how) : client.download(domain, data, how);
        const bool fits = data.size() <= 2048;
        EXPECT_EQ(abort, fits ? Abort::none : Abort::memory);
        EXPECT_EQ(bench.objects.at(domain).value, fits ? data : (Bytes{1, 2, 3}));
        EXPECT_EQ(bench.objects.writes.size(), fits ? 1U : 0U);
        EXPECT_EQ(bench.server.counters().downloads, fits ? 1U : 0U);
        EXPECT_EQ(client.time_outs, 0);
        expect_clean(bench);
      }
    }
  }
}

TEST_P(SdoSizes, DownloadInSegmentsEvenWhereExpeditedWouldDo) {
  Bench bench;
  Client client(bench);
  EXPECT_EQ(client.download_segmented(domain, data), data.size() <= 2048 ? Abort::none : Abort::memory);
  expect_clean(bench);
}

TEST_P(SdoSizes, BlockDownloadInEveryBlockSizeOfTheServer) {
  for (const std::uint8_t block_size : Bytes{1, 2, 7, 31, 126, 127}) {
    LargeBench bench({.download_block_size = block_size});
    SdoTestClient<LargeBench> client(bench);
    EXPECT_EQ(client.block_download(domain, data), Abort::none);
    EXPECT_EQ(bench.objects.at(domain).value, data);
    const std::size_t segments = std::max<std::size_t>(1, (data.size() + 6) / 7);
    EXPECT_EQ(static_cast<std::size_t>(client.blocks), (segments + block_size - 1) / block_size);
    expect_clean(bench);
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
      const Client::Download how{.size = indicated};
      const Abort abort =
          block ? client.block_download(domain, data, how) : client.download(domain, data, how);
      EXPECT_EQ(abort, difference < 0 ? Abort::too_long : Abort::too_short) << difference << block;
      EXPECT_TRUE(bench.objects.writes.empty());
      expect_clean(bench);
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
      const Client::Download how{.unused = unused};
      EXPECT_EQ(block ? client.block_download(domain, data, how) : client.download(domain, data, how),
                expected);
      EXPECT_TRUE(bench.objects.writes.empty());
      expect_clean(bench);
    }
    // Without a size the CRC finds it; zeros of the padding taken for data would be the worst case.
    Bench bench;
    Client client(bench);
    EXPECT_EQ(client.block_download(domain, data, {.size_indicated = false, .unused = unused}), Abort::crc);
    EXPECT_TRUE(bench.objects.writes.empty());
    expect_clean(bench);
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
    EXPECT_EQ(bench.objects.writes.size(), 1U);
    expect_clean(bench);
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
  expect_clean(bench);
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
  expect_clean(bench);
}

TEST(SdoTransfers, TheSegmentsOfABlockLeaveWithoutWaiting) {
  Bench bench;
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
  EXPECT_EQ(bench.server.counters().uploads, 0U);
  expect_clean(bench);
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
  expect_clean(bench);
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
      EXPECT_EQ(bench.server.counters().replaced, 1U);
      EXPECT_EQ(bench.objects.at(domain).value, pattern(2000));
      expect_clean(bench);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_transfers_test
