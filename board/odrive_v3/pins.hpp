#pragma once

#include <array>
#include <cstddef>

#include "drivers/stm32f4/gpio.hpp"

// Pins of the ODrive v3.6 and their state at start-up. From the schematic of v3.5 and the vendor's firmware,
// which treats v3.5 and v3.6 alike; the schematic of v3.6 is not public.

namespace kmax::board::odrive_v3 {

using drivers::stm32f4::GpioConfig;
using drivers::stm32f4::GpioMode;
using drivers::stm32f4::GpioPort;
using drivers::stm32f4::GpioPull;
using drivers::stm32f4::GpioSpeed;
using drivers::stm32f4::PinLocation;

struct PinState {
  PinLocation pin;
  GpioConfig config;
};

namespace pins {
/// Enables both DRV8301. Low switches all twelve motor FETs off. No pull-down on the board.
inline constexpr PinLocation gate_enable{GpioPort::b, 12};
/// Brake half-bridge. The driver has no interlock: never both high. 3.3 kOhm pull-downs on the board.
inline constexpr PinLocation brake_low_side{GpioPort::b, 10};
inline constexpr PinLocation brake_high_side{GpioPort::b, 11};
/// Wired-OR of both DRV8301, low = fault. No pull-up on the board.
inline constexpr PinLocation gate_driver_fault{GpioPort::d, 2};
/// Chip selects of the two DRV8301. PC13 to PC15 may only switch slowly and cannot drive a load.
inline constexpr PinLocation gate_driver0_select{GpioPort::c, 13};
inline constexpr PinLocation gate_driver1_select{GpioPort::c, 14};
/// SPI3, shared by both gate drivers and connector J3.
inline constexpr PinLocation bus_clock{GpioPort::c, 10};
inline constexpr PinLocation bus_from_chips{GpioPort::c, 11};
inline constexpr PinLocation bus_to_chips{GpioPort::c, 12};
/// Quadrature lines; 3.3 kOhm pull-ups on the board. Index of motor 1 has no timer on its pin.
inline constexpr PinLocation encoder0_a{GpioPort::b, 4};
inline constexpr PinLocation encoder0_b{GpioPort::b, 5};
inline constexpr PinLocation encoder0_index{GpioPort::c, 9};
inline constexpr PinLocation encoder1_a{GpioPort::b, 6};
inline constexpr PinLocation encoder1_b{GpioPort::b, 7};
inline constexpr PinLocation encoder1_index{GpioPort::c, 15};
/// GPIO5 of connector J3: a normally closed contact to ground; open = stop. It has an interrupt vector of its
/// own, no boot strap and no filter.
inline constexpr PinLocation emergency_stop{GpioPort::c, 4};
/// GPIO8 of connector J3: high = ready and without fault. Needs a pull-down at the other end: during reset
/// the pin is the debugger's.
inline constexpr PinLocation healthy{GpioPort::b, 3};
/// GPIO7 of connector J3, pulled up during reset: chip select of an AS5047P on the bus.
inline constexpr PinLocation encoder_select{GpioPort::a, 15};
/// The CAN transceiver; it has no standby pin.
inline constexpr PinLocation can_receive{GpioPort::b, 8};
inline constexpr PinLocation can_transmit{GpioPort::b, 9};
/// GPIO3 and GPIO4 of connector J3.
inline constexpr PinLocation serial_transmit{GpioPort::a, 2};
inline constexpr PinLocation serial_receive{GpioPort::a, 3};
/// USB, connector J1; its VBUS goes nowhere.
inline constexpr PinLocation usb_minus{GpioPort::a, 11};
inline constexpr PinLocation usb_plus{GpioPort::a, 12};
}  // namespace pins

inline constexpr GpioConfig output_low{.mode = GpioMode::output};
inline constexpr GpioConfig output_high{.mode = GpioMode::output, .initial_level = true};
/// For a gate signal that no timer drives yet: the gate driver reads low.
inline constexpr GpioConfig gate_off{.mode = GpioMode::input, .pull = GpioPull::down};

/// Applied before anything else at start-up, in this order: the switch that turns everything off comes first.
inline constexpr auto power_stage_off = std::to_array<PinState>({
    PinState{pins::gate_enable, output_low},
    PinState{pins::brake_low_side, output_low},
    PinState{pins::brake_high_side, output_low},
    // Motor 0 (TIM1): high sides A, B, C, then low sides.
    PinState{{GpioPort::a, 8}, gate_off},
    PinState{{GpioPort::a, 9}, gate_off},
    PinState{{GpioPort::a, 10}, gate_off},
    PinState{{GpioPort::b, 13}, gate_off},
    PinState{{GpioPort::b, 14}, gate_off},
    PinState{{GpioPort::b, 15}, gate_off},
    // Motor 1 (TIM8).
    PinState{{GpioPort::c, 6}, gate_off},
    PinState{{GpioPort::c, 7}, gate_off},
    PinState{{GpioPort::c, 8}, gate_off},
    PinState{{GpioPort::a, 7}, gate_off},
    PinState{{GpioPort::b, 0}, gate_off},
    PinState{{GpioPort::b, 1}, gate_off},
    PinState{pins::gate_driver0_select, output_high},
    PinState{pins::gate_driver1_select, output_high},
    PinState{pins::gate_driver_fault, {.mode = GpioMode::input, .pull = GpioPull::up}},
});

/// USART2, alternate function 7. The pull-up keeps an open receive line idle.
inline constexpr auto serial_pins = std::to_array<PinState>({
    PinState{pins::serial_transmit,
             {.mode = GpioMode::alternate, .speed = GpioSpeed::medium, .alternate_function = 7}},
    PinState{pins::serial_receive,
             {.mode = GpioMode::alternate, .pull = GpioPull::up, .alternate_function = 7}},
});

/// CAN1, alternate function 9. The pull-up keeps a receive line without a transceiver recessive.
inline constexpr auto can_pins = std::to_array<PinState>({
    PinState{pins::can_receive, {.mode = GpioMode::alternate, .pull = GpioPull::up, .alternate_function = 9}},
    PinState{pins::can_transmit,
             {.mode = GpioMode::alternate, .speed = GpioSpeed::medium, .alternate_function = 9}},
});

/// OTG_FS, alternate function 10; its transceiver has the pull-ups.
inline constexpr auto usb_pins = std::to_array<PinState>({
    PinState{pins::usb_minus,
             {.mode = GpioMode::alternate, .speed = GpioSpeed::very_high, .alternate_function = 10}},
    PinState{pins::usb_plus,
             {.mode = GpioMode::alternate, .speed = GpioSpeed::very_high, .alternate_function = 10}},
});

/// TIM1 (alternate function 1) and TIM8 (3): high sides, then low sides; TIM2 (1): the brake. The pull-downs
/// hold a leg off that the timer does not drive.
constexpr GpioConfig gate(std::uint8_t alternate_function) {
  return {.mode = GpioMode::alternate,
          .pull = GpioPull::down,
          .speed = GpioSpeed::high,
          .alternate_function = alternate_function};
}
inline constexpr auto gate_pins = std::to_array<PinState>({
    PinState{{GpioPort::a, 8}, gate(1)},
    PinState{{GpioPort::a, 9}, gate(1)},
    PinState{{GpioPort::a, 10}, gate(1)},
    PinState{{GpioPort::b, 13}, gate(1)},
    PinState{{GpioPort::b, 14}, gate(1)},
    PinState{{GpioPort::b, 15}, gate(1)},
    PinState{{GpioPort::c, 6}, gate(3)},
    PinState{{GpioPort::c, 7}, gate(3)},
    PinState{{GpioPort::c, 8}, gate(3)},
    PinState{{GpioPort::a, 7}, gate(3)},
    PinState{{GpioPort::b, 0}, gate(3)},
    PinState{{GpioPort::b, 1}, gate(3)},
    PinState{pins::brake_high_side, gate(1)},
});

/// TIM3 and TIM4, alternate function 2; the board's own pull-ups are stronger than the chip's.
inline constexpr GpioConfig encoder_line{.mode = GpioMode::alternate, .alternate_function = 2};
inline constexpr GpioConfig plain_input{.mode = GpioMode::input};
inline constexpr auto encoder_pins = std::to_array<PinState>({
    PinState{pins::encoder0_a, encoder_line},
    PinState{pins::encoder0_b, encoder_line},
    PinState{pins::encoder0_index, plain_input},
    PinState{pins::encoder1_a, encoder_line},
    PinState{pins::encoder1_b, encoder_line},
    PinState{pins::encoder1_index, plain_input},
});

/// Phase currents, supply, thermistors.
inline constexpr GpioConfig analog_input{.mode = GpioMode::analog};
inline constexpr auto analog_pins = std::to_array<PinState>({
    PinState{{GpioPort::c, 0}, analog_input},
    PinState{{GpioPort::c, 1}, analog_input},
    PinState{{GpioPort::c, 2}, analog_input},
    PinState{{GpioPort::c, 3}, analog_input},
    PinState{{GpioPort::a, 6}, analog_input},
    PinState{{GpioPort::c, 5}, analog_input},
    PinState{{GpioPort::a, 4}, analog_input},
    PinState{{GpioPort::a, 5}, analog_input},
});

/// SPI3, alternate function 6. Pulled so that a chip that does not answer reads as all ones.
inline constexpr auto bus_pins = std::to_array<PinState>({
    PinState{pins::bus_clock,
             {.mode = GpioMode::alternate,
              .pull = GpioPull::down,
              .speed = GpioSpeed::medium,
              .alternate_function = 6}},
    PinState{pins::bus_from_chips,
             {.mode = GpioMode::alternate, .pull = GpioPull::up, .alternate_function = 6}},
    PinState{pins::bus_to_chips,
             {.mode = GpioMode::alternate,
              .pull = GpioPull::down,
              .speed = GpioSpeed::medium,
              .alternate_function = 6}},
    PinState{pins::encoder_select, output_high},
});

inline constexpr auto line_pins = std::to_array<PinState>({
    PinState{pins::emergency_stop, {.mode = GpioMode::input, .pull = GpioPull::up}},
    PinState{pins::healthy, output_low},
});

namespace detail {
template <std::size_t count>
constexpr bool names_no_pin_twice(const std::array<PinState, count>& table) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (table[i].pin == table[j].pin) return false;
    }
  }
  return true;
}
}  // namespace detail
static_assert(detail::names_no_pin_twice(power_stage_off));
static_assert(detail::names_no_pin_twice(serial_pins));
static_assert(detail::names_no_pin_twice(can_pins));
static_assert(detail::names_no_pin_twice(usb_pins));
static_assert(detail::names_no_pin_twice(gate_pins));
static_assert(detail::names_no_pin_twice(encoder_pins));
static_assert(detail::names_no_pin_twice(analog_pins));
static_assert(detail::names_no_pin_twice(bus_pins));

}  // namespace kmax::board::odrive_v3
