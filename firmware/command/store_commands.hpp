#pragma once

#include <array>
#include <optional>

#include "firmware/command/parameter_access.hpp"
#include "firmware/parameters/parameter_keeper.hpp"

namespace kmax::firmware {

/// CANopen's own settings as the last start, or the last save since, left them: what a reset of the
/// communication brings back (CiA 301, 7.3.2.2).
class PowerOnCommunication {
 public:
  void take(const ParameterValues& values) { at_power_on_ = part_of(values); }
  void put_back(ParameterValues& values) const {
    for (std::size_t i = 0; i < at_power_on_.size(); ++i)
      values.set_raw(first_communication_slot + i, at_power_on_[i]);
  }
  /// Of a set that is being saved.
  void note_saving(const ParameterValues& values) { saving_ = part_of(values); }
  void finish_saving(bool saved) {
    if (saving_ && saved) at_power_on_ = *saving_;
    saving_.reset();
  }

 private:
  using Part = std::array<std::uint32_t, communication_entries.size()>;

  static Part part_of(const ParameterValues& values) {
    Part part{};
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = values.raw(first_communication_slot + i);
    return part;
  }

  Part at_power_on_{};
  std::optional<Part> saving_;
};

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
