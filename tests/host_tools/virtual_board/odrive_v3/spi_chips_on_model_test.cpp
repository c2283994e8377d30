// drivers/stm32f4/spi_master.hpp, drv8301.hpp and as5047p_angle.hpp on the models of bus and chips.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "drivers/as5047p_angle.hpp"
#include "drivers/drv8301.hpp"
#include "drivers/stm32f4/spi_master.hpp"
#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"
#include "host_tools/virtual_board/odrive_v3/drv8301_chip.hpp"
#include "host_tools/virtual_board/stm32f4/spi.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::spi_chips_on_model_test {

using drivers::Drv8301Result;
using testing::RegisterOnModel;

constexpr BoardTime us = units_per_microsecond;

struct SpiOnModel {
  RegisterOnModel cr1, cr2, sr, dr;
};

/// SPI3 with the chips that hang on it.
struct SpiBench : testing::ModelBench {
  SpiBench() : ModelBench({&model}) {
    clocks.apb1 = units_per_period(42'000'000);
    access_time = 12;  // a load or store on APB1 and the instructions around it: six core cycles
    model.on_frame([this](std::uint16_t mosi, BoardTime at) { return wire(mosi, at); });
  }
  std::uint16_t wire(std::uint16_t mosi, BoardTime at) {
    // Pulled up: who does not drive leaves ones, who drives pulls down.
    std::uint16_t miso = 0xFFFF;
    for (Drv8301Chip* chip : {&gate_driver_0, &gate_driver_1}) {
      if (const auto reply = chip->exchange(mosi, at)) miso &= *reply;
    }
    if (const auto reply = encoder.exchange(mosi, at, model.frame_began())) miso &= *reply;
    return miso;
  }

  SpiModel model{clocks};
  SpiOnModel registers = block_on_model<SpiOnModel>(*this, model);
  drivers::stm32f4::SpiMaster<SpiOnModel> master{registers};
  std::int64_t angle = 0;
  Drv8301Chip gate_driver_0, gate_driver_1;
  As5047pChip encoder{[this](BoardTime) { return angle; }};
};

/// drivers::SpiChip for one chip of the bench: `set_level(bool level)` moves its select pin.
struct SelectedChip {
  SpiBench& bench;
  std::function<void(bool level)> set_level;

  void select(bool active) {
    EXPECT_FALSE(bench.model.busy()) << "the select moves while a frame is under way";
    set_level(!active);
  }
  std::optional<std::uint16_t> exchange(std::uint16_t word) { return bench.master.exchange(word); }
  void delay_us(std::uint32_t microseconds) { bench.run(microseconds * us); }
};

struct Board : SpiBench {
  Board() {
    EXPECT_TRUE(master.configure({}));
    for (Drv8301Chip* chip : {&gate_driver_0, &gate_driver_1}) chip->enable_gate(true, now);
    run(20'000 * us);
  }
  SelectedChip line_0{*this, [this](bool level) { gate_driver_0.select(level, now); }};
  SelectedChip line_1{*this, [this](bool level) { gate_driver_1.select(level, now); }};
  drivers::Drv8301<SelectedChip> driver_0{line_0};
  drivers::Drv8301<SelectedChip> driver_1{line_1};
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
    RC_ASSERT(result != Drv8301Result::bad_configuration);
  }
}

TEST(SpiChipsOnModel, GateOffIsNamedAndNotTakenForHealth) {
  Board board;
  ASSERT_EQ(board.driver_0.configure({}), Drv8301Result::ok);
  board.gate_driver_0.enable_gate(false, board.now);
  EXPECT_EQ(board.driver_0.configure({}), Drv8301Result::stuck_high);
  board.run(30 * us);
  board.gate_driver_0.enable_gate(true, board.now);
  board.run(20'000 * us);
  EXPECT_NE(board.gate_driver_0.control(0), 0x550) << "the chip has forgotten";
  EXPECT_EQ(board.driver_0.configure({}), Drv8301Result::ok);
}

TEST(SpiChipsOnModel, SplitTransferRunsWhileTheTickWorks) {
  Board board;
  drivers::As5047pAngle angle;
  board.angle = 100;
  std::uint32_t begin = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    ASSERT_TRUE(board.master.claim());
    board.encoder.select(false, board.now);
    board.run(1 * us);
    const BoardTime called = board.now;
    ASSERT_TRUE(board.master.start(angle.ISR_command()));
    EXPECT_LT(board.now - called, units_per_microsecond / 2) << "nobody waits";
    EXPECT_FALSE(board.master.ready());
    board.run(7 * us);  // the other axis is computed
    ASSERT_TRUE(board.master.ready());
    board.encoder.select(true, board.now);
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

}  // namespace kmax::virtual_board::spi_chips_on_model_test
