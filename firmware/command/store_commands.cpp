#include "firmware/command/store_commands.hpp"

namespace kmax::firmware {

ParameterAccess::Result StoreCommands::refuse(Refusal refusal) {
  return parameters_.refuse_slot(refusal, slot_of(entry_of<"store.command">(), 0));
}

const LoadReport& StoreCommands::attach(AnyFlashSectors flash) {
  ParameterValues stored = parameters_.values();
  keeper_.attach(flash, stored);
  parameters_.set_all(stored, false);
  return keeper_.loaded();
}

ParameterAccess::Result StoreCommands::command(std::uint32_t command, bool armed) {
  switch (static_cast<StoreCommand>(command)) {
    case StoreCommand::save:
      return save(armed);
    case StoreCommand::defaults: {
      const Refusal refusal = parameters_.locked()             ? Refusal::locked
                              : armed                          ? Refusal::while_armed
                              : parameters_.transaction_open() ? Refusal::transaction_open
                                                               : Refusal::none;
      if (refusal == Refusal::none) {
        ParameterValues wanted = parameters_.values();
        set_defaults(wanted);
        parameters_.set_all(wanted, false);
      }
      keeper_.note_defaults(refusal);
      return refuse(refusal);
    }
  }
  return refuse(Refusal::out_of_range);
}

ParameterAccess::Result StoreCommands::save_defaults(bool armed) {
  ParameterValues defaults = parameters_.values();
  set_defaults(defaults);
  return save(defaults, armed);
}

ParameterAccess::Result StoreCommands::save(const ParameterValues& set, bool armed) {
  const Refusal refusal = parameters_.locked() ? Refusal::locked : keeper_.save(set, armed);
  if (refusal == Refusal::none) power_on_communication_.note_saving(set);
  return refuse(refusal);
}

void StoreCommands::poll() {
  keeper_.poll();
  if (!keeper_.busy()) power_on_communication_.finish_saving(keeper_.state() == StoreState::saved);
}

}  // namespace kmax::firmware
