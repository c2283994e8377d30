// What a host can read and write: the bank behind the Modbus server.
#include "firmware/application.hpp"
#include "firmware/modbus/parameter_registers.hpp"

namespace kmax::firmware {

using modbus::Exception;

bool Application::Bank::has_holding(std::uint16_t address, std::uint16_t count) const {
  return modbus::readable(true, address, count);
}

Exception Application::Bank::read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
  if (!modbus::readable(true, address, out.size())) return Exception::illegal_data_address;
  modbus::read_registers(app_.parameters_, true, address, out);
  return Exception::none;
}

Exception Application::Bank::read_input(std::uint16_t address, std::span<std::uint16_t> out) {
  const auto last = static_cast<std::uint32_t>(address + out.size() - 1);
  if (Trace::contains(address) && Trace::contains(last)) {
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = app_.tick_.trace().word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (Capture::contains(address) && Capture::contains(last)) {
    // Zeros must not be taken for data.
    if (!app_.tick_.capture().readable()) return Exception::server_device_busy;
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = app_.tick_.capture().word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (!modbus::readable(false, address, out.size())) return Exception::illegal_data_address;
  app_.refresh_readings();
  modbus::read_registers(app_.parameters_, false, address, out);
  return Exception::none;
}

Exception Application::Bank::write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
  const modbus::WantedValues wanted = modbus::wanted_values(address, in);
  if (wanted.refusal != Refusal::none) {
    app_.parameters_.refuse(wanted.refusal, wanted.address);
    return modbus::exception_for(wanted.refusal);
  }
  return modbus::exception_for(app_.write(wanted.values(), Link::serial).refusal);
}

ParameterAccess::Result Application::write(std::span<const SlotValue> wanted, Link by) {
  const std::size_t entry = owner_of(wanted[0].slot).entry;
  if (entry == entry_of<"store.command">()) return store_.command(wanted[0].raw, any_armed());
  if (entry == entry_of<"capture.command">())
    return command_capture(wanted[0].raw, parameters_, tick_.capture());
  const auto result = parameters_.write(wanted, by, armed_axes(), now_us_);
  for (const SlotValue& one : wanted) {
    const auto [of, axis] = owner_of(one.slot);
    if (of == entry_of<"drive.controlword">()) supervisors_[axis].set_commander(by);
  }
  // Controlwords act at once: a poll that comes late finds several, and each must act as if it had come
  // alone, by the settings that came before it. Else settings act at the end of the poll, whichever link they
  // came over: thousands may come in a second.
  if (parameters_.controlword_waits())
    act();
  else
    publish_torques();
  return result;
}

std::string_view Application::Bank::identification(std::uint8_t object_id) const {
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
      return app_.board_.board_name;
    default:
      return {};
  }
}

}  // namespace kmax::firmware
