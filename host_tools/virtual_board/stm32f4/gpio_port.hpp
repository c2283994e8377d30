#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "drivers/stm32f4/gpio.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// What the world outside does to a pin.
enum class PinDrive : std::uint8_t {
  floating,
  low,
  high,
  pulled_down,  ///< by a resistor on the board, stronger than the pulls inside the part
  pulled_up,
};

/// What the part does to a pin. A pull resistor inside is not an output.
enum class PinOutput : std::uint8_t { released, low, high };

/// One GPIO port, A to D: RM0090, chapter General-purpose I/Os (GPIO), sections I/O port control registers,
/// Input configuration, Output configuration, Analog configuration. In alternate mode a pin is released: what
/// peripherals do is wired past the ports.
///
/// The level of a pin is decided by the first that drives it: the output inside, the drive outside, a pull-up
/// or pull-down outside, the pull inside. A pin that nothing drives reads low (undefined on silicon: floats()
/// tells). An output against an outside drive is a short circuit and is refused.
///
/// IDR follows the pin in every mode but analog, where it reads 0. Changes reach IDR at once (silicon: one
/// AHB clock). ODR, BSRR and IDR take byte, half-word and word accesses, the others words. Not modelled and
/// refused: LCKR, a pull of both kinds (PUPDR 3), reserved bits. The port's clock in the RCC is not looked
/// at.
class GpioPortModel final : public RegisterBlock<GpioPortModel> {
 public:
  using PinChange = std::function<void(unsigned pin, bool level, BoardTime now)>;
  using OutputChange = std::function<void(unsigned pin, PinOutput output, BoardTime now)>;

  explicit GpioPortModel(drivers::stm32f4::GpioPort port);

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

  /// The world's side of a pin (0 to 15).
  void drive(unsigned pin, PinDrive drive, BoardTime now);

  /// Level on the pin, as an instrument would see it.
  bool level(unsigned pin) const { return (levels_ >> pin & 1U) != 0; }
  /// Nothing drives or pulls the pin: level() is a guess.
  bool floats(unsigned pin) const { return (floating_ >> pin & 1U) != 0; }
  PinOutput output(unsigned pin) const { return outputs_[pin]; }
  drivers::stm32f4::GpioMode mode(unsigned pin) const;
  /// The alternate function that is chosen, whether or not the mode lets it out.
  unsigned alternate_function(unsigned pin) const { return afr_[pin / 8] >> (4 * (pin % 8)) & 0xFU; }

  /// Called when the part begins or ceases to drive a pin or changes the level that it drives, and at once
  /// (with time 0) for those that it drives already.
  void on_output_change(OutputChange callback);
  /// Called when a bit of IDR changes: what the EXTI and the peripherals' inputs see. At once for those that
  /// are 1.
  void on_input_change(PinChange callback);

 private:
  struct Resolved {
    bool level;
    bool floating;
  };

  static const RegisterTable<GpioPortModel>& registers();
  void restore_reset_values();
  void write_pulls(const Access& access, std::uint32_t value);
  void update(BoardTime now);
  void report(BoardTime now);
  PinOutput output_of(unsigned pin) const;
  Resolved resolve(unsigned pin) const;
  bool pulled(unsigned pin, drivers::stm32f4::GpioPull pull) const;
  std::string pin_name(unsigned pin) const;

  drivers::stm32f4::GpioPort port_;
  std::uint32_t moder_ = 0, otyper_ = 0, ospeedr_ = 0, pupdr_ = 0, odr_ = 0;
  std::array<std::uint32_t, 2> afr_{};
  std::array<PinDrive, 16> drives_{};
  std::array<PinOutput, 16> outputs_{};
  std::uint32_t levels_ = 0;    // on the pins
  std::uint32_t floating_ = 0;  // driven by nothing
  std::uint32_t idr_ = 0;
  std::array<PinOutput, 16> reported_outputs_{};  // as the callbacks know them
  std::uint32_t reported_idr_ = 0;
  PinChange input_change_;
  OutputChange output_change_;
};

}  // namespace kmax::virtual_board
