#pragma once

#include "board/description.hpp"
#include "drivers/stm32f4/current_sampling.hpp"
#include "drivers/stm32f4/three_phase_pwm.hpp"
#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::board::odrive_v3 {

inline constexpr std::uint32_t core_clock_hz = 168'000'000;  // timers 1 and 8 as well

inline constexpr drivers::stm32f4::ThreePhasePwmConfig pwm_config{
    .half_period_ticks = 4200,
    .dead_time_code = drivers::stm32f4::dead_time_code_for(core_clock_hz, 120),  // 21 ticks = 125 ns
    .minimum_low_ticks = 252,
};
inline constexpr drivers::stm32f4::CurrentSamplingConfig sampling_config{
    .axes = {{{10, 11}, {13, 12}}},  // PC0, PC1; PC3, PC2
    .supply = 6,                     // PA6
    .temperatures = {15, 4},         // PC5, PA4
    .current_sampling_code = 0,      // 3 cycles
    .slow_sampling_code = 2,         // 28 cycles
};

/// Of both variants, whose dividers and ratings differ (voltage_variant.hpp).
inline constexpr BoardDescription description{
    .name = "odrive_v3",
    .core_clock_hz = core_clock_hz,
    .timer_clock_hz = core_clock_hz,
    .half_period_ticks = pwm_config.half_period_ticks,
    .dead_time_ticks = drivers::stm32f4::dead_time_ticks(pwm_config.dead_time_code),
    .minimum_low_ticks = pwm_config.minimum_low_ticks,
    // Leaves the low sides on for 3.1 us at a gain of 10, 3.25, 4 and 6 us at 80. Half of that is before the
    // sample, and in it the amplifiers settle to 1.3 % (host_tools/simulation/current_sensor.hpp).
    .modulation_limit = {0.875f, 0.87f, 0.84f, 0.76f},
    .shunt = 0.5e-3,
    // NCP15XH103. Open is what reads below -42 degC, shorted above 203 degC.
    .thermistor = {.resistance_25_ohm = 10'000.0,
                   .beta_kelvin = 3434.0,
                   .ground_resistor_ohm = 3'300.0,
                   .open_below = 48,
                   .shorted_above = 3936},
    // DRV8301 data sheet, PVDD under-voltage.
    .gate_driver_supply_minimum = 5.9,
    // Of a tick's 50 us: what its place in the tick varies by is left, and the bootstrap capacitor fills.
    .brake_pulse = 44e-6,
};
static_assert(description.pwm_hz() == firmware::tick_rate_hz);
static_assert(description.modulation_fits());
static_assert(
    without_defaults<drivers::stm32f4::ThreePhasePwmConfig, drivers::stm32f4::CurrentSamplingConfig>);

}  // namespace kmax::board::odrive_v3
