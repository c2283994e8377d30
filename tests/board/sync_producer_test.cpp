// The device's own SYNC, and what it sets off; the length of the SYNCs that it hears.
#include <gtest/gtest.h>

#include <vector>

#include "tests/board/canopen_host.hpp"

namespace kmax::board::sync_producer_test {
namespace {

constexpr std::uint32_t device_state = 0x0800'0022, generates = 1U << 30;

class OwnSync : public testing::Test, public CanOpenHost {
 protected:
  OwnSync() {
    bench.set_up_plain_wall();
    bench.set("wall.law", 0);
    bench.preset("link.timeout", 0);
  }
  void make(std::uint32_t period_us, std::uint32_t overflow = 0) {
    EXPECT_EQ(write(0x1019, 0, overflow, 1), 0U);
    EXPECT_EQ(write(0x1006, 0, period_us, 4), 0U);
    EXPECT_EQ(write(0x1005, 0, generates | 0x80, 4), 0U);
  }
  std::vector<drivers::CanFrame> frames(std::uint32_t identifier, double ms) {
    heard.clear();
    run_ms(ms);
    std::vector<drivers::CanFrame> found;
    for (const drivers::CanFrame& frame : heard) {
      if (frame.identifier == identifier) found.push_back(frame);
    }
    return found;
  }
  std::size_t syncs(double ms) { return frames(0x80, ms).size(); }
};

TEST_F(OwnSync, GoesInPreOperationalAndOperationalOnly) {
  make(5'000);
  EXPECT_EQ(syncs(100), 20U);
  nmt(1);
  EXPECT_EQ(syncs(100), 20U);
  nmt(2);
  EXPECT_EQ(syncs(100), 0U);
  nmt(0x80);
  EXPECT_EQ(syncs(100), 20U);
  EXPECT_EQ(write(0x1005, 0, 0x80, 4), 0U);
  EXPECT_EQ(syncs(100), 0U);
  EXPECT_EQ(write(0x1005, 0, generates | 0x90, 4), 0U);
  EXPECT_EQ(frames(0x90, 100).size(), 20U);
  EXPECT_EQ(write(0x1006, 0, 0, 4), 0U);
  EXPECT_EQ(frames(0x90, 100).size(), 0U);
}

TEST_F(OwnSync, HasACounterThatBeginsWith1AfterNmtStop) {
  make(10'000, 4);
  std::vector<int> counters;
  for (const drivers::CanFrame& sync : frames(0x80, 60)) {
    EXPECT_EQ(sync.length, 1);
    counters.push_back(sync.data[0]);
  }
  EXPECT_EQ(counters, (std::vector<int>{1, 2, 3, 4, 1, 2}));
  nmt(1);
  nmt(2);
  nmt(1);
  const auto after = frames(0x80, 10);
  ASSERT_EQ(after.size(), 1U);
  EXPECT_EQ(after[0].data[0], 1);
}

// As one that is heard does: what came before it is taken over, and the PDOs of every second one follow it.
TEST_F(OwnSync, SetsOffSynchronousPdosOfBothKinds) {
  EXPECT_EQ(write(0x1400, 2, 1, 1), 0U);
  EXPECT_EQ(write(0x1800, 2, 2, 1), 0U);
  EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
  make(20'000);
  nmt(1);
  const auto pdos = frames(0x181, 200);
  EXPECT_EQ(pdos.size(), 5U);
  const auto sync =
      std::find_if(heard.begin(), heard.end(), [](const auto& f) { return f.identifier == 0x80; });
  const auto pdo =
      std::find_if(heard.begin(), heard.end(), [](const auto& f) { return f.identifier == 0x181; });
  EXPECT_LT(sync, pdo) << "the SYNC first";
  for (const std::uint16_t word : {std::uint16_t{6}, std::uint16_t{15}}) rpdo(word, 0, 22);
  ASSERT_TRUE(armed());
  run_ms(300);
  while (syncs(1) == 0) {
  }
  rpdo(15, 300, 5);
  EXPECT_EQ(bench.force(), 0.0) << "it waits";
  run_ms(20);
  EXPECT_GT(bench.force(), 0.01);
  nmt(0x80);
  EXPECT_EQ(frames(0x181, 100).size(), 0U);
}

// Else it would wait for whichever of them is on the bus.
TEST_F(OwnSync, GoesInARoundWithPdosOfTheSamePeriodAndBeforeThem) {
  EXPECT_EQ(write(0x1800, 5, 1, 2), 0U);
  make(1'000);
  for (int start = 0; start < 11; ++start) {
    nmt(0x80);
    run_ms(0.2 * start);
    nmt(1);
    run_ms(10);
    int together = 0;
    for (int round = 0; round < 100; ++round) {
      heard.clear();
      run_ms(0.2);
      const auto at = [this](std::uint32_t identifier) {
        return std::find_if(heard.begin(), heard.end(),
                            [&](const drivers::CanFrame& frame) { return frame.identifier == identifier; });
      };
      if (at(0x80) == heard.end() && at(0x181) == heard.end()) continue;
      ASSERT_LT(at(0x80), at(0x181)) << start << ", in round " << round;
      ASSERT_NE(at(0x181), heard.end()) << start << ", in round " << round;
      ++together;
    }
    EXPECT_EQ(together, 20) << start;
  }
}

TEST_F(OwnSync, ChangesOnlyWhileNoAxisIsArmed) {
  make(5'000);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(write(0x1005, 0, 0x80, 4), device_state);
  EXPECT_EQ(write(0x1006, 0, 10'000, 4), device_state);
  EXPECT_EQ(write(0x1006, 0, 0, 4), device_state);
  EXPECT_EQ(write(0x1019, 0, 10, 1), device_state);
  EXPECT_EQ(syncs(100), 20U);
  bench.disarm();
  EXPECT_EQ(write(0x1019, 0, 10, 1), device_state) << "there is a period";
  EXPECT_EQ(write(0x1006, 0, 0, 4), 0U);
  EXPECT_EQ(write(0x1019, 0, 10, 1), 0U);
}

TEST_F(OwnSync, IsPutBackByAResetOfTheCommunication) {
  make(5'000);
  nmt(0x82);
  EXPECT_EQ(syncs(100), 0U);
  EXPECT_EQ(read(0x1005, 0), 0x80U);
  EXPECT_EQ(read(0x1006, 0), 0U);
}

TEST_F(OwnSync, OneOfTheWrongLengthIsToldOfAndObeyedAllTheSame) {
  EXPECT_EQ(write(0x1800, 2, 1, 1), 0U);
  nmt(1);
  const auto answered = [this](std::uint8_t length) {
    heard.clear();
    send({.identifier = 0x80, .length = length, .data = {1}});
    return std::any_of(heard.begin(), heard.end(),
                       [](const auto& frame) { return frame.identifier == 0x181; });
  };
  EXPECT_TRUE(answered(0));
  EXPECT_EQ(read(0x1001, 0), 0U);
  EXPECT_TRUE(answered(1));
  EXPECT_EQ(read(0x1001, 0), 0x11U);
  EXPECT_EQ(read(0x1003, 1), 127U << 16 | 0x8240U);
  EXPECT_TRUE(answered(0));
  EXPECT_EQ(read(0x1001, 0), 0U);
  EXPECT_FALSE(answered(2)) << "no SYNC at all";
  EXPECT_EQ(read(0x1001, 0), 0x11U);
  EXPECT_EQ(write(0x1019, 0, 240, 1), 0U);
  EXPECT_TRUE(answered(1));
  EXPECT_EQ(read(0x1001, 0), 0U);
  EXPECT_TRUE(answered(0));
  EXPECT_EQ(read(0x1001, 0), 0x11U);
}

}  // namespace
}  // namespace kmax::board::sync_producer_test
