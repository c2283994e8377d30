#include "host_tools/record/can_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <thread>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::record::can_source_test {

using drivers::CanFrame;
using std::chrono::microseconds;

/// A bus on which frames wait, and which keeps what is sent.
class FakePort final : public device::CanPort {
 public:
  void send(const CanFrame& frame) override { sent.push_back(frame); }
  std::optional<device::Received> receive(microseconds wait) override {
    if (waiting.empty()) {
      std::this_thread::sleep_for(std::min(wait, microseconds(1000)));
      return std::nullopt;
    }
    const device::Received next = waiting.front();
    waiting.pop_front();
    return next;
  }
  int descriptor() const override { return -1; }
  std::string description() const override { return "fake0"; }
  std::string trouble() const override { return troubles; }

  void arrive(std::uint32_t identifier, std::uint8_t length, std::array<std::uint8_t, 8> data = {}) {
    waiting.push_back({{.identifier = identifier, .length = length, .data = data}, {}});
  }
  void arrive_row(std::uint16_t tick) {
    for (const std::uint32_t identifier : {0x185U, 0x285U, 0x385U}) arrive(identifier, 8);
    arrive(0x485, 8,
           {0, 0, 0, 0, 0, 0, static_cast<std::uint8_t>(tick & 0xFF), static_cast<std::uint8_t>(tick >> 8)});
  }

  std::deque<device::Received> waiting;
  std::vector<CanFrame> sent;
  std::string troubles;
};

PdoPlan plan_in(std::uint8_t node_state) {
  return {.node = 5,
          .identifiers = {0x185, 0x285, 0x385, 0x485},
          .period_ticks = 20,
          .count_lengths = {1e-5, 1e-5},
          .node_state = node_state,
          .tick = 1000};
}

CanFrame nmt(std::uint8_t command) {
  return {.identifier = 0, .length = 2, .data = {command, 5}};
}

TEST(CanSource, StartsANodeAndPutsItBackOnce) {
  FakePort port;
  {
    CanSource source(port, plan_in(127));
    EXPECT_EQ(port.sent, std::vector<CanFrame>{nmt(1)});
    source.stop();
    EXPECT_EQ(port.sent, (std::vector<CanFrame>{nmt(1), nmt(128)}));
  }
  EXPECT_EQ(port.sent.size(), 2u);
}

TEST(CanSource, TheDestructorPutsItBackToo) {
  FakePort port;
  { CanSource source(port, plan_in(127)); }
  EXPECT_EQ(port.sent, (std::vector<CanFrame>{nmt(1), nmt(128)}));
}

TEST(CanSource, ANodeThatIsOperationalIsLeftAlone) {
  FakePort port;
  {
    CanSource source(port, plan_in(5));
    port.arrive_row(1000);
    port.arrive_row(1020);
    port.arrive_row(1040);
    const auto first = source.next(microseconds(1000)), second = source.next(microseconds(1000));
    ASSERT_TRUE(first && second);
    EXPECT_EQ(first->tick, 1020u);
    EXPECT_EQ(second->tick, 1040u);
    EXPECT_FALSE(source.next(microseconds(1000)));
    EXPECT_EQ(source.losses()->rows, 0u);
  }
  EXPECT_TRUE(port.sent.empty());
}

TEST(CanSource, ARestartEndsTheRecordingAndIsNotPutBack) {
  FakePort port;
  {
    CanSource source(port, plan_in(127));
    port.arrive(0x705, 1, {5});  // a heartbeat
    EXPECT_FALSE(source.next(microseconds(1000)));
    port.arrive(0x705, 1, {0});
    EXPECT_CONTAINS(
        host_tools_test::thrown_message<base::DeviceError>([&] { source.next(microseconds(1000)); }),
        "node 5 has restarted");
  }
  EXPECT_EQ(port.sent, std::vector<CanFrame>{nmt(1)});
}

TEST(CanSource, SilenceEndsTheRecordingAndSaysWhatTheBusSays) {
  FakePort port;
  port.troubles = "nobody acknowledges";
  CanSource source(port, plan_in(127));
  port.arrive(0x185, 3);
  const std::string message = host_tools_test::thrown_message<device::LinkError>([&] {
    while (true) source.next(microseconds(50'000));
  });
  EXPECT_CONTAINS(message, "fake0: no complete set of PDOs from node 5 for 1 s");
  EXPECT_CONTAINS(message, "1 PDOs had the wrong length");
  EXPECT_CONTAINS(message, "nobody acknowledges");
}

// Another recording that asked for the PDOs has ended, and put their event times back.
TEST(CanSource, RowsThatCeaseAreAskedForAgainOnceUntilOneComes) {
  FakePort port;
  int asked = 0;
  CanSource source(port, plan_in(5), [&] { ++asked; });
  std::uint16_t tick = 1000;
  for (int round = 1; round <= 2; ++round) {
    while (!source.next(microseconds(1000))) port.arrive_row(tick = static_cast<std::uint16_t>(tick + 20));
    EXPECT_EQ(asked, round - 1);
    const auto end = std::chrono::steady_clock::now() + 2 * CanSource::silence;
    while (std::chrono::steady_clock::now() < end) {
      port.arrive_row(tick = static_cast<std::uint16_t>(tick + 200));
      EXPECT_FALSE(source.next(microseconds(10'000)));
    }
    EXPECT_EQ(asked, round);
  }
  EXPECT_EQ(source.restarts(), 0u);
}

// Another recording that started the node has ended, and put it back.
TEST(CanSource, ANodeThatIsPutBackByAnotherIsStartedAgain) {
  FakePort port;
  {
    CanSource source(port, plan_in(5));
    for (int round = 0; round < 2; ++round) {
      port.arrive_row(static_cast<std::uint16_t>(1000 + 20 * round));
      source.next(microseconds(1000));
      port.arrive(0x705, 1, {127});
      const auto end = std::chrono::steady_clock::now() + 2 * CanSource::silence;
      while (std::chrono::steady_clock::now() < end) {
        source.next(microseconds(10'000));
        port.arrive(0x705, 1, {127});  // it lives
      }
    }
    EXPECT_EQ(source.restarts(), 2u);
    EXPECT_EQ(port.sent, (std::vector<CanFrame>{nmt(1), nmt(1)})) << "once for each silence";
  }
  EXPECT_EQ(port.sent.back(), nmt(128)) << "the last one puts it back";
}

TEST(CanSource, AStoppedNodeStaysStopped) {
  FakePort port;
  CanSource source(port, plan_in(5));
  port.arrive(0x705, 1, {4});
  const auto end = std::chrono::steady_clock::now() + 2 * CanSource::silence;
  while (std::chrono::steady_clock::now() < end) {
    source.next(microseconds(10'000));
    port.arrive(0x705, 1, {4});  // it lives
  }
  EXPECT_TRUE(port.sent.empty());
}

TEST(CanSource, PdosThatNeverMakeASetEndItToo) {
  FakePort port;
  CanSource source(port, plan_in(127));
  for (int i = 0; i < 2500; ++i) {
    port.arrive(0x185, 8);
    port.arrive(
        0x485, 8,
        {0, 0, 0, 0, 0, 0, static_cast<std::uint8_t>(20 * i), static_cast<std::uint8_t>(20 * i >> 8)});
  }
  EXPECT_CONTAINS(host_tools_test::thrown_message<device::LinkError>([&] {
                    while (true) source.next(microseconds(50'000));
                  }),
                  "no complete set of PDOs");
}

// The program was stopped for a while; what waits must not be taken for silence.
TEST(CanSource, ItsOwnAbsenceIsNoSilence) {
  FakePort port;
  CanSource source(port, plan_in(127));
  port.arrive_row(1000);
  port.arrive_row(1020);
  EXPECT_TRUE(source.next(microseconds(1000)));
  std::this_thread::sleep_for(CanSource::patience + std::chrono::milliseconds(50));
  for (std::uint16_t tick = 1040; tick < 1100; tick = static_cast<std::uint16_t>(tick + 20))
    port.arrive_row(tick);
  EXPECT_TRUE(source.next(microseconds(1000)));
}

TEST(CanSource, TheFiltersPassWhatItNeeds) {
  const device::CanPortOptions options = port_options(plan_in(5));
  ASSERT_EQ(options.filters.size(), 5u);
  EXPECT_EQ(options.filters[3].identifier, 0x485u);
  EXPECT_EQ(options.filters[4].identifier, 0x705u);
}

}  // namespace kmax::record::can_source_test
