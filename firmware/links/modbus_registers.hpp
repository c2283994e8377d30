#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/board_interface/board_identity.hpp"
#include "firmware/command/axes.hpp"
#include "firmware/command/host_writes.hpp"
#include "firmware/command/link_states.hpp"
#include "firmware/command/parameter_access.hpp"
#include "firmware/links/readings.hpp"
#include "firmware/modbus/register_bank.hpp"

namespace kmax::firmware {

class ModbusEdge;

/// The device as Modbus sees it (modbus::RegisterBank): parameters and readings, the windows of the trace,
/// the capture and the fault log, and the texts of the device identification. Main loop only.
class ModbusRegisters {
 public:
  /// What the registers stand for. The edge is used from the first request on, not before.
  struct Sources {
    const BoardIdentity& board;
    ParameterAccess& parameters;
    HostWrites& writes;
    Readings& readings;
    Axes& axes;  ///< their trace, captures and fault log
    LinkState& state;
    const ModbusEdge& edge;
  };
  explicit ModbusRegisters(const Sources& sources) : of_(sources) {}

  modbus::Exception read_holding(std::uint16_t address, std::span<std::uint16_t> out);
  modbus::Exception read_input(std::uint16_t address, std::span<std::uint16_t> out);
  modbus::Exception write_holding(std::uint16_t address, std::span<const std::uint16_t> in);
  bool has_holding(std::uint16_t address, std::uint16_t count) const;
  std::string_view identification(std::uint8_t object_id) const;

 private:
  Sources of_;
};

}  // namespace kmax::firmware
