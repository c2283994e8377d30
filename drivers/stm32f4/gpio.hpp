#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/gpio.hpp"

// One pin of a GPIO port: mode, alternate function, pull resistor, edge speed, level. RM0090 chapter on GPIO.
//
// `configure` changes only the fields of its own pin and orders the writes so that no wrong level appears:
// the output level is set before the pin becomes an output, the alternate function is chosen before the pin
// is handed to it. It reads, modifies and writes whole port registers, so call it from one context only
// (start-up). `write` is a single store to BSRR and may be called from any context.

namespace kmax::drivers::stm32f4 {

enum class GpioMode : std::uint8_t { input, output, alternate, analog };
enum class GpioOutput : std::uint8_t { push_pull, open_drain };
enum class GpioSpeed : std::uint8_t { low, medium, high, very_high };
enum class GpioPull : std::uint8_t { none, up, down };  // 30 to 50 kOhm; PA10 and PB12 8 to 15 kOhm

struct GpioConfig {
  GpioMode mode = GpioMode::input;
  GpioPull pull = GpioPull::none;
  GpioSpeed speed = GpioSpeed::low;
  GpioOutput output = GpioOutput::push_pull;
  bool initial_level = false;           // outputs only
  std::uint8_t alternate_function = 0;  // 0 to 15; mode `alternate` only
};

/// Where a pin is, for a board's pin table.
struct PinLocation {
  GpioPort port;
  std::uint8_t number;  // 0 to 15

  friend constexpr bool operator==(const PinLocation&, const PinLocation&) = default;
};

template <typename Registers = GpioRegisters>
class GpioPin {
 public:
  /// `number` 0 to 15; higher bits are ignored.
  constexpr GpioPin(Registers& port, unsigned number) : port_(port), number_(number & 0xFU) {}

  void configure(const GpioConfig& config) {
    if (config.mode == GpioMode::output) write(config.initial_level);
    replace(port_.otyper, number_, 1, static_cast<std::uint32_t>(config.output));
    replace(port_.ospeedr, 2 * number_, 2, static_cast<std::uint32_t>(config.speed));
    replace(port_.pupdr, 2 * number_, 2, static_cast<std::uint32_t>(config.pull));
    if (config.mode == GpioMode::alternate) {
      replace(port_.afr[number_ / 8], 4 * (number_ % 8), 4, config.alternate_function);
    }
    replace(port_.moder, 2 * number_, 2, static_cast<std::uint32_t>(config.mode));
  }

  void write(bool level) { port_.bsrr = 1U << (level ? number_ : number_ + 16); }

  bool read() const { return ((static_cast<std::uint32_t>(port_.idr) >> number_) & 1U) != 0; }

 private:
  static void replace(Register auto& target, unsigned position, unsigned width, std::uint32_t value) {
    const std::uint32_t mask = ((1U << width) - 1U) << position;
    target = (static_cast<std::uint32_t>(target) & ~mask) | ((value << position) & mask);
  }

  Registers& port_;
  unsigned number_;
};

}  // namespace kmax::drivers::stm32f4
