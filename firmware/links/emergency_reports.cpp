#include "firmware/links/emergency_reports.hpp"

#include <bit>

namespace kmax::firmware {

namespace {
using canopen::bus_source;
/// What lies behind us for so long is over.
constexpr std::uint32_t overrun_over_us = 1'000'000, conflict_over_us = 5'000'000;

/// Bits of object 0x1001 by the group of error codes (CiA 301, table of emergency error codes).
std::uint8_t register_bits_of(std::uint16_t code) {
  namespace bits = canopen::error_register;
  switch (code >> 12) {
    case 0x2:
      return bits::current;
    case 0x3:
      return bits::voltage;
    case 0x4:
      return bits::temperature;
    case 0x8:
      return code == 0x8480 ? bits::device_profile : bits::communication;
    case 0xF:
      return bits::manufacturer;
    default:
      return bits::device_profile;
  }
}

std::array<std::uint8_t, 5> bytes_of(std::uint8_t source, float value) {
  const auto word = std::bit_cast<std::uint32_t>(value);
  return {source, static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8),
          static_cast<std::uint8_t>(word >> 16), static_cast<std::uint8_t>(word >> 24)};
}

void raise_about_bus(canopen::Emergency& emergency, std::uint16_t code) {
  emergency.raise({code, canopen::error_register::communication, {bus_source}});
}
}  // namespace

void EmergencyReports::poll(const EmergencyCauses& now, canopen::Emergency& emergency, std::uint32_t now_us) {
  if (now.can_state != reported_.can_state) {
    if (now.can_state == CanState::error_passive)
      raise_about_bus(emergency, 0x8120);
    else
      emergency.clear(0x8120, bus_source);
    // It can be reported only when it is over.
    if (reported_.can_state == CanState::bus_off) raise_about_bus(emergency, 0x8140);
  } else if (now.can_state == CanState::active) {
    emergency.clear(0x8140, bus_source);
  }
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const Fault fault = now.faults[axis], before = reported_.faults[axis];
    if (fault == before) continue;
    const auto source = static_cast<std::uint8_t>(axis);
    if (before != Fault::none) emergency.clear(error_code_of(before), source);
    if (fault == Fault::none) continue;
    const std::uint16_t code = error_code_of(fault);
    emergency.raise({code, register_bits_of(code), bytes_of(source, now.fault_values[axis])});
  }
  const auto counted = [&](std::uint32_t count, std::uint32_t before, std::uint32_t& at_us,
                           std::uint32_t over_us, std::uint16_t code) {
    if (count != before) {
      at_us = now_us;
      raise_about_bus(emergency, code);
    } else if (now_us - at_us > over_us) {
      emergency.clear(code, bus_source);
    }
  };
  counted(now.identity_conflicts, reported_.identity_conflicts, conflict_us_, conflict_over_us, 0x8100);
  counted(now.frames_lost, reported_.frames_lost, overrun_us_, overrun_over_us, 0x8110);
  reported_ = now;
}

}  // namespace kmax::firmware
