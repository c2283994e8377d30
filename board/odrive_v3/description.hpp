#pragma once

#include "board/description.hpp"
#include "drivers/stm32f4/three_phase_pwm.hpp"
#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::board::odrive_v3 {

inline constexpr drivers::stm32f4::ThreePhasePwmConfig pwm_config{};

/// The board for 24 V; that for 56 V differs in divider and ratings (voltage_variant.hpp).
inline constexpr BoardDescription description{
    .name = "odrive_v3",
    .core_clock_hz = 168'000'000,
    .timer_clock_hz = 168'000'000,
    .half_period_ticks = pwm_config.half_period_ticks,
    .dead_time_ticks = drivers::stm32f4::dead_time_ticks(pwm_config.dead_time_code),
    .minimum_low_ticks = pwm_config.minimum_low_ticks,
    // Leaves the low sides on for 3.1 us at a gain of 10, 3.25, 4 and 6 us at 80. Half of that is before the
    // sample, and in it the amplifiers settle to 1.3 % (host_tools/simulation/current_sensor.hpp).
    .modulation_limit = {0.875f, 0.87f, 0.84f, 0.76f},
    .supply_ratio = 11.0,
    // DRV8301 data sheet, PVDD under-voltage.
    .gate_driver_supply_minimum = 5.9,
    // Of a tick's 50 us: what its place in the tick varies by is left, and the bootstrap capacitor fills.
    .brake_pulse = 44e-6,
};
static_assert(description.pwm_hz() == firmware::tick_rate_hz);
static_assert(description.modulation_fits());

}  // namespace kmax::board::odrive_v3
