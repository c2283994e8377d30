#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/current_sense.hpp"

// Texas Instruments DRV8301, three-phase gate driver: its frames and registers. DRV8301 data sheet, sections
// SPI communication, Register maps, Overcurrent protection (table of OC_ADJ_SET).
//
// A frame has 16 bits: bit 15 read (1) or write (0), bits 14 to 11 the address, 10 to 0 the data. The chip
// answers a frame in the next one, with the address at the same place; its bit 15 is not used here.

namespace kmax::drivers {

enum class Drv8301Register : std::uint8_t { status_1 = 0, status_2 = 1, control_1 = 2, control_2 = 3 };

namespace drv8301 {

inline constexpr std::uint16_t data_mask = 0x07FF;
inline constexpr std::uint16_t read_bit = 0x8000;
inline constexpr unsigned address_position = 11;
inline constexpr std::uint16_t address_mask = 0xF;

constexpr std::uint16_t read_word(Drv8301Register address) {
  return static_cast<std::uint16_t>(read_bit | static_cast<unsigned>(address) << address_position);
}
constexpr std::uint16_t write_word(Drv8301Register address, std::uint16_t data) {
  return static_cast<std::uint16_t>(static_cast<unsigned>(address) << address_position | (data & data_mask));
}
constexpr unsigned address_of(std::uint16_t word) {
  return word >> address_position & address_mask;
}

// Status 2.
inline constexpr std::uint16_t status_2_device_mask = 0x000F;
inline constexpr std::uint16_t device_id = 1;
inline constexpr std::uint16_t status_2_gate_supply_over_voltage = 1U << 7;

// Control 1.
inline constexpr unsigned gate_current_position = 0;       // 2 bits
inline constexpr std::uint16_t gate_reset = 1U << 2;       // falls by itself
inline constexpr std::uint16_t three_inputs = 1U << 3;     // PWM_MODE
inline constexpr unsigned over_current_mode_position = 4;  // 2 bits
inline constexpr unsigned over_current_code_position = 6;  // 5 bits

// Control 2.
inline constexpr unsigned gain_position = 2;  // 2 bits: 10, 20, 40, 80
inline constexpr std::uint16_t calibrate_channel_1 = 1U << 4;
inline constexpr std::uint16_t calibrate_channel_2 = 1U << 5;
inline constexpr std::uint16_t control_2_mask = 0x007F;

/// Drain-source voltage at which a FET counts as carrying too much, in mV, by the code of OC_ADJ_SET. Up to
/// 20 % spread between channels; codes 28 to 31 not with a supply below 8 V.
inline constexpr std::array<std::uint16_t, 32> over_current_millivolts{
    60,  68,  76,  86,  97,  109, 123, 138, 155,  175,  197,  222,  250,  282,  317,  358,
    403, 454, 511, 576, 648, 730, 822, 926, 1043, 1175, 1324, 1491, 1679, 1892, 2131, 2400};

/// The code of the highest level that is not above `millivolts`; none below 60 mV.
constexpr std::optional<std::uint8_t> over_current_code(std::uint32_t millivolts) {
  std::optional<std::uint8_t> code;
  for (std::uint8_t i = 0; i < over_current_millivolts.size(); ++i) {
    if (over_current_millivolts[i] <= millivolts) code = i;
  }
  return code;
}
static_assert(over_current_code(730) == 21);
static_assert(!over_current_code(59));

}  // namespace drv8301

/// Bits 0 to 10 are those of status register 1; GVDD_OV of status register 2 is put above them, and above
/// that what the chip cannot say itself.
enum class Drv8301Fault : std::uint16_t {
  over_current_c_low = 1U << 0,   // FETLC_OC
  over_current_c_high = 1U << 1,  // FETHC_OC
  over_current_b_low = 1U << 2,
  over_current_b_high = 1U << 3,
  over_current_a_low = 1U << 4,
  over_current_a_high = 1U << 5,
  over_temperature_warning = 1U << 6,   // OTW
  over_temperature = 1U << 7,           // OTSD
  supply_under_voltage = 1U << 8,       // PVDD_UV
  gate_supply_under_voltage = 1U << 9,  // GVDD_UV
  fault = 1U << 10,                     // FAULT: the gates are off and nFAULT is low
  gate_supply_over_voltage = 1U << 11,  // GVDD_OV; only a full reset by EN_GATE takes it back
  no_answer = 1U << 12,
};

enum class Drv8301GateCurrent : std::uint8_t { a1_7, a0_7, a0_25 };

/// What the chip does when a FET carries too much. `report_only` and `limit` do not pull nFAULT: without the
/// nOCTW line, which the ODrive does not connect, only reading the status shows them.
enum class Drv8301OverCurrent : std::uint8_t { limit, latched_shut_down, report_only, off };

struct Drv8301Config {
  CurrentSenseGain gain = CurrentSenseGain::x40;
  std::uint8_t over_current_code = *drv8301::over_current_code(730);  ///< 0 to 31
  Drv8301OverCurrent over_current = Drv8301OverCurrent::latched_shut_down;
  Drv8301GateCurrent gate_current = Drv8301GateCurrent::a1_7;
  bool three_inputs = false;  ///< false: six PWM inputs
};

constexpr std::uint16_t drv8301_control_1(const Drv8301Config& config) {
  return static_cast<std::uint16_t>(
      static_cast<unsigned>(config.over_current_code) << drv8301::over_current_code_position |
      static_cast<unsigned>(config.over_current) << drv8301::over_current_mode_position |
      (config.three_inputs ? drv8301::three_inputs : 0U) |
      static_cast<unsigned>(config.gate_current) << drv8301::gate_current_position);
}
constexpr std::uint16_t drv8301_control_2(const Drv8301Config& config) {
  return static_cast<std::uint16_t>(static_cast<unsigned>(config.gain) << drv8301::gain_position);
}
static_assert(drv8301_control_1({}) == 0x550);
static_assert(drv8301_control_2({}) == 0x008);

}  // namespace kmax::drivers
