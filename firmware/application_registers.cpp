// What a host can read and write: the bank behind the Modbus server.
#include "firmware/application.hpp"
#include "firmware/drive/cyclic_torque.hpp"
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
  if (app_.port_.is_broadcast()) {
    for (const SlotValue& one : wanted.values()) {
      if (owner_of(one.slot).entry == entry_of<"drive.controlword">() &&
          asks_for_operation(one.raw & 0xFFFFU)) {
        app_.parameters_.refuse_slot(Refusal::armed_by_broadcast, one.slot);
        return modbus::exception_for(Refusal::armed_by_broadcast);
      }
    }
  }
  return modbus::exception_for(app_.write(wanted.values(), Link::serial).refusal);
}

ParameterAccess::Result Application::write(std::span<const SlotValue> wanted, Link by) {
  const std::size_t entry = owner_of(wanted[0].slot).entry;
  if (entry == entry_of<"store.command">()) return store_.command(wanted[0].raw, any_armed());
  if (entry == entry_of<"capture.command">())
    return command_capture(wanted[0].raw, parameters_, tick_.capture());
  for (const SlotValue& one : wanted) {
    if (commands_anothers_axis(one, by)) return parameters_.refuse_slot(Refusal::other_commander, one.slot);
  }
  const auto result = parameters_.write(wanted, by, armed_axes(), now_us_);
  if (result.refusal == Refusal::none) note_commander(wanted, by);
  // Controlwords act at once: a poll that comes late finds several, and each must act as if it had come
  // alone, by the settings that came before it. Else settings act at the end of the poll, whichever link they
  // came over: thousands may come in a second.
  if (parameters_.controlword_waits())
    act();
  else
    publish_torques();
  return result;
}

/// Whether it would keep another link's armed axis under force, or say how much.
bool Application::commands_anothers_axis(const SlotValue& one, Link by) const {
  const auto [entry, axis] = owner_of(one.slot);
  const bool command =
      is_target(entry) || (entry == entry_of<"drive.controlword">() && asks_for_operation(one.raw & 0xFFFFU));
  return command && supervisors_[axis].armed() && supervisors_[axis].commander() != by;
}

void Application::note_commander(std::span<const SlotValue> written, Link by) {
  const auto number_of = [](std::uint32_t raw) { return static_cast<std::uint16_t>(raw); };
  for (const SlotValue& one : written) {
    const auto [entry, axis] = owner_of(one.slot);
    if (entry == entry_of<"drive.controlword">())
      supervisors_[axis].set_commander(by, number_of(parameters_.values().whole<"drive.commander">(axis)),
                                       now_us_);
    if (entry == entry_of<"link.sign_of_life">()) {
      for (Supervisor& supervisor : supervisors_)
        supervisor.take_sign_of_life(by, number_of(one.raw), now_us_);
    }
  }
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
