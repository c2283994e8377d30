#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/links/link_sources.hpp"
#include "firmware/modbus/register_bank.hpp"

/// Registers and slots, either way: the Modbus edge of ParameterAccess. A value of 32 bits has two registers,
/// high word first.
namespace kmax::firmware::modbus {

/// Whether every one of these registers is there.
bool readable(bool holding, std::uint32_t address, std::size_t count);

/// The range must be readable(). Reading may start or end within a value.
void read_registers(const ParameterAccess& parameters, bool holding, std::uint16_t address,
                    std::span<std::uint16_t> out);

/// What a write of holding registers wants.
struct WantedValues {
  std::array<SlotValue, 123> storage;
  std::size_t count = 0;
  Refusal refusal = Refusal::none;  ///< unknown_register, value_cut_in_two: there are no such values
  std::uint16_t address = 0;        ///< of the register that this is about

  std::span<const SlotValue> values() const { return std::span(storage).first(count); }
};

/// At most 123 registers. A signed value of 8 bits may come with its sign extended (0xFFFF) or as the bare
/// byte (0x00FF).
WantedValues wanted_values(std::uint16_t address, std::span<const std::uint16_t> in);

Exception exception_for(Refusal refusal);

}  // namespace kmax::firmware::modbus

namespace kmax::firmware {

/// The device as Modbus sees it (modbus::RegisterBank): parameters and readings, the windows of the trace,
/// the capture and the fault log, and the texts of the device identification. Main loop only.
class ModbusRegisters {
 public:
  /// `link`: by which requests come.
  ModbusRegisters(const LinkSources& sources, Link link) : of_(sources), link_(link) {}

  /// Before what a request asks for: its host lives, and the command to arm needs to know.
  void begin_request(std::uint32_t end_us, bool broadcast) {
    of_.links[link_].heard_us = end_us;
    broadcast_ = broadcast;
  }
  modbus::Exception read_holding(std::uint16_t address, std::span<std::uint16_t> out);
  modbus::Exception read_input(std::uint16_t address, std::span<std::uint16_t> out);
  modbus::Exception write_holding(std::uint16_t address, std::span<const std::uint16_t> in);
  bool has_holding(std::uint16_t address, std::uint16_t count) const;
  std::string_view identification(std::uint8_t object_id) const;

 private:
  LinkSources of_;
  Link link_;
  bool broadcast_ = false;  ///< the request went to every unit
};

}  // namespace kmax::firmware
