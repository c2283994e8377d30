// CANopen on the flashed image, over a bus with its bits and their time.
#include <gtest/gtest.h>

#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "tests/image/can_bench.hpp"

namespace kmax::tests::canopen_test {

using firmware::DriveState;
using firmware::statusword::state_of;

std::vector<std::uint8_t> pattern(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 31 + i / 251);
  return bytes;
}

TEST(CanOpen, BootsUpAndAnswersTransfersOfEveryKind) {
  CanBench bench;
  bench.start();
  const auto boot_up = bench.next(0x701, 0.0001);
  ASSERT_TRUE(boot_up);
  EXPECT_EQ(boot_up->frame.length, 1);
  EXPECT_EQ(boot_up->frame.data[0], 0);
  EXPECT_EQ(bench.number(0x1000, 0), firmware::device_type_of_several_axes);
  for (const std::size_t size : {1, 7, 8, 889, 890, 2000}) {
    bench.sdo.download({0x5822, 1}, pattern(size), true);
    EXPECT_EQ(bench.sdo.upload({0x5822, 1}, size), pattern(size)) << size;
    EXPECT_EQ(bench.sdo.upload({0x5822, 1}, 0), pattern(size)) << size << " segmented";
  }
  EXPECT_EQ(bench.number(0x5812, 10), 0U) << "a tick was missed";
}

TEST(CanOpen, ArmedOverTheBusAnAxisMakesForceAndNmtStopTakesIt) {
  CanBench bench({{"axis0.wall.law", std::string("plain")}, {"axis0.wall.stiffness", 1000.0}}, 1.0);
  bench.start();
  EXPECT_EQ(state_of(static_cast<std::uint16_t>(bench.arm())), DriveState::operation_enabled);
  EXPECT_TRUE(bench.board->bridge_armed(0));
  bench.nmt(0x02);
  bench.board->run_for(0.001);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  bench.nmt(0x80);
  bench.board->run_for(0.001);
  EXPECT_EQ(state_of(static_cast<std::uint16_t>(bench.number(0x6041, 0))), DriveState::switch_on_disabled);
}

TEST(CanOpen, ResetNodeRestartsTheBoard) {
  CanBench bench;
  bench.start();
  bench.port.forget();
  const auto resets = bench.board->resets();
  bench.nmt(0x81);
  const auto boot_up = bench.next(0x701, 0.2);
  ASSERT_TRUE(boot_up);
  EXPECT_EQ(boot_up->frame.data[0], 0);
  EXPECT_EQ(bench.board->resets(), resets + 1);
  bench.nmt(0x82);
  ASSERT_TRUE(bench.next(0x701, 0.2));
  EXPECT_EQ(bench.board->resets(), resets + 1) << "the communication alone";
}

// With the main loop at its busiest. What is reached, so that it does not grow unseen: where the request
// meets the ticks decides whether the worst is 1.43 or 1.51. Wanted is 1.5, which docs/canopen.md judges with
// more objects, and more of each.
TEST(CanOpen, AnExpeditedTransferTakesLittleMoreThanItsFrames) {
  CanBench bench({{"link.timeout", 0.0},
                  {"wall.law", std::string("adaptive")},
                  {"axis1.wall.law", std::string("adaptive")},
                  {"wall.position", -1.0},
                  {"axis1.wall.position", -1.0}});
  bench.start();
  for (std::size_t axis = 0; axis < 2; ++axis) ASSERT_EQ(bench.arm(axis) & 0x6F, 0x27U);
  const auto answered = bench.round_trips({0x2012, 2}, 400);
  EXPECT_EQ(answered.size(), 400U);
  double worst = 0.0;
  for (const auto& one : answered) worst = std::max(worst, one.us / one.own_us);
  EXPECT_LT(worst, 1.53);
}

/// Asks for one object again as soon as it is answered.
class BusyClient {
 public:
  BusyClient(virtual_board::VirtualBoard& board, firmware::canopen::ObjectAddress object)
      : node_(board.can_bus(), 1'000'000) {
    request_.data[1] = static_cast<std::uint8_t>(object.index);
    request_.data[2] = static_cast<std::uint8_t>(object.index >> 8);
    request_.data[3] = object.subindex;
    node_.on_frame([this](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
      if (frame.identifier != 0x581) return;
      ++answers;
      node_.send(request_, now);
    });
    node_.send(request_, board.now());
  }

  int answers = 0;

 private:
  virtual_board::CanHostNode node_;
  drivers::CanFrame request_{.identifier = 0x601, .length = 8, .data = {0x40}};
};

// The grid is exact; what is added is the loop's round, which begins late when it has much to do, and the
// bus. The numbers are those of docs/canopen.md.
TEST(CanOpen, OwnSyncsAreRegularWhateverElseIsAskedFor) {
  CanBench bench;
  bench.start();
  bench.write(0x1006, 0, 1000, 4);
  virtual_board::CanHostNode listener(bench.board->can_bus(), 1'000'000);
  std::vector<double> times;
  listener.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
    if (frame.identifier == 0x80) times.push_back(1e6 * virtual_board::seconds(now));
  });
  const auto worst_deviation = [&](double seconds) {
    times.clear();
    bench.board->run_for(seconds);
    EXPECT_NEAR(static_cast<double>(times.size()), 1000.0 * seconds, 1.0);
    double worst = 0.0;
    for (std::size_t i = 1; i < times.size(); ++i)
      worst = std::max(worst, std::abs(times[i] - times[0] - 1000.0 * static_cast<double>(i)));
    return worst;
  };
  bench.write(0x1005, 0, 0x4000'0080, 4);
  bench.board->run_for(0.01);
  EXPECT_LT(worst_deviation(2.0), 50.0) << "pre-operational, us";
  bench.ask_for_telemetry();
  bench.nmt(0x01);
  bench.board->run_for(0.01);  // setting up the PDOs is one long round
  {
    BusyClient client(*bench.board, {0x2012, 4});
    EXPECT_LT(worst_deviation(2.0), 200.0) << "beside four PDOs at 1 kHz and transfers, us";
    EXPECT_GT(client.answers, 1000);
  }
  // Two that ask one server take each other's answers.
  bench.board->run_for(0.01);
  bench.port.forget();
  EXPECT_EQ(bench.number(0x5812, 10), 0U) << "a tick was missed";
}

// Wherever in the main loop's own rhythm the node is started (every 10 ms the loop has more to do), and
// whatever else a host asks for meanwhile: all values of a PDO are of one tick, and those of the next are of
// exactly a period later.
TEST(CanOpen, PdosTellOfOneTickAndOfRegularOnes) {
  CanBench bench;
  bench.start();
  bench.write(0x1803, 1, 0x8000'0481, 4);
  bench.write(0x1A03, 0, 0, 1);
  bench.write(0x1A03, 1, 0x2012'0120, 4);  // measured.tick of axis 0
  bench.write(0x1A03, 2, 0x2812'0120, 4);  // and of axis 1
  bench.write(0x1A03, 0, 2, 1);
  bench.write(0x1803, 1, 0x0000'0481, 4);
  bench.ask_for_telemetry();
  virtual_board::CanHostNode listener(bench.board->can_bus(), 1'000'000);
  std::vector<std::array<std::uint32_t, 2>> ticks;
  listener.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime) {
    if (frame.identifier != 0x481) return;
    std::array<std::uint32_t, 2> both{};
    for (unsigned byte = 0; byte < 8; ++byte)
      both[byte / 4] |= std::uint32_t{frame.data[byte]} << 8 * (byte % 4);
    ticks.push_back(both);
  });
  const auto listen = [&](double seconds, const std::string& what) {
    ticks.clear();
    bench.nmt(0x01);
    bench.board->run_for(seconds);
    bench.nmt(0x80);
    ASSERT_GE(static_cast<double>(ticks.size()), 1000.0 * seconds - 1.0);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      ASSERT_EQ(ticks[i][0], ticks[i][1]) << "PDO " << i << ", " << what;
      const std::uint32_t before = i == 0 ? ticks[0][0] - 20 : ticks[i - 1][0];
      ASSERT_EQ(ticks[i][0] - before, 20U) << "PDO " << i << ", " << what;
    }
  };
  for (int phase = 0; phase < 40; ++phase) {
    listen(0.025, "phase " + std::to_string(phase));
    bench.board->run_for(0.005123);
  }
  // A reading, and one that takes long: it compares every parameter with what is kept.
  for (const auto& object : {firmware::canopen::ObjectAddress{0x2012, 4}, {0x5817, 1}}) {
    BusyClient client(*bench.board, object);
    for (int phase = 0; phase < 10; ++phase) {
      listen(0.1, "beside reads of " + std::to_string(object.index) + " at phase " + std::to_string(phase));
      bench.board->run_for(0.005123);
    }
    EXPECT_GT(client.answers, 500);
  }
}

}  // namespace kmax::tests::canopen_test
