#pragma once

#include <cstdint>
#include <optional>

#include "board/odrive_v3/description.hpp"
#include "board/odrive_v3/pins.hpp"
#include "board/power/power_stage.hpp"
#include "drivers/cortex_m/cycle_counter.hpp"
#include "drivers/current_sense.hpp"
#include "drivers/drv8301.hpp"
#include "drivers/stm32f4/gpio.hpp"
#include "drivers/stm32f4/spi_master.hpp"

namespace kmax::board::odrive_v3 {

using ChipBus = drivers::stm32f4::SpiMaster<>;

/// The two DRV8301 behind SPI3. Main loop only; the bus is claimed for each conversation, so that the tick's
/// encoder frames and these never mix.
class GateDrivers {
 public:
  explicit GateDrivers(ChipBus& bus) : bus_(bus) {}

  /// Both control registers written and read back.
  GateDriverAnswer configure(std::size_t axis, drivers::CurrentSenseGain gain) {
    if (!claim()) return GateDriverAnswer::bus_busy;
    Selected chip = select(axis);
    drivers::Drv8301<Selected> driver{chip};
    drivers::Drv8301Config config;
    config.gain = gain;
    using enum drivers::Drv8301Result;
    const drivers::Drv8301Result result = driver.configure(config);
    // A line that nobody drives also ends what had begun well.
    const bool silent = (result == stuck_high || result == stuck_low) && driver.probe() == result;
    bus_.release();
    if (result == ok) return GateDriverAnswer::accepted;
    return silent ? GateDriverAnswer::silent : GateDriverAnswer::faulty;
  }

  /// In the bits of drive.gate_driver_faults: drivers::Drv8301Fault.
  std::uint16_t read_faults(std::size_t axis) {
    constexpr auto no_answer = static_cast<std::uint16_t>(drivers::Drv8301Fault::no_answer);
    if (!claim()) return no_answer;
    Selected chip = select(axis);
    const std::optional<std::uint16_t> faults = drivers::Drv8301<Selected>{chip}.faults();
    bus_.release();
    return faults.value_or(no_answer);
  }

 private:
  bool claim() {
    // The tick's frame holds the bus for 25 us.
    bool claimed = bus_.claim();
    for (unsigned attempt = 0; attempt < 10 && !claimed; ++attempt) {
      delay_us(10);
      claimed = bus_.claim();
    }
    return claimed;
  }

  static void delay_us(std::uint32_t microseconds) {
    // By the cycle counter; longer on a slower clock, which these delays may be.
    constexpr std::uint32_t cycles_per_us = description.core_clock_hz / 1'000'000;
    drivers::cortex_m::CycleCounter counter{drivers::cortex_m::dwt(), drivers::cortex_m::core_debug()};
    const std::uint32_t start = counter.now();
    // Bounded in case the counter stands still.
    for (std::uint32_t spins = 0;
         counter.since(start) < microseconds * cycles_per_us && spins < 1000 * microseconds; ++spins) {
    }
  }

  /// One chip on the bus (drivers::SpiChip).
  class Selected {
   public:
    Selected(ChipBus& bus, PinLocation select)
        : bus_(bus), pin_(drivers::stm32f4::gpio(select.port), select.number) {}

    void select(bool selected) { pin_.write(!selected); }
    std::optional<std::uint16_t> exchange(std::uint16_t word) { return bus_.exchange(word); }
    void delay_us(std::uint32_t microseconds) { GateDrivers::delay_us(microseconds); }

   private:
    ChipBus& bus_;
    drivers::stm32f4::GpioPin<> pin_;
  };

  Selected select(std::size_t axis) {
    return {bus_, axis == 0 ? pins::gate_driver0_select : pins::gate_driver1_select};
  }

  ChipBus& bus_;
};

}  // namespace kmax::board::odrive_v3
