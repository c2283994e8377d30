#include "firmware/links/modbus_registers.hpp"

#include "firmware/board_interface/board_identity.hpp"
#include "firmware/links/modbus_edge.hpp"
#include "firmware/links/parameter_registers.hpp"

namespace kmax::firmware {

using modbus::Exception;

bool ModbusRegisters::has_holding(std::uint16_t address, std::uint16_t count) const {
  return modbus::readable(true, address, count);
}

Exception ModbusRegisters::read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
  if (!modbus::readable(true, address, out.size())) return Exception::illegal_data_address;
  modbus::read_registers(of_.parameters, true, address, out);
  return Exception::none;
}

Exception ModbusRegisters::read_input(std::uint16_t address, std::span<std::uint16_t> out) {
  const auto last = static_cast<std::uint32_t>(address + out.size() - 1);
  if (Trace::contains(address) && Trace::contains(last)) {
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = of_.axes.tick().trace().word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (Capture::contains(address) && Capture::contains(last)) {
    // Zeros must not be taken for data.
    if (!of_.axes.tick().capture().readable()) return Exception::server_device_busy;
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = of_.axes.tick().capture().word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (address >= fault_log_window && last < fault_log_window + fault_log_registers) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t at = address - fault_log_window + i;
      const std::uint32_t word = of_.axes.log().word(at / (2 * fault_log_words), at / 2 % fault_log_words);
      out[i] = static_cast<std::uint16_t>(at % 2 == 0 ? word >> 16 : word);
    }
    return Exception::none;
  }
  if (!modbus::readable(false, address, out.size())) return Exception::illegal_data_address;
  of_.readings.refresh();
  modbus::read_registers(of_.parameters, false, address, out);
  return Exception::none;
}

Exception ModbusRegisters::write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
  of_.state.heard_us = of_.edge.heard_us();
  const modbus::WantedValues wanted = modbus::wanted_values(address, in);
  if (wanted.refusal != Refusal::none) {
    of_.parameters.refuse(wanted.refusal, wanted.address);
    return modbus::exception_for(wanted.refusal);
  }
  if (of_.edge.is_broadcast()) {
    for (const SlotValue& one : wanted.values()) {
      if (owner_of(one.slot).entry == entry_of<"drive.controlword">() &&
          asks_for_operation(one.raw & 0xFFFFU)) {
        of_.parameters.refuse_slot(Refusal::armed_by_broadcast, one.slot);
        return modbus::exception_for(Refusal::armed_by_broadcast);
      }
    }
  }
  return modbus::exception_for(of_.writes.write(wanted.values(), Link::serial).refusal);
}

std::string_view ModbusRegisters::identification(std::uint8_t object_id) const {
  switch (object_id) {
    case 0:
      return "Kmax";
    case 1:
      return "kmax-haptic-controller";
    case 2:
      return firmware_version_text;
    case 4:
      return "Kmax haptic device controller";
    case 5:
      return of_.board.board_name;
    default:
      return {};
  }
}

}  // namespace kmax::firmware
