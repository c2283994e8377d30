// The application on a bare clock: wraps at 2^32 us, late polls, and interrupts between any two calls.
#include <gtest/gtest.h>

#include <memory>

#include "firmware/application.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/firmware/register_words.hpp"

namespace kmax::firmware::application_clock_test {
namespace {

using modbus::Bytes;

// Tick, poll and serial line called one by one, the clock set at will.
class BareBoard {
 public:
  explicit BareBoard(std::uint32_t start_us)
      : application(std::make_unique<Application>(BoardIdentity{})), now(start_us) {
    for (const std::size_t axis : {0u, 1u}) {
      preset("encoder.counts_per_turn", 1'000'000, axis);
      preset("device.transmission", 0.15915494309189535, axis);
      preset("force.ramp_time", 0, axis);
      preset("velocity.limit", 0, axis);
    }
    step();
  }

  void preset(std::string_view name, double number, std::size_t axis = 0) {
    const std::size_t entry = entry_named(name);
    EXPECT_EQ(application->preset(entry, axis, raw_from_number(entry_at(entry).type, number)).refusal,
              Refusal::none);
  }
  void tick() { output = application->ISR_tick({{{{count, valid}, {count, valid}}}}); }
  void step(std::uint32_t us = 50) {
    now += us;
    tick();
    application->poll(now);
  }
  // Characters on the line, without a poll; the line is silent long enough after them to end the frame.
  void hear(const Bytes& frame) {
    for (const std::uint8_t byte : frame) application->serial().ISR_byte(byte, false, now += 96);
    now += 2000;
  }
  void hear_command(unsigned word) {
    hear(modbus::adu(1,
                     {6, 0x02, 0x00, static_cast<std::uint8_t>(word >> 8), static_cast<std::uint8_t>(word)}));
  }
  void command(unsigned word) {
    hear_command(word);
    step();
    step();
    step();
  }
  bool arm() {
    command(0x06);
    command(0x0F);
    return application->state(0) == DriveState::operation_enabled;
  }
  double read_input(std::string_view name) {
    hear(modbus::adu(1, modbus::read_request(4, address_of(name), 2)));
    application->poll(now);
    const auto reply = application->serial().reply_due(now);
    const Bytes bytes(reply.begin(), reply.end());
    application->serial().reply_sent();
    now += 200;
    if (bytes.size() != 9) return -12345;
    return number_in(name, {static_cast<std::uint16_t>(bytes[3] << 8 | bytes[4]),
                            static_cast<std::uint16_t>(bytes[5] << 8 | bytes[6])});
  }

  std::unique_ptr<Application> application;
  TickOutput output{};
  std::uint32_t now;
  std::uint32_t count = 1000;
  bool valid = true;
};

class ClockStart : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Starts, ClockStart,
                         testing::Values(0u, 1u, 0x7FFFF000u, 0x80000000u, 0xFFFFFFFFu, 0xFFFFFF00u,
                                         0xFFFFFFFFu - 500'000u, 0xFFFFFFFFu - 10'000u));

TEST_P(ClockStart, SilenceIsMeasuredRightWhereverTheClockStands) {
  BareBoard board(GetParam());
  board.preset("link.timeout", 0.5);
  ASSERT_TRUE(board.arm());
  board.count = static_cast<std::uint32_t>(-1000);
  board.hear(modbus::adu(1, {6, 0x02, 0x00, 0, 0x0F}));
  const std::uint32_t heard = board.now - 2000;
  board.step();
  while (board.output.axis[0].force != 0.0f && board.now - heard < 2'000'000) board.step();
  EXPECT_GE(board.now - heard, 500'000u);
  EXPECT_LE(board.now - heard, 500'200u);
  EXPECT_EQ(board.application->state(0), DriveState::fault);
}

TEST_P(ClockStart, TalkingHostIsNeverCalledSilent) {
  BareBoard board(GetParam());
  board.preset("link.timeout", 0.05);
  ASSERT_TRUE(board.arm());
  for (int i = 0; i < 50; ++i) {
    board.hear(modbus::adu(1, {3, 0, 0, 0, 1}));
    for (int j = 0; j < 40; ++j) board.step(1000);
    ASSERT_EQ(board.application->state(0), DriveState::operation_enabled) << i;
  }
}

TEST(Clock, DayAndNightArmedWithAHostThatTalks) {
  // 26 hours: the clock wraps 21 times. In steps of 50 ms; a request every 0.5 s, as `kmax watch` makes.
  BareBoard board(0xFFFF0000u);
  board.preset("link.timeout", 1.0);
  ASSERT_TRUE(board.arm());
  std::uint64_t elapsed = 0;
  while (elapsed < 26ull * 3600 * 1'000'000) {
    const std::uint32_t before = board.now;
    board.hear(modbus::adu(1, {3, 0, 0, 0, 1}));
    for (int i = 0; i < 10; ++i) board.step(50'000);
    elapsed += board.now - before;
    ASSERT_EQ(board.application->state(0), DriveState::operation_enabled) << elapsed;
  }
  EXPECT_NEAR(board.read_input("info.uptime"), static_cast<double>(elapsed) * 1e-6, 2.0);
  // And then it falls silent.
  const std::uint32_t last = board.now;
  while (board.application->state(0) == DriveState::operation_enabled && board.now - last < 5'000'000)
    board.step(1000);
  EXPECT_EQ(board.application->state(0), DriveState::fault);
  EXPECT_LE(board.now - last, 1'020'000u);
}

TEST(Clock, DayAndNightSilentAndDisarmedThenArmedIsNotTripped) {
  BareBoard board(0);
  board.preset("link.timeout", 1.0);
  board.command(0x06);
  // Past a whole wrap, and to just about the time of the day at which the host last spoke.
  for (const std::uint64_t silence_s : {4294ull, 4295ull, 2147ull, 2148ull, 90000ull}) {
    for (std::uint64_t i = 0; i < silence_s * 2; ++i) board.step(500'000);
    ASSERT_TRUE(board.arm()) << silence_s;
    for (int i = 0; i < 100; ++i) board.step();
    EXPECT_EQ(board.application->state(0), DriveState::operation_enabled) << silence_s;
    board.command(0x06);
  }
}

TEST(Clock, SilentHostWithoutSupervisionStaysArmedAcrossTheWrap) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  ASSERT_TRUE(board.arm());
  for (int i = 0; i < 3 * 4295 * 2; ++i) board.step(500'000);
  EXPECT_EQ(board.application->state(0), DriveState::operation_enabled);
}

TEST(Clock, ForgottenTransactionIsNotFoundAgainOneLapOfTheClockLater) {
  BareBoard board(0);
  const auto transaction = [&](std::uint8_t request) {
    board.hear(modbus::adu(1, {6, 0x21, 0x00, 0, request}));
    board.application->poll(board.now);
  };
  transaction(1);
  board.hear(modbus::adu(
      1, modbus::multiple_request(address_of("wall.stiffness"), words_for("wall.stiffness", 5000))));
  board.application->poll(board.now);
  const std::uint32_t staged = board.now;
  for (int i = 0; i < 4294; ++i) board.step(1'000'000);
  board.step(staged - board.now);  // the same reading of the clock, 71 minutes later
  transaction(2);
  EXPECT_EQ(board.application->values().real<"wall.stiffness">(), 1000.0f);
}

TEST(Clock, UptimeCountsSecondsFromTheFirstPoll) {
  BareBoard board(0xFFFFFFFFu - 300'000u);
  board.step(900'000);
  EXPECT_EQ(board.read_input("info.uptime"), 0);
  board.step(200'000);
  EXPECT_EQ(board.read_input("info.uptime"), 1);
  for (int i = 0; i < 20; ++i) board.step(500'000);
  EXPECT_EQ(board.read_input("info.uptime"), 11);
}

// A main loop that was held up finds several requests at once.
TEST(LatePoll, DisarmFollowedByEnableIsNotTakenForAHeldEnable) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  ASSERT_TRUE(board.arm());
  board.hear_command(0x00);
  board.hear_command(0x0F);
  board.step();
  EXPECT_EQ(board.application->state(0), DriveState::switch_on_disabled);
}

TEST(LatePoll, EveryCommandOfASequenceIsObeyed) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  board.hear_command(0x06);
  board.hear_command(0x07);
  board.hear_command(0x0F);
  board.step();
  board.step();
  EXPECT_EQ(board.application->state(0), DriveState::operation_enabled);
}

TEST(LatePoll, DisarmedAndArmedAgainBetweenTwoTicksStillStartsSoftly) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  board.preset("wall.law", 2);  // a field outside: 2 N at the surface
  board.preset("force.ramp_time", 1.0);
  ASSERT_TRUE(board.arm());
  board.count = 1;
  for (int i = 0; i < 25'000; ++i) board.step();
  ASSERT_GT(board.output.axis[0].force, 1.9f);
  board.hear_command(0x06);
  board.hear_command(0x0F);
  board.application->poll(board.now);
  for (int i = 0; i < 3; ++i) {
    board.step();
    EXPECT_LT(board.output.axis[0].force, 0.01f);
  }
  EXPECT_EQ(board.application->state(0), DriveState::operation_enabled);
}

TEST(LatePoll, WallMovedOntoTheHandleAndArmedInOnePollIsRefused) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  board.command(0x06);
  board.hear(modbus::adu(
      1, modbus::multiple_request(address_of("wall.position"), words_for("wall.position", 0.0015))));
  board.hear_command(0x0F);
  board.application->poll(board.now);  // no tick in between
  EXPECT_NE(board.application->state(0), DriveState::operation_enabled);
  for (int i = 0; i < 5; ++i) {
    board.step();
    EXPECT_EQ(board.output.axis[0].force, 0.0f);
  }
  EXPECT_EQ(board.application->state(0), DriveState::switched_on);
}

TEST(LatePoll, SettingsTakenByATickInTheMiddleOfAPollAreNotJudgedByTheReportBefore) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  board.command(0x06);
  board.hear(modbus::adu(
      1, modbus::multiple_request(address_of("wall.position"), words_for("wall.position", 0.0015))));
  board.hear_command(0x0F);
  board.hear(modbus::adu(1, {6, 0x20, 0x40, 0, 0}));       // a third request, whose end is seen only below
  board.application->poll(board.now - 2000);               // the wall moves; the command waits for the tick
  board.tick();                                            // takes the settings
  (void)board.application->serial().reply_due(board.now);  // the third request, with the report from before
  EXPECT_NE(board.application->state(0), DriveState::operation_enabled);
  board.tick();
  EXPECT_FALSE(board.output.axis[0].enabled);
  board.step();
  EXPECT_EQ(board.application->state(0), DriveState::switched_on);
}

TEST(LatePoll, ATripThatTheMainLoopHasNotSeenYetIsNotWipedOutByDisarmingAndArming) {
  BareBoard board(0);
  board.preset("link.timeout", 0);
  ASSERT_TRUE(board.arm());
  board.count = static_cast<std::uint32_t>(-1000);
  board.tick();
  EXPECT_EQ(board.output.axis[0].force, 1.0f);
  board.valid = false;
  board.tick();
  EXPECT_EQ(board.output.axis[0].force, 0.0f);
  board.valid = true;
  board.tick();
  for (const unsigned word : {0x0Fu, 0x07u, 0x0Fu}) board.hear_command(word);
  for (int i = 0; i < 10; ++i) {
    board.step();
    EXPECT_EQ(board.output.axis[0].force, 0.0f);
  }
  EXPECT_EQ(board.application->state(0), DriveState::fault);
}

TEST(LatePoll, RequestHeardAfterTheClockWasReadIsNoSilence) {
  // reply_due() polls the line with a newer clock than poll() had.
  BareBoard board(0xFFFFFF00u);
  board.preset("link.timeout", 0.5);
  ASSERT_TRUE(board.arm());
  const std::uint32_t earlier = board.now;
  board.hear_command(0x0F);
  board.application->poll(earlier);
  (void)board.application->serial().reply_due(board.now + 1000);
  EXPECT_EQ(board.application->state(0), DriveState::operation_enabled);
}

TEST(SerialQueue, BytesLostBetweenInterruptAndMainLoopAreCounted) {
  BareBoard board(0);
  for (int i = 0; i < 600; ++i) board.application->serial().ISR_byte(0x55, false, board.now += 96);
  board.now += 5000;
  board.application->poll(board.now);
  board.step();
  EXPECT_EQ(board.read_input("counters.queue_overflows"), 600 - 512);
  EXPECT_EQ(board.read_input("counters.length_errors"), 1);
}

// The tick comes between any two calls of the main loop: nothing may depend on one tick per poll.
TEST(Interleaving, AnyNumberOfTicksBetweenPollsArmsAndDisarms) {
  for (const int ticks : {1, 2, 7}) {
    BareBoard board(0);
    board.preset("link.timeout", 0);
    board.preset("wall.stiffness_ceiling", 2000);
    const auto several = [&] {
      for (int i = 0; i < 8; ++i) {
        for (int t = 0; t < ticks; ++t) board.tick();
        board.application->poll(board.now += 50);
      }
    };
    board.hear_command(0x06);
    several();
    board.hear_command(0x0F);
    several();
    EXPECT_EQ(board.application->state(0), DriveState::operation_enabled) << ticks;
    board.preset("wall.stiffness", 2000);
    board.count = static_cast<std::uint32_t>(-1000);
    board.tick();
    EXPECT_EQ(board.output.axis[0].force, 2.0f) << ticks;
    board.hear_command(0x07);
    board.application->poll(board.now);
    board.tick();
    EXPECT_EQ(board.output.axis[0].force, 0.0f);
  }
}

}  // namespace
}  // namespace kmax::firmware::application_clock_test
