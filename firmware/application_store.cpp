// What the application does with the parameter store.
#include "firmware/application.hpp"

namespace kmax::firmware {

const LoadReport& Application::attach_store(AnyFlashSectors flash) {
  ParameterValues stored = registers_.values();
  keeper_.attach(flash, stored);
  registers_.set_all(stored, false);
  offer_settings_if_changed();
  start_communication(true);
  refresh_readings();
  return keeper_.loaded();
}

DeviceRegisters::WriteResult Application::command_store(std::uint16_t command) {
  const std::uint16_t address = register_address(entry_of<"store.command">(), 0);
  switch (static_cast<StoreCommand>(command)) {
    case StoreCommand::save: {
      const Refusal refusal = keeper_.save(registers_.values(), any_armed());
      if (refusal == Refusal::none) note_saving(registers_.values());
      return registers_.refuse(refusal, address);
    }
    case StoreCommand::defaults: {
      DeviceRegisters::WriteResult result = registers_.refuse(Refusal::none, address);
      if (any_armed()) {
        result = registers_.refuse(Refusal::while_armed, address);
      } else if (registers_.transaction_open()) {
        result = registers_.refuse(Refusal::transaction_open, address);
      } else {
        ParameterValues wanted = registers_.values();
        set_defaults(wanted);
        registers_.set_all(wanted, false);
      }
      keeper_.note_defaults(result.refusal);
      return result;
    }
  }
  return registers_.refuse(Refusal::out_of_range, address);
}

DeviceRegisters::WriteResult Application::save_defaults() {
  ParameterValues defaults = registers_.values();
  set_defaults(defaults);
  const Refusal refusal = keeper_.save(defaults, any_armed());
  if (refusal == Refusal::none) note_saving(defaults);
  return registers_.refuse(refusal, register_address(entry_of<"store.command">(), 0));
}

void Application::refresh_store_readings() {
  ParameterValues& v = registers_.values();
  keeper_.publish(v);
}

void Application::refresh_crash_readings() {
  ParameterValues& v = registers_.values();
  v.set_whole<"info.reset_cause">(static_cast<std::uint32_t>(board_.reset_cause));
  const CrashRecord& crash = board_.crash;
  v.set_whole<"info.crash_count">(crash.count);
  v.set_whole<"info.crash_cause">(static_cast<std::uint32_t>(crash.cause));
  v.set_whole<"info.crash_exception">(crash.exception_number);
  v.set_whole<"info.crash_program_counter">(crash.program_counter);
  v.set_whole<"info.crash_link_register">(crash.link_register);
  v.set_whole<"info.crash_status">(crash.status);
  v.set_whole<"info.crash_hard_fault_status">(crash.hard_fault_status);
  v.set_whole<"info.crash_address">(crash.address);
}

}  // namespace kmax::firmware
