// The board as a PC's CAN adapter: a second node on the bus, the board's own node between them, floods, a bus
// that fails, and channels that are closed in the middle.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "firmware/board_interface/can_port.hpp"
#include "firmware/drive/statusword.hpp"
#include "tests/image/can_bench.hpp"
#include "tests/image/gs_usb_host.hpp"

namespace kmax::tests::usb_can_adapter_test {
namespace {

using drivers::CanFrame;
using virtual_board::BoardTime;
using virtual_board::CanHostNode;

constexpr std::uint8_t node = 0, bus = 1;
constexpr firmware::canopen::ObjectAddress device_type{0x1000, 0}, product{0x1018, 2};

CanFrame numbered(std::uint32_t identifier, std::uint32_t number) {
  CanFrame frame{.identifier = identifier, .length = 8, .data = {0, 0, 0, 0, 0xA5, 0x5A, 0xA5, 0x5A}};
  for (unsigned i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> 8 * i);
  return frame;
}
std::uint32_t number_of(const CanFrame& frame) {
  std::uint32_t number = 0;
  for (unsigned i = 0; i < 4; ++i) number |= std::uint32_t{frame.data[i]} << 8 * i;
  return number;
}
CanFrame controlword(std::uint8_t word) {
  return {.identifier = 0x601, .length = 8, .data = {0x2B, 0x40, 0x60, 0, word, 0, 0, 0}};
}

/// Another node on the bus: what it hears of each identifier, and how long the board's node takes to answer.
class SecondNode {
 public:
  explicit SecondNode(virtual_board::VirtualBoard& board) : board_(board), node_(board.can_bus(), 1'000'000) {
    node_.on_frame([this](const CanFrame& frame, BoardTime now) {
      heard_[frame.identifier].push_back(frame);
      if (frame.identifier == 0x581 && asked_ && frame.data[1] == asked_->data[1]) {
        worst_s_ = std::max(worst_s_, virtual_board::seconds(now) - asked_at_);
        ++answers_;
        asked_.reset();
      }
    });
  }
  CanHostNode& on_bus() { return node_; }
  void send(const CanFrame& frame) { node_.send(frame, board_.now()); }
  const std::vector<CanFrame>& heard(std::uint32_t identifier) { return heard_[identifier]; }
  void forget() { heard_.clear(); }

  /// Asks the board's node, one request at a time.
  void ask(firmware::canopen::ObjectAddress object) {
    if (asked_) return;
    asked_ = upload_request(object);
    asked_at_ = virtual_board::seconds(board_.now());
    send(*asked_);
  }
  bool waits() const { return asked_.has_value(); }
  int answers() const { return answers_; }
  double worst_s() const { return worst_s_; }

 private:
  virtual_board::VirtualBoard& board_;
  CanHostNode node_;
  std::map<std::uint32_t, std::vector<CanFrame>> heard_;
  std::optional<CanFrame> asked_;
  double asked_at_ = 0.0, worst_s_ = 0.0;
  int answers_ = 0;
};

/// A PC with both channels open, and a second node on the bus.
class UsbCanAdapter : public testing::Test {
 protected:
  explicit UsbCanAdapter(const ImageBench::Parameters& parameters = {})
      : bench(parameters, 0.0, "dc_coreless_a"), second(*bench.board), pc(bench) {
    bench.start();
    ready = bench.plug_in() && pc.bind() && pc.open(node) && pc.open(bus);
    pc.start_reading();
    pc.on_frame(
        [this](std::uint8_t channel, const CanFrame& frame, BoardTime) { seen[channel].push_back(frame); });
    bench.board->run_for(0.01);
    forget();
  }
  void SetUp() override { ASSERT_TRUE(ready) << bench.found().trouble(); }
  void TearDown() override {
    if (!flash_was_erased) {
      EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);
    }
    EXPECT_EQ(bench.board->resets(), 1U);
    EXPECT_EQ(pc.counts(node).strays + pc.counts(bus).strays, 0U);
  }

  void forget() {
    for (auto& frames : seen) frames.clear();
    second.forget();
  }
  std::vector<CanFrame> seen_of(std::uint8_t channel, std::uint32_t identifier) const {
    std::vector<CanFrame> found;
    std::ranges::copy_if(seen[channel], std::back_inserter(found),
                         [&](const CanFrame& frame) { return frame.identifier == identifier; });
    return found;
  }
  /// The PC sends on a channel, and again whenever one has its echo.
  void flood(std::uint8_t channel, std::uint32_t identifier) {
    pc.on_echo([this, channel, identifier](std::uint8_t of) {
      if (of == channel && flooding) pc.send(channel, numbered(identifier, next++));
    });
    flooding = true;
    for (std::size_t i = 0; i < GsUsbHost::frames_before_echo; ++i)
      pc.send(channel, numbered(identifier, next++));
  }
  static void expect_in_order(const std::vector<CanFrame>& frames) {
    for (std::size_t i = 1; i < frames.size(); ++i)
      ASSERT_EQ(number_of(frames[i]), number_of(frames[i - 1]) + 1) << i;
  }
  bool command(std::uint8_t word) { return pc.sdo_round_trip(node, controlword(word)).has_value(); }
  bool arm() {
    for (const std::uint8_t word : std::to_array<std::uint8_t>({0x06, 0x07, 0x0F})) {
      if (!command(word)) return false;
      bench.board->run_for(0.005);
    }
    return bench.board->bridge_armed(0);
  }

  UsbBench bench;
  SecondNode second;
  GsUsbHost pc;
  std::array<std::vector<CanFrame>, GsUsbHost::channels> seen;
  std::uint32_t next = 0;
  bool ready = false, flooding = false;
  bool flash_was_erased = false;  ///< disarmed, meanwhile there are no ticks
};

// A PC's driver works the timing of every bit rate out of this number (GS_USB_BREQ_BT_CONST, second word).
TEST_F(UsbCanAdapter, SaysTheClockByWhichTheBusRuns) {
  const virtual_board::UsbTransferResult said = bench.control({0xC1, 4, 0, 0, 0, 0, 40, 0});
  ASSERT_EQ(said.data.size(), 40u);
  std::uint32_t clock = 0;
  for (unsigned i = 0; i < 4; ++i) clock |= std::uint32_t{said.data[4 + i]} << 8 * i;
  // RM0090: bxCAN is on APB1, a quarter of 168 MHz.
  EXPECT_EQ(clock, 42'000'000u);
}

TEST_F(UsbCanAdapter, TheSecondChannelIsOnTheBusAndTheFirstIsNot) {
  second.send(numbered(0x123, 1));
  bench.board->run_for(0.005);
  EXPECT_EQ(seen_of(bus, 0x123), std::vector{numbered(0x123, 1)});
  EXPECT_TRUE(seen_of(node, 0x123).empty()) << "what others say on the bus";

  pc.send(bus, numbered(0x321, 2));
  pc.send(node, numbered(0x322, 3));
  bench.board->run_for(0.005);
  EXPECT_EQ(second.heard(0x321), std::vector{numbered(0x321, 2)});
  EXPECT_TRUE(second.heard(0x322).empty()) << "it is between the PC and the node";
  EXPECT_EQ(pc.counts(bus).echoes, 1U);
  EXPECT_EQ(pc.counts(node).echoes, 1U);

  // Extended, remote and empty frames go as they are.
  for (const CanFrame& frame :
       {CanFrame{.identifier = 0x1ABCDEF0, .extended = true, .length = 3, .data = {7, 8, 9}},
        CanFrame{.identifier = 0x155, .remote = true, .length = 4}, CanFrame{.identifier = 0x2AA}}) {
    pc.send(bus, frame);
    bench.board->run_for(0.005);
    EXPECT_EQ(second.heard(frame.identifier), std::vector{frame});
    second.send(frame);
    bench.board->run_for(0.005);
    EXPECT_EQ(seen_of(bus, frame.identifier), std::vector{frame});
  }
}

TEST_F(UsbCanAdapter, TheNodeAnswersOnBothChannelsAndOnTheBus) {
  for (const std::uint8_t channel : {node, bus}) {
    forget();
    ASSERT_TRUE(pc.sdo_round_trip(channel, upload_request(device_type))) << +channel;
    bench.board->run_for(0.002);
    EXPECT_EQ(second.heard(0x601).size(), channel == bus ? 1U : 0U);
    EXPECT_EQ(second.heard(0x581).size(), 1U) << "what the node sends, all of its hosts hear";
    EXPECT_EQ(seen_of(static_cast<std::uint8_t>(1 - channel), 0x581).size(), 1U);
  }
  second.ask(device_type);
  bench.board->run_for(0.005);
  EXPECT_FALSE(second.waits());
  ASSERT_TRUE(pc.close(bus));
  forget();
  second.ask(product);
  bench.board->run_for(0.005);
  EXPECT_FALSE(second.waits()) << "with nobody on the second channel";
  EXPECT_TRUE(seen[bus].empty());
}

/// Both directions fill the bus, with identifiers in front of the node's and behind.
TEST_F(UsbCanAdapter, ThroughAFullBusBothWaysTheNodeIsNeverStarved) {
  ASSERT_TRUE(arm());
  const double busy_before = virtual_board::seconds(bench.board->can_bus().busy_time());
  forget();
  flood(bus, 0x6F0);
  std::mt19937 random(3);
  std::uint32_t sent = 0;
  double worst = 0.0;
  constexpr int rounds = 60;
  const double begin = virtual_board::seconds(bench.board->now());
  for (int i = 0; i < rounds; ++i) {
    // Three frames of the second node for each four that the bus could take in this time.
    for (int k = 0; k < 8; ++k) second.send(numbered(0x100, sent++));
    if (i % 2 == 0) {  // one client of the server at a time
      second.ask(product);
      for (int k = 0; k < 500 && second.waits(); ++k) bench.board->run_for(20e-6);
    } else {
      const auto took = pc.sdo_round_trip(node, upload_request(device_type));
      ASSERT_TRUE(took) << i;
      worst = std::max(worst, *took);
    }
    bench.board->run_for(static_cast<double>(random() % 200) * 1e-6);
    while (virtual_board::seconds(bench.board->now()) < begin + 1.4e-3 * (i + 1)) bench.board->run_for(20e-6);
  }
  const double lasted = virtual_board::seconds(bench.board->now()) - begin;
  const double busy = virtual_board::seconds(bench.board->can_bus().busy_time()) - busy_before;
  flooding = false;
  bench.board->run_for(0.05);
  std::printf(
      "full bus (%.0f %% busy): %zu frames from the PC, %u from the bus; SDO over the first channel %.2f ms "
      "at most, over the bus %.2f ms\n",
      100.0 * busy / lasted, second.heard(0x6F0).size(), sent, worst * 1e3, second.worst_s() * 1e3);
  EXPECT_GT(busy, 0.9 * lasted) << "a full bus";
  EXPECT_LT(worst, 5e-3);
  EXPECT_EQ(second.answers(), rounds / 2);
  EXPECT_LT(second.worst_s(), 5e-3);
  EXPECT_TRUE(bench.board->bridge_armed(0));
  // To the bus nothing is lost; to the PC, which asks eight times in a millisecond, no more than is counted.
  const auto come = seen_of(bus, 0x100), gone = second.heard(0x6F0);
  const std::uint32_t lost = bench.number("counters.usb_frames_lost");
  EXPECT_GE(come.size() + lost, sent);
  EXPECT_LT(lost, sent / 20);
  EXPECT_LE(pc.counts(bus).losses, lost) << "and says so";
  EXPECT_EQ(gone.size(), next);
  expect_in_order(gone);
  EXPECT_EQ(pc.counts(node).losses, 0U);
  for (const char* counter :
       {"counters.usb_frames_not_sent", "can.overruns", "can.queue_overflows", "counters.usb_frames_refused"})
    EXPECT_EQ(bench.number(counter), 0U) << counter;
}

// A save that erases holds the core up for 250 ms, in which a FIFO keeps three frames and no more.
TEST_F(UsbCanAdapter, WhatOthersSayDuringAnEraseDoesNotPushOutWhatTheNodeIsAsked) {
  constexpr std::uint32_t before = 800, after = 100;
  for (unsigned saves = 0; saves < 60 && !flash_was_erased; ++saves) {
    bench.write("wall.law", 0, saves % 2);
    forget();
    for (std::uint32_t i = 0; i < before; ++i) second.send(numbered(0x100, i));
    second.ask(device_type);
    for (std::uint32_t i = 0; i < after; ++i) second.send(numbered(0x100, before + i));
    const std::uint32_t overruns = bench.number("can.overruns");
    bench.write("store.command", 0, 1);
    for (int i = 0; i < 400 && bench.number("store.state") == 1; ++i) bench.board->run_for(1e-3);
    bench.board->run_for(0.2);
    flash_was_erased = bench.number("can.overruns") > overruns;
    ASSERT_FALSE(second.waits()) << "at save " << saves;
  }
  EXPECT_TRUE(flash_was_erased) << "no save ever held the core up";
  EXPECT_GT(second.worst_s(), 0.1) << "the request came during the erase";
}

TEST_F(UsbCanAdapter, ABabblingBusHoldsUpNeitherThePcNorTheNode) {
  ASSERT_TRUE(arm());
  flood(bus, 0x6F0);
  bench.board->run_for(0.02);
  CanHostNode babbler(bench.board->can_bus(), 1'000'000);
  babbler.babble(CanFrame{.identifier = 0, .length = 2, .data = {1, 99}}, bench.board->now());
  double worst = 0.0;
  for (int i = 0; i < 40; ++i) {
    const auto took = pc.sdo_round_trip(node, upload_request(device_type));
    ASSERT_TRUE(took) << i;
    worst = std::max(worst, *took);
  }
  std::printf("a babbling bus: SDO over the first channel %.2f ms at most\n", worst * 1e3);
  EXPECT_LT(worst, 0.02);
  EXPECT_TRUE(bench.board->bridge_armed(0));
  EXPECT_GT(bench.number("counters.usb_frames_not_sent"), 0U);
  babbler.babble(std::nullopt, bench.board->now());
  flooding = false;
  bench.board->run_for(0.05);
  forget();
  pc.send(bus, numbered(0x321, 2));
  bench.board->run_for(0.005);
  EXPECT_EQ(second.heard(0x321).size(), 1U) << "and is there again";
}

TEST_F(UsbCanAdapter, CommandsOverUsbGoOnWhileTheBusIsOff) {
  ASSERT_TRUE(arm());
  flood(bus, 0x6F0);
  bench.board->can_bus().destroy_frames_of(bench.board->chip().peripherals().can1.node());
  bench.board->can_bus().destroy_frames(40);
  bench.board->run_for(0.02);
  ASSERT_EQ(bench.number("can.state"), static_cast<unsigned>(firmware::CanState::bus_off));
  for (int i = 0; i < 20; ++i) {
    const auto took = pc.sdo_round_trip(i % 2 == 0 ? node : bus, upload_request(device_type));
    ASSERT_TRUE(took) << i;
    EXPECT_LT(*took, 5e-3) << i;
    EXPECT_TRUE(bench.board->bridge_armed(0)) << i;
  }
  EXPECT_GT(bench.number("counters.usb_frames_not_sent"), 0U);
  // Disarmed and armed again, without a bus.
  ASSERT_TRUE(command(0x06));
  bench.board->run_for(0.005);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  EXPECT_TRUE(arm());
  flooding = false;
  bench.board->can_bus().destroy_frames(0);
  bench.board->run_for(0.5);
  EXPECT_EQ(bench.number("can.state"), static_cast<unsigned>(firmware::CanState::active));
  forget();
  pc.send(bus, numbered(0x321, 2));
  second.ask(product);
  bench.board->run_for(0.005);
  EXPECT_EQ(second.heard(0x321).size(), 1U);
  EXPECT_FALSE(second.waits());
}

// The node sends a block faster than a turn of the main loop shows it, and the bus has room for all of it.
TEST_F(UsbCanAdapter, ABlockOfSegmentsReachesThePcWhole) {
  constexpr std::uint8_t segments = 127;
  constexpr unsigned size = 7U * segments;
  const auto ask = [this](const std::array<std::uint8_t, 8>& data) {
    forget();
    pc.send(node, {.identifier = 0x601, .length = 8, .data = data});
    for (int i = 0; i < 400 && seen_of(node, 0x581).empty(); ++i) bench.board->run_for(50e-6);
    const auto answers = seen_of(node, 0x581);
    return answers.empty() ? std::uint8_t{0xFF} : answers.front().data[0];
  };
  ASSERT_EQ(ask({0x21, 0x22, 0x58, 1, size & 0xFFU, size >> 8}), 0x60);
  for (std::uint8_t i = 0; i < segments; ++i) {
    const auto command = static_cast<std::uint8_t>((i % 2) << 4 | (i + 1 == segments ? 1 : 0));
    ASSERT_EQ(ask({command, i, i, i, i, i, i, i}) & 0xE0, 0x20) << int{i};
  }
  for (int round = 0; round < 5; ++round) {
    ASSERT_EQ(ask({0xA0, 0x22, 0x58, 1, segments}) & 0xE0, 0xC0);
    forget();
    pc.send(node, {.identifier = 0x601, .length = 8, .data = {0xA3}});
    bench.board->run_for(0.05);
    const auto block = seen_of(node, 0x581);
    ASSERT_EQ(block.size(), segments) << round;
    for (std::size_t i = 0; i < segments; ++i) EXPECT_EQ(block[i].data[0] & 0x7F, static_cast<int>(i) + 1);
    EXPECT_EQ(second.heard(0x581).size(), segments) << "and the bus";
    ASSERT_EQ(ask({0xA2, segments, segments}) & 0xE0, 0xC0);
    pc.send(node, {.identifier = 0x601, .length = 8, .data = {0xA1}});
    bench.board->run_for(0.002);
  }
  EXPECT_EQ(bench.number("counters.usb_frames_lost"), 0U);
}

// An open channel is no commander: whoever armed the axis over the bus is not reached any more.
TEST_F(UsbCanAdapter, ABusThatGoesOffTakesTheForceOfWhoCommandsOverIt) {
  for (const std::uint8_t word : std::to_array<std::uint8_t>({0x06, 0x07, 0x0F})) {
    second.send(controlword(word));
    bench.board->run_for(0.01);
  }
  ASSERT_TRUE(bench.board->bridge_armed(0));
  ASSERT_TRUE(pc.sdo_round_trip(node, upload_request(device_type))) << "the PC is there, and reads";
  flood(bus, 0x6F0);
  bench.board->can_bus().destroy_frames_of(bench.board->chip().peripherals().can1.node());
  bench.board->can_bus().destroy_frames(40);
  bench.board->run_for(0.02);
  ASSERT_EQ(bench.number("can.state"), static_cast<unsigned>(firmware::CanState::bus_off));
  bench.board->run_for(0.3);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  EXPECT_EQ(bench.number("drive.error_code"), 0x8140U) << "bus_off";
}

/// Nothing that was under way for a session reaches the next one, whichever moment it is closed at.
TEST_F(UsbCanAdapter, WhoOpensAChannelNextSeesNothingOfTheSessionBefore) {
  std::mt19937 random(5);
  std::uint32_t sent = 0;
  const int rounds = times(40, 400);
  for (int i = 0; i < rounds; ++i) {
    const bool with_the_other_open = i % 3 != 0, reads = i % 2 == 0;
    ASSERT_TRUE(pc.open(bus));
    if (!with_the_other_open) {
      ASSERT_TRUE(pc.close(node));
    }
    if (!reads) pc.stop_reading();
    for (int k = 0; k < 40; ++k) second.send(numbered(0x100, sent++));
    const std::uint32_t first = next;
    for (std::size_t k = 0; k < GsUsbHost::frames_before_echo; ++k) pc.send(bus, numbered(0x6F0, next++));
    bench.board->run_for(static_cast<double>(random() % 4000) * 1e-6);
    // A driver asks for nothing more before it closes its last channel.
    if (random() % 2 == 0) pc.stop_reading();
    switch (i % 4) {
      case 0:
      case 1:
        ASSERT_TRUE(pc.close(bus));
        break;
      case 2:
        break;  // its program died, and the next one opens it as it is
      default:
        ASSERT_TRUE(pc.bind());
    }
    if (i % 5 == 0) bench.board->run_for(0.01);
    const auto old = static_cast<std::uint32_t>(sent - second.on_bus().waiting());
    ASSERT_TRUE(pc.open(bus)) << i;
    const auto opened = pc.counts(bus);
    seen[bus].clear();
    pc.start_reading();
    bench.board->run_for(0.01);
    // On the bus the second node's frames go on all the while: those that come behind the opening are seen.
    const auto come = seen_of(bus, 0x100);
    expect_in_order(come);
    if (!come.empty()) {
      EXPECT_GE(number_of(come.front()), old) << i;
    }
    EXPECT_EQ(pc.counts(bus).echoes, opened.echoes) << i;
    EXPECT_EQ(pc.counts(bus).losses, opened.losses) << i;
    // What had gone to the bus before has gone in order, and once.
    const auto gone = second.heard(0x6F0);
    EXPECT_LE(gone.size(), std::size_t{next - first});
    expect_in_order(gone);
    seen[bus].clear();
    second.forget();
    while (second.on_bus().waiting() != 0) bench.board->run_for(1e-3);
    bench.board->run_for(1e-3);
    seen[bus].clear();
    // And it works.
    second.send(numbered(0x101, 7));
    pc.send(bus, numbered(0x6F1, 8));
    bench.board->run_for(0.005);
    EXPECT_EQ(seen_of(bus, 0x101).size(), 1U) << i;
    EXPECT_EQ(second.heard(0x6F1).size(), 1U) << i;
    EXPECT_EQ(pc.counts(bus).echoes, opened.echoes + 1) << i;
    second.forget();
    if (!with_the_other_open || i % 4 == 3) {
      ASSERT_TRUE(pc.open(node));
    }
  }
  EXPECT_EQ(bench.number("can.overruns"), 0U);
}

TEST_F(UsbCanAdapter, TheFrameThatWaitsInTheEndpointGoesWithItsSession) {
  for (const bool with_the_other_open : {true, false}) {
    ASSERT_TRUE(pc.open(bus));
    if (!with_the_other_open) {
      ASSERT_TRUE(pc.close(node));
    }
    bench.board->run_for(0.005);
    pc.stop_reading();
    second.send(numbered(0x100, 1));
    bench.board->run_for(0.005);
    ASSERT_TRUE(pc.close(bus));
    ASSERT_TRUE(pc.open(bus));
    bench.board->run_for(0.005);
    seen[bus].clear();
    pc.start_reading();
    bench.board->run_for(0.005);
    EXPECT_TRUE(seen[bus].empty());
    second.send(numbered(0x100, 2));
    bench.board->run_for(0.005);
    EXPECT_EQ(seen[bus], std::vector{numbered(0x100, 2)});
  }
}

// docs/usb.md: a master may take so many segments at once from a node behind the adapter where nothing else
// is said, one after the other.
TEST_F(UsbCanAdapter, ABlockOf32SegmentsOfAnotherNodeWaitsForALatePc) {
  for (const std::uint32_t segments : {32U, 127U}) {
    forget();
    pc.stop_reading();
    for (std::uint32_t i = 0; i < segments; ++i) second.send(numbered(0x100, i));
    bench.board->run_for(0.1);
    EXPECT_TRUE(seen_of(bus, 0x100).empty());
    EXPECT_EQ(bench.number("counters.usb_frames_lost") != 0, segments == 127) << "more than it keeps";
    pc.start_reading();
    bench.board->run_for(0.02);
    EXPECT_EQ(seen_of(bus, 0x100).size() == segments, segments == 32);
    expect_in_order(seen_of(bus, 0x100));
  }
}

TEST_F(UsbCanAdapter, APcThatDoesNotReadLosesFramesAndHoldsUpNobody) {
  ASSERT_TRUE(arm());
  pc.stop_reading();
  for (std::uint32_t i = 0; i < 300; ++i) second.send(numbered(0x100, i));
  bench.board->run_for(0.06);
  for (int i = 0; i < 10; ++i) {
    second.ask(device_type);
    bench.board->run_for(0.005);
    EXPECT_FALSE(second.waits()) << i;
  }
  EXPECT_TRUE(bench.board->bridge_armed(0));
  const std::uint32_t lost = bench.number("counters.usb_frames_lost");
  EXPECT_GT(lost, 100U);
  const auto losses = pc.counts(bus).losses;
  pc.start_reading();
  bench.board->run_for(0.01);
  second.send(numbered(0x100, 200));
  bench.board->run_for(0.005);
  EXPECT_GT(pc.counts(bus).losses, losses) << "and hears of it";
  const auto heard = pc.counts(bus).losses;
  second.send(numbered(0x100, 300));
  bench.board->run_for(0.005);
  EXPECT_EQ(pc.counts(bus).losses, heard) << "once it reads, nothing is lost";
}

}  // namespace
}  // namespace kmax::tests::usb_can_adapter_test
