#pragma once

#include "firmware/command/parameter_access.hpp"
#include "firmware/parameters/parameter_keeper.hpp"
#include "firmware/parameters/power_on_communication.hpp"

namespace kmax::firmware {

/// What hosts ask of the parameter store: store.command, and CANopen's 0x1010 and 0x1011. Main loop only;
/// what is refused, as all is while the device is locked, is also in `parameters`' last_refusal(), under
/// store.command.
class StoreCommands {
 public:
  explicit StoreCommands(ParameterAccess& parameters) : parameters_(parameters) {}

  /// The newest set that is kept there is in force from now on.
  const LoadReport& attach(AnyFlashSectors flash);

  ParameterAccess::Result command(std::uint32_t command, bool armed);
  ParameterAccess::Result save(bool armed) { return save(parameters_.values(), armed); }
  /// The next start has all parameters at their defaults; the present ones stay.
  ParameterAccess::Result save_defaults(bool armed);

  /// See ParameterKeeper. Whether the device may be locked or opened is the caller's question.
  Refusal save_lock_code(std::uint32_t code, bool armed) { return keeper_.save_lock_code(code, armed); }

  /// One step of a save under way.
  void poll();

  const ParameterKeeper& keeper() const { return keeper_; }
  PowerOnCommunication& power_on_communication() { return power_on_communication_; }

 private:
  ParameterAccess::Result save(const ParameterValues& set, bool armed);
  ParameterAccess::Result refuse(Refusal refusal);

  ParameterAccess& parameters_;
  ParameterKeeper keeper_;
  PowerOnCommunication power_on_communication_;
};

}  // namespace kmax::firmware
