#include "board/power/serial_encoder.hpp"

#include <gtest/gtest.h>

namespace kmax::board::serial_encoder_test {
namespace {

/// An AS5047P on a bus that the main loop may take.
struct Bus {
  bool claim() {
    if (taken) return false;
    return taken = true;
  }
  void release() { taken = false; }
  bool start(std::uint16_t command) {
    EXPECT_TRUE(selected);
    if (unfetched) return false;
    unfetched = true;
    reply = pending;
    pending = drivers::as5047p::with_parity(command == 0xFFFF ? static_cast<std::uint16_t>(position & 0x3FFF)
                                                              : std::uint16_t{0});
    return true;
  }
  bool ready() const { return over && unfetched; }
  std::optional<std::uint16_t> finish() {
    if (!ready()) return std::nullopt;
    unfetched = false;
    return reply;
  }

  bool taken = false, selected = false, over = true, unfetched = false;
  std::uint16_t reply = 0, pending = 0;
  int position = 0;
};
struct Select {
  void write(bool level) { bus->selected = !level; }
  Bus* bus;
};

struct Board {
  drivers::As5047pSample tick(int position) {
    bus.position = position;
    encoder.ISR_select();
    if (encoder.ISR_selected()) encoder.ISR_begin();
    return encoder.ISR_take();
  }
  drivers::As5047pSample ticks(int count, int position) {
    drivers::As5047pSample sample;
    for (int i = 0; i < count; ++i) sample = tick(position);
    return sample;
  }
  /// More than a turn from where it began.
  void start_at_twenty_thousand() {
    for (int position = 16'000; position <= 20'000; position += 50) tick(position);
    ASSERT_EQ(ticks(2, 20'000).count, 20'000U);
  }
  Bus bus;
  SerialEncoder<Bus, Select> encoder{bus, Select{&bus}};
};

TEST(SerialEncoder, ABusThatWasTakenForMillisecondsCostsNoTurnAndForLongerTheTurnsWhichItSays) {
  struct Row {
    int ticks, position;
    std::uint32_t count, generation;
  };
  for (const Row& row : {Row{60, 20'100, 20'100, 0}, Row{1000, 20'000, 3616, 1}}) {
    Board board;
    board.start_at_twenty_thousand();
    board.bus.taken = true;
    EXPECT_FALSE(board.ticks(row.ticks, row.position).valid);
    board.bus.taken = false;
    const auto sample = board.ticks(10, row.position);
    EXPECT_TRUE(sample.valid);
    EXPECT_EQ(sample.count, row.count);
    EXPECT_EQ(sample.reference_generation, row.generation);
    EXPECT_FALSE(board.bus.taken || board.bus.selected);
  }
}

// As while flash is written, which holds up the ticks: it was invalid until the next start of the board.
TEST(SerialEncoder, FramesThatAreNotOverInTimeCostNoMoreThanABusThatWasTaken) {
  Board board;
  board.start_at_twenty_thousand();
  board.bus.over = false;
  EXPECT_FALSE(board.ticks(60, 20'100).valid);
  board.bus.over = true;
  EXPECT_TRUE(board.ticks(10, 20'100).valid);
  EXPECT_EQ(board.tick(20'100).count, 20'100U);
  EXPECT_FALSE(board.bus.taken || board.bus.selected);
}

TEST(SerialEncoder, ARestartOfAnEncoderThatIsReadKeepsTheTurns) {
  Board board;
  board.start_at_twenty_thousand();
  board.encoder.restart();
  EXPECT_FALSE(board.tick(20'000).valid);
  EXPECT_EQ(board.ticks(10, 20'000).count, 20'000U);
}

TEST(SerialEncoder, AfterATimeInWhichNobodyReadTheTurnsAreUnknown) {
  Board board;
  board.start_at_twenty_thousand();
  board.encoder.restart_without_turns();
  const auto sample = board.ticks(10, 20'000);
  EXPECT_TRUE(sample.valid);
  EXPECT_EQ(sample.count, 3616U);
  EXPECT_EQ(sample.reference_generation, 1U);
}

// A jump is the encoder's own doing: only the main loop forgives it.
TEST(SerialEncoder, AFaultOfTheEncoderStaysAlsoWhenTheBusWasTakenThen) {
  Board board;
  board.start_at_twenty_thousand();
  EXPECT_FALSE(board.ticks(10, 25'000).valid);
  board.bus.taken = true;
  board.tick(25'000);
  board.bus.taken = false;
  EXPECT_FALSE(board.ticks(10, 25'000).valid);
  board.encoder.restart();
  EXPECT_TRUE(board.ticks(10, 25'000).valid);
}

TEST(SerialEncoder, AMissedFrameBehindOthersThatWereWrongForgivesNothing) {
  Board board;
  board.start_at_twenty_thousand();
  board.ticks(5, 25'000);  // the reply comes one frame late: four jumps
  board.bus.taken = true;
  EXPECT_FALSE(board.tick(25'000).valid);
  board.bus.taken = false;
  EXPECT_FALSE(board.ticks(20, 25'000).valid);
}

}  // namespace
}  // namespace kmax::board::serial_encoder_test
