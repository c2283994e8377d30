// What a host can read and write: the bank behind the Modbus server.
#include "firmware/application.hpp"

namespace kmax::firmware {

using modbus::Exception;

namespace {
Exception exception_for(Refusal refusal) {
  switch (refusal) {
    case Refusal::none:
      return Exception::none;
    case Refusal::unknown_register:
    case Refusal::read_only:
    case Refusal::value_cut_in_two:
      return Exception::illegal_data_address;
    case Refusal::while_armed:
    case Refusal::no_transaction:
    case Refusal::store_missing:
    case Refusal::capture_missing:
      return Exception::server_device_failure;
    case Refusal::transaction_open:
    case Refusal::store_busy:
      return Exception::server_device_busy;
    default:
      return Exception::illegal_data_value;
  }
}
}  // namespace

bool Application::Bank::has_holding(std::uint16_t address, std::uint16_t count) const {
  return app_.registers_.readable(true, address, count);
}

Exception Application::Bank::read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
  if (!app_.registers_.readable(true, address, out.size())) return Exception::illegal_data_address;
  app_.registers_.read(true, address, out);
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
  if (!app_.registers_.readable(false, address, out.size())) return Exception::illegal_data_address;
  app_.refresh_readings();
  app_.registers_.read(false, address, out);
  return Exception::none;
}

Exception Application::Bank::write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
  return exception_for(app_.write_registers(address, in, Commander::serial).refusal);
}

DeviceRegisters::WriteResult Application::write_registers(std::uint16_t address,
                                                          std::span<const std::uint16_t> in, Commander by) {
  const auto is_single = [&](std::size_t entry, std::size_t axis) {
    return in.size() == 1 && address == register_address(entry, axis);
  };
  DeviceRegisters::WriteResult result;
  if (is_single(entry_of<"store.command">(), 0)) {
    result = command_store(in[0]);
  } else if (is_single(entry_of<"capture.command">(), 0)) {
    result = command_capture(in[0]);
  } else {
    result = registers_.write(address, in, armed_axes(), now_us_);
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      if (is_single(entry_of<"drive.controlword">(), axis)) commander_[axis] = by;
    }
  }
  // At once: a poll that comes late finds several requests, and each must act as if it had come alone.
  // Settings that came over CAN, where one value is one message and thousands may come in a second, are made
  // once per poll for all, or before the next controlword.
  const bool commands = registers_.controlword_waits();
  if (by == Commander::serial || commands)
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
