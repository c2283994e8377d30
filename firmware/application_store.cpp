// What the application does with the parameter store.
#include "firmware/application.hpp"

namespace kmax::firmware {

const LoadReport& Application::attach_store(AnyFlashSectors flash) {
  ParameterValues stored = parameters_.values();
  keeper_.attach(flash, stored);
  parameters_.set_all(stored, false);
  offer_settings_if_changed();
  start_communication(true);
  refresh_readings();
  return keeper_.loaded();
}

ParameterAccess::Result Application::command_store(std::uint16_t command) {
  const std::uint16_t address = register_address(entry_of<"store.command">(), 0);
  switch (static_cast<StoreCommand>(command)) {
    case StoreCommand::save: {
      const Refusal refusal = keeper_.save(parameters_.values(), any_armed());
      if (refusal == Refusal::none) note_saving(parameters_.values());
      return parameters_.refuse(refusal, address);
    }
    case StoreCommand::defaults: {
      ParameterAccess::Result result = parameters_.refuse(Refusal::none, address);
      if (any_armed()) {
        result = parameters_.refuse(Refusal::while_armed, address);
      } else if (parameters_.transaction_open()) {
        result = parameters_.refuse(Refusal::transaction_open, address);
      } else {
        ParameterValues wanted = parameters_.values();
        set_defaults(wanted);
        parameters_.set_all(wanted, false);
      }
      keeper_.note_defaults(result.refusal);
      return result;
    }
  }
  return parameters_.refuse(Refusal::out_of_range, address);
}

ParameterAccess::Result Application::save_defaults() {
  ParameterValues defaults = parameters_.values();
  set_defaults(defaults);
  const Refusal refusal = keeper_.save(defaults, any_armed());
  if (refusal == Refusal::none) note_saving(defaults);
  return parameters_.refuse(refusal, register_address(entry_of<"store.command">(), 0));
}

void Application::refresh_store_readings() {
  ParameterValues& v = parameters_.values();
  keeper_.publish(v);
}

void Application::refresh_crash_readings() {
  ParameterValues& v = parameters_.values();
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
