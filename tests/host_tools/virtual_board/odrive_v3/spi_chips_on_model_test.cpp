// drivers/stm32f4/spi_master.hpp, drv8301.hpp, as5047p.hpp and as5047p_angle.hpp on the models of bus and
// chips.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "drivers/as5047p.hpp"
#include "drivers/as5047p_angle.hpp"
#include "drivers/drv8301.hpp"
#include "tests/host_tools/virtual_board/stm32f4/spi_on_model.hpp"

namespace kmax::virtual_board::spi_chips_on_model_test {
namespace {

using drivers::As5047pResult;
using drivers::Drv8301Fault;
using drivers::Drv8301Result;
using testing::SelectedChip;
using testing::SpiBench;

constexpr BoardTime us = units_per_microsecond;

struct Board : SpiBench {
  Board() {
    EXPECT_TRUE(master.configure({}));
    for (Drv8301Chip* chip : {&gate_driver_0, &gate_driver_1}) chip->enable_gate(true, now);
    run(20'000 * us);
  }
  SelectedChip line_0{*this, [this](bool level) { gate_driver_0.select(level, now); }};
  SelectedChip line_1{*this, [this](bool level) { gate_driver_1.select(level, now); }};
  SelectedChip encoder_line{*this, [this](bool level) { encoder.select(level); }};
  drivers::Drv8301<SelectedChip> driver_0{line_0};
  drivers::Drv8301<SelectedChip> driver_1{line_1};
  drivers::As5047p<SelectedChip> angle_sensor{encoder_line};
};

TEST(SpiChipsOnModel, BothGateDriversOnOneBus) {
  Board board;
  const BoardTime begin = board.now;
  ASSERT_EQ(board.driver_0.configure({.gain = drivers::CurrentSenseGain::x20}), Drv8301Result::ok);
  EXPECT_LT(board.now - begin, 110 * us) << "ten frames";
  ASSERT_EQ(board.driver_1.configure({.gain = drivers::CurrentSenseGain::x80}), Drv8301Result::ok);
  EXPECT_EQ(board.gate_driver_0.gain(), drivers::CurrentSenseGain::x20);
  EXPECT_EQ(board.gate_driver_1.gain(), drivers::CurrentSenseGain::x80);
  EXPECT_EQ(board.gate_driver_0.control(0), 0x550);
  EXPECT_EQ(board.driver_0.read_status().result, Drv8301Result::ok);
  ASSERT_EQ(board.driver_1.set_offset_calibration(true), Drv8301Result::ok);
  EXPECT_TRUE(board.gate_driver_1.calibrating());
  EXPECT_FALSE(board.gate_driver_0.calibrating());
  EXPECT_EQ(board.master.counters().time_outs + board.master.counters().overruns, 0U);
}

// Any number of lost writes and disturbed replies: configured in the end, or named.
RC_GTEST_PROP(SpiChipsOnModel, ConfiguredOrNamed, ()) {
  Board board;
  const auto lost = *rc::gen::inRange(0U, 12U);
  const auto noise = *rc::gen::container<std::vector<std::uint16_t>>(
      60, rc::gen::weightedOneOf<std::uint16_t>(
              {{5, rc::gen::just<std::uint16_t>(0)}, {1, rc::gen::arbitrary<std::uint16_t>()}}));
  board.gate_driver_0.lose_writes(lost);
  std::size_t frames = 0;
  board.model.on_frame([&](std::uint16_t mosi, BoardTime at) {
    const std::uint16_t flips = frames < noise.size() ? noise[frames] : std::uint16_t{0};
    ++frames;
    return static_cast<std::uint16_t>(board.wire(mosi, at) ^ flips);
  });
  const Drv8301Result result = board.driver_0.configure({});
  RC_ASSERT(frames <= 60U);
  if (result == Drv8301Result::ok) {
    RC_ASSERT(board.gate_driver_0.control(0) == 0x550);
    RC_ASSERT(board.gate_driver_0.control(1) == 0x008);
  } else {
    RC_ASSERT(std::string(drivers::drv8301_result_text(result)) != "?");
  }
}

TEST(SpiChipsOnModel, GateOffIsNamedAndNotTakenForHealth) {
  Board board;
  ASSERT_EQ(board.driver_0.configure({}), Drv8301Result::ok);
  board.gate_driver_0.enable_gate(false, board.now);
  EXPECT_EQ(board.driver_0.read_status().result, Drv8301Result::stuck_high);
  EXPECT_EQ(board.driver_0.configure({}), Drv8301Result::stuck_high);
  board.run(30 * us);
  board.gate_driver_0.enable_gate(true, board.now);
  board.run(20'000 * us);
  EXPECT_EQ(board.driver_0.read_status().result, Drv8301Result::configuration_lost);
  EXPECT_EQ(board.driver_0.configure({}), Drv8301Result::ok);
}

TEST(SpiChipsOnModel, FaultsArriveByName) {
  Board board;
  ASSERT_EQ(board.driver_0.configure({}), Drv8301Result::ok);
  board.gate_driver_0.over_current(Drv8301Fault::over_current_c_low, board.now);
  EXPECT_FALSE(board.gate_driver_0.fault_output()) << "latched shut-down: nFAULT falls";
  const auto status = board.driver_0.read_status();
  EXPECT_EQ(status.result, Drv8301Result::ok);
  EXPECT_TRUE(status.faults.has(Drv8301Fault::over_current_c_low));
  EXPECT_TRUE(status.faults.has(Drv8301Fault::fault));
  EXPECT_EQ(board.driver_1.probe(), Drv8301Result::ok);
}

TEST(SpiChipsOnModel, EncoderIsDiagnosed) {
  Board board;
  EXPECT_EQ(board.angle_sensor.diagnose().result, As5047pResult::ok);
  board.encoder.set_diagnostics(0x9FF);
  EXPECT_EQ(board.angle_sensor.diagnose().result, As5047pResult::field_too_weak);
  board.encoder.disturb_next_command(0x0400);
  EXPECT_EQ(board.angle_sensor.diagnose().result, As5047pResult::field_too_weak) << "EF, ERRFL, again";
  EXPECT_EQ(board.angle_sensor.chip_errors(), 1U);
  board.encoder.set_fitted(false);
  EXPECT_EQ(board.angle_sensor.diagnose().result, As5047pResult::stuck_high);
}

TEST(SpiChipsOnModel, SplitTransferRunsWhileTheTickWorks) {
  Board board;
  drivers::As5047pAngle angle;
  board.angle = 100;
  std::uint32_t begin = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    ASSERT_TRUE(board.master.claim());
    board.encoder.select(false);
    const BoardTime called = board.now;
    ASSERT_TRUE(board.master.start(angle.ISR_command()));
    EXPECT_LT(board.now - called, units_per_microsecond / 2) << "nobody waits";
    EXPECT_FALSE(board.master.ready());
    board.run(7 * us);  // the other axis is computed
    ASSERT_TRUE(board.master.ready());
    board.encoder.select(true);
    const auto word = board.master.finish();
    board.master.release();
    ASSERT_TRUE(word.has_value());
    const auto sample = angle.ISR_decode(*word);
    board.angle += 37;
    board.run(40 * us);
    if (tick == 5) begin = sample.count;
    if (tick > 5) {
      ASSERT_TRUE(sample.valid && !sample.held) << tick;
      ASSERT_EQ(sample.count - begin, static_cast<std::uint32_t>(37 * (tick - 5)));
    }
  }
}

TEST(SpiChipsOnModel, WholeFrameTakesSixMicroseconds) {
  Board board;
  const BoardTime begin = board.now;
  ASSERT_TRUE(board.master.exchange(0xC000).has_value());
  EXPECT_GT(board.now - begin, 6 * us);
  EXPECT_LT(board.now - begin, 7 * us);
}

}  // namespace
}  // namespace kmax::virtual_board::spi_chips_on_model_test
