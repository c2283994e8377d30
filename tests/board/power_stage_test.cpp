#include "board/power/power_stage.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace kmax::board::power_stage_test {
namespace {

using firmware::Fault;

constexpr std::size_t another(std::size_t axis) {
  return (axis + 1) % 2;
}

struct Hardware {
  bool gate = false, fault_low = false, stop_open = false;
  GateDriverAnswer answers[2] = {GateDriverAnswer::accepted, GateDriverAnswer::accepted};
  bool missing[2] = {}, names_cause[2] = {};
  OffsetProgress offsets = OffsetProgress::accepted;
  bool offsets_hold = true;
  mutable int looks_for_spike = 0;
  int gate_rises = 0, configured = 0, calibrations = 0, tracked = 0;
  int looks[2] = {};

  void set_gate_enable(bool level) {
    gate_rises += level && !gate ? 1 : 0;
    gate = level;
  }
  bool fault_line_low() const { return fault_low; }
  bool emergency_stop_open() const { return stop_open || looks_for_spike-- > 0; }
  bool in_service(std::size_t axis) const { return !missing[axis]; }
  bool is_missing(std::size_t axis) const { return missing[axis]; }
  void set_missing(std::size_t axis) { missing[axis] = true; }
  bool note_gate_driver_faults(std::size_t axis) {
    EXPECT_TRUE(gate) << "a reset has wiped them out";
    EXPECT_FALSE(missing[axis]);
    ++looks[axis];
    return names_cause[axis];
  }
  GateDriverAnswer configure_gate_driver(std::size_t axis) {
    EXPECT_TRUE(gate) << "the chips do not answer while EN_GATE is low";
    EXPECT_FALSE(missing[axis]);
    ++configured;
    return answers[axis];
  }
  void restart_offset_calibration() { ++calibrations; }
  OffsetProgress offset_progress() const { return offsets; }
  bool track_offsets() {
    ++tracked;
    return offsets_hold;
  }
};

class PowerStageTest : public testing::Test {
 protected:
  void run(std::uint32_t duration_us, bool armed = false) {
    for (const std::uint32_t end = now + duration_us; now != end; now += 100) stage.poll(now, armed);
  }

  Hardware hardware;
  PowerStage<Hardware> stage{hardware};
  std::uint32_t now = 0xFFFF'FF9C - 10'000;  // the clock wraps while it starts
};

TEST_F(PowerStageTest, ADriverThatPullsTheFaultLineWhileItIsSilentIsThere) {
  hardware.answers[1] = GateDriverAnswer::silent;
  hardware.fault_low = true;
  run(3'000'000);
  EXPECT_FALSE(hardware.missing[1]);
  EXPECT_EQ(stage.condition(), Fault::power_stage);
  hardware.answers[1] = GateDriverAnswer::accepted;
  hardware.fault_low = false;
  run(500'000);
  EXPECT_TRUE(stage.ready());
}

TEST_F(PowerStageTest, ADriverThatPullsTheFaultLineIsNamedBesideOneThatDoesNotAnswer) {
  for (const GateDriverAnswer other : {GateDriverAnswer::silent, GateDriverAnswer::faulty}) {
    for (const std::size_t axis : {0U, 1U}) {
      Hardware board;
      PowerStage<Hardware> faulty{board};
      board.answers[another(axis)] = other;
      board.fault_low = board.names_cause[axis] = true;
      std::uint32_t at = 0;
      for (; at < 1'000'000; at += 100) faulty.poll(at, false);
      EXPECT_EQ(faulty.condition(), Fault::gate_driver);
      EXPECT_EQ(board.looks[axis], board.gate_rises) << "once before each reset";
      EXPECT_FALSE(board.missing[0] || board.missing[1]);
      board.fault_low = board.names_cause[axis] = false;
      for (; at < 2'000'000; at += 100) faulty.poll(at, false);
      EXPECT_EQ(board.missing[another(axis)], other == GateDriverAnswer::silent);
      EXPECT_EQ(faulty.condition(), other == GateDriverAnswer::silent ? Fault::none : Fault::power_stage);
    }
  }
}

TEST_F(PowerStageTest, IsNotReadyBeforeItHasRun) {
  EXPECT_EQ(stage.condition(), Fault::power_stage);
  EXPECT_FALSE(stage.ready());
}

TEST_F(PowerStageTest, WaitsForTheChipsBeforeItWritesToThem) {
  run(20'900);
  EXPECT_EQ(hardware.configured, 0);
  EXPECT_EQ(stage.condition(), Fault::power_stage);
  run(500);
  EXPECT_EQ(hardware.configured, 2);
  EXPECT_TRUE(stage.ready());
  EXPECT_EQ(stage.condition(), Fault::none);
}

TEST_F(PowerStageTest, TracksTheOffsetsEachMillisecondFromThenOnAlsoWhileArmed) {
  run(21'000);
  EXPECT_EQ(hardware.tracked, 0);
  run(1'000'000, true);
  EXPECT_NEAR(hardware.tracked, 1000, 2);
  hardware.offsets_hold = false;
  run(1'100, true);
  EXPECT_EQ(stage.condition(), Fault::current_sense);
  EXPECT_TRUE(hardware.gate) << "until nobody drives any more, and its reason can be read";
  hardware.offsets_hold = true;
  const int calibrations = hardware.calibrations;
  run(250'000);
  EXPECT_EQ(hardware.calibrations, calibrations + 1);
  EXPECT_EQ(stage.condition(), Fault::none);
}

TEST_F(PowerStageTest, WaitsForTheOffsets) {
  hardware.offsets = OffsetProgress::running;
  run(500'000);
  EXPECT_EQ(stage.condition(), Fault::power_stage);
  hardware.offsets = OffsetProgress::accepted;
  run(200);
  EXPECT_TRUE(stage.ready());
}

TEST_F(PowerStageTest, ABoardWhoseChipsDoNotAnswerIsTriedAgain) {
  hardware.answers[0] = hardware.answers[1] = GateDriverAnswer::silent;
  run(3'000'000);
  EXPECT_EQ(stage.condition(), Fault::power_stage);
  EXPECT_GE(hardware.gate_rises, 12);
  EXPECT_FALSE(hardware.missing[0] || hardware.missing[1]) << "the supply is not there";
  hardware.answers[0] = hardware.answers[1] = GateDriverAnswer::accepted;
  run(300'000);
  EXPECT_TRUE(stage.ready());
}

// Either of the two, and only when it has been silent three times beside one that answers.
TEST_F(PowerStageTest, AChipThatHasNeverAnsweredIsMissingAndTheOtherGoesOn) {
  for (const std::size_t axis : {0U, 1U}) {
    Hardware board;
    PowerStage<Hardware> other{board};
    board.answers[axis] = GateDriverAnswer::silent;
    for (std::uint32_t at = 0; at < 450'000; at += 100) {
      other.poll(at, false);
      EXPECT_FALSE(board.missing[axis]);
      EXPECT_EQ(other.condition(), Fault::power_stage);
    }
    for (std::uint32_t at = 450'000; at < 500'000; at += 100) other.poll(at, false);
    EXPECT_TRUE(board.missing[axis]);
    EXPECT_FALSE(board.missing[another(axis)]);
    EXPECT_TRUE(other.ready());
    EXPECT_EQ(other.condition(), Fault::none);
  }
}

TEST_F(PowerStageTest, OnlyAChipThatNeverAnsweredAndIsSilentIsMissing) {
  using enum GateDriverAnswer;
  struct Row {
    GateDriverAnswer first, then;
    bool missing, ready;
  };
  for (const Row& row : {Row{silent, accepted, false, true},
                         // Has answered and falls silent: a fault of the board.
                         {accepted, silent, false, false},
                         // Whatever disturbed the line at first was no answer.
                         {faulty, silent, true, true},
                         {faulty, faulty, false, false},
                         {bus_busy, bus_busy, false, false},
                         {bus_busy, silent, true, true}}) {
    SCOPED_TRACE(testing::Message() << static_cast<int>(row.first) << static_cast<int>(row.then));
    Hardware board;
    PowerStage<Hardware> other{board};
    board.answers[1] = row.first;
    std::uint32_t at = 0;
    for (; at < 300'000; at += 100) other.poll(at, false);
    EXPECT_EQ(other.ready(), row.first == accepted);
    board.answers[1] = row.then;
    if (other.ready()) other.restart(at);
    for (; at < 5'300'000; at += 100) other.poll(at, false);
    EXPECT_EQ(board.missing[1], row.missing);
    EXPECT_EQ(other.ready(), row.ready);
    EXPECT_EQ(other.condition(), row.ready ? Fault::none : Fault::power_stage);
  }
}

// A look takes back what it shows: there is one for each fall of the line, before the reset.
TEST_F(PowerStageTest, TheDriversAreAskedOnceWhyTheLineFellWhoeverIsArmed) {
  run(100'000);
  ASSERT_TRUE(stage.ready());
  EXPECT_EQ(hardware.looks[0] + hardware.looks[1], 0);
  for (const bool armed : {true, false}) {
    hardware.looks[0] = hardware.looks[1] = 0;
    stage.ISR_take(PowerStage<Hardware>::Line::fault);
    for (int i = 0; i < 5; ++i) stage.poll(now += 100, armed);
    run(100'000);
    EXPECT_TRUE(stage.ready());
    EXPECT_EQ(hardware.looks[0], 1);
    EXPECT_EQ(hardware.looks[1], 1);
  }
}

TEST_F(PowerStageTest, ALineThatStaysLowIsAskedAboutAtEachTryToStart) {
  hardware.fault_low = true;
  run(1'000'000);
  EXPECT_EQ(hardware.looks[0], hardware.gate_rises);
  EXPECT_GE(hardware.looks[1], 4);
}

TEST_F(PowerStageTest, OffsetsOutOfBoundsAreNamedAndMeasuredAgain) {
  hardware.offsets = OffsetProgress::refused;
  run(100'000);
  EXPECT_EQ(stage.condition(), Fault::current_sense);
  hardware.offsets = OffsetProgress::accepted;
  run(300'000);
  EXPECT_TRUE(stage.ready());
  EXPECT_GE(hardware.calibrations, 2);
}

TEST_F(PowerStageTest, AFaultEdgeActsAtOnceAndIsResetOnlyWhenNobodyIsArmed) {
  run(100'000);
  ASSERT_TRUE(stage.ready());
  stage.ISR_take(PowerStage<Hardware>::Line::fault);  // a pulse: the line is high again
  EXPECT_EQ(stage.condition(), Fault::gate_driver);
  run(50'000, true);
  EXPECT_TRUE(hardware.gate) << "the other axis may still be braking";
  EXPECT_EQ(stage.condition(), Fault::gate_driver);
  run(100'000, false);
  EXPECT_EQ(stage.condition(), Fault::none);
  EXPECT_EQ(hardware.gate_rises, 2);
}

TEST_F(PowerStageTest, AFaultThatStaysKeepsTheBridgesOff) {
  run(100'000);
  hardware.fault_low = true;
  stage.ISR_take(PowerStage<Hardware>::Line::fault);
  run(2'000'000);
  EXPECT_EQ(stage.condition(), Fault::gate_driver);
  hardware.fault_low = false;
  run(300'000);
  EXPECT_EQ(stage.condition(), Fault::none);
}

TEST_F(PowerStageTest, AFaultLineThatIsLowWithoutAnEdgeIsSeenToo) {
  run(100'000);
  hardware.fault_low = true;
  run(100);
  EXPECT_EQ(stage.condition(), Fault::gate_driver);
}

TEST_F(PowerStageTest, TheEmergencyStopLeavesTheBrakesSupplyOn) {
  run(100'000);
  hardware.stop_open = true;
  stage.ISR_take(PowerStage<Hardware>::Line::emergency_stop);
  EXPECT_EQ(stage.condition(), Fault::emergency_stop);
  run(100'000, false);
  EXPECT_TRUE(hardware.gate);
  EXPECT_EQ(hardware.gate_rises, 1);
  EXPECT_EQ(stage.condition(), Fault::emergency_stop);
  hardware.stop_open = false;
  run(100'000, true);
  EXPECT_EQ(stage.condition(), Fault::emergency_stop) << "an armed axis has not yet seen it";
  run(200, false);
  EXPECT_EQ(stage.condition(), Fault::none);
}

TEST_F(PowerStageTest, InterferenceAtTheLineIsNoStopAndWhatLastsOrKeepsComingIs) {
  run(100'000);
  for (const auto& [looks, stops] : {std::pair{1, false}, {10, false}, {16, false}, {27, true}}) {
    hardware.looks_for_spike = looks;
    stage.poll(now += 100, true);
    EXPECT_EQ(stage.condition(), stops ? Fault::emergency_stop : Fault::none) << looks;
  }
  EXPECT_TRUE(drivers::ISR_is_meant([n = 0]() mutable { return ++n % 10 == 0; }))
      << "never at rest for long enough";
  EXPECT_FALSE(drivers::ISR_is_meant([n = 0]() mutable { return ++n % 11 == 0; }));
}

TEST_F(PowerStageTest, AStopPressedSincePowerUpIsSeenWithoutAnEdge) {
  hardware.stop_open = true;
  run(200'000);
  EXPECT_EQ(stage.condition(), Fault::emergency_stop);
}

}  // namespace
}  // namespace kmax::board::power_stage_test
