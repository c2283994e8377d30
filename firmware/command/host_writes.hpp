#pragma once

#include <cstdint>
#include <span>

#include "firmware/command/axes.hpp"
#include "firmware/command/parameter_access.hpp"
#include "firmware/command/store_commands.hpp"
#include "firmware/command/write_lock.hpp"

namespace kmax::firmware {

/// What hosts write, by whichever link: parameters, controlwords and targets, or one command to the store,
/// the write lock, the capture or the fault log. Main loop only; why something was refused is also in
/// refusal.reason.
class HostWrites {
 public:
  HostWrites(ParameterAccess& parameters, StoreCommands& store, WriteLock& lock, Axes& axes)
      : parameters_(parameters), store_(store), lock_(lock), axes_(axes) {}

  /// store.command, lock.code, lock.key, capture.command and log.command come alone; `wanted` is not empty.
  ParameterAccess::Result write(std::span<const SlotValue> wanted, Link by);

 private:
  ParameterAccess::Result command_log(std::uint32_t command);
  /// Begins a capture with the settings capture.*, or ends it.
  ParameterAccess::Result command_capture(std::uint32_t command);

  ParameterAccess& parameters_;
  StoreCommands& store_;
  WriteLock& lock_;
  Axes& axes_;
};

}  // namespace kmax::firmware
