#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "drivers/stm32f4/registers/spi.hpp"
#include "drivers/stm32f4/spi_master.hpp"
#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"
#include "host_tools/virtual_board/odrive_v3/drv8301_chip.hpp"
#include "host_tools/virtual_board/stm32f4/spi.hpp"

// SPI3 with the chips that hang on it, and time that passes with every register access.

namespace kmax::virtual_board::testing {

struct SpiBench {
  /// A load or store on APB1 and the instructions around it: six core cycles.
  static constexpr BoardTime access_time = 12;

  class Register {
   public:
    Register(SpiBench& bench, std::size_t offset)
        : bench_(&bench), offset_(static_cast<std::uint32_t>(offset)) {}
    explicit operator std::uint32_t() const {
      bench_->run(access_time);
      return bench_->model.read({offset_, 4, bench_->now});
    }
    Register& operator=(std::uint32_t word) {
      bench_->run(access_time);
      bench_->model.write({offset_, 4, bench_->now}, word);
      return *this;
    }

   private:
    SpiBench* bench_;
    std::uint32_t offset_;
  };
  struct Registers {
    explicit Registers(SpiBench& bench)
        : cr1{bench, offsetof(drivers::stm32f4::SpiRegisters, cr1)},
          cr2{bench, offsetof(drivers::stm32f4::SpiRegisters, cr2)},
          sr{bench, offsetof(drivers::stm32f4::SpiRegisters, sr)},
          dr{bench, offsetof(drivers::stm32f4::SpiRegisters, dr)} {}
    Register cr1, cr2, sr, dr;
  };

  SpiBench() {
    clocks.apb1 = units_per_period(42'000'000);
    model.on_frame([this](std::uint16_t mosi, BoardTime at) { return wire(mosi, at); });
  }
  SpiBench(const SpiBench&) = delete;

  void run(BoardTime duration) {
    const BoardTime end = now + duration;
    for (BoardTime event = model.next_event(); event <= end; event = model.next_event()) {
      now = event;
      model.advance(now);
    }
    now = end;
  }

  std::uint16_t wire(std::uint16_t mosi, BoardTime at) {
    sent.push_back(mosi);
    // Pulled up: who does not drive leaves ones, who drives pulls down.
    std::uint16_t miso = 0xFFFF;
    for (Drv8301Chip* chip : {&gate_driver_0, &gate_driver_1}) {
      if (const auto reply = chip->exchange(mosi, at)) miso &= *reply;
    }
    if (const auto reply = encoder.exchange(mosi, at)) miso &= *reply;
    return miso;
  }

  BoardClocks clocks;
  BoardTime now = 1000;
  SpiModel model{clocks};
  Registers registers{*this};
  drivers::stm32f4::SpiMaster<Registers> master{registers};
  std::int64_t angle = 0;
  Drv8301Chip gate_driver_0, gate_driver_1;
  As5047pChip encoder{[this](BoardTime) { return angle; }};
  std::vector<std::uint16_t> sent;
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
  void delay_us(std::uint32_t us) { bench.run(us * units_per_microsecond); }
};

}  // namespace kmax::virtual_board::testing
